"""Elastic rods between frames: corotational, with Reissner strains of their middle."""

from typing import NamedTuple

import numpy as np

from ringsim.core.library import call
from ringsim.frame.mesh import Mesh
from ringsim.layout.bodies import Array

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
    ``lead`` (1/s) give their rates, lead * strain + before.
    """

    now: Array
    before: Array
    lead: float


def move(mesh: Mesh, pose: Pose, step: Array) -> None:
    """Move a pose by changes of all unknowns, shape (unknowns,); in place."""
    call("move", mesh, pose, step)


def moved_between(mesh: Mesh, before: Pose, after: Pose, out: Array) -> None:
    """Changes of all unknowns from one pose to another, shape (unknowns,)."""
    call("moved_between", mesh, before, after, out)


def straighten(pose: Pose) -> None:
    """Take what round-off has done to the axes out: R (3 - R^T R) / 2."""
    call("straighten", pose)


def place_points(mesh: Mesh, pose: Pose, out: Array) -> None:
    """Places of all points with mass, shape (p, 3)."""
    call("place_points", mesh, pose, out)


def room_for_loads(mesh: Mesh) -> Array:
    """Room for what elements hold, from ``add_forces`` to its derivative."""
    return np.zeros(call("room_for_loads", len(mesh.length)))


def add_forces(
    mesh: Mesh, pose: Pose, points: Array, accelerations: Array, strains: Strains, loads: Array,
    g: Array,
) -> None:  # fmt: skip
    """Add forces of elastic rods and of inertia on all unknowns, shape (unknowns,); keeps what the
    elements hold in ``loads`` (``room_for_loads``).  Places and accelerations are those of all
    points, (p, 3).
    """
    call("add_forces", mesh, pose, points, accelerations, strains, loads, g)


def energies_of(mesh: Mesh, velocities: Array, strains: Array) -> tuple[float, float]:
    """Kinetic energy of rods and points and elastic energy of rods, J; velocities of the points,
    shape (p, 3), m/s.
    """
    found = np.zeros(2)
    call("energies_of", mesh, velocities, strains, found)
    return float(found[0]), float(found[1])
