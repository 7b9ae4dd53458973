"""The state of a model: places, rates and accelerations, and the balance of forces in it."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.frame.mesh import Indices, Mesh
from ringsim.frame.rods import Pose
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


# What is followed, and what holds it (balance.c).


class Held(NamedTuple):
    """Where followed coordinates begin, shape (7,): points with mass, points of the cables, joint
    angles, the ends of the net's strings and its hub, bodies that hang on lines; bodies at the
    ends of strings, and on lines; bodies with a boom and those that slide along it, lengths (m) at
    which their turns are held (see ``aside`` in balance.c), and the stiffness of both
    (N/m);
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


# The state of a model: where everything stands and how it moves.


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


class Moving(NamedTuple):
    """What the core sees of a state."""

    pose: Pose
    hub: Array
    followed: Followed


class State:
    """A pose, the hub (m), strains of the elements and all followed coordinates; ``place``,
    ``rate`` and ``acceleration`` are views of these, ``chain`` the cables where a step has led.
    """

    def __init__(
        self, pose: Pose, hub: Array, strains: Array, followed: Followed, held: Held
    ) -> None:
        self.pose, self.hub, self.strains, self.followed = pose, hub, strains, followed
        self.table = Moving(pose, hub, followed)
        self._held = held
        self.place = Groups.of(followed.place, held)
        self.rate = Groups.of(followed.rate, held)
        self.chain: ChainState | None = None

    @property
    def acceleration(self) -> Groups:
        """As ``place``."""
        return Groups.of(self.followed.acceleration, self._held)

    def memory(self) -> Memory:
        """All but the cables, see ``ringsim.stepping.instant``."""
        return {"arrays": self._arrays()}

    def recall(self, memory: Memory) -> None:
        """Go on from a memory."""
        for own, value in zip(self._arrays(), memory["arrays"], strict=True):
            own[...] = value

    def take(self, other: "State") -> None:
        """Be where another state is."""
        for own, value in zip(self._arrays(), other._arrays(), strict=True):
            np.copyto(own, value)

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
