"""Cables, paths and motions for the tests of this folder."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringsim.cable.friction import (
    BearingFriction,
    CapstanFriction,
    ExactBearingFriction,
    Frictionless,
)
from ringsim.cable.records import Cable, Winch
from ringsim.cable.winding import ConstantWinding
from ringsim.core.chain import Chain
from ringsim.core.winches import Winches

RADIUS = 0.01
LAWS = {
    "none": Frictionless(),
    "bearing": BearingFriction(coefficient=0.3 * RADIUS),
    "bearing-exact": ExactBearingFriction(coefficient=0.3 * RADIUS),
    "capstan": CapstanFriction(coefficient=0.2),
}


def cable(**fields):
    defaults = {"winch": Winch(winding=ConstantWinding(speed=0.01)), "pulley_radius": RADIUS}
    return Cable(**(defaults | fields))


def eta(law, angles, radius=RADIUS):
    """Ratio of the tension behind a pulley to the one before it."""
    return np.exp(law.log_decay(angles, radius))


def decays(state):
    """Tension of each span over the tension of its rope's first span."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return state.shares / state.shares[state.ropes.starts][state.ropes.of_span]


def friction_loss(state):
    """Power lost on each pulley, in W, shape (pulleys,)."""
    return state.friction_forces * state.speeds


def damping_loss(state):
    """Power lost inside each rope, in W, shape (ropes,)."""
    return state.viscous_forces * state.strain_rates * state.natural


def winch_power(state):
    """Power that the winches at both ends of each cable put in, in W, shape (cables, 2)."""
    return state.winch_tensions * (1.0 + state.strains[state.ropes.of_end]) * state.wound_rate


@dataclass
class Case:
    """A chain in motion; rope wound is counted from a rope as long as its path."""

    chain: Chain
    points: np.ndarray
    velocities: np.ndarray
    wound: np.ndarray
    wound_rate: np.ndarray

    def __post_init__(self):
        self.ropes = self.chain.start(self.points)

    def state(self, points=None, velocities=None, ropes=None, wound=None):
        return self.chain.state(
            self.ropes if ropes is None else ropes,
            self.points if points is None else points,
            self.velocities if velocities is None else velocities,
            self.wound if wound is None else wound,
            self.wound_rate,
        )


def random_case(seed, counts=(7, 4), speed=1.0, wound=0.0, winding=0.0, far_winding=0.0, **fields):
    """Paths that wander in space; spans between 0.3 and 1 m, no two neighbours parallel."""
    rng = np.random.default_rng(seed)
    paths = []
    for count in counts:
        steps = rng.normal(size=(count - 1, 3))
        steps *= rng.uniform(0.3, 1.0, size=(count - 1, 1)) / np.linalg.norm(steps, axis=1)[:, None]
        paths.append(np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]))
    points = np.concatenate(paths)
    cables = len(counts)
    return Case(
        Chain([cable(**fields) for _ in counts], counts),
        points,
        speed * rng.normal(size=points.shape),
        np.tile([wound, 0.0], (cables, 1)),
        np.tile([winding, far_winding], (cables, 1)),
    )


def still(points, wound, rate=(1.0, 0.0), **fields):
    """One cable at rest, with its rope on the move."""
    points = np.asarray(points, dtype=float)
    chain = Chain([cable(**fields)], [len(points)])
    return Case(
        chain,
        points,
        np.zeros_like(points),
        np.array([[wound, 0.0]]),
        np.array([rate], dtype=float),
    )


def wind(law, stiffness, step, steps, path_speed=lambda time: 0.0, friction=LAWS["bearing"]):
    """Wind a rope over two pulleys whose far end moves: tensions, speeds, last span's strain."""
    start = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 1, 0]], dtype=float)
    case = still(
        start, 0.0, axial_stiffness=stiffness, friction=friction, initial_slack=0.005,
        winch=Winch(winding=law),
    )  # fmt: skip
    winches, tensions, speeds = Winches(case.chain.cables), [], []
    for k in range(steps):
        rate = path_speed(k * step)
        path = np.array([2.0 + case.points[3, 0] - 1.0])
        case.velocities[3, 0] = rate
        case.wound, case.wound_rate = winches.at(k * step, path, np.array([rate]))
        now = case.state()
        winches.advance(k * step, now, np.zeros(1))
        tensions.append(now.winch_tensions[0, 0])
        speeds.append(case.wound_rate[0, 0])
        case.points[3, 0] += step * rate
    return np.array(tensions), np.array(speeds), now.tensions[2] / stiffness
