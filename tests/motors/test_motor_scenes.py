"""Rings that motors open, as scenes: where they stall, what they give, and both engines."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

from motor_rings import MOTOR, PLAIN, STALL, TRAVEL, ring
from ringsim.frame.integrate import Integration
from ringsim.frame.model import FrameModel
from ringsim.outputs.family import holds
from ringsim.rigid.margin import PULLEYS
from ringsim.rigid.mechanism import Mechanism
from ringsim.rigid.resistances import Opening, resistances
from ringsim.scene import load_scene, scene_from_toml
from ringsim.simulation import simulate, steps
from ringsim.variables import Fate, Status

STIFFNESS, NEUTRAL = 300.0, 0.4


@pytest.fixture(scope="module")
def stalled() -> xr.Dataset:
    """Motors that meet a net; they crawl against the joints' friction as they come to it.

    The net is in one plane alone, and its rods as stiff as can be: usual ones let the other plane
    open 5 deg further.
    """
    scene = ring(
        net__stiffness=STIFFNESS, net__neutral_length=NEUTRAL, solver__end_time=100.0,
        record__interval=0.5, rods__young_modulus=1e15, cables__upper__friction={"kind": "none"},
        cables__lower__friction={"kind": "none"}, joints__vjoint__viscous=2.0,
        margin=PLAIN.model_dump(),
    )  # fmt: skip
    return simulate(scene, "frame")


@pytest.fixture(scope="module")
def opening() -> xr.Dataset:
    """The first two seconds of a usual ring."""
    scene = ring(
        solver__end_time=2.0, solver__step=0.02, record__interval=0.02, margin=PLAIN.model_dump()
    )
    return simulate(scene, "frame")


def test_motors_stall_where_they_meet_the_net(stalled: xr.Dataset) -> None:
    """Virtual work: every V span shortens by dL, every corner moves out by dR."""
    offset, bar, pin = 0.105, 0.2889, 0.006554

    def unbalanced(phi: float) -> float:
        span = np.sqrt(bar**2 + offset**2 + 2.0 * bar * offset * np.sin(phi))
        radius = 2.0 * (bar * np.cos(phi) + pin)  # a hexagon's, as long as its chord
        drive = 2 * 12 * STALL * bar * offset * np.cos(phi) / span
        stretch = max(radius - NEUTRAL, 0.0)
        return drive - 6.0 * STIFFNESS * stretch * 2.0 * bar * np.sin(phi)

    rest = np.degrees(np.pi - 2.0 * brentq(unbalanced, np.radians(15.0), np.radians(59.0)))
    assert Fate(stalled.outcome.item()) is Fate.STALLED
    kept = stalled.dropna("time", subset=["opening_angle"]).isel(time=-1)
    np.testing.assert_allclose(kept.opening_angle, rest, atol=2e-3)
    # Newton's tolerance lets the shafts creep: 0.05 rad/s are 8e-5 of the line from 600 rad/s on.
    np.testing.assert_allclose(kept.motor_speed, 0.0, atol=0.05)
    np.testing.assert_allclose(kept.motor_torque, 0.002, rtol=0.05 / 600.0)


def test_the_margin_vanishes_where_a_run_stalls_and_a_run_tells_it(stalled: xr.Dataset) -> None:
    found = stalled.dropna("time", subset=["opening_angle"])
    # Close to the stall the motors crawl: what is left of their line is the viscous friction.
    assert found.drive_margin[-2] == pytest.approx(0.0, abs=1e-4)
    assert found.drive_margin[1] > 0.5
    least = float(found.least_drive_margin)
    assert least <= found.drive_margin.min()
    assert least == pytest.approx(float(found.drive_margin.min()), abs=1e-6)
    # It crawls for its last seconds.
    assert found.least_drive_margin_time == pytest.approx(float(found.time[-1]), abs=2.0)
    assert list(found.resistance.values) == [PULLEYS, "inertia", "joint friction", "net"]
    assert found.drive_resistance.attrs["units"] == found.drive_available.attrs["units"] == "N m"
    # It counts neither the viscous friction of this motion nor its inertia.
    assert (found.drive_resistance.sel(resistance=["joint friction", "inertia"]) == 0.0).all()


def test_along_a_run_work_is_drive_less_resistance(opening: xr.Dataset) -> None:
    """The ring's equation of motion: what the cables give goes into friction and inertia."""
    found = opening.sel(time=slice(0.46, None)).dropna("time", subset=["drive_margin"])
    angle = np.radians(found.opening_angle.mean(("plane", "section")).values)
    rate = np.gradient(angle, found.time.values)
    bend = np.gradient(rate, found.time.values)
    scene = scene_from_toml(opening.attrs["scene"], source="attribute scene")
    mechanism = Mechanism(scene)
    kinds, resisting = resistances(scene, mechanism), []
    for row in zip(angle, rate, bend, strict=True):
        now = mechanism.at(0.5 * (np.pi - row[0]))
        resisting.append(
            sum(one.force(Opening(*map(float, row), now, mechanism.switches)) for one in kinds)
        )
    tension = found.motor_torque.isel(plane=0, winch=0) / MOTOR["stall_torque"]
    lost = found.drive_resistance.sel(resistance=PULLEYS)
    driving = tension * (found.drive_available - lost)
    np.testing.assert_allclose(driving[4:-4], resisting[4:-4], rtol=2e-3)


@pytest.mark.parametrize("short", [True, False])
def test_dry_friction_holds_a_ring_that_is_short_of_drive(short: bool) -> None:
    """Virtual work in the stowed ring: two V spans shorten for each V-joint that turns."""
    offset, bar, phi = 0.105, 0.2889, np.radians(60.0)
    span = np.sqrt(bar**2 + offset**2 + 2.0 * bar * offset * np.sin(phi))
    holding = STALL * bar * offset * np.cos(phi) / span
    scene = ring(
        cables__upper__friction={"kind": "none"}, cables__lower__friction={"kind": "none"},
        joints__vjoint={"coulomb": (1.03 if short else 0.8) * holding, "rate": 2e-4},
        solver__end_time=20.0,
    )  # fmt: skip
    found = simulate(scene, "frame")
    assert (Fate(found.outcome.item()) is Fate.STALLED) == short
    farthest = float(found.opening_angle.max())
    assert farthest == pytest.approx(60.0, abs=0.2) if short else farthest > 120.0


def test_outputs_of_motors_tell_what_their_words_say(opening: xr.Dataset) -> None:
    found = opening
    assert found.motor_torque.dims == ("plane", "winch", "time")
    units = {name: found[f"motor_{name}"].attrs["units"] for name in ("torque", "speed", "power")}
    assert units == {"torque": "N m", "speed": "rad/s", "power": "W"}
    assert found.motor_energy.attrs["units"] == "J"
    now = found.isel(winch=0).where(found.time > 0.3, drop=True)
    product = now.motor_torque * now.motor_speed
    np.testing.assert_allclose(now.motor_power, product, rtol=1e-5)
    # Simpson's rule, as the energy is kept at the steps; power changes by less than 1 % in 0.02 s.
    power, energy = now.motor_power.values, now.motor_energy.values
    simpson = 0.02 / 3.0 * (power[:, :-2:2] + 4.0 * power[:, 1:-1:2] + power[:, 2::2]).cumsum(1)
    np.testing.assert_allclose(energy[:, 2::2] - energy[:, :1], simpson, rtol=1e-3)
    # Tension asks for its torque through the gear, on the line of the motor or at its command.
    tension = now.cable_tension.isel(span=0).transpose("plane", "time").values
    np.testing.assert_allclose(now.motor_torque, tension * TRAVEL / 0.6, rtol=1e-4)
    line = 600.0 * (1.0 - now.motor_torque.values / 0.002)
    np.testing.assert_allclose(now.motor_speed, line, rtol=1e-3)
    # The shafts' energy less the gears' losses is what the winches put into the ring.
    work = found.work.diff("time").sum().item()
    given = 0.6 * found.motor_energy.isel(time=-1).sum().item()
    assert work == pytest.approx(given, rel=2e-3)


def test_a_motor_winds_as_commanded_and_gives_nothing_while_it_is_off() -> None:
    values = {
        f"cables.{plane}.winch": {
            "winding": MOTOR | {"speed": 250.0}, "start_time": 0.1, "stop_time": 0.4
        }
        for plane in ("upper", "lower")
    }  # fmt: skip
    scene = ring(structure__sections=3, solver__end_time=1.0).with_values(values)
    found = simulate(scene, "frame").isel(plane=0, winch=0)
    found = found.dropna("time", subset=["motor_torque"])
    torque = found.motor_torque
    off = np.concatenate([torque.sel(time=slice(None, 0.05)), torque.sel(time=slice(0.45, None))])
    assert (off == 0.0).all()
    on = found.sel(time=slice(0.2, 0.35))
    assert (on.motor_torque > 1e-6).all()
    np.testing.assert_allclose(on.motor_speed, 250.0, rtol=1e-6)
    np.testing.assert_allclose(on.wound_length.diff("time"), 0.05 * 250.0 * TRAVEL, rtol=1e-6)
    assert np.ptp(found.motor_energy.sel(time=slice(0.45, None)).values) == 0.0


def test_a_commanded_rotor_gives_what_its_present_command_asks_for() -> None:
    """As of any rotor, whose command is not that of the scene; the brake takes nothing here."""
    inertia, told = 1e-6, 100.0 * TRAVEL
    rotor = MOTOR | {"speed": 300.0, "rotor_inertia": inertia}
    values: dict[str, object] = {f"cables.{p}.winch.winding": rotor for p in ("upper", "lower")}
    values["controller"] = {"kind": "synchronise", "period": 0.2, "speed": told, "gain": 0.0}
    scene = ring(structure__sections=3, solver__end_time=0.6, solver__tolerance=3e-4)
    found = simulate(scene.with_values(values), "frame")
    last = found.isel(winch=0, time=-1)
    assert last.motor_speed.values == pytest.approx(100.0, rel=1e-6)
    kept = 0.5 * inertia * float((last.motor_speed**2).sum())
    given, work = float(last.motor_energy.sum()), float(found.work[-1])
    assert given == pytest.approx(work / 0.6 + kept, rel=0.02)


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_rotors_keep_what_the_rope_does_not_get(fidelity: str) -> None:
    """Energy of the shafts = work of the winches over the gear's efficiency + J w^2 / 2."""
    inertia = 1e-6
    rotor = MOTOR | {"speed": 300.0, "ramp": 0.5, "rotor_inertia": inertia}
    values = {f"cables.{plane}.winch.winding": rotor for plane in ("upper", "lower")}
    scene = ring(structure__sections=3, solver__end_time=0.45, solver__tolerance=1e-3)
    found = simulate(scene.with_values(values), fidelity)
    last = found.isel(winch=0, time=-1)
    kept = 0.5 * inertia * float((last.motor_speed**2).sum())
    given, work = float(last.motor_energy.sum()), float(found.work[-1])
    assert kept > 0.2 * given
    assert given == pytest.approx(work / 0.6 + kept, rel=2e-3)


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_motors_tell_how_long_they_were_slower_than_commanded(fidelity: str) -> None:
    """As the courses of their speeds show; the stowed ring asks for more than they have."""
    weak = MOTOR | {"speed": 300.0}
    ramped = weak | {"ramp": 0.2, "rotor_inertia": 1e-7}
    scene = ring(
        structure__sections=3, record__interval=0.005, solver__end_time=0.5,
        joints__vjoint={"coulomb": 0.3}, cables__lower__winch__stop_time=0.3,
    )  # fmt: skip
    found = simulate(
        scene.with_values({
            "cables.upper.winch.winding": ramped, "cables.lower.winch.winding": weak,
        }), fidelity,
    )  # fmt: skip
    speed, time = found.motor_speed.isel(winch=0), found.time
    phase = np.clip(time / 0.2, 0.0, 1.0)
    command = {"upper": 300.0 * phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2),
               "lower": xr.where(time < 0.3, 300.0, 0.0)}  # fmt: skip
    truth = {
        plane: 0.005 * int((speed.sel(plane=plane) < 0.99 * told).sum())
        for plane, told in command.items()
    }
    lag = found.motor_lag_duration.isel(winch=0)
    for plane, counted in truth.items():
        assert lag.sel(plane=plane) == pytest.approx(counted, abs=0.011)
    assert max(truth.values()) > 0.05
    assert found.longest_motor_lag == lag.max()
    plain = {f"cables.{p}.winch.winding": MOTOR for p in ("upper", "lower")}
    without = simulate(scene.with_values(plain | {"solver.end_time": 0.1}), "frame")
    assert np.isnan(without.motor_lag_duration).all()  # nothing is commanded
    assert without.longest_motor_lag == 0.0
    # One that has its torque at once never lags, not in its first step either.
    strong = MOTOR | {"speed": 100.0, "stall_torque": 0.02}
    free = {f"cables.{p}.winch.winding": strong for p in ("upper", "lower")}
    free |= {"joints.vjoint.coulomb": 0.0, "cables.upper.winch.start_time": 0.05}
    found = simulate(scene.with_values(free | {"solver.end_time": 0.2}), "frame")
    assert (found.motor_lag_duration == 0.0).all()


@pytest.mark.parametrize("fidelity", ["frame", "full"])
@pytest.mark.parametrize("speed", [150.0, 450.0])
def test_a_rotor_without_a_ramp_begins_with_its_stall_torque(speed: float, fidelity: str) -> None:
    """Its torque falls along its line from the stall torque as soon as it is on, and its power is
    that of the parabola w T (1 - w / w_0), of which it passes the top or comes to the command:
    closed forms, which no step has to meet.
    """
    rotor = MOTOR | {"speed": speed, "rotor_inertia": 1e-7, "stall_torque": 0.01}
    values = {f"cables.{plane}.winch.winding": rotor for plane in ("upper", "lower")}
    scene = ring(structure__sections=3, solver__end_time=0.1, record__interval=0.01)
    found = simulate(scene.with_values(values), fidelity)
    assert float(found.peak_motor_torque) == pytest.approx(0.01, rel=1e-9)
    assert float(found.peak_motor_torque_time) == 0.0
    top = min(speed, 300.0)
    assert float(found.peak_motor_power) == pytest.approx(
        0.01 * top * (1.0 - top / 600.0), rel=1e-3
    )
    # Later on a stronger rope may ask for more than the line leaves, and never for more than that.
    line = 0.01 * (1.0 - found.motor_speed / 600.0)
    assert bool((found.motor_torque <= line * (1.0 + 1e-9)).all())


def test_a_rotor_that_starts_later_has_its_stall_torque_then() -> None:
    """And gives its rope and its own run-up what they take: energy of the shafts."""
    rotor = MOTOR | {"speed": 300.0, "rotor_inertia": 1e-6}
    values = {f"cables.{plane}.winch.winding": rotor for plane in ("upper", "lower")}
    values |= {f"cables.{plane}.winch.start_time": 0.05 for plane in ("upper", "lower")}
    scene = ring(structure__sections=3, solver__end_time=0.5, solver__tolerance=1e-3)
    found = simulate(scene.with_values(values), "frame")
    assert float(found.peak_motor_torque) == pytest.approx(MOTOR["stall_torque"], rel=1e-9)
    assert float(found.peak_motor_torque_time) == pytest.approx(0.05, abs=1e-9)
    last = found.isel(winch=0, time=-1)
    kept = 0.5 * 1e-6 * float((last.motor_speed**2).sum())
    given, work = float(last.motor_energy.sum()), float(found.work[-1])
    assert kept > 0.2 * given
    assert given == pytest.approx(work / 0.6 + kept, rel=1e-3)


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_a_rotor_takes_what_its_run_up_needs_however_few_steps_it_has(fidelity: str) -> None:
    """It runs up within 7 ms: J w^2 / 2 and what the rope took, closed at any steps; and the
    largest current is that of the stall torque with that of what turns, just after the start.
    """
    rotor = MOTOR | {"speed": 300.0, "stall_torque": 0.01, "rotor_inertia": 1e-7,
                     "torque_constant": 0.02, "no_load_current": 0.05}  # fmt: skip
    values = {f"cables.{plane}.winch.winding": rotor for plane in ("upper", "lower")}
    given = []
    for tolerance in (3e-3, 1e-4):
        scene = ring(structure__sections=3, solver__end_time=0.1, solver__tolerance=tolerance)
        found = simulate(scene.with_values(values), fidelity)
        last = found.isel(winch=0, time=-1)
        kept = 0.5 * 1e-7 * float((last.motor_speed**2).sum())
        given.append(float(last.motor_energy.sum()))
        assert kept > 0.15 * given[-1]
        assert given[-1] == pytest.approx(float(found.work[-1]) / 0.6 + kept, rel=1e-3)
        assert float(found.peak_motor_current) == pytest.approx(0.01 / 0.02 + 0.05, rel=1e-9)
    assert given[0] == pytest.approx(given[1], rel=0.02)


def test_a_rotor_that_is_switched_off_while_it_runs_up_took_what_it_had() -> None:
    """w = w_0 (1 - exp(-t T / J w_0)) of a rope that hardly pulls yet; then a brake holds it."""
    inertia, stop = 3e-7, 0.005
    rotor = MOTOR | {"rotor_inertia": inertia, "stall_torque": 0.01}
    values: dict[str, object] = {}
    for plane in ("upper", "lower"):
        winch = {"start_time": 0.0, "stop_time": stop, "winding": rotor}
        values[f"cables.{plane}.winch"] = winch
    found = []
    for tolerance in (3e-3, 1e-5):
        scene = ring(structure__sections=3, solver__end_time=0.1, solver__tolerance=tolerance)
        run = simulate(scene.with_values(values), "frame")
        found.append(float(run.total_motor_energy))
    speed = 600.0 * (1.0 - np.exp(-stop * 0.01 / (inertia * 600.0)))
    truth = inertia * speed**2 + float(run.work.max()) / 0.6
    assert found == pytest.approx([truth, truth], rel=0.05)
    assert found[1] == pytest.approx(truth, rel=0.01)


def test_a_command_that_changes_asks_for_nothing_before_it() -> None:
    """Work of the winches over the gear's efficiency, and J w^2 / 2 of each run-up: a step that
    ends with a new command has none of its torque.  What slows down meets a brake.
    """
    inertia, planes = 1e-8, ("upper", "lower")
    rotor = MOTOR | {"speed": 100.0, "rotor_inertia": inertia, "stall_torque": 0.01}
    values = {f"cables.{plane}.winch.winding": rotor for plane in planes}
    scene = ring(structure__sections=3, solver__end_time=0.3, solver__tolerance=3e-3)
    run, speeds = steps(scene.with_values(values), period=0.05), [100.0, 200.0, 50.0, 250.0, 2.0]
    speeds += 9 * [200.0]
    for _, speed in zip(run, speeds, strict=False):
        run.command(**dict.fromkeys(planes, TRAVEL * speed))
    found = run.result
    ups = [(0.0, 100.0), (100.0, 200.0), (50.0, 250.0), (2.0, 200.0)]
    kept = 2.0 * sum(0.5 * inertia * (high**2 - low**2) for low, high in ups)
    given, work = float(found.total_motor_energy), float(found.work[-1])
    assert given == pytest.approx(work / 0.6 + kept, rel=0.02)


def test_a_command_of_its_own_speed_ends_the_ramp_of_a_motor() -> None:
    """As one of nearly its own speed does."""
    ramped, planes = MOTOR | {"speed": 100.0, "ramp": 1.0}, ("upper", "lower")
    values = {f"cables.{plane}.winch.winding": ramped for plane in planes}
    scene = ring(structure__sections=3, solver__end_time=0.4).with_values(values)
    speeds = []
    for told in (100.0, 100.0 * (1.0 - 1e-9)):
        run = steps(scene, period=0.1)
        for number, _ in enumerate(run):
            if number == 1:
                run.command(**dict.fromkeys(planes, TRAVEL * told))
        speeds.append(run.result["motor_speed"].sel(time=[0.15, 0.3], method="nearest").values)
    np.testing.assert_allclose(speeds[0], speeds[1], rtol=1e-6)
    assert speeds[0][0, 0].min() > 50.0


def test_a_ramp_takes_the_jump_from_the_first_steps() -> None:
    peaks = {}
    for ramp in (None, 0.5):
        rotor = MOTOR | {"speed": 300.0, "rotor_inertia": 1e-7} | ({"ramp": ramp} if ramp else {})
        values = {f"cables.{plane}.winch.winding": rotor for plane in ("upper", "lower")}
        brief = ring(
            structure__sections=3, solver__end_time=0.05, solver__step=0.02, record__interval=0.05
        )
        for tolerance in (3e-3, 1e-4):
            scene = brief.with_values(values | {"solver.tolerance": tolerance})
            peaks[ramp, tolerance] = float(simulate(scene, "frame").peak_tension)
    assert peaks[0.5, 3e-3] < 0.1 * peaks[None, 3e-3]
    assert peaks[0.5, 3e-3] == pytest.approx(peaks[0.5, 1e-4], rel=5e-3)


def test_winches_without_a_motor_have_no_such_output() -> None:
    winding = {"kind": "stall", "speed": 0.05, "max_tension": 5.0}
    brief = ring(structure__sections=3, solver__end_time=0.1, record__interval=0.1)
    one = brief.with_values({"cables.upper.winch.winding": winding})
    none = one.with_values({"cables.lower.winch.winding": winding})
    assert [holds(scene) & {"motors"} for scene in (one, none)] == [{"motors"}, set()]
    found = simulate(none, "frame")
    assert not [name for name in found.variables if str(name).startswith(("motor", "winch"))]
    found = simulate(one, "frame")
    assert np.isnan(found.motor_torque.sel(plane="upper")).all()
    assert np.isfinite(found.motor_torque.sel(plane="lower")).all()


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_motors_at_both_ends_of_a_rope_share_what_they_wind(fidelity: str) -> None:
    """Alike by symmetry, after a late start of the lower cable, too: each went by the other's last
    speed, so that they took turns at every step, and steps fell to the shortest."""
    ends = {f"cables.{plane}.end": "both" for plane in ("upper", "lower")}
    plain = {"structure.sections": 4, "boom": "none", "net": "none", "solver.end_time": 1.5}
    late = {"cables.lower.winch.start_time": 0.37}
    found = simulate(load_scene("ring18-motor").with_values(ends | plain | late), fidelity)
    assert found["status"] == 0
    assert found["steps"] < 200
    first, second = (found["motor_speed"].sel(winch=k).to_numpy() for k in (1, 2))
    known = np.isfinite(first)
    assert known.sum() > 20
    np.testing.assert_allclose(first[known], second[known], rtol=1e-5, atol=1e-3)


def test_a_free_rope_is_wound_up_and_nothing_more() -> None:
    """Also where a pulley was jammed before, which parts the rope: its winch winds what holds
    nothing, however much it is."""
    cuts = [{"kind": "cut-cable", "cable": k, "span": 1, "time": 1.0} for k in (1, 2)]
    values = {"structure.sections": 4, "faults": cuts, "solver.end_time": 500.0}
    found = simulate(load_scene("ring18-motor").with_values(values), "frame")
    assert found.status == Status.OK
    jam = {"kind": "jammed-pulley", "cable": "upper", "pulley": "section 1 V", "time": 1.0}
    values = {
        "structure.sections": 4, "structure.opening_angle": 90.0, "solver.end_time": 30.0,
        "record.interval": 0.5, "faults": [jam, cuts[0]],
    }  # fmt: skip
    found = simulate(load_scene("ring18-cable").with_values(values), "frame")
    assert found.status == Status.OK
    assert float(found.wound_length.max()) > 0.3
    assert float(found.rope_strain.max()) < 0.01


def test_what_newton_refuses_is_its_last_residual() -> None:
    """Not what the winches had wound before: with that there may be tensions."""
    scene = load_scene("ring18-motor").with_values(
        {"structure.sections": 4, "solver.end_time": 0.5}
    )
    run = Integration(FrameModel(scene))
    run.run()
    cables, state = run.model.cables, run.state
    assert cables.winches.answering
    cables.refuse(state.place.paths, state.rate.paths)  # these have
    cables.roped.winches.turned[0] = 100.0
    with pytest.raises(ValueError, match="more is wound than there is rope"):
        cables.refuse(state.place.paths, state.rate.paths)


@pytest.mark.parametrize("inertia", [None, 1e-7])
def test_a_motor_that_holds_after_the_lock_is_what_it_was_before(inertia: float | None) -> None:
    """It follows no command then: it has no lag, and no rotor that runs up; to hold the tension
    takes what its load asks for.
    """
    values: dict[str, object] = {
        "structure.sections": 4, "structure.opening_angle": 120.0, "solver.end_time": 12.0,
        "solver.settling_time": 0.5, "record.interval": 0.25, "margin": "none",
    }  # fmt: skip
    for plane in ("upper", "lower"):
        motor = {"speed": 200.0, "ramp": 3.0} | (
            {} if inertia is None else {"rotor_inertia": inertia}
        )
        values |= {f"cables.{plane}.winch.winding.{name}": value for name, value in motor.items()}
    stops, holds_on = (
        simulate(
            load_scene("ring18-motor").with_values(
                values | {f"cables.{plane}.winch.after_lock": word for plane in ("upper", "lower")}
            ),
            "frame",
        )
        for word in ("stop", "hold")
    )
    assert stops.longest_motor_lag == holds_on.longest_motor_lag == 0.0
    assert float(holds_on.peak_motor_power) == pytest.approx(
        float(stops.peak_motor_power), rel=0.03
    )
    # Its stall torque is 5e-3 N m.
    least, found = float(stops.peak_motor_torque), float(holds_on.peak_motor_torque)
    assert least <= found < 1.2 * least
