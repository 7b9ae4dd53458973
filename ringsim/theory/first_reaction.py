"""What the base carries at the start of a run, when nothing but the rigid structure moves."""

from typing import NamedTuple

import numpy as np

from ringsim.layout.bodies import Lump
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array, cross
from ringsim.theory.one_coordinate import OneCoordinate


class Acceleration(NamedTuple):
    """Accelerations of the coordinate (1/s^2) and of what floats (m/s^2, 1/s^2)."""

    coordinate: float
    velocity: Array
    rotation: Array

    def at(self, place: Array, rate: Array) -> Array:
        """Of a point (m) with its derivative after the coordinate, m/s^2."""
        moving = rate - self.velocity - cross(self.rotation, place)
        return np.asarray(self.coordinate * moving)

    def turning(self, turn: Array) -> Array:
        """Of a body with its rotation after the coordinate, rad/s^2."""
        return self.coordinate * (turn - self.rotation)


def first_acceleration(layout: Layout, ideal: OneCoordinate, q: float) -> Acceleration:
    """Of the structure with rigid rods, released at rest at a coordinate (rad).

    One with springs of its own starts without: it rests against them on its cables.
    """
    if layout.springs:
        return Acceleration(0.0, np.zeros(3), np.zeros(3))
    motion = ideal.motion(q)
    return Acceleration(ideal.work_rate(q) / motion.inertia, motion.velocity, motion.rotation)


def first_reaction(layout: Layout, moving: Acceleration) -> Array | None:
    """Force (N) and torque (N m) about the base's origin, shape (2, 3); None of a base that floats
    alone.
    """
    if layout.base is None:
        return None
    base = layout.bodies[layout.base].pose
    gravity = np.zeros(3) if layout.gravity is None else layout.gravity
    if layout.spacecraft is not None:
        own = moving.at(base.place, base.rate) - gravity, moving.turning(base.turn)
        return body_reaction(layout.spacecraft, base.axes, *own, np.zeros(3))
    if not layout.supports:
        return None
    masses, _, places, rates = layout.point_masses()
    accelerations = [moving.at(*one) - gravity for one in zip(places, rates, strict=True)]
    pulled = masses[:, None] * np.array(accelerations)
    arms = places - base.place
    found = np.array([pulled.sum(axis=0), np.cross(arms, pulled).sum(axis=0)])
    for joint, force in layout.forces:
        arm = layout.pose(layout.joints[joint].first).place - base.place
        found -= np.array([force, cross(arm, force)])
    if layout.hung is not None:
        for body, lift in zip(layout.hung.bodies, layout.hung.lifts, strict=True):
            force = lift * layout.hung.up
            arm = layout.bodies[body].pose.place - base.place
            found -= np.array([force, cross(arm, force)])
    return found


def body_reaction(
    lump: Lump, axes: Array, acceleration: Array, turning: Array, spin: Array
) -> Array:
    """What a rigid part of a body does to the rest of it, shape (2, 3), N and N m about the body's
    origin: Newton's and Euler's equations, with the opposite sign.

    Its ``axes`` are those of the body in space; acceleration of the origin, angular acceleration
    and velocity in space.
    """
    centre, inertia = axes @ lump.centre, axes @ lump.inertia @ axes.T
    force = lump.mass * (acceleration + cross(turning, centre) + cross(spin, cross(spin, centre)))
    torque = lump.mass * cross(centre, acceleration) + inertia @ turning
    torque += cross(spin, inertia @ spin)
    return -np.array([force, torque])
