"""Work and inertia of that coordinate, release from rest, and the scales of a run."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ringsim.layout.bodies import Array, JointOpening, Lump, OnBody, OnRod, cross
from ringsim.layout.layout import OWN, Layout, layout_of
from ringsim.outputs.family import slowest_period
from ringsim.parts.ground import Offload
from ringsim.parts.laws import Switches
from ringsim.rigid.mechanism import Configuration, Mechanism, body_of, torques_at
from ringsim.scene import Scene
from ringsim.stepping.instant import Scales

# Any structure with rigid rods as one coordinate q: inertia, work, and its release from rest.
#
# With rigid rods every point is a function of q, so
#
#     I(q) q'' + I'(q) q'^2 / 2 = dW/dq,
#
# I = sum m |dr/dq|^2 over all masses with the rigid-body motion taken out, W the work of the loads
# less the energy of the net.  A free structure keeps momentum and angular momentum at zero (its
# loads turn with it); a support holds its body.  The end assemblies of an open arc are held
# upright.  From rest at q_0 the time until q_1 is
#
#     T = integral from q_1 to q_0 of sqrt(I / (2 (W - W(q_0)))) dq.
#
# The substitution q = q_0 - (q_0 - q_1) u^2 removes the singularity at the start.


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class Motion(NamedTuple):
    """Inertia I(q), kg m^2, and the rigid motion in the layout's rates: a point at r moves with
    r' - velocity - rotation x r, shapes (3,), m/rad and rad/rad.
    """

    inertia: float
    velocity: Array
    rotation: Array


class OneCoordinate:
    """Masses, loads, net and hinge springs of a scene, without joint friction, stops and cables."""

    def __init__(self, scene: Scene, start: Layout | None = None) -> None:
        """Everywhere; or, with the layout at the start, there alone and sooner."""
        self._switches = Switches((start or layout_of(scene)).angle_laws)
        if start is not None:
            begin = Mechanism(scene, scene.structure.coordinate, start)
            self._mechanism: Callable[[float], Mechanism] = lambda _: begin
            return
        known = scene.structure.basis(scene.structure.coordinate).size
        everywhere = Mechanism(scene) if known else None
        self._mechanism = lru_cache(maxsize=4)(lambda q: everywhere or Mechanism(scene, q))

    def motion(self, q: float) -> Motion:
        """Inertia and rigid-body part of the motion at ``q`` (rad)."""
        mechanism, now = self._at(q)
        rates = mechanism.rates(now)
        return Motion(mechanism.inertia(now), -rates[:3], -rates[3:6])

    def work(self, q: float) -> float:
        """Work function W(q) in J, up to a constant."""
        mechanism, now = self._at(q)
        done = np.tensordot(*mechanism.points.forces, 2) @ now.values
        done += mechanism.weight_work(now)
        stored = mechanism.pairs(now).energy + torques_at(self._switches, 2.0 * q).stored
        return float(done) - stored

    def work_rate(self, q: float) -> float:
        """Generalised force dW/dq, J/rad."""
        mechanism, now = self._at(q)
        done = np.tensordot(*mechanism.points.forces, 2) @ now.slopes
        done += mechanism.rates(now) @ mechanism.weight(now)
        pulled = done + mechanism.pairs(now).force
        return float(pulled - 2.0 * torques_at(self._switches, 2.0 * q).torque)

    def _at(self, q: float) -> tuple[Mechanism, Configuration]:
        mechanism = self._mechanism(q)
        return mechanism, mechanism.at(q)


class OpeningTime(NamedTuple):
    """A time in s and the difference to a quadrature with half as many panels."""

    time: float
    uncertainty: float


def opening_time(
    ring: OneCoordinate, phi_start: float, phi_end: float = 0.0, *, panels: int = 24
) -> OpeningTime:
    """Time from rest at ``phi_start`` to ``phi_end`` (rad), by panels of 8 Gauss-Legendre nodes.

    Raises
    ------
    ValueError
        If the work done turns negative before the ring reaches ``phi_end``.
    """
    fine, coarse = (_integrate(ring, phi_start, phi_end, n) for n in (panels, panels // 2))
    return OpeningTime(fine, abs(fine - coarse))


def _integrate(ring: OneCoordinate, phi_start: float, phi_end: float, panels: int) -> float:
    span, work_start, total = phi_start - phi_end, ring.work(phi_start), 0.0
    places = (np.arange(panels)[:, None] + 0.5 + 0.5 * _NODES) / panels
    for u, weight in zip(places.ravel(), np.tile(0.5 * _WEIGHTS / panels, panels), strict=True):
        phi = phi_start - span * u**2
        gained = ring.work(phi) - work_start
        if gained <= 0.0:
            raise ValueError(
                f"the ring does not open: at an opening angle of "
                f"{180.0 - 2.0 * np.degrees(phi):.2f} deg the work done is {gained:.3g} J"
            )
        slowness = np.sqrt(ring.motion(phi).inertia / 2.0 / gained)
        total += weight * 2.0 * abs(span) * u * slowness
    return float(total)


# What the base carries at the start of a run, when nothing but the rigid structure moves.


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
    if any(law.group == OWN for law in layout.pair_laws):
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
    masses, _, places, rates = layout.point_masses
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


# Reference numbers of a scene, from which the control of its run starts.


_MEASURED = 0.2889
"""Reach of ``ring18``, m."""


def scales_of(scene: Scene, layout: Layout, ideal: OneCoordinate, ropes: Array | None) -> Scales:
    """What the ideal structure, as stowed, the stops and the cables say before a run.

    ``ropes`` are the natural lengths of the cables' ropes, shape (cables,), m; None without cables.
    """
    structure = scene.structure
    angles, rates = layout.opening_angles()
    per_angle = float(rates.mean())
    start = structure.coordinate
    folding = ideal.motion(start).inertia
    acceleration = per_angle * (ideal.work_rate(start) / folding)
    inertia = folding / per_angle**2
    travel = math.pi - float(angles.mean())
    if acceleration < 0.0 and scene.cables is None:  # it folds, which may be a far longer way
        stowed = 0.0 if scene.stop is None else math.radians(scene.stop.stowed_angle)
        travel = max(float(angles.mean()) - stowed, travel)
    # The mean rate if the first acceleration lasted, at least that of the longest run.
    rate = max(math.sqrt(0.5 * abs(acceleration) * travel), travel / scene.solver.end_time)
    # Springs of its own set the scale: a thousandth of their force times a rod does not matter.
    pushed = 1e-3 * structure.push * structure.reach
    energy = pushed or 0.5 * inertia * rate**2
    contact = _contact_step(scene, layout)
    found = Scales(
        rate, energy, travel, structure.reach, contact_step=contact, period=slowest_period(layout)
    )
    if scene.cables is None or ropes is None:
        return found
    cables, lengths = scene.cables.present(), np.abs(ropes)
    widths = np.array([cable.slack_width for _, cable in cables])
    stiffness = sum(
        cable.axial_stiffness / float(length) * structure.path_slope(cable, angles[plane]) ** 2
        for (plane, cable), length in zip(cables, lengths, strict=True)
    )
    return found._replace(
        first_step=_swing_step(inertia, stiffness, 50),
        slack_tension=float(widths.max()),
        slack_energy=0.1 * float(np.sum(widths * lengths)),
    )


def coordinates(scene: Scene) -> float:
    """Size of coordinates, m, that round-off goes with: 1 m for a ring as ``ring18``, for which
    what it leaves of residuals was measured, and else as its reach.
    """
    return scene.structure.reach / _MEASURED


def residual_tolerance(scene: Scene, layout: Layout, reached: float) -> float:
    """Residual norm in N at which Newton stops: a share of the driving forces, but above what
    round-off lets it reach.

    ``reached`` is that norm over the rate EA / L (N/m) of the stiffest element, for coordinates of
    1 m.
    """
    drive = float(np.linalg.norm([force for _, force in layout.forces])) + scene.structure.push
    for law in layout.pair_laws:
        if law.hung:  # as far again as without force
            still = law.reaction(2.0 * law.natural, np.zeros(len(law.natural)))
            drive += float(np.linalg.norm(still.elastic))
    if drive == 0.0 and layout.gravity is not None:
        drive = sum(layout.masses().values()) * float(np.linalg.norm(layout.gravity))
    stiffest = max(rod.young_modulus * rod.tube.area / rod.lengths.min() for rod in layout.rods)
    return max(
        scene.solver.newton_tolerance * drive, reached * float(stiffest) * coordinates(scene)
    )


class RopeReach:
    """Residual norm over the round-off of coordinates of order 1 m that ropes leave.

    The strain S / M - 1 of a rope is rounded as S / M, about 1, and its tension pulls on both ends
    of every span; damped ropes feel rates, rounded as much as their derivative after places.
    """

    def __init__(self, scene: Scene) -> None:
        present = [] if scene.cables is None else scene.cables.present()
        self._pulls = [
            (
                cable.axial_stiffness * math.sqrt(2 * (scene.pulleys_of(cable) + 1)),
                cable.damping_time,
            )
            for _, cable in present
        ]

    def at(self, rate_by_place: float) -> float:
        """That norm, N, where rates follow places so (1/s); 0 without ropes."""
        return math.hypot(*(still * (1.0 + time * rate_by_place) for still, time in self._pulls))


def _swing_step(inertia: float, stiffness: float, steps: int) -> float:
    """Step in s that takes so many to the period 2 pi sqrt(I / k) of a swing (kg m^2, N m/rad).

    20 for a bounce on a stop: the period is right to (w h)^2 / 12 = 0.8 %.  50 for ropes: a winch
    that starts at once throws the structure into its swing on them, often with the largest tension
    of the run, and the first V-joint moves before the others, that is faster than the period says.
    """
    return 2.0 * math.pi * math.sqrt(inertia / stiffness) / steps


def _contact_step(scene: Scene, layout: Layout) -> float:
    """Of the first V-joint with its two rods; infinite without stops or V-joints."""
    opening, stop = layout.openings[0][0], scene.stop
    if stop is None or not isinstance(opening, JointOpening):
        return math.inf
    joint = layout.joints[opening.joint]
    sides = [mount for mount in (joint.first, joint.second) if isinstance(mount, OnRod)]
    rods = [(r, sum(mass for _, mass, _ in r.masses)) for r in (layout.rods[s.rod] for s in sides)]
    inertia = sum((rod.mass / 3.0 + ends) * rod.length**2 for rod, ends in rods)
    return _swing_step(inertia, stop.stiffness, 20)


# Corners on lines, where a ring of rigid rods takes them.


class Lines(NamedTuple):
    """Of n lines, shape (n,): pull, N; height of the corner over that at the start, m; how far it
    rises, and how far its trolley goes on the grid, for the opening angle, m/rad.
    """

    law: Offload
    pulls: Array
    heights: Array
    climbs: Array
    ways: Array


class Carried:
    """The corners that hang on lines, of a ring that folds.

    Beside the body that is held, or, of a ring that floats, without momentum along the grid and at
    the height that leaves the sum of the pulls: its weight stays as it is.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        layout = mechanism.points.layout
        assert layout.hung is not None
        self._hung, self._mechanism = layout.hung, mechanism
        self._corners = mechanism.points.places([OnBody(body) for body in layout.hung.bodies])
        held = [body_of(support.second) for support in layout.supports]
        self._base = mechanism.points.frame(held[0])[0] if held else None
        self._start = self._height(mechanism.at(scene.structure.coordinate))

    def at(self, now: Configuration) -> Lines:
        """At a coordinate."""
        places, rates = now.places(self._corners), now.velocities(self._corners)
        rigid = self._mechanism.rates(now)
        # The angle opens by two for one that the coordinate falls.
        moving = -0.5 * (rigid[:3] + np.cross(rigid[3:6], places) + rates)
        up, law = self._up(now), self._hung.law
        climbs = moving @ up
        level = moving - climbs[:, None] * up
        heights = self._height(now) - self._start
        if self._base is None:
            heights, climbs = heights - heights.mean(), climbs - climbs.mean()
        pulls = self._hung.lifts - law.stiffness * heights
        return Lines(law, pulls, heights, climbs, np.linalg.norm(level, axis=1))

    def _height(self, now: Configuration) -> Array:
        places = now.places(self._corners)
        if self._base is not None:
            places = places - self._base @ now.values
        return np.asarray(places @ self._up(now))

    def _up(self, now: Configuration) -> Array:
        """Against gravity, in the structure's axes."""
        down = self._mechanism.gravity(now)
        return -down / np.linalg.norm(down)
