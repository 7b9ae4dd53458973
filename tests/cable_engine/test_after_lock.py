"""What a winch does once its plane has locked, while the other plane still opens."""

import functools
from typing import Any

import numpy as np
import pytest
from loops import for_each

from driven import outcome, truss
from ringsim.cable.winding import StallWinding
from ringsim.outputs.family import Reading
from ringsim.outputs.recorder import Recorder
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene
from ringsim.simulation import FIDELITIES, run_frame
from ringsim.variables import Fate, Outcome, Status


def uneven_scene(after_lock: str, **values: Any) -> Scene:
    """A truss whose upper winch is the faster one: its V-joint locks first."""
    fields = {
        "structure__opening_angle": 165.0,
        "joints__vjoint__viscous": 0.1,
        "solver__end_time": 4.0,
        "record__interval": 0.01,
        "both__winch__winding__speed": 0.05,
        "both__winch__after_lock": after_lock,
        "limits__overrun": 15.0,
        "solver__tolerance": 5e-4,
    }
    return truss(**fields | values).with_values({"cables.upper.winch.winding.speed": 0.1})


@functools.cache
def uneven(after_lock: str, engine: str, **values: Any) -> Outcome:
    return outcome(uneven_scene(after_lock, **values), engine)


def after_upper_lock(found: Outcome) -> tuple[np.ndarray, slice]:
    """Times from a little after the upper plane's lock on, until the last lock."""
    times = found.coordinates["time"]
    lock, last = found.values["lock_time"][0].max(), found.values["deployment_time"]
    assert last > lock + 0.1
    inside = np.flatnonzero((times > lock + 0.03) & (times < last))
    return times, slice(inside[0], inside[-1] + 1)


@pytest.mark.parametrize("after_lock", ["stop", "hold", "pull"])
def test_winches_do_after_the_lock_what_they_are_told(after_lock: str, engine: str) -> None:
    found = uneven(after_lock, engine)
    assert found.status == Status.OK, found.reason
    assert found.fate is Fate.DEPLOYED
    times, after = after_upper_lock(found)
    wound = found.values["wound_length"]
    upper = np.diff(wound[0, after]) / np.diff(times[after])
    if after_lock == "pull":
        assert upper == pytest.approx(0.1, rel=1e-6)
    elif after_lock == "stop":
        assert upper == pytest.approx(0.0, abs=1e-12)
        # A step ends at the lock, within a twenty-fifth of it.
        lock = found.values["lock_time"][0].max()
        assert 0.0 <= wound[0, after][-1] - 0.1 * lock < 0.1 * 0.0005
    # The other winch goes on by its law until its own plane has locked.
    assert wound[1, after] == pytest.approx(0.05 * times[after], abs=1e-9)
    assert found.values["energy_error"] < 1e-3


@pytest.mark.parametrize("engine", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_a_winch_that_holds_follows_the_line_of_its_motor(
    engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """T = T0 (1 - b v / v0) at the end of every step, T0 being the tension at the lock, v the speed
    of the drum, v0 the usual one and b the band of a stall motor.

    Without friction, which makes the rope's tension another than the one that the motor feels
    while the rope turns round.
    """
    seen = list[tuple[float, float, float, float, float]]()
    note = Recorder.note

    def watched(history: Recorder, now: Reading) -> None:
        assert now.chain is not None
        wound, speed = now.chain.wound.flat[0], now.chain.wound_rate.flat[0]
        seen.append((now.time, now.angles[0].min(), wound, speed, now.chain.tensions[0]))
        note(history, now)

    monkeypatch.setattr(Recorder, "note", watched)
    slippery = {f"cables.{plane}.friction": {"kind": "none"} for plane in ("upper", "lower")}
    scene = uneven_scene("hold", solver__tolerance=1e-3).with_values(slippery)
    found = FIDELITIES[engine](scene)
    assert found.fate is Fate.DEPLOYED
    times, angles, wound, turning, tension = np.array(seen).T
    lock = int(np.argmax(angles >= np.pi))
    speed = turning[lock + 1 :]
    band = StallWinding(speed=0.1, max_tension=1.0).band
    line = tension[lock] * (1.0 - band * speed / 0.1)
    # Solved within the step, to round-off.
    np.testing.assert_allclose(tension[lock + 1 :], line, rtol=1e-9)
    # What is wound is what it turns, to the second order of the steps.
    mean = 0.5 * (speed[1:] + speed[:-1]) * np.diff(times[lock + 1 :])
    assert mean.sum() == pytest.approx(wound[-1] - wound[lock + 1], abs=5e-5)
    # The lock shakes the rope, which moves the drum both ways and comes to rest.
    assert speed.max() > 0.01
    assert speed.min() < -0.01
    assert np.abs(speed[times[lock + 1 :] > times[lock] + 0.2]).max() < 0.005


def test_a_winch_that_pulls_on_a_locked_plane_loads_its_rope_and_joints(engine: str) -> None:
    stopped, pulling = uneven("stop", engine), uneven("pull", engine)
    peaks = [float(one.values["peak_tension"]) for one in (stopped, pulling)]
    assert peaks[1] > 2.0 * peaks[0]
    assert "past its stop" not in stopped.reason
    assert "V-joint upper 1 was up to" in pulling.reason


def test_limits_that_a_run_passes_are_told_with_value_and_time() -> None:
    """Whatever the engine: frames are the cheapest."""
    found = run_frame(uneven_scene("stop"))
    peak, time = (float(found.values[n]) for n in ("peak_tension", "peak_tension_time"))
    limited = run_frame(uneven_scene("stop", limits__tension=0.5 * peak))
    assert (limited.status, limited.fate) == (Status.OK, Fate.OVERLOADED)
    assert limited.reason == (
        f"{found.reason}; {peak:.4g} N at {time:.6g} s, more than limits.tension = {0.5 * peak:g} N"
    )
    assert np.isfinite(limited.values["deployment_time"])


@pytest.mark.parametrize("engine", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_the_stress_has_a_limit_too(engine: str) -> None:
    found = uneven(
        "stop", engine, record__stress=True, limits__rod_stress=1e3, solver__end_time=0.3
    )
    assert found.fate is Fate.OVERLOADED
    assert "more than limits.rod_stress = 0.001 MPa" in found.reason


def test_a_limit_that_is_refused_is_left_out_as_the_message_says() -> None:
    limit = {"limits.rod_stress": 1e8}
    with pytest.raises(InputError, match=r"leave the limit out \(--set limits.rod_stress=none\)"):
        load_scene("truss2").with_values(limit)
    left_out = load_scene("truss2").with_values(limit | {"limits.rod_stress": "none"})
    assert left_out.limits.rod_stress is None


@for_each(
    ("values", "words"),
    [
        ({"limits.rod_stress": 1e8}, "limits.rod_stress = 1e+08 Pa needs the stress of the rods"),
        ({"limits.tension": 10.0, "cables": "none"}, "limits.tension = 10 N needs a cable"),
        ({"limits.overrun": 120.0}, "limits.overrun = 120.0 deg must be at most 90"),
    ],
)
def test_limits_of_what_is_not_there_are_refused(values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words.replace("+", r"\+")):
        load_scene("truss2").with_values(values)
