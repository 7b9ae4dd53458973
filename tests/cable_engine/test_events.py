"""Winches that start and stop at given times wind what their laws say, by either engine.

A jammed first pulley leaves the winch a span of constant length S alone: nothing else moves.  On a
line of torque and speed, v = a - b T with T = EA w / (S - w), the rope wound follows from

    dw/dt = a (1 - c w / (S - w)),  c = b EA / a:
    a t = w / k - S (1 - 1 / k) / k ln(1 - k w / S),  k = 1 + c,

from the end of any time w / v on in which the winch turns at its full speed v.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from ringsim.outputs.family import Reading
from ringsim.outputs.recorder import Recorder
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run, run_frame
from ringsim.variables import Outcome, Status

FRAMES = pytest.param(run_frame, id="frames")
EXUDYN = pytest.param(run, id="exudyn", marks=pytest.mark.slow)
"""Where test_frame_laws.py compares both with motors and feedback, and both are told the times."""
Engine = Callable[[Scene], Outcome]
EA, SPAN = 100.0, 0.3
START, STOP = 0.525, 0.732


class Line(NamedTuple):
    """A winding table, and the line that it is: ``idle`` speed a (m/s), standstill at a ``stall``
    tension a / b (N), not above the ``fastest`` speed (m/s).
    """

    winding: dict[str, Any]
    idle: float
    stall: float
    fastest: float = math.inf

    def duration(self, wound: float) -> float:
        """Time (s) in which it winds so much rope (m), less than it stops at."""
        k = 1.0 + EA / self.stall

        def along(w: float) -> float:
            return (w / k - SPAN * (1.0 - 1.0 / k) / k * math.log(1.0 - k * w / SPAN)) / self.idle

        # Full speed up to the tension at which the line is down to it.
        share = (1.0 - min(self.fastest / self.idle, 1.0)) * self.stall / EA
        level = SPAN * share / (1.0 + share)
        if wound <= level:
            return wound / self.fastest
        return level / self.fastest + along(wound) - along(level)

    def wound(self, duration: float) -> float:
        """Rope (m) that it winds in a time (s)."""
        most = SPAN * self.stall / (EA + self.stall)
        found = brentq(lambda w: self.duration(w) - duration, 0.0, most * (1.0 - 1e-12), xtol=1e-14)
        return float(found)


LINES = [
    pytest.param(
        Line(
            {"kind": "motor", "no_load_speed": 6.0, "stall_torque": 0.5, "drum_radius": 0.02},
            6.0 * 0.02,
            0.5 / 0.02,
        ),
        id="motor",
    ),
    pytest.param(
        Line({"kind": "stall", "speed": 0.12, "max_tension": 5.0, "band": 0.5}, 0.24, 5.0, 0.12),
        id="stall",
    ),
    pytest.param(
        Line(
            {"kind": "tension-feedback", "target": 6.0, "gain": 0.03, "max_speed": 0.1},
            0.03 * 6.0,
            6.0,
            0.1,
        ),
        id="feedback",
    ),
]


def alone(winding: dict[str, Any], **values: Any) -> Scene:
    """The truss whose upper winch has one span; two underscores stand for a dot."""
    winch = "cables.upper.winch"
    fields = {
        "cables.lower": "none",
        "cables.upper.axial_stiffness": EA,
        "cables.upper.slack_width": 1e-3,
        "cables.upper.initial_slack": 0.0,
        "cables.winch_distance": SPAN,
        f"{winch}.winding": winding,
        f"{winch}.start_time": START,
        f"{winch}.stop_time": STOP,
        "faults": [{"kind": "jammed-pulley", "cable": 1, "pulley": 1, "time": 0.0}],
        "solver.end_time": 1.0,
    }
    return load_scene("truss2").with_values(
        fields | {name.replace("__", "."): value for name, value in values.items()}
    )


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float, float]]:
    """Time (s), rope wound (m) and its rate (m/s) of the first winch at all steps."""
    seen: list[tuple[float, float, float]] = []
    note = Recorder.note

    def watched(history: Recorder, now: Reading) -> None:
        assert now.chain is not None
        seen.append((now.time, float(now.chain.wound.flat[0]), float(now.chain.wound_rate.flat[0])))
        note(history, now)

    monkeypatch.setattr(Recorder, "note", watched)
    return seen


Steps = list[tuple[float, float, float]]


@pytest.mark.parametrize("engine", [FRAMES, EXUDYN])
@pytest.mark.parametrize("line", LINES)
def test_a_winch_that_answers_winds_what_its_line_says(
    engine: Engine, line: Line, steps: Steps
) -> None:
    found = engine(alone(line.winding))
    assert found.status is Status.OK, found.reason
    times, wound, rates = np.array(steps).T
    assert wound[-1] == pytest.approx(line.wound(STOP - START), rel=1e-3)
    assert {START, STOP} <= set(times)
    # There are readings of both sides, on which it is as fast as the tension lets it be.
    (before, first), (still, last) = (np.flatnonzero(times == time) for time in (START, STOP))
    assert (rates[before], wound[first], rates[last]) == (0.0, 0.0, 0.0)
    assert rates[first] == pytest.approx(min(line.idle, line.fastest), rel=1e-3)
    # It stops at full speed; steps of a motor's sag change that by a fifth at most.
    assert rates[still] == pytest.approx(rates[still - 1], rel=0.2)
    assert wound[last:] == pytest.approx(wound[-1], abs=0.0)


@pytest.mark.parametrize("engine", [FRAMES, EXUDYN])
def test_the_rope_of_a_ring_does_not_depend_on_the_steps(engine: Engine, steps: Steps) -> None:
    """Two motors of a ring that pull with three quarters of what stalls them; 0.03004 m at steps
    of a thirtieth.
    """
    hours = {"start_time": START, "stop_time": 1.732}
    values = {f"cables.{p}.winch.{k}": v for p in ("upper", "lower") for k, v in hours.items()}
    ring = {"structure.sections": 4, "solver.end_time": 1.8}
    assert engine(load_scene("ring18-motor").with_values(ring | values)).status is Status.OK
    assert steps[-1][1] == pytest.approx(0.030041, rel=1e-3)


def test_times_that_are_nearly_one_are_one(steps: Steps) -> None:
    """0.1 + 0.2 is above 0.3 by a rounding: the winches, a table's end and a fault share a step."""
    table = {"kind": "table", "times": [0.0, 0.1, 0.2], "lengths": [0.0, 0.001, 0.003]}
    scene = load_scene("truss2").with_values(
        {
            "solver.end_time": 0.7,
            "cables.upper.winch.winding": table,
            "cables.upper.winch.start_time": 0.1,
            "cables.lower.winch.winding": {"kind": "constant", "speed": 0.01},
            "cables.lower.winch.start_time": 0.1 + 0.2,
            "cables.lower.winch.stop_time": 0.6,
            "faults": [{"kind": "failed-latch", "section": 1, "time": 0.3}],
        }
    )
    assert run_frame(scene).status is Status.OK
    times, wound, rates = np.array(steps).T
    apart = np.diff(times)  # none between both sides of an event
    assert apart[apart > 0.0].min() > 1e-6
    assert np.sum(apart == 0.0) == 3  # at 0.1, 0.3 and 0.6 s
    for time, length in ((0.1, 0.0), (0.2, 0.001), (0.3, 0.003)):
        number = int(np.flatnonzero(np.abs(times - time) < 1e-9)[-1])
        assert times[number] == pytest.approx(time, abs=1e-12)
        assert wound[number] == pytest.approx(length, abs=1e-15)
    # Behind the table's end the drum stands still, from the very reading there.
    assert not rates[number:].any()
    assert rates[number - 1] > 0.0


@pytest.mark.parametrize("line", LINES)
def test_the_rope_wound_is_of_second_order(line: Line, steps: Steps) -> None:
    """Steps of 0.01 s and of half that, from a line on which it starts at once."""
    errors = []
    for step in (0.01, 0.005):
        steps.clear()
        scene = alone(line.winding, solver__step=step, solver__step_control="constant")
        assert run_frame(scene).status is Status.OK
        errors.append(abs(steps[-1][1] - line.wound(STOP - START)))
    assert math.log2(errors[0] / errors[1]) > 1.8


def test_a_step_ends_where_the_last_joint_of_a_plane_locks(steps: Steps) -> None:
    """And the winch stops there: by the ramp's law it has wound no more."""
    values = {"structure.sections": 4, "structure.opening_angle": 150.0}
    scene = load_scene("ring18-cable").with_values(values)
    found = run_frame(scene)
    times, wound, _ = np.array(steps).T
    lock = float(found.values["lock_time"][0].max())
    number = int(np.searchsorted(times, lock))
    assert 0.0 <= times[number] - lock <= 0.045 * (times[number] - times[number - 1])
    law = scene.cables.upper.winch.winding
    assert wound[number:] == pytest.approx(law.wound(times[number]), abs=1e-12)
