"""What every residual needs, in one call: places, rates, rods, masses, linear friction."""

from typing import NamedTuple

from ringsim.frame.following import Coefficients, Followed, follow
from ringsim.frame.kernels import Pose, Strains, add_forces, place_points
from ringsim.frame.lines import Arms, Lines, place_lines
from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Indices
from ringsim.frame.slide import aside
from ringsim.frame.vectors import compiled
from ringsim.layout.pose import Array

POINTS, LINES, ANGLES, ENDS, HUB, HUNG = range(6)
"""Followed coordinates: points with mass, points of the cables, joint angles, the ends of the net's
strings and its hub, bodies that hang on lines."""


class Held(NamedTuple):
    """Where followed coordinates begin, shape (7,); bodies at the ends of strings, and on lines;
    bodies with a boom and those that slide along it, with the stiffness that holds them (N/m);
    linear friction of the angles, N m s/rad; whether there is gravity, and it, m/s^2.
    """

    cuts: Indices
    ends: Indices
    hung: Indices
    top: Indices
    low: Indices
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
    mesh: Mesh, lines: Lines, held: Held, coefficients: Coefficients, step: float,
    start: Followed, pose: Pose, hub: Array, arms: Arms, now: Followed, strains: Strains, g: Array,
) -> None:  # fmt: skip
    """Follow a pose over a step, and add forces of rods, masses, slides and linear friction to the
    residual, shape (unknowns,).
    """
    put_in_place(mesh, lines, held, pose, hub, arms, now.place)
    follow(coefficients, step, start, now)
    first, last = held.cuts[POINTS], held.cuts[LINES]
    points = now.place[first:last].reshape((-1, 3))
    accelerations = now.acceleration[first:last].reshape((-1, 3))
    if held.weighs:
        accelerations = accelerations - held.gravity
    add_forces(mesh, pose, points, accelerations, strains, g)
    rates = now.rate[held.cuts[ANGLES] : held.cuts[ENDS]]
    for n in range(len(held.damping)):
        g[mesh.angle_home[n]] += held.damping[n] * rates[n]
    for n in range(len(held.top)):
        top, low = held.top[n], held.low[n]
        gaps, rows = aside(pose, top, low)
        for k in range(2):
            force = held.stiffness * gaps[k]
            for i in range(6):
                g[mesh.home[top] + i] += force * rows[k, i]
                g[mesh.home[low] + i] += force * rows[k, 6 + i]


@compiled
def add_slides(mesh: Mesh, held: Held, pose: Pose, fronts: Array) -> None:
    """Add what holds the bodies on their boom to the fronts; gaps are so small that how their
    directions turn does not matter.
    """
    for n in range(len(held.top)):
        top, low = mesh.frame_local[held.top[n]], mesh.frame_local[held.low[n]]
        _, rows = aside(pose, held.top[n], held.low[n])
        front = fronts[top[0]]
        for i in range(12):
            row = top[1] + i if i < 6 else low[1] + i - 6
            for j in range(12):
                column = top[1] + j if j < 6 else low[1] + j - 6
                shared = rows[0, i] * rows[0, j] + rows[1, i] * rows[1, j]
                front[row, column] += held.stiffness * shared
