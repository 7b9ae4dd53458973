"""Reaction and rotation of the base: momentum, by hand, and the other engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from momenta import Array, momenta
from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.frame.integrate import Integration
from ringsim.frame.integrate import solve as by_frames
from ringsim.frame.model import FrameModel
from ringsim.outputs.base import BaseReaction, BaseRotation
from ringsim.outputs.joints import first_impulse
from ringsim.scene import Scene, load_scene
from ringsim.variables import Outcome

CRAFT = {"mass": 20.0, "inertia": [2.0, 3.0, 4.0], "centre": [0.3, 0.1, 0.2]}


def ring(name: str = "ring18", **values: Any) -> Scene:
    """A ring of four, with its boom; two underscores stand for a dot."""
    chosen = {key.replace("__", "."): value for key, value in values.items()}
    plain = {
        "structure.sections": 4,
        "structure.opening_angle": 60.0,
        "net": "none",
        "record.reactions": True,
        "record.interval": 0.05,
        "solver.step_control": "constant",
        "solver.step": 0.01,
        "solver.end_time": 1.0,
        "solver.newton_tolerance": 1e-10,
    }
    return load_scene(name).with_values(plain | chosen)


class Course:
    """A run with the momenta at every step, (n, 2, 3), of all and without the spacecraft."""

    def __init__(self, scene: Scene) -> None:
        model = FrameModel(scene)
        self.whole, self.rest, self.states = [], [], []

        def note(_: Any) -> None:
            state = run.state.copy()
            self.whole.append(momenta(model, state))
            self.rest.append(momenta(model, state, craft=False))
            self.states.append(state)

        run = Integration(model, note)
        history = run.run()
        self.model, self.times = model, np.array(history.times)
        self.outcome = history.outcome()
        readings = {type(output): values for output, values in history.readings.items()}
        self.reaction = np.array(readings.get(BaseReaction, []))
        self.rotation = np.array(readings[BaseRotation])


def impulses(course: Course) -> Array:
    """Time integral of the reaction up to every step but the first, shape (n - 1, 2, 3)."""
    steps = np.diff(course.times)[:, None, None]
    means = 0.5 * (course.reaction[1:] + course.reaction[:-1])
    return np.asarray(np.cumsum(steps * means, axis=0))


def about_base(course: Course, momentum: Array) -> Array:
    """Angular momentum about the base's place at the start, which does not move."""
    base = course.model.layout.bodies[course.model.layout.base].pose.place
    return np.asarray(momentum[:, 1] - np.cross(base, momentum[:, 0]))


def test_a_fixed_base_gives_the_ring_its_momentum() -> None:
    """Cables pull within the ring, so that nothing else does.  Both are of second order in the
    step, and 1e-4 of the largest at this one.
    """
    course = Course(
        ring("ring18-cable", boom__base="fixed", solver__step=0.0025, solver__end_time=0.5)
    )
    whole, pushed = np.array(course.whole), impulses(course)
    for found, expected in ((pushed[:, 0], whole[:, 0]), (pushed[:, 1], about_base(course, whole))):
        largest = np.abs(expected).max()
        assert largest > 1e-4
        assert np.abs(found - expected).max() < 1e-4 * largest
    assert not course.rotation.any()


def test_spacecraft_and_ring_exchange_momentum() -> None:
    """Springs to a hub fold the ring from within, which pushes its spacecraft.  What is exchanged
    of angular momentum counts about the spacecraft's centre of mass: generalised-alpha keeps it to
    second order in the step over the time of the motion, if the rods do not ring.
    """
    net = {"stiffness": 0.03, "neutral_length": 0.05, "two_sided": True, "hub_mass": 1e-9}
    scene = ring(
        spacecraft=CRAFT, net=net, loads="none", structure__opening_angle=120.0,
        rods__damping=0.02, solver__step=0.004, solver__end_time=0.6,
    )  # fmt: skip
    course = Course(scene)
    whole, rest = np.array(course.whole), np.array(course.rest)
    centre = course.states[0].pose.place[0] + np.array(CRAFT["centre"])
    given = np.abs(rest[:, 1] - np.cross(centre, rest[:, 0])).max()
    pushed = np.abs(rest[:, 0]).max()
    assert pushed > 5e-3
    assert np.abs(whole[:, 0]).max() < 1e-8 * pushed
    assert np.abs(whole[:, 1]).max() < 1e-8 * given


def test_the_spacecraft_pushes_the_ring() -> None:
    scene = ring("ring18-cable", spacecraft=CRAFT, solver__step=0.0025, solver__end_time=0.5)
    course = Course(scene)
    rest, pushed = np.array(course.rest), impulses(course)
    largest = np.abs(rest[:, 0]).max()
    assert np.abs(pushed[:, 0] - rest[:, 0]).max() < 1e-4 * largest


def test_a_free_base_gives_nothing() -> None:
    """Momentum stays what it was, zero, and results tell how the base turns alone."""
    course = Course(ring("ring18-cable"))
    whole = np.array(course.whole)
    moving = np.array([momenta(course.model, s, craft=False) for s in course.states])
    assert "base_force" not in course.outcome.values
    assert np.abs(whole[:, 0]).max() < 1e-10
    assert np.abs(moving[:, 1]).max() < 1e-6
    assert float(course.outcome.values["base_rotation_max"]) > 0.01


def test_the_rate_of_the_spacecraft_is_the_derivative_of_its_rotation() -> None:
    """The rate is read of velocities, the rotation of axes.  A light spacecraft and a winch that
    starts late turn its axis: in its own axes the rate would be off by 2 % of its largest.
    """
    craft = {"mass": 0.3, "inertia": [0.01, 0.012, 0.008], "centre": [0.2, 0.15, 0.1]}
    scene = load_scene("ring18-cable").with_values({
        "structure.sections": 4, "boom.base": "free", "spacecraft": craft, "record.reactions": True,
        "solver.end_time": 1.5, "record.interval": 0.01, "solver.tolerance": 1e-4,
        "cables.lower.winch.start_time": 0.3,
    })  # fmt: skip
    runs = by_frames(scene), by_exudyn(scene)
    for run in runs:
        rates = run.values["base_rate"].T
        turned = Rotation.from_rotvec(np.radians(run.values["base_rotation"].T))
        slope = np.degrees((turned[2:] * turned[:-2].inv()).as_rotvec() / 0.02)
        largest = float(run.values["base_rate_max"])
        assert np.abs(slope - rates[1:-1])[2:].max() < 2e-3 * largest
        assert np.abs(slope - turned.inv().apply(rates)[1:-1]).max() > 1e-2 * largest
        sizes = np.linalg.norm(rates, axis=1)
        assert sizes.max() <= largest < 1.01 * sizes.max()
        near = np.interp(float(run.values["base_rate_max_time"]), run.coordinates["time"], sizes)
        assert near == pytest.approx(largest, rel=2e-3)
    here, there = (run.values["base_rate"] for run in runs)
    assert np.abs(here - there).max() < 2e-3 * np.abs(there).max()


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(
            {"boom.base": "fixed", "rods.young_modulus": [1.2e11, 2e11, 0.7e11, 1e11]}, id="fixed"
        ),
        pytest.param({"spacecraft": CRAFT}, id="spacecraft", marks=pytest.mark.slow),
    ],
)
def test_engines_agree(values: dict[str, Any]) -> None:
    """With equal steps and rods, at 1 % of the smallest component; Newton's residual is left."""
    uneven = {"loads.force": [0.05, 0.06, 0.04, 0.055], "solver.newton_tolerance": 1e-7}
    scene = ring().with_values(values | uneven)
    here, there = by_frames(scene).values, by_exudyn(scene).values
    for name in ("base_force", "base_torque", "base_rotation"):
        largest = np.abs(there[name]).max(axis=1)
        assert np.all(np.abs(here[name] - there[name]).max(axis=1) <= 1e-2 * largest)
    assert float(here["peak_base_force"]) == pytest.approx(
        float(there["peak_base_force"]), rel=1e-3
    )


def test_a_heavy_spacecraft_is_a_fixed_base() -> None:
    """10 t against 1 kg: what is left is the ratio of the masses."""
    heavy = {"mass": 1e4, "inertia": [1e5, 1e5, 1e5]}
    craft, fixed = by_frames(ring(spacecraft=heavy)), by_frames(ring(boom__base="fixed"))
    for name in ("base_force", "base_torque"):
        largest = np.abs(fixed.values[name]).max()
        assert np.abs(craft.values[name] - fixed.values[name]).max() < 1e-3 * largest


@pytest.mark.parametrize("drag", [0.0, 0.3, 0.9, 3.0])
def test_impulse_of_a_bounce(drag: float) -> None:
    """I w (1 + e) of a joint that meets a linear stop alone, which needs 2 acos(drag) / (f root) to
    throw it back, f the natural frequency and root = sqrt(1 - drag^2), with acosh and drag^2 - 1
    where it is overdamped.  What follows does not count."""
    inertia, met, natural, start = 0.7, 0.4, 40.0, 0.123
    times = np.linspace(0.0, 1.5, 60001)
    since = np.maximum(times - start, 0.0)
    poles = np.roots([1.0, 2.0 * drag * natural, natural**2]).astype(complex)
    waves = np.exp(poles[:, None] * since) * met / (poles[0] - poles[1])
    rates, gain = (((poles**k) * [1.0, -1.0] @ waves).real for k in (1, 2))
    turn = math.acos(drag) if drag < 1.0 else math.acosh(drag)
    end = 2.0 * turn / natural / math.sqrt(abs(1.0 - drag**2))
    back = -np.interp(start + end, times, rates) / met
    torques = np.where(times > start, inertia * gain, 0.0)
    found = first_impulse(times, torques, rates, start)
    assert found == pytest.approx(inertia * met * (1.0 + back), rel=1e-3)
    assert first_impulse(times, 0.0 * torques, rates, start) == 0.0


@pytest.mark.parametrize("after", [0.2, 1.0, 20.0])
def test_impulse_of_a_lock_is_not_what_presses_on(after: float) -> None:
    """A latched joint that a torque M presses on: 2 I w and M over the contact, which ends when it
    leaves as fast as it came, however long the run goes on.  Its stop holds M for good."""
    inertia, met, natural, load, start = 0.7, 0.4, 40.0, 5.0, 0.123
    times = np.arange(0.0, start + after, 2e-5)
    turned = natural * np.maximum(times - start, 0.0)
    sag = load / inertia / natural**2
    rates = met * np.cos(turned) + sag * natural * np.sin(turned)
    torques = load - inertia * natural * (sag * natural * np.cos(turned) - met * np.sin(turned))
    assert torques.min() < load < torques.max()
    held = 2.0 * (math.pi - math.atan(met / (sag * natural))) / natural
    torques = np.where(times > start + 0.15, load, np.where(times < start, 0.0, torques))
    rates = np.where(times > start + 0.15, 0.0, rates)
    found = first_impulse(times, torques, rates, start)
    assert found == pytest.approx(2.0 * inertia * met + load * held, rel=1e-3)


def test_impulse_of_a_lock_is_not_what_a_joint_creeps_on_under() -> None:
    """A stop that only brakes takes I w (1 - exp(-t / tau)) until the rate is a fiftieth, and as
    long again; then the joint creeps on at 0.0105 of its rate under a load that rises.
    """
    inertia, met, brakes, start = 0.7, 0.4, 0.01, 0.123
    times = np.arange(0.0, start + 20.0, 1e-4)
    since = np.maximum(times - start, 0.0)
    faded = np.exp(-since / brakes)
    rest = 2.0 * brakes * math.log(50.0)
    load = 3.0 * np.maximum(since - rest, 0.0)
    torques = np.where(times > start, inertia * met / brakes * faded + load, 0.0)
    rates = met * np.maximum(faded, 0.0105)
    found = first_impulse(times, torques, rates, start)
    assert found == pytest.approx(inertia * met * (1.0 - 50.0**-2), rel=2e-3)


LOCKING: dict[str, Any] = {
    "structure__sections": 3, "structure__opening_angle": 165.0, "loads__force": 0.1,
    "solver__step": 5e-4, "solver__end_time": 0.6, "stop__latch": True,
    "solver__newton_tolerance": 1e-6, "solver__energy_tolerance": 1e3, "boom": "none",
    "structure__aspect_ratio": 1.0,
}  # fmt: skip


@pytest.mark.parametrize("by", [by_frames, pytest.param(by_exudyn, marks=pytest.mark.slow)])
def test_impulses_do_not_tell_how_long_a_run_waits(by: Callable[[Scene], Outcome]) -> None:
    """Loads press the joints on their latches to the end."""
    scene = ring(**LOCKING)
    short, long = (by(scene.with_values({"solver.settling_time": t})).values for t in (0.05, 0.15))
    assert long["final_time"] > short["final_time"] + 0.09
    assert long["peak_lock_impulse"] == pytest.approx(short["peak_lock_impulse"], rel=1e-6)


def test_locks_have_impulses() -> None:
    """Inertia times rate before and after: nearly all V-joints alike in an even ring."""
    scene = ring(**LOCKING, solver__settling_time=0.02)
    here, there = by_frames(scene).values, by_exudyn(scene).values
    assert np.isfinite(here["lock_impulse"]).all()
    assert (here["lock_impulse"] > 0.0).all()
    assert here["lock_impulse"] == pytest.approx(there["lock_impulse"], rel=1e-2)
    assert np.ptp(here["lock_impulse"]) < 1e-3 * here["lock_impulse"].max()
