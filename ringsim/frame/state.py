"""The state of a model: places, rates and accelerations, the rods between frames, and the balance
of forces.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.core.library import call
from ringsim.frame.mesh import Indices, Mesh
from ringsim.layout.bodies import Array
from ringsim.layout.layout import Hung
from ringsim.parts.ground import Hold
from ringsim.stepping.instant import Memory

# A rod element between two frames: corotational, with Reissner strains of its middle (rods.c).
#
# Ends at x_1, x_2 with axes R_1, R_2; half-way between these, R = R_1 exp(psi / 2) with
# psi = log(R_1^T R_2).  Strains are
#
#     u = Z R^T (x_2 - x_1) - L e_x,   psi,
#
# with Z below: those of a screw from one end to the other, whose middle line is as long as its arc
# (Sonneville, Cardona and Bruels, Computer Methods in Applied Mechanics and Engineering 268, 2014;
# exudyn's element has the same), and the energy (u . K_u u + psi . K_psi psi) / 2 with K_u =
# diag(EA, S, S) / L, K_psi = diag(GJ, EI, EI) / L and 1 / S = 1 / kGA + L^2 / 12 EI: the shear
# carries the flexibility of bending that constant curvature lacks (MacNeal 1978), so that the ends
# of a rod loaded at its ends are exact to first order.  Kelvin-Voigt damping adds tau times the
# rates of the strains.
#
# Variations, with d phi_1, d phi_2 of the ends (spatial), a = R^T d phi, r = a_2 - a_1 and
# k = |psi|:
#
#     d psi = Z r,              Z = 1 + c [psi]^2,   c = (1 - (k / 2) / sin(k / 2)) / k^2,
#     d (Z y) = Z dy + G d psi, G = c (psi y^T + (psi . y) - 2 y psi^T) + c' terms,
#     turn of R: (a_1 + a_2) / 2 - e [psi] r,   e = tan(k / 4) / 2 k -> 1 / 8:
#
# exp(-psi / 2) takes the right-hand Jacobian of the exponential map at psi to an even function of
# [psi], whose inverse is Z, and half the difference of the Jacobians at -psi / 2 and psi / 2 gives
# e (Jacobians: Simo and Vu-Quoc 1986; Sola et al., A micro Lie theory, 2018).  So, with y = R^T d,
# spatial n = R Z K_u u and w = (x_2 - x_1) x n, forces are -n, n and moments -m - w / 2, m - w / 2
# with m = R Z (K_psi psi + G^T K_u u) + e w x (R psi): the energy's exact derivative, which leaves
# it unchanged in a rigid motion.  The tangent leaves out terms of second order in psi, but for G^T
# K_u G, which is large where a rod is slender.


# Of all rods and masses.


class Pose(NamedTuple):
    """Places (f, 3), m, and axes (f, 3, 3) of all frames, and all joint angles (a,), rad."""

    place: Array
    axes: Array
    angle: Array


class Strains(NamedTuple):
    """Strains u (m) and psi (rad) of all elements at a state, shape (e, 6); ``before`` and
    ``lead`` (1/s, shape (1,)) give their rates, lead * strain + before.
    """

    now: Array
    before: Array
    lead: Array

    @classmethod
    def resting(cls, elements: int) -> "Strains":
        """None, of so many elements."""
        return cls(np.zeros((elements, 6)), np.zeros((elements, 6)), np.zeros(1))


def room_for_loads(mesh: Mesh) -> Array:
    """Room for what elements hold, from ``add_forces`` to its derivative."""
    return np.zeros(call("room_for_loads", len(mesh.length)))


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

    # ``stiffen`` of newton.c has both as well; tests/frame/test_frame_tangent.py compares tangents
    # with differences, with parts of either.

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
    paths: Array
    angles: Array
    ends: Array
    hub: Array
    hung: Array

    @classmethod
    def of(cls, values: Array, held: Held) -> "Groups":
        """Views of followed coordinates."""
        points, paths, angles, *rest = [
            values[first:last] for first, last in pairwise(held.cuts.tolist())
        ]
        ends, hub, hung = (each.reshape(-1, 3) for each in rest)
        return cls(points.reshape(-1, 3), paths.reshape(-1, 3), angles, ends, hub, hung)


class Moving(NamedTuple):
    """What the core sees of a state."""

    pose: Pose
    hub: Array
    followed: Followed
    strains: Strains


class State:
    """A pose, the hub (m), strains of the elements and all followed coordinates; ``place``,
    ``rate`` and ``acceleration`` are views of these, ``chain`` the cables where a step has led.
    """

    def __init__(
        self, pose: Pose, hub: Array, strains: Strains, followed: Followed, held: Held
    ) -> None:
        self.pose, self.hub, self.strains, self.followed = pose, hub, strains, followed
        self.table = Moving(pose, hub, followed, strains)
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

    def _arrays(self) -> list[Array]:
        return [*self.pose, self.hub, *self.strains, *self.followed]

    def copy(self) -> "State":
        """Arrays of its own."""
        pose, hub = Pose(*(each.copy() for each in self.pose)), self.hub.copy()
        strains = Strains(*(each.copy() for each in self.strains))
        return State(pose, hub, strains, self.followed.copy(), self._held)


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
