"""The verb ``modes`` and its function: angles, what is told, what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from loops import for_each

import ringsim
from ringsim.cli import cli
from ringsim.parts.rods import LengthError
from ringsim.plots.ring import modes as drawn
from ringsim.refusal import InputError
from ringsim.vibration import angles_of, modes_tables

RING = ringsim.load_scene("ring18").with_values({"structure.sections": 4})
ALONE = RING.with_values({"net": "none"})


def called(*words: str) -> tuple[int, str]:
    """Exit code and what was printed."""
    found = CliRunner().invoke(cli, ["modes", *words])
    return found.exit_code, found.output


@pytest.mark.quick
def test_angles_are_words_numbers_or_evenly_spread() -> None:
    assert angles_of(RING, ["stowed", 90, "120.5", "Deployed", 90.0], 9) == [47.578, 90, 120.5, 180]
    assert angles_of(RING, None, 3) == [47.578, 113.789, 180.0]


@pytest.mark.quick
@for_each(
    ("words", "told"),
    [
        (["--at", "200"], "at = 200 deg must be at most 180 deg"),
        (["--at", "0.5"], "at = 0.5 deg must be at least 1 deg: angles are in degrees"),
        (["--at", "nan"], "at = nan deg must be at least 1 deg"),
        (["--at", "10,opened"], "at = 'opened' is no opening angle: give degrees from 1 to 180"),
        (["--at", "90", "--points", "3"], "--points 3: --at says which angles"),
        (["--tension", "5"], "tension = 5 N: the scene has no cables"),
        (["--set", "stop=none", "--at", "deployed"], "give stop.stiffness, or choose --free"),
        (
            ["--set", "rods.kind=ancf", "--at", "90"],
            "does not represent rods.kind = 'ancf': leave that out",
        ),
        (["--plot-format", "svg"], "has no effect without --plot"),
        (
            ["--modes", "90", "--set", "structure.sections=3"],
            "count = 90 must be at most 3",
        ),
    ],
)
def test_bad_input_is_refused_in_one_line(words: list[str], told: str) -> None:
    code, printed = called("ring18", *words)
    assert code == 2
    assert told in printed
    assert len(printed.splitlines()) == 1


@for_each(
    "given, told",
    [
        ({"at": 60}, "at = 60 must be a list of opening angles: write [60]"),
        (
            {"at": "deployed"},
            'at = "deployed" must be a list of opening angles: write ["deployed"]',
        ),
        ({"at": [None]}, "at = None is no opening angle"),
        ({"at": []}, "number of angles = 0 must be from 1"),
        ({"count": 2.5}, "count = 2.5 must be a whole number from 1 to 100"),
        ({"count": "6"}, 'count = "6" must be a whole number'),
        ({"count": 101}, "count = 101 must be from 1 to 100"),
        ({"points": 3.0}, "points = 3.0 must be a whole number"),
    ],
)
@pytest.mark.quick
def test_arguments_that_are_none_are_refused(given: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError) as error:
        ringsim.modes(RING, **given)
    assert told in str(error.value)


@pytest.mark.quick
def test_other_structures_are_refused() -> None:
    assert called("planar-truss") == (
        2, 'structure.kind = "planar-truss" has no opening_angle: modes are those of rings that '
        "open by one\n",
    )  # fmt: skip


@pytest.mark.quick
def test_motions_that_nothing_holds_are_counted_and_told_apart() -> None:
    """A free ring: six of the whole; one of the mechanism until it is latched, where it is open and
    free one of every V-joint.  A ring that is held has none of the whole.
    """
    assert counts(ALONE, ["stowed", 90.0, 180.0]) == [(6, 1), (6, 1), (6, 0)]
    assert counts(ALONE, [90.0], latched=True) == [(6, 0)]
    assert counts(ALONE, [180.0], latched=False) == [(6, 8)]
    fixed = ALONE.with_values({"boom.base": "fixed"})
    assert counts(fixed, [90.0, 180.0]) == [(0, 1), (0, 0)]


def counts(scene: Any, at: list[Any], **given: Any) -> list[tuple[int, int]]:
    """Rigid-body modes and those of the mechanism by angle."""
    found = ringsim.modes(scene, at, count=3, **given)
    return list(
        zip(found["rigid_body_modes"].values.tolist(), found["mechanism_modes"].values.tolist(),
            strict=True)
    )  # fmt: skip


@pytest.mark.quick
def test_an_unstable_state_is_told_and_not_hidden() -> None:
    """The lever of a net's strings falls faster than they stretch: nothing leads back."""
    netted = RING.with_values({"net.stiffness": 1.0, "net.neutral_length": 0.1})
    found = ringsim.modes(netted, [150.0], count=3)
    rate = float(found["growth_rate"][0, 0])
    assert rate > 0.0
    assert np.isnan(found["frequency"][0, 0])
    assert float(found["energy_share"][0, 0].sum()) == pytest.approx(-1.0)
    told = modes_tables(found)[0]
    assert told.rows[0][4] == "unstable n"
    assert f"a factor e in {1.0 / rate:.3g} s" in "\n".join(told.notes)


def test_ropes_that_winches_hold_are_springs_and_slack_ones_nothing() -> None:
    """Half open the mechanism swings on the ropes, k = EA / S of each along its path."""
    scene = ringsim.load_scene("ring18-cable").with_values({"structure.sections": 4})
    slack, taut = (ringsim.modes(scene, [90.0], count=4, tension=t) for t in (0.0, 0.5))
    assert int(slack["mechanism_modes"][0]) == 1
    assert int(taut["mechanism_modes"][0]) == 0
    assert float(taut["frequency"][0, 0]) > 0.9 * float(slack["frequency"][0, 0])


@pytest.mark.parametrize("values", [
    {"rods.length_error.diagonal_rising": [1e-4, 0.0, -2e-4, 0.0]},
    {"structure.hinge_error.upper_left": 2e-5},
    {"structure.angle_error": [0.5, 0.0, -0.5, 0.0]},
])  # fmt: skip
def test_rods_that_are_not_as_drawn_change_next_to_nothing(values: dict[str, Any]) -> None:
    """Also where they are fully open, and no state of strained rods is near the drawing."""
    drawn, made = (
        ringsim.modes(scene, [90.0, "deployed"], count=3)["frequency"].values
        for scene in (ALONE, ALONE.with_values(values))
    )
    assert made == pytest.approx(drawn, rel=2e-3)
    assert np.any(made != drawn) or "structure.angle_error" in values


def test_gravity_is_that_of_the_scene() -> None:
    """A ring on a clamped boom hangs or stands: its weight stiffens or softens it."""
    held = ALONE.with_values({"boom.base": "fixed"})
    each = [
        float(ringsim.modes(scene, ["deployed"], count=1)["frequency"][0, 0])
        for scene in (
            held.with_values({"gravity.vector": [0.0, 0.0, pull]}) for pull in (-9.81, 9.81)
        )
    ]
    still = float(ringsim.modes(held, ["deployed"], count=1)["frequency"][0, 0])
    assert min(each) < still < max(each)
    assert np.mean(each) == pytest.approx(still, rel=1e-3)


@pytest.mark.parametrize(("pull", "first"), [(-4.0, 0.48992), (-9.81, 0.49311)])
def test_a_ring_that_its_weight_bends_much_finds_its_balance(pull: float, first: float) -> None:
    """Whole Newton steps lead away; smaller ones of any size lead to one state."""
    held = {"boom.base": "fixed", "net": "none", "gravity.vector": [0.0, 0.0, pull]}
    found = ringsim.modes(ringsim.load_scene("ring18").with_values(held), ["deployed"], count=3)
    assert float(found["frequency"][0, 0]) == pytest.approx(first, rel=1e-4)


@pytest.mark.parametrize("sections", [1, 3])
def test_arcs_without_a_boom_have_the_same_modes_however_many_are_asked_for(sections: int) -> None:
    arc = {"net": "none", "boom": "none", "structure.closed": False, "structure.sections": sections}
    scene = ringsim.load_scene("ring18").with_values(arc)
    few, many = (ringsim.modes(scene, [60.0, "deployed"], count=n) for n in (3, 6))
    assert few["frequency"].values == pytest.approx(many["frequency"].values[:, :3], rel=1e-5)


def test_errors_of_all_rods_at_once_leave_a_frequency() -> None:
    """As large as those that ship, where rods cannot be put together next to 180 deg."""
    rng = np.random.default_rng(1)
    plain = ringsim.load_scene("ring18")
    kinds = LengthError.model_fields
    errors = {f"rods.length_error.{k}": (2e-4 * rng.standard_normal(18)).tolist() for k in kinds}
    both = (plain, plain.with_values(errors))
    found = [float(ringsim.modes(s, ["deployed"], count=1)["frequency"][0, 0]) for s in both]
    assert found[1] == pytest.approx(found[0], rel=1e-3)


def test_a_run_whose_frequency_is_not_found_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(scene: Any) -> float:
        raise InputError("at 180 deg nothing balances")

    monkeypatch.setattr("ringsim.frame.modes.first_frequency", refuses)
    run = ringsim.simulate(RING.with_values({"record.frequency": True}))
    assert np.isnan(run["first_frequency"])
    assert float(run["deployment_time"]) > 0.0
    assert "; first_frequency unknown: at 180 deg nothing balances" in run.attrs["reason"]


def test_the_verb_prints_writes_and_draws(tmp_path: Path) -> None:
    file = tmp_path / "four.nc"
    code, printed = called(
        "ring18", "--set", "structure.sections=4", "--set", "boom.base=fixed", "--set", "net=none",
        "--at", "90,deployed", "--modes", "3", "--out", str(file), "--plot",
    )  # fmt: skip
    assert code == 0
    assert "up to 1 mode of the mechanism, which nothing holds: no frequencies" in printed
    assert "effective mass along x (kg)" in printed
    found = xr.load_dataset(file)
    assert found["shape"].dims == ("angle", "mode", "point", "axis")
    assert set(found["point"].values) >= {"upper corner 1", "lower V-joint 4"}
    for name, each in found.variables.items():
        assert each.attrs["long_name"], name
        assert each.dtype.kind == "U" or each.dtype == object or each.attrs["units"], name
    largest = np.linalg.norm(found["shape"], axis=-1).max(axis=-1)
    assert largest == pytest.approx(np.ones((2, 3)))
    assert (tmp_path / "four-fig-modes.png").stat().st_size > 10_000
    curves, *shapes = drawn(found).axes
    assert curves.get_position().height > 0.35
    assert all(panel.get_position().height > 0.15 for panel in shapes)
    again = CliRunner().invoke(cli, ["plot", str(file), "--plot-format", "svg"])
    assert again.exit_code == 0
    assert (tmp_path / "four-fig-modes.svg").exists()


def test_the_same_call_gives_the_same_bits() -> None:
    one, two = (ringsim.modes(RING, [90.0, "deployed"], count=4) for _ in range(2))
    assert one.drop_attrs().equals(two.drop_attrs())


def test_a_missing_scene_key_is_an_input_error() -> None:
    with pytest.raises(InputError, match="count = 0 must be from 1 to 100"):
        ringsim.modes(RING, [90.0], count=0)


@pytest.mark.parametrize("fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_a_run_records_the_first_frequency_of_what_it_has_deployed(fidelity: str) -> None:
    """That of the verb; missing where the ring does not open, and nothing where nobody asks."""
    asked = ALONE.with_values(
        {"record.frequency": True, "structure.opening_angle": 170.0, "loads.force": 0.1}
    )
    known = float(ringsim.modes(asked, ["deployed"], count=1)["frequency"][0, 0])
    run = ringsim.simulate(asked, fidelity)
    assert float(run["first_frequency"]) == pytest.approx(known, rel=1e-9)
    assert run["first_frequency"].attrs["units"] == "Hz"
    short = {"solver.end_time": 0.1, "solver.step": 0.05}
    assert np.isnan(ringsim.simulate(asked.with_values(short), fidelity)["first_frequency"])
    plain = asked.with_values(short | {"record.frequency": False})
    assert "first_frequency" not in ringsim.simulate(plain, fidelity)


@for_each(
    ("values", "told"),
    [
        ({"stop": "none"}, 'record.frequency = true: stop = "none" latches no V-joint'),
        ({"rods.kind": "ancf"}, 'record.frequency = true: rods.kind = "ancf"'),
    ],
)
def test_a_first_frequency_that_there_cannot_be_is_refused(values: Any, told: str) -> None:
    with pytest.raises(InputError) as refused:
        RING.with_values(values | {"record.frequency": True})
    assert told in str(refused.value)
