"""The margin along a run is the static one of ``check --margin`` at the run's angles: whatever the
rates and the output times, with what is broken so far, of the scene that the ring then had.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from motor_rings import PLAIN, STALL, ring
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.layout.layout import layout_of
from ringsim.parts.margin import EcssMechanisms
from ringsim.rigid.margin import DriveMargin, Passed, least_along, passed, with_margin
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate
from ringsim.stored_state import read_state
from ringsim.variables import PLANES, Outcome, Status

ECSS = {"kind": "ecss-e-st-33-01c"}
SPRING = {"kind": "linear", "stiffness": 0.004, "preload": 0.005}
CUT = {"kind": "cut-cable", "cable": "lower", "span": 1}


def netted(**values: object) -> Scene:
    """Whose margin is least where its net is nearly tight, in the middle of the travel."""
    plain = {
        "joints__vjoint": {"coulomb": 0.01, "viscous": 0.5}, "net__stiffness": 40.0,
        "net__neutral_length": 0.4, "margin": ECSS,
    }  # fmt: skip
    return ring(**plain | values)


def opened(interval: float, last: float = 180.0, lock: float = 1.0) -> Outcome:
    """From 60 to 180 deg within 1 s, the rate growing; then until 1.3 s as it is."""
    times = interval * np.arange(round(1.3 / interval) + 1)
    angles = np.minimum(60.0 + (last - 60.0) * times**2, last)
    values = {
        "opening_angle": np.broadcast_to(angles, (2, 6, len(times))).copy(),
        "deployment_time": np.array(lock),
    }
    places = {"plane": np.array(PLANES), "section": np.arange(1, 7)}
    return Outcome(Status.OK, "made", {"time": times, **places}, values)


def test_at_every_output_time_it_is_the_static_margin_of_that_angle() -> None:
    scene = netted()
    found, drive = with_margin(opened(0.1), scene), DriveMargin(scene, EcssMechanisms())
    for k, time in enumerate(found.coordinates["time"][:10].tolist()):
        now = drive.at(math.radians(60.0 + 120.0 * time**2))
        assert found.values["drive_margin"][k] == pytest.approx(now.margin, rel=1e-12)
        assert found.values["drive_available"][k] == pytest.approx(now.available, rel=1e-12)
        resisting = found.values["drive_resistance"][:, k]
        np.testing.assert_allclose(resisting, list(now.resisting.values()), rtol=1e-12)
    assert np.isnan(found.values["drive_margin"][11:]).all()


@pytest.mark.parametrize("interval", [pytest.param(0.01, marks=pytest.mark.slow), 0.1, 0.26])
def test_the_least_is_that_of_check_at_any_output_interval(interval: float) -> None:
    scene = netted()
    truth = DriveMargin(scene, EcssMechanisms()).least()
    assert 62.0 < math.degrees(truth.angle) < 178.0
    found = with_margin(opened(interval), scene).values
    assert found["least_drive_margin"] == pytest.approx(truth.margin, rel=1e-9)
    assert found["least_drive_margin_angle"] == pytest.approx(math.degrees(truth.angle), abs=1e-4)
    when = math.sqrt((math.degrees(truth.angle) - 60.0) / 120.0)
    assert found["least_drive_margin_time"] == pytest.approx(when, abs=0.13 * interval)


def test_a_ring_that_stops_counts_only_what_it_passed() -> None:
    scene = netted()
    drive = DriveMargin(scene, EcssMechanisms())
    last = math.degrees(drive.least().angle) - 20.0
    found = with_margin(opened(0.1, last, math.nan), scene).values
    assert found["least_drive_margin_angle"] == pytest.approx(last, abs=1e-6)
    assert found["least_drive_margin"] == pytest.approx(drive.at(math.radians(last)).margin)
    assert found["least_drive_margin_time"] == pytest.approx(1.0, abs=0.06)


def test_faults_and_switches_count_from_their_time_on() -> None:
    """The lower cable parts at 0.5 s, at 90 deg, and the upper winch stops at 0.9 s."""
    scene = netted(faults=[CUT | {"time": 0.5}], cables__upper__winch__stop_time=0.9)
    found = with_margin(opened(0.05), scene).values
    sound = DriveMargin(netted(), EcssMechanisms())
    upper = DriveMargin(netted(cables__lower="none"), EcssMechanisms())
    angles = np.radians(60.0 + 120.0 * (0.05 * np.arange(21)) ** 2)
    expected = [
        *(sound.at(angle).margin for angle in angles[:10]),
        *(upper.at(angle).margin for angle in angles[10:18]), -1.0, -1.0, -1.0,
    ]  # fmt: skip
    np.testing.assert_allclose(found["drive_margin"][:21], expected, rtol=1e-9)
    assert found["least_drive_margin"] == -1.0
    assert found["least_drive_margin_time"] == pytest.approx(0.9)
    assert found["least_drive_margin_angle"] == pytest.approx(60.0 + 120.0 * 0.81, abs=0.1)


def virtual_work(planes: slice, angle: float) -> float:
    """The margin of cables without friction in their pulleys at an angle (rad): their shortening,
    by differences of the layout, against twelve V-joints of 0.01 N m.
    """

    def lengths(at: float) -> np.ndarray:
        layout = layout_of(ring(), 0.5 * (math.pi - at))
        places = [np.array([layout.sheave(each)[0] for each in path]) for path in layout.paths]
        return np.array([np.linalg.norm(np.diff(each, axis=0), axis=1).sum() for each in places])

    shortening = (lengths(angle - 1e-5) - lengths(angle + 1e-5)) / 2e-5
    return STALL * float(shortening[planes].sum()) / (12 * 0.01) - 1.0


UPPER, LOWER = "cables__upper__winch__stop_time", "cables__lower__winch__stop_time"
BOTH, ONE = slice(0, 2), slice(0, 1)


@pytest.mark.parametrize(
    ("values", "least", "time"),
    [
        # What is passed after both have been stopped as planned needs no drive.
        ({UPPER: 0.7, LOWER: 0.9}, (ONE, 60.0 + 120.0 * 0.49), 0.7),
        ({UPPER: 0.9, LOWER: 0.9}, (BOTH, 60.0), 0.0),
        # A motor that stops leaves all to the other.
        ({LOWER: 0.5}, (ONE, 90.0), 0.5),
        # One that has lost its rope was not stopped: nothing drives when the other is.
        ({UPPER: 0.9, "faults": [CUT | {"time": 0.5}]}, None, 0.9),
        # Springs that no winch ever helps: at 180 deg they give half of what resists.
        ({UPPER: 0.0, LOWER: 0.0, "hinge_spring": SPRING}, -0.5, 1.0),
    ],
    ids=["one after the other", "both", "one alone", "lost rope", "springs alone"],
)  # fmt: skip
def test_the_margin_ends_where_nobody_drives_on_purpose(
    values: dict[str, object], least: object, time: float
) -> None:
    plain = {"joints__vjoint": {"coulomb": 0.01}, "margin": PLAIN.model_dump()}
    plain |= {f"cables__{plane}__friction": {"kind": "none"} for plane in PLANES}
    run = with_margin(opened(0.05), ring(**plain | values))
    truth = least if isinstance(least, float) else -1.0
    if isinstance(least, tuple):
        truth = virtual_work(least[0], math.radians(least[1]))
    assert run.values["least_drive_margin"] == pytest.approx(truth, rel=1e-6)
    assert run.values["least_drive_margin_time"] == pytest.approx(time, abs=1e-3)
    words = "the least drive margin ends at 0.9 s, when the last winch is switched off"
    both = values.get(LOWER) == 0.9
    assert (words in run.reason) == both


@pytest.mark.parametrize("interval", [pytest.param(0.02, marks=pytest.mark.slow), 0.13])
def test_the_least_between_output_times_knows_what_is_broken(interval: float) -> None:
    scene = netted(
        faults=[CUT | {"time": 0.5}, {"kind": "stuck-vjoint", "section": 1, "time": 2.0}]
    )
    upper = DriveMargin(netted(cables__lower="none"), EcssMechanisms())
    truth = upper.least()
    assert truth.angle > math.radians(95.0)
    found = with_margin(opened(interval), scene).values
    assert found["least_drive_margin"] == pytest.approx(truth.margin, rel=1e-9)


def test_before_a_restart_the_margin_is_that_of_the_scene_before() -> None:
    old, new = netted(joints__vjoint={"coulomb": 0.2}), netted()
    found = with_margin(opened(0.05), new, [(0.5, old)]).values["drive_margin"]
    alone = [with_margin(opened(0.05), scene).values["drive_margin"] for scene in (old, new)]
    assert found[:10].tolist() == alone[0][:10].tolist()
    assert found[10:21].tolist() == alone[1][10:21].tolist()
    assert (alone[0][:10] < alone[1][:10]).all()
    unlimited = {"cables.upper.winch.winding": {"kind": "constant", "speed": 0.1}}
    before = old.with_values({"margin": "none"}).with_values(unlimited)
    later = with_margin(opened(0.05), new, [(0.5, before)])
    assert np.isnan(later.values["drive_margin"][:10]).all()
    assert later.values["drive_margin"][10:21].tolist() == alone[1][10:21].tolist()


def test_a_run_that_went_on_keeps_the_margin_of_its_file(tmp_path: Path) -> None:
    scene = ring(
        structure__sections=3, joints__vjoint={"coulomb": 0.01}, margin=PLAIN.model_dump(),
        solver__end_time=0.12, record__interval=0.02, record__state_interval=0.06,
    )  # fmt: skip
    first, path = simulate(scene, "frame"), tmp_path / "first.nc"
    save(first, path)
    changed = scene.with_values({"joints.vjoint.coulomb": 0.02})
    found, again = simulate(changed, start=read_state(path, 0.06)), tmp_path / "again.nc"
    before = found.time.values < 0.06 - 1e-9
    assert before.sum() == 3
    np.testing.assert_array_equal(found.drive_margin[before], first.drive_margin[before])
    dry = found.drive_resistance.sel(resistance="joint friction")
    np.testing.assert_allclose(dry[before], 6 * 0.01, rtol=1e-9)
    np.testing.assert_allclose(dry[~before], 6 * 0.02, rtol=1e-9)
    # Once more, at the end, to a third scene: each keeps what was told of it.
    save(found, again)
    third = scene.with_values({"joints.vjoint.coulomb": 0.03, "solver.end_time": 0.16})
    last = simulate(third, start=read_state(again, 0.12))
    dry = last.drive_resistance.sel(resistance="joint friction").values
    coulomb = np.repeat([0.01, 0.02, 0.03], 3)
    np.testing.assert_allclose(dry, 6 * coulomb, rtol=1e-9)
    start = DriveMargin(scene, PLAIN).at(math.radians(60.0))
    assert float(first.drive_margin[0]) == pytest.approx(start.margin, rel=1e-6)


def test_the_least_of_a_campaign_follows_from_angles_alone() -> None:
    """As it is computed anew from the file of a campaign."""
    scene = netted()
    for coulomb in (0.01, 0.03):
        own = scene.with_values({"joints.vjoint.coulomb": coulomb})
        run = with_margin(opened(0.1), own)
        way = passed(run.coordinates["time"], run.values["opening_angle"], 1.0)
        least = least_along(DriveMargin(own, EcssMechanisms()), way)
        assert least.margin == pytest.approx(float(run.values["least_drive_margin"]), rel=1e-9)


def test_times_are_those_at_which_an_angle_was_passed_first() -> None:
    way = Passed(np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 2.0, 1.5, 3.0]))
    assert [way.time_at(angle) for angle in (1.0, 1.25, 1.75, 3.0)] == [0.0, 0.25, 0.75, 3.0]
    part = way.between(0.5, 1.5)
    assert part.times.tolist() == [0.5, 1.0, 1.5]
    assert part.angles.tolist() == [1.5, 2.0, 1.75]


def test_explain_says_what_it_is() -> None:
    told = CliRunner().invoke(cli, ["explain", "drive_margin"]).stdout
    for words in ("static margin", "mean opening angle", "check --margin"):
        assert words in told


def test_an_angle_that_is_known_does_not_hide_the_way_behind_it() -> None:
    """The least margin lies half a degree behind the first angle, known from its output."""
    drive = DriveMargin(netted(), EcssMechanisms())
    best = drive.least()
    low = best.angle - math.radians(0.5)
    assert drive.at(low).margin > best.margin + 1e-6
    assert drive.least(low, known=[drive.at(low)]).margin == pytest.approx(best.margin, abs=1e-9)


def test_a_stretch_between_two_output_times_counts() -> None:
    """Of three scenes the middle one, in which the ring is held, lasted from 0.42 to 0.48 s."""
    stuck = {"kind": "stuck-vjoint", "plane": "upper", "section": 1, "time": 0.0}
    whole, held = netted(), netted(faults=[stuck])
    found = with_margin(opened(0.1), whole, [(0.42, whole), (0.48, held)])
    assert float(found.values["least_drive_margin"]) == -1.0
    assert 0.42 - 1e-9 <= float(found.values["least_drive_margin_time"]) <= 0.48 + 1e-9


def test_the_margin_from_the_start_of_the_last_winch_on() -> None:
    """The least of both cables lies at 60 deg, which a second winch from 0.5 s on never sees: at
    90 deg it pulls with, and from there on the margin of both grows.
    """
    plain = {"joints__vjoint": {"coulomb": 0.01}, "margin": PLAIN.model_dump()}
    plain |= {f"cables__{plane}__friction": {"kind": "none"} for plane in PLANES}
    late = plain | {"cables__lower__winch__start_time": 0.5}
    found = with_margin(opened(0.05), ring(**late)).values
    assert found["least_drive_margin"] == pytest.approx(
        virtual_work(ONE, math.radians(60.0)), rel=1e-6
    )
    best = min(virtual_work(BOTH, math.radians(angle)) for angle in np.linspace(90.0, 179.9, 8))
    assert found["least_drive_margin_started"] == pytest.approx(best, rel=2e-2)
    at = float(found["least_drive_margin_started_angle"])
    assert found["least_drive_margin_started"] == pytest.approx(
        virtual_work(BOTH, math.radians(min(at, 179.99))), abs=2e-3 * abs(best) + 1e-6
    )
    # Of a run that ended before it is that of the whole run; of one winch alone there is none.
    short = opened(0.05, lock=math.nan)
    short.values["opening_angle"][:, :, 8:] = np.nan
    ended = with_margin(short, ring(**late)).values
    assert ended["least_drive_margin_started"] == ended["least_drive_margin"]
    single = with_margin(opened(0.05), ring(**plain, cables__lower="none")).values
    assert "least_drive_margin_started" not in single
    # What was passed before all winches started, at once or the only one that ever does, is before.
    equal = plain | {f"cables__{plane}__winch__start_time": 0.5 for plane in PLANES}
    whole = with_margin(opened(0.05), ring(**equal)).values
    assert whole["least_drive_margin_started"] == pytest.approx(best, rel=2e-2)
    alone = late | {"cables__upper__winch__stop_time": 0.0}
    lone = with_margin(opened(0.05), ring(**alone)).values["least_drive_margin_started"]
    best_alone = min(virtual_work(ONE, math.radians(a)) for a in np.linspace(90.0, 179.9, 8))
    assert lone == pytest.approx(best_alone, rel=2e-2)
    # A winch that starts after a restart: nothing of the scene before counts.
    later = plain | {"cables__lower__winch__start_time": 0.8}
    after = with_margin(opened(0.05), ring(**later), [(0.5, ring(**plain))]).values
    from_there = min(virtual_work(BOTH, math.radians(a)) for a in np.linspace(136.8, 179.9, 8))
    assert after["least_drive_margin_started"] == pytest.approx(from_there, rel=2e-2)
    # A scene before that had its second winch late counts up to the restart.
    both = with_margin(opened(0.05), ring(**plain), [(0.6, ring(**late))]).values
    assert both["least_drive_margin_started"] == pytest.approx(
        found["least_drive_margin_started"], rel=1e-9
    )


def test_each_plane_has_the_margin_of_its_own_cable_along_its_own_angles() -> None:
    """A jam in the lower cable at 0.5 s, at 90 deg, which the mean of both planes all but hides."""
    plain = {"joints__vjoint": {"coulomb": 0.01}, "margin": PLAIN.model_dump()}
    plain |= {f"cables__{plane}__friction": {"kind": "none"} for plane in PLANES}
    jam = {"kind": "jammed-pulley", "cable": "lower", "pulley": 1, "time": 0.5}
    found = with_margin(opened(0.05), ring(**plain, faults=[jam])).values
    whole = virtual_work(BOTH, math.radians(60.0))
    # The span from the winch to the first pulley keeps its length: behind the jam nothing pulls.
    assert found["least_drive_margin_plane"] == pytest.approx([whole, -1.0], rel=1e-6)
    assert found["least_plane_margin"] == pytest.approx(-1.0)
    alone = virtual_work(ONE, math.radians(90.0))
    assert found["least_drive_margin"] == pytest.approx(alone, rel=1e-6)
    # A winch that starts at 0.5 s leaves its plane without drive until then, and with it from then.
    late = plain | {"cables__lower__winch__start_time": 0.5}
    waiting = with_margin(opened(0.05), ring(**late)).values
    assert waiting["least_plane_margin"] == pytest.approx(-1.0)
    best = min(virtual_work(BOTH, math.radians(angle)) for angle in np.linspace(90.0, 179.9, 8))
    assert waiting["least_plane_margin_started"] == pytest.approx(best, rel=2e-2)
    short = opened(0.05, lock=math.nan)
    short.values["opening_angle"][:, :, 8:] = np.nan
    assert with_margin(short, ring(**late)).values["least_plane_margin_started"] == -1.0
    single = with_margin(opened(0.05), ring(**plain, cables__lower="none")).values
    assert "least_plane_margin" not in single


def test_a_plane_counts_what_it_passed_until_it_has_locked() -> None:
    scene = netted()
    drive = DriveMargin(scene, EcssMechanisms())
    truth = drive.least()
    run, last = opened(0.02), math.degrees(truth.angle) - 20.0
    run.values["opening_angle"][1] = np.minimum(run.values["opening_angle"][1], last)
    found = with_margin(run, scene).values["least_drive_margin_plane"]
    # Planes are alike, so that the margin of each is that of both at its own angle.
    both = [truth.margin, drive.at(math.radians(last)).margin]
    assert found == pytest.approx(both, rel=1e-9)
    stopped = netted(**{UPPER: 1.1})
    assert with_margin(run, stopped).values["least_drive_margin_plane"][0] == -1.0
    run.values["lock_time"] = np.repeat([[1.0], [np.nan]], 6, axis=1)
    found = with_margin(run, stopped).values["least_drive_margin_plane"]
    assert found[0] == pytest.approx(truth.margin, rel=1e-9)


@pytest.mark.parametrize("struck", [True, False])
def test_a_ring_at_rest_names_the_faults_that_had_struck(struck: bool) -> None:
    cut = {"kind": "cut-cable", "cable": "lower", "span": 3, "time": 2.0}
    stop = {"cables.lower.winch.stop_time": 2.0}
    few = {"structure.sections": 4, "record.interval": 1.0} | (
        {"faults": [cut]} if struck else stop
    )
    found = simulate(load_scene("ring18-motor").with_values(few), fidelity="frame")
    why = found.attrs["reason"].split("; ")[0]
    assert why.startswith("came to rest with ")
    assert why.endswith(", after cut-cable at 2 s") == struck
    assert ("after" in why) == struck
