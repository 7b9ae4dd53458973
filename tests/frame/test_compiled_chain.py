"""How frames evaluate the chain and its tangent, against the chain alone."""

from dataclasses import fields

import numpy as np
import pytest

from law_scenes import CABLES as CABLES_AND_FAULTS
from law_scenes import of_cables
from ringsim.cable.chain import ChainState
from ringsim.cable.friction import BearingFriction, CapstanFriction
from ringsim.cable.records import Cable, Winch
from ringsim.cable.ropes import SHORTEST, Ropes
from ringsim.cable.winding import ConstantWinding
from ringsim.core.chain import Chain
from ringsim.core.library import call
from ringsim.core.tension import PASSING, Drums, RopeTable, Spans
from ringsim.frame.integrate import Integration
from ringsim.frame.model import FrameModel

pytestmark = pytest.mark.quick

ROUND_OFF = 1e-11
"""Sums of a dozen terms in another order, through exponentials of their logarithms."""
WINCH = Winch(winding=ConstantWinding(speed=0.02))
CABLES = (
    Cable(winch=WINCH, friction=BearingFriction(coefficient=8e-4), damping_time=0.01),
    Cable(winch=WINCH, end="both", friction=CapstanFriction(coefficient=0.2), slip_speed=5e-3),
)
POINTS = (8, 7)
LEFT = np.array([1.0, 0.6, 0.8])


class Case:
    """Ropes at random places and rates, the second cable perhaps jammed, the first one cut."""

    def __init__(self, seed: int, *, jammed: bool, cut: bool, unfelt: tuple[int, ...] = ()) -> None:
        random = np.random.default_rng(seed)
        self.chain, count = Chain(CABLES, POINTS), sum(POINTS)
        self.points = 0.1 * random.normal(size=(count, 3))
        self.points[:, 0] += 0.3 * np.arange(count)
        self.rates = 2e-3 * random.normal(size=(count, 3))
        self.wound = np.array([[0.004, 0.0], [0.002, 0.003]])
        self.wound_rate = np.array([[0.02, 0.0], [0.01, -0.004]])
        self.ropes: Ropes = self.chain.start(self.points)
        if jammed:
            before = self.evaluated()
            self.ropes = self.ropes.jam(1, 2, before.stored, before.wound)
        if cut:
            self.ropes = self.ropes.cut(0, 3)
        self.points += 1e-3 * random.normal(size=(count, 3))
        self.felt = np.setdiff1d(np.arange(self.ropes.spans), unfelt)
        self.table = RopeTable.of(self.ropes, self.chain.material, self.chain.slip_speed, self.felt)
        inflow = np.zeros(len(self.ropes.starts))
        inflow[self.ropes.of_end[:, 1]] = -self.wound_rate[:, 1]
        natural = self.ropes.content - self.ropes.per_rope(self.wound)
        self.drums = Drums(natural, self.ropes.per_rope(self.wound_rate), inflow)
        self.spans = Spans.empty(self.ropes)
        least = call("measure", self.table, self.points, self.rates, self.spans)
        assert least == pytest.approx(self.spans.length.min())
        self.log_decays = self.evaluated().log_decays
        call("slide", self.table, self.drums, self.spans)
        call("tighten", self.table, self.drums, self.log_decays, self.spans)

    def evaluated(self) -> ChainState:
        return self.chain.state(self.ropes, self.points, self.rates, self.wound, self.wound_rate)


BOTH = (False, True)
CASES = [(seed, jammed, cut) for seed in range(3) for jammed in BOTH for cut in BOTH]


@pytest.mark.parametrize("faults", [False, True], ids=["sound", "faults"])
def test_accepted_states_are_those_of_the_chain(faults: bool) -> None:
    """All that energies and outputs read of a chain, after a run: whole, jammed and cut ropes."""
    values = CABLES_AND_FAULTS["faults"] if faults else {}
    run = Integration(FrameModel(of_cables(values | {"solver.end_time": 0.4})))
    time = run.run().times[-1]
    cables, state = run.model.cables, run.state
    assert cables is not None
    found = cables.state(time, state.place.paths, state.rate.paths)
    wound = found.wound, found.wound_rate
    truth = cables.chain.state(cables.ropes, state.place.paths, state.rate.paths, *wound)
    assert found.tensions.max() > 1.0
    assert found.ropes.alive.tolist() == ([True, True, False] if faults else [True, True])
    for field in fields(ChainState):
        one, other = getattr(found, field.name), getattr(truth, field.name)
        if isinstance(other, np.ndarray):
            allowed = ROUND_OFF * max(1e-3, np.abs(other).max())
            assert np.abs(one - other).max() <= allowed, field.name
    for one in ("decays", "by_angle", "by_speed"):
        law = getattr(found.friction, one)
        assert law(found.pulleys) == pytest.approx(getattr(truth.friction, one)(truth.pulleys))


@pytest.mark.parametrize("unfelt", [(), (1, 2, 3, 4, 10, 11)], ids=["all", "felt"])
@pytest.mark.parametrize(("seed", "jammed", "cut"), CASES)
def test_the_border_is_the_tangent_of_the_chain(
    seed: int, jammed: bool, cut: bool, unfelt: tuple[int, ...]
) -> None:
    """Both points of a span that is not felt are on one frame: its pulls there are no force."""
    case = Case(seed, jammed=jammed, cut=cut, unfelt=unfelt)
    truth, ropes, by_rate = case.evaluated(), case.ropes, 40.0
    left = LEFT[: len(ropes.starts)]
    own = truth.exponent_slopes
    slopes = np.where(own * truth.slip_speeds > PASSING, own, 0.0)
    count, points = call("factors_needed", case.table, slopes), sum(POINTS)
    pulls, changes = np.zeros((count, ropes.spans)), np.zeros((count, ropes.spans, 3))
    log_slopes = truth.friction.by_angle(truth.pulleys)
    tight = 0.5 + 0.5 * np.tanh(0.5 * truth.forces / case.table.material[:, 2])
    call(
        "tension_changes", case.table, case.drums, case.log_decays, log_slopes, slopes, case.spans,
        case.rates, tight, left, 1.0, by_rate, pulls, changes,
    )  # fmt: skip
    out = np.zeros((2, count, points, 3))
    call("spread_changes", case.table, case.spans, pulls, changes, out)
    found = np.einsum("kpi,kqj->piqj", *out)

    expected = np.zeros_like(found)
    # Pulleys that frames leave out, as their friction no longer changes, count here as well.
    for rope, pulled, changed in case.chain.changes(
        truth, case.rates, slopes, left, 1.0, by_rate, passing=PASSING
    ):
        spans = slice(ropes.starts[rope], ropes.ends[rope])
        inner = slopes[ropes.inner(rope)]
        kept = np.concatenate([[True], inner > 0.0, [True]])[: len(pulled)]
        change = np.einsum("kn,kmi->nmi", pulled[kept], changed[kept])
        if len(pulled) > 1:  # the last factor holds the path's part of those left out, too
            gone = pulled[~kept], changed[~kept]
            tail = (
                np.array(
                    [
                        np.sum(truth.shares[spans][b:] * truth.lengths[spans][b:])
                        for b in np.flatnonzero(~kept)
                    ]
                )
                / truth.paths[rope]
            )
            change = change + np.einsum("n,k,kmi->nmi", truth.tensions[spans], tail, gone[1])
        near = ropes.near[spans]
        pull = change[:, None] * truth.directions[spans][:, :, None, None]
        for i, point in enumerate(near):
            for k, other in enumerate(near):
                block = pull[i, :, k]
                expected[point, :, other] += block
                expected[point + 1, :, other] -= block
                expected[point, :, other + 1] -= block
                expected[point + 1, :, other + 1] += block
    if unfelt:
        felt = case.table._replace(felt=np.ones_like(case.table.felt))
        separate = call("factors_needed", felt, slopes)
        assert count < separate
    for near in sorted(ropes.near[list(unfelt)], reverse=True):
        for each in (expected, found):
            each[near] += each[near + 1]
            each[near + 1] = 0.0
    assert np.allclose(found, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_a_pulley_that_was_seen_on_both_sides_is_felt_at_any_speed() -> None:
    """Full friction changes nothing, unless it has changed its sign within the step."""
    model = FrameModel(of_cables({}))
    assert model.cables is not None
    roped, slip = model.cables.roped, model.cables.roped.ropes.slip_speed
    speeds = np.resize([300.0, 300.0, -160.0, 0.1 * slip[0], 160.0], len(slip))
    before = np.resize([200.0, -300.0, 160.0, 0.2 * slip[0], 1e-9], len(slip))
    for each in before, speeds:
        call("note_rates", roped.seen, each)
    roped.spans.speed[:], roped.spans.exponent[:] = speeds, np.tanh(speeds / slip)
    roped.spans.tension[:], roped.spans.angle[:] = 1.0, 2.0
    count = call("find_slopes", roped, model.system.laws)
    own = (1.0 - np.tanh(speeds / slip) ** 2) / slip
    expected = np.resize([0.0, 2.0 / 600.0, 2.0 / 320.0, np.nan, 0.0], len(slip))
    np.testing.assert_allclose(roped.slopes, np.where(np.isnan(expected), own, expected))
    assert count == call("factors_needed", roped.ropes, roped.slopes) > 2


def test_the_core_has_the_same_limits() -> None:
    assert call("limit_of_ropes", 0) == SHORTEST
    assert call("limit_of_ropes", 1) == PASSING
