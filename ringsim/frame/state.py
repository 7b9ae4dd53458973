"""The state of a model: places, rates and accelerations, and the balance of forces in it."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.compiled.vectors import compiled
from ringsim.frame.cables import Arms, Lines, place_lines
from ringsim.frame.kernels import Pose, Strains, add_forces, begin_tangent, place_points
from ringsim.frame.laws import Acting, add_joint_slopes, push_joints
from ringsim.frame.mesh import Indices, Mesh
from ringsim.frame.springs import Web, add_pairs, aside, pull_pairs
from ringsim.layout.bodies import Array
from ringsim.layout.layout import Hung
from ringsim.parts.ground import Hold
from ringsim.stepping.instant import Memory

# Generalised-alpha on points and angles: rates and accelerations follow from places.
#
# Of each coordinate z of a point, or angle, the integrator keeps the rate z', the acceleration a
# and the auxiliary one b (Arnold and Bruels, Multibody System Dynamics 18, 2007):
#
#     z_1 = z_0 + h z'_0 + h^2 ((1/2 - beta) b_0 + beta b_1),
#     z'_1 = z'_0 + h ((1 - gamma) b_0 + gamma b_1),
#     (1 - alpha_m) b_1 + alpha_m b_0 = (1 - alpha_f) a_1 + alpha_f a_0,
#
# solved for b_1, z'_1 and a_1.  Forces balance at the end of a step.  Points move in space, so that
# bodies need no angular velocities and rods no gyroscopic terms.


class Coefficients(NamedTuple):
    """Of generalised-alpha; Chung and Hulbert, Journal of Applied Mechanics 60, 1993."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @classmethod
    def of(cls, radius: float) -> "Coefficients":
        """With a spectral radius at infinite frequency."""
        alpha_m, alpha_f = (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0)
        gamma = 0.5 - alpha_m + alpha_f
        return cls(alpha_m, alpha_f, 0.25 * (gamma + 0.5) ** 2, gamma)

    def acceleration_by_place(self, step: float) -> float:
        """Derivative of a_1 after z_1, 1/s^2."""
        return (1.0 - self.alpha_m) / ((1.0 - self.alpha_f) * self.beta * step**2)

    def rate_by_place(self, step: float) -> float:
        """Derivative of z'_1 after z_1, 1/s."""
        return self.gamma / (self.beta * step)


class Followed(NamedTuple):
    """Places, rates, accelerations and auxiliary ones, shape (n,) each."""

    place: Array
    rate: Array
    acceleration: Array
    auxiliary: Array

    @classmethod
    def at_rest(cls, place: Array, acceleration: Array) -> "Followed":
        """Released at rest with these accelerations."""
        return cls(place, np.zeros_like(place), acceleration, acceleration.copy())

    def copy(self) -> "Followed":
        """Arrays of its own."""
        return Followed(*(each.copy() for each in self))


@compiled
def follow(coefficients: Coefficients, step: float, start: Followed, now: Followed) -> None:
    """Rates and accelerations of ``now`` from its places and where the step has started."""
    alpha_m, alpha_f, beta, gamma = coefficients
    for k in range(len(now.place)):
        b0 = start.auxiliary[k]
        moved = now.place[k] - start.place[k] - step * start.rate[k]
        b1 = moved / (beta * step * step) - (0.5 / beta - 1.0) * b0
        now.auxiliary[k] = b1
        now.rate[k] = start.rate[k] + step * ((1.0 - gamma) * b0 + gamma * b1)
        pulled = (1.0 - alpha_m) * b1 + alpha_m * b0 - alpha_f * start.acceleration[k]
        now.acceleration[k] = pulled / (1.0 - alpha_f)


# Residual and tangent but for cables, in one call each: numba takes longer to receive these tables
# than to go through most of them.


POINTS, LINES, ANGLES, ENDS, HUB, HUNG = range(6)
"""Followed coordinates: points with mass, points of the cables, joint angles, the ends of the net's
strings and its hub, bodies that hang on lines."""


class Held(NamedTuple):
    """Where followed coordinates begin, shape (7,); bodies at the ends of strings, and on lines;
    bodies with a boom and those that slide along it, lengths (m) at which their turns are held (see
    ``ringsim.frame.springs.aside``), and the stiffness of both (N/m);
    linear friction of the angles, N m s/rad; whether there is gravity, and it, m/s^2.
    """

    cuts: Indices
    ends: Indices
    hung: Indices
    top: Indices
    low: Indices
    reach: Array
    stiffness: float
    damping: Array
    weighs: bool
    gravity: Array


@compiled
def put_in_place(
    mesh: Mesh, lines: Lines, held: Held, pose: Pose, hub: Array, arms: Arms, place: Array
) -> None:
    """Places of all followed coordinates at a pose, and arms of the cables' points."""
    cuts = held.cuts
    place_points(mesh, pose, place[cuts[POINTS] : cuts[LINES]].reshape((-1, 3)))
    place_lines(lines, pose, arms, place[cuts[LINES] : cuts[ANGLES]].reshape((-1, 3)))
    place[cuts[ANGLES] : cuts[ENDS]] = pose.angle
    for n in range(len(held.ends)):
        k = cuts[ENDS] + 3 * n
        place[k : k + 3] = pose.place[held.ends[n]]
    if cuts[HUNG] > cuts[HUB]:
        place[cuts[HUB] : cuts[HUNG]] = hub
    for n in range(len(held.hung)):
        k = cuts[HUNG] + 3 * n
        place[k : k + 3] = pose.place[held.hung[n]]


@compiled
def balance(
    mesh: Mesh, lines: Lines, held: Held, joints: Acting, web: Web, coefficients: Coefficients,
    step: float, start: Followed, pose: Pose, hub: Array, arms: Arms, now: Followed,
    strains: Strains, loads: Array, g: Array,
) -> bool:  # fmt: skip
    """Follow a pose over a step, and add forces of rods, masses, slides, joints and strings to the
    residual, shape (all unknowns,); returns whether a string pulls.  ``loads`` keep what elements
    hold.
    """
    put_in_place(mesh, lines, held, pose, hub, arms, now.place)
    follow(coefficients, step, start, now)
    cuts = held.cuts
    points = now.place[cuts[POINTS] : cuts[LINES]].reshape((-1, 3))
    add_forces(mesh, pose, points, _inertial(held, now), strains, loads, g)
    rates = now.rate[cuts[ANGLES] : cuts[ENDS]]
    for n in range(len(held.damping)):
        g[mesh.angle_home[n]] += held.damping[n] * rates[n]
    push_joints(joints, pose.angle, rates, mesh, g)
    for n in range(len(held.top)):
        top, low = held.top[n], held.low[n]
        gaps, rows = aside(pose, top, low, held.reach[n])
        for k in range(len(gaps)):
            force = held.stiffness * gaps[k]
            for i in range(6):
                g[mesh.home[top] + i] += force * rows[k, i]
                g[mesh.home[low] + i] += force * rows[k, 6 + i]
    if len(web.first) == 0:
        return False
    if cuts[HUNG] > cuts[HUB]:
        for i in range(3):
            g[len(g) - 3 + i] += web.hub_mass * (now.acceleration[cuts[HUB] + i] - held.gravity[i])
    ends, end_rates, at, hub_rate = _strings(held, now)
    return bool(pull_pairs(web, mesh, ends, end_rates, at, hub_rate, g))


@compiled
def _inertial(held: Held, now: Followed) -> Array:
    """Accelerations of the points with mass, less that of gravity, (p, 3), m/s^2."""
    found = now.acceleration[held.cuts[POINTS] : held.cuts[LINES]].reshape((-1, 3))
    return found - held.gravity if held.weighs else found


@compiled
def _strings(held: Held, now: Followed) -> tuple[Array, Array, Array, Array]:
    """Places and rates of the strings' ends, (n, 3), and of the hub, (3,)."""
    ends, hub, last = held.cuts[ENDS], held.cuts[HUB], held.cuts[HUNG]
    return (
        now.place[ends:hub].reshape((-1, 3)), now.rate[ends:hub].reshape((-1, 3)),
        now.place[hub:last], now.rate[hub:last],
    )  # fmt: skip


@compiled
def differentiate(
    mesh: Mesh, held: Held, joints: Acting, web: Web, pose: Pose, now: Followed, loads: Array,
    lead: float, by_rate: float, by_place: float, strung: bool, fronts: Array, columns: Array,
    rows: Array, corner: Array,
) -> None:  # fmt: skip
    """Set the fronts, and the border's part of strings, if one pulls, to the derivative of
    the last ``balance``; ``lead``, ``by_rate`` and ``by_place`` are those of rates of strains
    after strains, and of rates and accelerations after places.
    """
    cuts = held.cuts
    points = now.place[cuts[POINTS] : cuts[LINES]].reshape((-1, 3))
    inertial = _inertial(held, now)
    begin_tangent(mesh, pose, points, inertial, loads, lead, by_place, fronts)
    add_slides(mesh, held, pose, fronts)
    for n in range(len(held.damping)):
        front, spot = mesh.angle_local[n, 0], mesh.angle_local[n, 1]
        fronts[front, spot, spot] += held.damping[n] * by_rate
    rates = now.rate[cuts[ANGLES] : cuts[ENDS]]
    add_joint_slopes(joints, pose.angle, rates, by_rate, mesh, fronts)
    if strung:
        for i in range(3):
            corner[i, i] = web.hub_mass * by_place
    if len(web.first) > 0:
        ends, end_rates, at, hub_rate = _strings(held, now)
        add_pairs(
            web, mesh, ends, end_rates, at, hub_rate, by_rate, strung, fronts, columns, rows,
            corner,
        )  # fmt: skip


@compiled
def add_slides(mesh: Mesh, held: Held, pose: Pose, fronts: Array) -> None:
    """Add what holds the bodies on their boom to the fronts; gaps are so small that how their
    directions turn does not matter.
    """
    for n in range(len(held.top)):
        top, low = mesh.frame_local[held.top[n]], mesh.frame_local[held.low[n]]
        _, rows = aside(pose, held.top[n], held.low[n], held.reach[n])
        front = fronts[top[0]]
        for i in range(12):
            row = top[1] + i if i < 6 else low[1] + i - 6
            for j in range(12):
                column = top[1] + j if j < 6 else low[1] + j - 6
                shared = rows[0, i] * rows[0, j] + rows[1, i] * rows[1, j]
                for k in range(2, len(rows)):
                    shared += rows[k, i] * rows[k, j]
                front[row, column] += held.stiffness * shared


# The state of a model: where everything stands and how it moves.


_NO_HUB = np.zeros(3)


class Groups(NamedTuple):
    """Followed coordinates by what they belong to: points with mass and points of the cables,
    shape (n, 3); joint angles, (a,); ends of the net's strings, (n, 3), and its hub, (1, 3); bodies
    that hang on lines, (n, 3).
    """

    points: Array
    lines: Array
    angles: Array
    ends: Array
    hub: Array
    hung: Array

    @classmethod
    def of(cls, values: Array, held: Held) -> "Groups":
        """Views of followed coordinates."""
        points, lines, angles, *rest = [
            values[first:last] for first, last in pairwise(held.cuts.tolist())
        ]
        ends, hub, hung = (each.reshape(-1, 3) for each in rest)
        return cls(points.reshape(-1, 3), lines.reshape(-1, 3), angles, ends, hub, hung)


class State:
    """A pose, the hub (m), strains of the elements and all followed coordinates; ``place``,
    ``rate`` and ``acceleration`` are views of these, ``chain`` the cables where a step has led.
    """

    def __init__(
        self, pose: Pose, hub: Array, strains: Array, followed: Followed, held: Held
    ) -> None:
        self.pose, self.hub, self.strains, self.followed = pose, hub, strains, followed
        self._held = held
        self.place = Groups.of(followed.place, held)
        self.rate = Groups.of(followed.rate, held)
        self.chain: ChainState | None = None

    @property
    def acceleration(self) -> Groups:
        """As ``place``."""
        return Groups.of(self.followed.acceleration, self._held)

    @property
    def net(self) -> tuple[Array, Array, Array, Array]:
        """Places and rates of the strings' ends, (n, 3), and of the hub, (3,)."""
        hub = (
            (_NO_HUB, _NO_HUB) if not len(self.place.hub) else (self.place.hub[0], self.rate.hub[0])
        )
        return self.place.ends, self.rate.ends, *hub

    def memory(self) -> Memory:
        """All but the cables, see ``ringsim.stepping.instant``."""
        return {"arrays": self._arrays()}

    def recall(self, memory: Memory) -> None:
        """Go on from a memory."""
        for own, value in zip(self._arrays(), memory["arrays"], strict=True):
            own[...] = value

    def _arrays(self) -> list[Array]:
        return [*self.pose, self.hub, self.strains, *self.followed]

    def copy(self) -> "State":
        """Arrays of its own."""
        pose, hub = Pose(*(each.copy() for each in self.pose)), self.hub.copy()
        strains, followed = self.strains.copy(), self.followed.copy()
        return State(pose, hub, strains, followed, self._held)


# Lines that carry corners, on their followed places.


class Hanging:
    """Adds what lines and trolleys do to residual, tangent and energies."""

    def __init__(self, hung: Hung, mesh: Mesh, start: Array) -> None:
        self._hung, self._mesh, self._start = hung, mesh, start
        self._spots = mesh.home[list(hung.bodies)][:, None] + np.arange(3)
        self._level = np.eye(3) - np.outer(hung.up, hung.up)
        self._trolley = hung.law.trolley_mass

    def hold(self, state: State) -> Hold:
        """What the lines do at a state."""
        moved, rates = state.place.hung - self._start, state.rate.hung
        return self._hung.law.hold(self._hung.up, self._hung.lifts, moved, rates)

    def push(self, state: State, g: Array) -> None:
        """Add to the residual."""
        pulled = self._trolley * state.acceleration.hung @ self._level
        g[self._spots] += pulled - self.hold(state).force

    def add_tangent(self, state: State, by_rate: float, by_place: float, fronts: Array) -> None:
        """Add to the fronts."""
        moved, rates = state.place.hung - self._start, state.rate.hung
        slopes = self._hung.law.slopes(self._hung.up, self._hung.lifts, moved, rates, by_rate)
        blocks = self._trolley * by_place * self._level - slopes
        for body, block in zip(self._hung.bodies, blocks, strict=True):
            front, spot = self._mesh.frame_local[body]
            fronts[front, spot : spot + 3, spot : spot + 3] += block

    def work(self, state: State) -> float:
        """Of what the lines carry at the start, since then, J."""
        return float(self._hung.lifts @ ((state.place.hung - self._start) @ self._hung.up))

    def kinetic(self, state: State) -> float:
        """Of the trolleys, J."""
        return 0.5 * self._trolley * float(np.sum((state.rate.hung @ self._level) ** 2))
