"""Residual and tangent but for cables, in one call each: numba takes longer to receive these tables
than to go through most of them.
"""

from typing import NamedTuple

from ringsim.frame.following import Coefficients, Followed, follow
from ringsim.frame.kernels import Pose, Strains, add_forces, place_points
from ringsim.frame.laws import Acting, add_joint_slopes, push_joints
from ringsim.frame.lines import Arms, Lines, place_lines
from ringsim.frame.mesh import Mesh
from ringsim.frame.net import Web, add_strings, pull_strings
from ringsim.frame.parts import Indices
from ringsim.frame.rod_tangent import begin_tangent
from ringsim.frame.slide import aside
from ringsim.frame.vectors import compiled
from ringsim.layout.pose import Array

POINTS, LINES, ANGLES, ENDS, HUB, HUNG = range(6)
"""Followed coordinates: points with mass, points of the cables, joint angles, the ends of the net's
strings and its hub, bodies that hang on lines."""


class Held(NamedTuple):
    """Where followed coordinates begin, shape (7,); bodies at the ends of strings, and on lines;
    bodies with a boom and those that slide along it, lengths (m) at which their turns are held (see
    ``ringsim.frame.slide.aside``), and the stiffness of both (N/m);
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
    if len(held.ends) > 0:
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
    if len(web.bodies) == 0:
        return False
    for i in range(3):
        g[len(g) - 3 + i] += web.hub_mass * (now.acceleration[cuts[HUB] + i] - held.gravity[i])
    ends, end_rates, at, hub_rate = _strings(held, now)
    return bool(pull_strings(web, mesh, ends, end_rates, at, hub_rate, g))


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
        ends, end_rates, at, hub_rate = _strings(held, now)
        add_strings(
            web, mesh, ends, end_rates, at, hub_rate, by_rate, fronts, columns, rows, corner
        )


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
