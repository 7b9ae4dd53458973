"""Every fidelity ends where a rope would not hold."""

from __future__ import annotations

import pytest

from ringsim.frame.model import FrameModel
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.simulation import FIDELITIES, simulate
from ringsim.variables import Fate, Status

JAMMED_AT, SPEED = 0.3, 0.01
JAMS = [
    {"kind": "jammed-pulley", "cable": cable, "pulley": 1, "time": JAMMED_AT} for cable in (1, 2)
]


@pytest.mark.parametrize(
    ("fidelity", "limit"),
    [
        pytest.param(fidelity, limit, marks=() if fidelity == "frame" else pytest.mark.slow)
        for fidelity in FIDELITIES
        for limit in (0.1, 0.25)
    ],
)
def test_a_winch_that_pulls_at_a_jam_ends_the_run_where_the_rope_would_break(
    fidelity: str, limit: float
) -> None:
    """The rope between winch and jam keeps its path, so that its strain is the rope wound since
    over the rope that is left there; what it had at the jam, 2 N of 1e5 N, does not count."""
    values = {"faults": JAMS, "solver.end_time": 20.0, "limits.rope_strain": limit}
    scene = load_scene("truss2").with_values(values)
    run = simulate(scene, fidelity)
    assert (int(run.status), int(run.outcome)) == (Status.OK, Fate.OVERLOADED)
    assert run.attrs["reason"].endswith(
        f" s, more than limits.rope_strain = {limit:g}, with 0 of 4 V-joints locked"
    )
    # EA e at the end, within a step of the engines.
    late = SPEED * 0.1 / 0.06
    assert limit * 1e5 <= run.peak_tension.item() * (1.0 + 1e-9)
    assert run.peak_tension.item() <= (limit + late) * 1e5
    # A span of length l is strained by v t / (l - v t).
    wound = SPEED * (run.final_time.item() - JAMMED_AT)
    strain = run.peak_tension.item() / 1e5
    length = wound * (1.0 + strain) / strain
    assert length == pytest.approx(scene.cables.winch_distance, rel=0.01)


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_a_rope_that_is_too_short_from_the_start_ends_the_run_there(fidelity: str) -> None:
    """By its own name, though nothing has moved; one of half its path is refused."""
    scene = load_scene("truss2")
    path = float(FrameModel(scene).cables.ropes.content[0])
    run = simulate(scene.with_values({"cables.upper.initial_slack": -0.3 * path}), fidelity)
    assert (int(run.status), int(run.outcome)) == (Status.OK, Fate.OVERLOADED)
    assert run.attrs["reason"].startswith("a rope was strained by 42.9 % at 0 s, more than")
    assert run.rope_strain.sel(plane="upper").values[0] == pytest.approx(3.0 / 7.0, rel=1e-6)
    too_short = {"cables.upper.initial_slack": -0.51 * path}
    with pytest.raises(InputError, match=r"^cable 1: initial_slack = .* half of its path"):
        simulate(scene.with_values(too_short), fidelity)
