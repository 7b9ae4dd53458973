"""The corners: where they are, how hard they are accelerated; the shape that they leave, and how it
vibrates.
"""

import math

import numpy as np

from ringsim.layout.layout import layout_at_opening
from ringsim.outputs.family import (
    Array,
    ErrorBar,
    Output,
    Peak,
    Reading,
    Run,
    Series,
    Values,
    Variable,
    in_all_planes,
    top_of,
)

# How hard corners are accelerated.


class PeakAcceleration(Output):
    """Largest acceleration of every corner's hinge assembly, at the origin of its body.

    It is that of its motion, without the pull of gravity.  Locks give it: each stop sends a shock
    through the rods, whose height depends on how stiff the stop is.
    """

    rank = 49
    needs = ("accelerations",)
    peak = Peak("peak_acceleration_max", ("plane", "corner"), "the largest acceleration")
    shocks = (("peak_acceleration_max", peak),)
    variables = (
        Variable(
            "peak_acceleration", ("plane", "corner"), "m/s^2",
            "largest acceleration of the corner at any step",
        ),
        Variable(
            "peak_acceleration_max", (), "m/s^2", "largest acceleration of any corner at any step",
            error_bar=ErrorBar("largest acceleration", safety=3.8, of="peak_acceleration"),
            summary=("largest acceleration", "10.3g"), worse="larger",
            largest_of="peak_acceleration",
        ),
        *peak.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """Shape (planes, corners, 3), m/s^2."""
        return now.meters.corners(now.meters.accelerations())

    def reduce(self, run: Run, series: Series) -> Values:
        """Of all steps."""
        sizes = np.linalg.norm(series.values, axis=3)
        rows = np.empty(sizes.shape[1:])
        for place in np.ndindex(*rows.shape):
            rows[place] = top_of(series.times, sizes[(slice(None), *place)]).value
        most, found = self.peak.of(run, series.times, sizes)
        rows = in_all_planes(rows, run.scene.structure.planes)
        return found | {"peak_acceleration": rows, "peak_acceleration_max": np.asarray(most)}


# Where corners, pins, joints and the hub are.


class Position(Output):
    """Positions in space of all points between which drawings have their lines.

    Which these are, and the lines between them, follows from the scene:
    :func:`ringsim.layout.points.points_of`.
    """

    rank = 46
    needs = ("positions",)
    coordinates = (
        Variable("point", ("point",), "1", "corner, pin, pivot, V-joint, hub or boom tip", "str"),
    )
    variables = (
        Variable(
            "position", ("point", "axis", "time"), "m", "position of a point of the structure"
        ),
    )

    def read(self, now: Reading) -> Array:
        """Places (m) and velocities (m/s), shape (points, 2, 3)."""
        return now.meters.points()

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated with the velocities: between two steps rods turn, and their ends go round
        arcs.
        """
        places, rates = series.values[:, :, 0], series.values[:, :, 1]
        return {"position": Series(series.times, places, series.grid).on_grid(rates)}


# How far the structure that has opened is from its drawing.


class Shape(Output):
    """Distances of all corners from where the drawing has them when deployed, at the run's end.

    The drawing is moved as a rigid body to where the sum of the squares of these distances is the
    least (Kabsch, Acta Crystallographica A 32, 1976).
    """

    rank = 49
    needs = ("shape",)
    coordinates = (Variable("corner", ("corner",), "1", "corner of the structure, from 1", "i4"),)
    variables = (
        Variable(
            "corner_deviation", ("plane", "corner"), "m",
            "distance of a corner at the end from the deployed design, after the best fit",
        ),
        Variable(
            "best_fit_rms", (), "m", "root of the mean square of all corners' deviations",
            summary=("best-fit rms", "10.3e"), worse="larger",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """Places of the corners, shape (planes, corners, 3), m."""
        return now.meters.corners(now.meters.bodies().places)

    def reduce(self, run: Run, series: Series) -> Values:
        """Of the last state."""
        drawn = layout_at_opening(run.scene, math.pi)
        places = [[drawn.bodies[number].pose.place for number in p] for p in drawn.corners]
        found = deviations(series.values[-1], np.array(places))
        rows = in_all_planes(found, run.scene.structure.planes)
        return {"corner_deviation": rows, "best_fit_rms": np.sqrt(np.mean(found**2))}


def deviations(places: Array, drawn: Array) -> Array:
    """Distances (m) of places from a drawing that is moved to fit best, shape (...), from (..., 3).

    >>> square = np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    >>> deviations(square[:, [1, 0, 2]] + 5.0, square).round(12).tolist()
    [0.0, 0.0, 0.0, 0.0]
    """
    from_centre = [
        each.reshape(-1, 3) - each.reshape(-1, 3).mean(axis=0) for each in (places, drawn)
    ]
    from scipy.spatial.transform import Rotation  # here: few scenes record their shape

    turn, _ = Rotation.align_vectors(*from_centre)
    apart = from_centre[0] - turn.apply(from_centre[1])
    return np.asarray(np.linalg.norm(apart, axis=1).reshape(places.shape[:-1]))


class FirstFrequency(Output):
    """Of the ring that a run leaves: fully open, all V-joints held by the stiffness of their stops.

    Rods, masses, stops, net and gravity are the run's; see :func:`ringsim.modes`.
    """

    rank = 49
    of_both = True  # the tangent of frames, whichever engine has run
    needs = ("frequency",)
    variables = (
        Variable(
            "first_frequency", (), "Hz",
            "lowest natural frequency of the deployed, latched ring, 0 if it is unstable; missing "
            "if the run does not deploy",
            summary=("first frequency", "10.4g"), worse="smaller",
        ),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """Nothing: the tangent of frames tells it, see ``ringsim.simulation``."""
        return {}


class Prestress(Output):
    """Elastic energy of the rods, from what assembling them has left on."""

    rank = 59
    needs = ("prestress",)
    variables = (
        Variable("rod_energy", ("time",), "J", "elastic energy of the rods"),
        Variable(
            "prestress_energy", (), "J", "elastic energy of the rods at the start",
            summary=("prestress", "10.3e"),
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> float:
        """In J."""
        return now.meters.rod_energy()

    def reduce(self, run: Run, series: Series) -> Values:
        """On the output grid, and the first."""
        return {"rod_energy": series.on_grid(), "prestress_energy": series.values[0]}
