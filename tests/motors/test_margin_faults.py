"""What is broken, switched off or held counts in the margin of the drive: against scenes that have
never had it, and against virtual work.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from click.testing import CliRunner

from motor_rings import PLAIN, STALL, ring
from ringsim.cli import cli
from ringsim.layout.layout import layout_of
from ringsim.parts.faults import JointFault, Struck
from ringsim.parts.margin import EcssMechanisms
from ringsim.rigid.margin import CABLES, DriveMargin, PlaneMargin
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate

ECSS = EcssMechanisms()
SPRING = {"kind": "linear", "stiffness": 0.004, "preload": 0.01}
CUT = {"kind": "cut-cable", "cable": "lower", "span": "section 3 V to second hinge"}
ANGLES = np.radians([60.0, 100.0, 150.0, 179.0])


def sprung(**values: object) -> Scene:
    """With dry friction, and kick-off springs in all twelve V-joints."""
    plain = {"hinge_spring": SPRING, "joints__vjoint": {"coulomb": 0.05}}
    return ring(**plain | values)


def struck(fault: dict[str, object], time: float = 0.0, **values: object) -> Scene:
    return sprung(faults=[fault | {"time": time}], **values)


def margins(scene: Scene, time: float = 0.0) -> list[float]:
    drive = DriveMargin(scene, ECSS)
    return [drive.at(float(angle), time).margin for angle in ANGLES]


def shortening(scene: Scene, angle: float) -> np.ndarray:
    """Of the spans of all cables with the opening angle, m/rad, by differences of the layout."""

    def lengths(at: float) -> np.ndarray:
        layout = layout_of(scene, 0.5 * (math.pi - at))
        places = [np.array([layout.sheave(each)[0] for each in path]) for path in layout.paths]
        return np.array([np.linalg.norm(np.diff(each, axis=0), axis=1) for each in places])

    return (lengths(angle - 1e-5) - lengths(angle + 1e-5)) / 2e-5


@pytest.mark.parametrize(
    "values",
    [
        {"faults": [CUT | {"time": 0.0}]},
        {"cables__lower__winch__stop_time": 0.0},
        {"cables__upper__winch__start_time": 1.0, "cables__lower__winch__start_time": 3.0},
    ],
    ids=["cut", "never on", "later than the other"],
)
def test_a_cable_that_does_not_pull_is_no_cable(values: dict[str, object]) -> None:
    without = margins(sprung(cables__lower="none"))
    assert margins(sprung(**values)) == pytest.approx(without, rel=1e-12)
    assert without[0] < margins(sprung())[0] - 0.1


def test_a_fault_counts_from_its_time_on() -> None:
    scene = struck(CUT, 0.3)
    sound, cut = margins(sprung()), margins(sprung(cables__lower="none"))
    for time, expected in ((0.0, sound), (0.299, sound), (0.3, cut), (9.0, cut)):
        assert margins(scene, time) == pytest.approx(expected, rel=1e-12)
    stopped = sprung(cables__lower__winch__stop_time=0.3)
    for time, expected in ((0.299, sound), (0.3, cut)):
        assert margins(stopped, time) == pytest.approx(expected, rel=1e-12)


def test_one_spring_out_takes_a_twelfth_of_them() -> None:
    fault = {"kind": "failed-spring", "plane": "lower", "section": 4}
    for angle in map(float, ANGLES):
        now = DriveMargin(struck(fault), ECSS).at(angle)
        one = 0.01 + 0.004 * (math.pi - angle)
        assert now.driving["springs"] == pytest.approx(11.0 * one, rel=1e-9)
        sound = DriveMargin(sprung(), ECSS).at(angle)
        lost = 0.8 * one / (2.0 * 3.0 * 12 * 0.05)  # ECSS: driving springs 0.8, friction 3, twice
        assert sound.margin - now.margin == pytest.approx(lost, rel=1e-9)
        assert now.driving[CABLES] == sound.driving[CABLES]
        assert sound.available - now.available == pytest.approx(one, rel=1e-9)


def test_a_stuck_joint_holds_the_ring() -> None:
    scene = struck({"kind": "stuck-vjoint", "section": 2})
    assert margins(scene) == [-1.0] * len(ANGLES)
    assert DriveMargin(scene, ECSS).least().margin == -1.0
    assert PlaneMargin(DriveMargin(scene, ECSS), 1).at(1.2).margin == -1.0


def test_a_latch_that_does_not_catch_changes_nothing() -> None:
    failed = struck({"kind": "failed-latch", "section": 2}, stop__latch=True)
    assert margins(failed) == margins(sprung(stop__latch=True))


@pytest.mark.parametrize("ends", ["first", "last", "both"])
def test_behind_a_jammed_pulley_the_rope_is_slack(ends: str) -> None:
    """Virtual work of the spans up to the jam, seen from each winch; the others get shorter."""
    plain = {f"cables__{plane}__friction": {"kind": "none"} for plane in ("upper", "lower")}
    plain |= {f"cables__{plane}__end": ends for plane in ("upper", "lower")}
    scene = struck({"kind": "jammed-pulley", "cable": "lower", "pulley": 5}, **plain)
    for angle in map(float, ANGLES[:3]):
        spans = shortening(scene, angle)
        assert spans[1, 5:].max() > 0.01
        pulled = spans[0].sum() + spans[1, : None if ends == "both" else 5].sum()
        found = DriveMargin(scene, PLAIN).at(angle)
        assert found.driving[CABLES] == pytest.approx(STALL * pulled, rel=1e-6)
    cut = {"kind": "cut-cable", "cable": "lower", "span": 7, "time": 0.0}
    jam = {"kind": "jammed-pulley", "cable": "lower", "pulley": 5, "time": 0.0}
    spans = shortening(scene, 1.5)
    for faults, pulling in (([jam, cut], 5), ([cut, jam], 0)):
        found = DriveMargin(sprung(faults=faults, **plain), PLAIN).at(1.5)
        pulled = spans[0].sum() + spans[1, :pulling].sum()
        assert found.driving[CABLES] == pytest.approx(STALL * pulled, rel=1e-6)


def test_a_jam_beside_one_of_two_winches_leaves_each_its_friction() -> None:
    """With a jam in the middle span's place both halves are as with two winches and no jam."""
    both = {f"cables__{plane}__end": "both" for plane in ("upper", "lower")}
    sound = DriveMargin(sprung(**both), PLAIN).at(1.5)
    jam = {"kind": "jammed-pulley", "cable": "lower", "pulley": 9}
    found = DriveMargin(struck(jam, **both), PLAIN).at(1.5)
    assert found.available == pytest.approx(sound.available, rel=1e-12)
    assert found.margin == pytest.approx(sound.margin, rel=1e-9)


def test_planes_have_what_is_left_of_their_cables() -> None:
    scene = struck(CUT)
    upper, lower = (PlaneMargin(DriveMargin(scene, PLAIN), plane).at(1.5) for plane in (0, 1))
    springs = 12.0 * (0.01 + 0.004 * (math.pi - 1.5))
    assert lower.driving[CABLES] == pytest.approx(0.0, abs=1e-12)
    assert lower.available == pytest.approx(0.5 * springs, rel=1e-9)
    assert lower.margin == pytest.approx(springs / (12 * 0.05) - 1.0, rel=1e-9)
    sound = DriveMargin(sprung(), PLAIN).at(1.5)
    assert upper.margin == pytest.approx(sound.margin, rel=1e-9)


def test_check_says_what_it_counts(tmp_path: Path) -> None:
    faults = [
        {"kind": "failed-spring", "section": 1, "time": 0.0}, CUT | {"time": 0.5},
        {"kind": "failed-latch", "section": 1, "time": 0.0},
    ]  # fmt: skip
    scene = sprung(faults=faults, stop__latch=True, margin=ECSS.model_dump())
    scene = scene.with_values({"cables.upper.winch.stop_time": 4.0})

    def told(scene: Scene) -> str:
        path = tmp_path / "scene.toml"
        path.write_text(scene.to_toml())
        result = CliRunner().invoke(cli, ["check", str(path), "--margin"])
        assert result.exit_code == 0, result.output
        return result.stdout

    text = told(scene)
    assert "faults[1], failed-spring at 0 s: counted\n" in text
    assert "faults[2], cut-cable at 0.5 s: strikes later, not included here; a run" in text
    assert "faults[3], failed-latch at 0 s: changes nothing" in text
    assert "cables.upper.winch: stops at 4 s; a run includes it until then\n" in text
    jam = {"kind": "jammed-pulley", "cable": "lower", "pulley": 9, "time": 0.0}
    strong = {f"cables.{p}.winch.winding.stall_torque": 1.0 for p in ("upper", "lower")}
    jammed = told(load_scene("ring18-motor").with_values({"faults": [jam]} | strong))
    assert "jammed-pulley at 0 s: counted, for a rigid ring, which opens as one: whether" in jammed
    verdicts = re.findall(r"least margin .* deg: (.*)$", jammed, re.M)
    assert [*verdicts] == ["enough for a rigid ring"] * 3  # of both planes, and of each
    stuck = told(sprung(faults=[{"kind": "stuck-vjoint", "section": 1, "time": 0.0}]))
    assert "faults[1], stuck-vjoint at 0 s: with rigid rods it holds the whole ring" in stuck
    assert re.search(r"^nasa-std-5017b: least margin -1.000 at 60.00 deg: NOT enough$", stuck, re.M)
    late = told(sprung(cables__lower__winch__start_time=2.0))
    assert "cables.lower.winch: starts at 2 s, not included here\n" in late
    assert "cables.lower.winch: never turns, not included\n" in told(
        sprung(cables__lower__winch__stop_time=0.0)
    )


class FailedSection(JointFault):
    """A kind that this test brings: the springs of a section fail in all planes."""

    kind: Literal["failed-section"] = "failed-section"

    def strike(self, now: Struck) -> None:
        for law in now.switches.of_group("springs"):
            for plane in range(len(now.planes)):
                now.switches.set(law, (plane, self.section - 1), on=0.0)


def test_a_fault_of_ones_own_counts_in_the_margin_unasked() -> None:
    own, both = own_and_known()
    for time in (0.0, 0.1):
        assert margins(own, time) == margins(both, time)
    assert margins(own, 0.1) != margins(own, 0.0)


@pytest.mark.parametrize("fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_a_fault_of_ones_own_strikes_unasked(fidelity: str) -> None:
    one, other = (simulate(scene, fidelity) for scene in own_and_known())
    # Room for one fault or two: exudyn's sums are rounded in another order.
    np.testing.assert_allclose(one.opening_angle, other.opening_angle, rtol=1e-10)
    assert float(one.energy_error) < 1e-3


def own_and_known() -> tuple[Scene, Scene]:
    """A ring with a fault of that kind, and with those that it stands for."""
    own = [{"kind": "failed-section", "section": 2, "time": 0.05}]
    both = [
        {"kind": "failed-spring", "plane": plane, "section": 2, "time": 0.05}
        for plane in ("upper", "lower")
    ]
    short = {"solver.end_time": 0.3, "record.interval": 0.1}
    one, other = (sprung(faults=faults).with_values(short) for faults in (own, both))
    return one, other


def test_at_a_commanded_speed_only_winches_with_a_rope_count() -> None:
    """The slowest winch sets the speed, unless its rope has parted."""
    speeds = {"upper": 300.0, "lower": 150.0}
    slow = sprung(joints__vjoint={"viscous": 0.5}).with_values(
        {f"cables.{plane}.winch.winding.speed": speed for plane, speed in speeds.items()}
    )
    keep = PLAIN.model_copy(update={"keep_speed": True})
    cut = slow.with_values({"faults": [CUT | {"time": 0.0}]})
    rates = []
    for scene, speed in ((slow, 150.0), (cut, 300.0)):
        friction = DriveMargin(scene, keep).at(1.5).resisting["joint friction"]
        rates.append(speed * 1e-4 / shortening(scene, 1.5)[0].sum())
        assert friction == pytest.approx(12 * 0.5 * rates[-1], rel=1e-6)
