"""A structure of beams by plain finite elements: Euler and Bernoulli's, with Timoshenko's shear.

Nothing of either engine: cubic elements with consistent masses (Przemieniecki, Theory of Matrix
Structural Analysis, 1968), many to a rod; rigid bodies; joints as linear constraints, taken out by
the null space.  It reads the layout alone, and is linear from the start.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ringsim.layout.bodies import JointOpening, OnBody, OnRod
from ringsim.layout.layout import Layout
from ringsim.parts.rods import Rods

Array = NDArray[np.float64]


def skew(a: Array) -> Array:
    """The matrix of a x."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def element(
    length: float,
    ea: float,
    ei: float,
    gj: float,
    ga: float,
    line: float,
    across: float,
    polar: float,
) -> tuple[Array, Array]:
    """Stiffness and mass in axes of its own: (u, v, w, turns about x, y, z) at both ends; ``line``
    is the mass a metre, ``across`` and ``polar`` its inertia about a diameter and about the axis.
    """
    stiffness, mass = np.zeros((12, 12)), np.zeros((12, 12))
    for first, along, heavy in ((0, ea, line), (3, gj, polar)):
        at = np.ix_([first, first + 6], [first, first + 6])
        stiffness[at] += along / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
        mass[at] += heavy * length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    shear = 12.0 * ei / (ga * length**2)
    bend = ei / (length**3 * (1.0 + shear)) * np.array([
        [12.0, 6.0 * length, -12.0, 6.0 * length],
        [6.0 * length, (4.0 + shear) * length**2, -6.0 * length, (2.0 - shear) * length**2],
        [-12.0, -6.0 * length, 12.0, -6.0 * length],
        [6.0 * length, (2.0 - shear) * length**2, -6.0 * length, (4.0 + shear) * length**2],
    ])  # fmt: skip
    heavy = line * length / 420.0 * np.array([
        [156.0, 22.0 * length, 54.0, -13.0 * length],
        [22.0 * length, 4.0 * length**2, 13.0 * length, -3.0 * length**2],
        [54.0, 13.0 * length, 156.0, -22.0 * length],
        [-13.0 * length, -3.0 * length**2, -22.0 * length, 4.0 * length**2],
    ])  # fmt: skip
    heavy += across / (30.0 * length) * np.array([
        [36.0, 3.0 * length, -36.0, 3.0 * length],
        [3.0 * length, 4.0 * length**2, -3.0 * length, -(length**2)],
        [-36.0, -3.0 * length, 36.0, -3.0 * length],
        [3.0 * length, -(length**2), -3.0 * length, 4.0 * length**2],
    ])  # fmt: skip
    for where, signs in (([1, 5, 7, 11], [1, 1, 1, 1]), ([2, 4, 8, 10], [1, -1, 1, -1])):
        both = np.outer(signs, signs)
        stiffness[np.ix_(where, where)] += both * bend
        mass[np.ix_(where, where)] += both * heavy
    return stiffness, mass


def squares(
    layout: Layout, rods: Rods, per_station: int, vjoint: float = 0.0, twisting: float = 1.0
) -> Array:
    """All w^2 of a layout, rad^2/s^2, with so many elements between two stations of a rod, and a
    stiffness of the V-joints, N m/rad; ``twisting`` multiplies the inertia of rods about their own
    axes.
    """
    count = len(layout.bodies) + sum(per_station * (len(r.stations) - 1) + 1 for r in layout.rods)
    stiffness, mass = np.zeros((2, 6 * count, 6 * count))
    rows: list[Array] = []
    for number, body in enumerate(layout.bodies):
        r, own = body.pose.axes, slice(6 * number, 6 * number + 6)
        arm = skew(r @ body.centre)
        mass[own, own] += np.block([
            [body.mass * np.eye(3), -body.mass * arm],
            [body.mass * arm, r @ body.inertia @ r.T],
        ])  # fmt: skip
    node: dict[tuple[int, int], int] = {}
    first = len(layout.bodies)
    for number, rod in enumerate(layout.rods):
        young, tube = rod.young_modulus, rod.tube
        shear = young * rods.shear_modulus_ratio
        turn = scipy.linalg.block_diag(*[rod.start.axes] * 4)
        for station, length in enumerate(rod.lengths):
            k, m = element(
                length / per_station, young * tube.area, young * tube.second_moment,
                2.0 * shear * tube.second_moment,
                tube.shear_factor(rods.poisson_ratio) * shear * tube.area,
                rod.density * tube.area, rod.density * tube.second_moment,
                2.0 * twisting * rod.density * tube.second_moment,
            )  # fmt: skip
            for piece in range(per_station):
                start = 6 * (first + station * per_station + piece)
                own = slice(start, start + 12)
                stiffness[own, own] += turn @ k @ turn.T
                mass[own, own] += turn @ m @ turn.T
        for station in range(len(rod.stations)):
            node[number, station] = first + station * per_station
        for station, own_mass, _ in rod.masses:
            at = 6 * node[number, station]
            mass[range(at, at + 3), range(at, at + 3)] += own_mass
        first += per_station * (len(rod.stations) - 1) + 1

    def moved(mount: OnBody | OnRod) -> tuple[Array, Array]:
        """How a mount moves and turns with all unknowns."""
        k = 6 * (mount.body if isinstance(mount, OnBody) else node[mount.rod, mount.station])
        way, spin = np.zeros((2, 3, 6 * count))
        way[:, k : k + 3], spin[:, k + 3 : k + 6] = np.eye(3), np.eye(3)
        if isinstance(mount, OnBody):
            way[:, k + 3 : k + 6] = -skew(layout.bodies[mount.body].pose.axes @ mount.arm)
        return way, spin

    openings = {o.joint for plane in layout.openings for o in plane if isinstance(o, JointOpening)}
    for number, joint in enumerate(layout.joints):
        assert joint.kind == "revolute"
        (one, turn_one), (other, turn_other) = moved(joint.first), moved(joint.second)
        axes = layout.pose(joint.first).axes
        relative = axes.T @ (turn_other - turn_one)
        rows += [other - one, relative[:2]]
        if number in openings:
            stiffness += vjoint * np.outer(relative[2], relative[2])
    free = scipy.linalg.null_space(np.concatenate(rows))
    return np.asarray(
        scipy.linalg.eigh(free.T @ stiffness @ free, free.T @ mass @ free, eigvals_only=True)
    )
