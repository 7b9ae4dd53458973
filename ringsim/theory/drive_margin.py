"""The margin of a drive on the ideal ring: at every angle, and along a run.

Quasi-static: what drives is set against what resists at the same opening angle, and speed helps
nowhere.  Pulley friction is no force beside the others but a share of the tension at every pulley,
so a standard's factor multiplies its coefficient, and the tensions are solved again.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ringsim.choice import kind_of
from ringsim.layout.pose import Array
from ringsim.parts.margin.family import MarginStandard
from ringsim.parts.net.boundary import BoundaryNet
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.theory.drive import Drive
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.resistances.family import Opening, folding, resistances
from ringsim.variables import Outcome

MOST = 1e6
"""Margin told along a run where next to nothing resists: files hold no infinite numbers."""
PULLEYS = "pulley friction"
"""Name of what is lost between the winches and the ring at the tension that they have."""


LATE = np.radians([168.0, 170.0, 172.0, 174.0, 176.0, 177.0, 178.0, 179.0])
"""Opening angles (rad) at which latches, and cables along a net's edge, are looked at besides."""


class Margin(NamedTuple):
    """At one opening angle (rad): what would drive without friction in the pulleys, all that
    resists, without a standard's factors, N m; and the margin with them.
    """

    angle: float
    available: float
    resisting: dict[str, float]
    margin: float


class DriveMargin:
    """The drive of a scene by a standard; ``kinds`` are the names of what resists.

    Raises
    ------
    InputError
        If the scene is no ring, or its drive has no limit.
    """

    def __init__(self, scene: Scene, standard: MarginStandard) -> None:
        if (kind := kind_of(scene.structure)) != "pantograph-ring":
            raise InputError(
                f'structure.kind = "{kind}": only the pantograph ring has a margin of its drive '
                "(leave margin out)"
            )
        self._mechanism = Mechanism(scene)
        self._standard = standard
        self._drive = Drive(scene, self._mechanism, at_speed=standard.keep_speed)
        self._resistances = resistances(scene, self._mechanism)
        self._ends_steeply = scene.latch is not None or isinstance(scene.net, BoundaryNet)
        self.kinds = [PULLEYS, *(one.kind for one in self._resistances)]
        self.start = math.pi - 2.0 * scene.structure.coordinate
        """Opening angle at which the scene begins, rad."""

    def at(
        self, angle: float, rate: float | None = None, acceleration: float = 0.0,
        time: float | None = None,
    ) -> Margin:  # fmt: skip
        """At an opening angle (rad); of a run at its rate (rad/s), acceleration (rad/s^2) and time
        (s), else at the speed that the winches are commanded to.
        """
        standard, now = self._standard, folding(self._mechanism, 0.5 * (math.pi - angle))
        over = self._drive.reeved(now)
        rate = self._drive.speed(over) if rate is None else max(rate, 0.0)
        opening = Opening(angle, rate, acceleration, now)
        ideal, driving = (self._drive.force(now, over, factor, time) for factor in (0.0, 1.0))
        drive = self._drive.force(now, over, standard.friction, time)
        resisting, required = {PULLEYS: ideal - driving}, 0.0
        for one in self._resistances:
            resisting[one.kind] = force = one.force(opening)
            if force >= 0.0:
                required += standard.factor(one.category) * force
            elif one.category == "spring":  # what else drives is not counted on
                drive -= standard.driving_spring * force
        required *= standard.motorisation
        margin = drive / required - 1.0 if required > 0.0 else math.inf
        return Margin(angle, ideal, resisting, margin)

    def course(self, count: int = 33) -> list[Margin]:
        """At so many angles from the start to 180 deg, and more where parts resist at the end."""
        angles = np.linspace(self.start, math.pi, count)
        if self._ends_steeply:
            angles = np.union1d(angles, LATE[self.start < LATE])
        return [self.at(float(angle)) for angle in angles]

    def least(self, course: list[Margin]) -> Margin:
        """The smallest margin of all angles between those of a course."""
        k = int(np.argmin([each.margin for each in course]))
        if not math.isfinite(course[k].margin):
            return course[k]
        bounds = course[max(k - 1, 0)].angle, course[min(k + 1, len(course) - 1)].angle
        from scipy.optimize import minimize_scalar  # here: most runs do not need it

        found = minimize_scalar(
            lambda angle: self.at(angle).margin, bounds=bounds, method="bounded",
            options={"xatol": 1e-9},
        )  # fmt: skip
        return min(course[k], self.at(float(found.x)), key=lambda each: each.margin)


def with_margin(outcome: Outcome, scene: Scene) -> Outcome:
    """The outcome of a run with the margin of its drive, if its scene names a standard.

    At the mean opening angle of all V-joints, with its rate and acceleration by differences over
    the output times, until the last joint has locked.  The ring is taken as sound: faults do not
    change what drives and resists.
    """
    if scene.margin is None or outcome.status.failed or "opening_angle" not in outcome.values:
        return outcome
    drive = DriveMargin(scene, scene.margin)
    times = outcome.coordinates["time"]
    angles = np.radians(outcome.values["opening_angle"].mean(axis=(0, 1)))
    until = np.nan_to_num(outcome.values.get("deployment_time", np.array(np.nan)), nan=np.inf)
    moving = np.flatnonzero(np.isfinite(angles) & (times <= until))
    available, margin = np.full((2, len(times)), np.nan)
    resisting = np.full((len(drive.kinds), len(times)), np.nan)
    if len(moving) > 2:
        rates = np.gradient(angles[moving], times[moving])
        found = _along(drive, times[moving], angles[moving], rates)
        available[moving] = [each.available for each in found]
        margin[moving] = [min(each.margin, MOST) for each in found]
        resisting[:, moving] = np.array([[*each.resisting.values()] for each in found]).T
    values = {"drive_available": available, "drive_resistance": resisting, "drive_margin": margin}
    if np.isfinite(margin).any():
        k = int(np.nanargmin(margin))
        values |= {
            "least_drive_margin": margin[k],
            "least_drive_margin_time": times[k],
            "least_drive_margin_angle": np.degrees(angles[k]),
        }
    names = {"resistance": np.array(drive.kinds, dtype=str)}
    return replace(
        outcome,
        values=outcome.values | {name: np.asarray(value) for name, value in values.items()},
        coordinates=outcome.coordinates | names,
    )


def _along(drive: DriveMargin, times: Array, angles: Array, rates: Array) -> list[Margin]:
    course = zip(times, np.minimum(angles, math.pi), rates, np.gradient(rates, times), strict=True)
    return [
        drive.at(float(angle), float(rate), float(bend), float(time))
        for time, angle, rate, bend in course
    ]
