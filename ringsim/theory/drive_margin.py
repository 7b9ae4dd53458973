"""The static margin of a drive on the ideal ring, at every opening angle.

What drives is set against what resists at the same angle, and speed helps nowhere.  Pulley friction
is no force beside the others but a share of the tension at every pulley, so a standard's factor
multiplies its coefficient, and the tensions are solved again.
"""

import math
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
from ringsim.theory.resistances.family import Opening, resistances
from ringsim.theory.section_loads import SectionLoads

MOST = 1e6
"""Margin told along a run where next to nothing resists: files hold no infinite numbers."""
PULLEYS = "pulley friction"
"""Name of what is lost between the winches and the ring at the tension that they have."""

LATE = np.radians([168.0, 170.0, 172.0, 174.0, 176.0, 177.0, 178.0, 179.0])
"""Opening angles (rad) at which latches, and cables along a net's edge, are looked at besides."""
_APART = 1e-9
"""Angles (rad) that count as the same."""


class Margin(NamedTuple):
    """At one opening angle (rad): what would drive without friction in the pulleys, and all that
    resists, without a standard's factors, N m; the margin with them; all that resists with them,
    ``required``, N m; what each cable drives without friction in the pulleys, and with the
    standard's, N m, shape (2, cables).
    """

    angle: float
    available: float
    resisting: dict[str, float]
    margin: float
    required: float
    pulls: Array


class DriveMargin:
    """The drive of a scene by a standard; ``kinds`` are the names of what resists.

    Raises
    ------
    InputError
        If its structure has no basis, or its drive no limit.
    """

    def __init__(self, scene: Scene, standard: MarginStandard) -> None:
        if not scene.structure.basis(scene.structure.coordinate).size:
            raise InputError(
                f'margin: structure.kind = "{kind_of(scene.structure)}" has no basis(), the '
                "functions in which its places are linear (give it one, or leave margin out)"
            )
        self.mechanism, self.standard = Mechanism(scene), standard
        self._drive = Drive(scene, self.mechanism, at_speed=standard.keep_speed)
        self.conditions = self._drive.conditions
        self._loads = SectionLoads(self.mechanism)
        self._resistances = resistances(scene, self.mechanism)
        self._ends_steeply = scene.latch is not None or isinstance(scene.net, BoundaryNet)
        self.kinds = [PULLEYS, *(one.kind for one in self._resistances)]
        self.start = math.pi - 2.0 * scene.structure.coordinate
        """Opening angle at which the scene begins, rad."""

    def at(self, angle: float, time: float = 0.0) -> Margin:
        """At an opening angle (rad), with what is whole and on at a time (s): at rest, or with
        ``keep_speed`` at the speed that the winches are commanded to.
        """
        standard, now = self.standard, self.mechanism.at(0.5 * (math.pi - angle))
        over, state = self._drive.reeved(now), self.conditions.at(time)
        opening = Opening(angle, self._drive.speed(over, state), 0.0, now, state.sprung)
        ideal, usual, factored = (
            self._drive.pulls(state, over, factor) for factor in (0.0, 1.0, standard.friction)
        )
        driving = float(self._loads.at(now).clip(min=0.0).sum())  # what resists is a resistance
        drive, required = float(factored.sum()) + driving, 0.0
        resisting = {PULLEYS: float((ideal - usual).sum())}
        for one in self._resistances:
            resisting[one.kind] = force = one.force(opening)
            if force >= 0.0:
                required += standard.factor(one.category) * force
            elif one.category == "spring":  # what else drives is not counted on
                drive -= standard.driving_spring * force
        required *= standard.motorisation
        margin = _margin(drive, math.inf if state.stuck else required)
        pulls = np.stack([ideal, factored])
        return Margin(angle, float(ideal.sum()) + driving, resisting, margin, required, pulls)

    def course(self, count: int = 33) -> list[Margin]:
        """At so many angles from the start to 180 deg, and more where parts resist at the end."""
        return [self.at(float(angle)) for angle in self._angles(self.start, math.pi, count)]

    def least(
        self, low: float | None = None, high: float = math.pi, time: float = 0.0,
        known: list[Margin] | None = None,
    ) -> Margin:  # fmt: skip
        """The smallest margin of all angles from ``low`` (rad), the start if None, to ``high``,
        with what is whole at a time (s); of some the margins may be ``known``.
        """
        low = self.start if low is None else low
        angles = self._angles(min(low, self.start), math.pi)
        inside = angles[(angles > low + _APART) & (angles < high - _APART)]
        wanted = np.unique([low, *inside, high])
        course = [*(known or []), *(self.at(float(angle), time) for angle in wanted)]
        course.sort(key=lambda each: each.angle)
        # A known angle that is wanted, too, would be its own neighbour.
        apart = np.diff([each.angle for each in course], prepend=-math.inf) > _APART
        course = [each for each, own in zip(course, apart, strict=True) if own]
        k = int(np.argmin([each.margin for each in course]))
        bounds = course[max(k - 1, 0)].angle, course[min(k + 1, len(course) - 1)].angle
        if not math.isfinite(course[k].margin) or bounds[1] - bounds[0] < _APART:
            return course[k]
        from scipy.optimize import minimize_scalar  # here: most runs do not need it

        found = minimize_scalar(
            lambda angle: self.at(angle, time).margin, bounds=bounds, method="bounded",
            options={"xatol": 1e-9},
        )  # fmt: skip
        return min(course[k], self.at(float(found.x), time), key=lambda each: each.margin)

    def _angles(self, low: float, high: float, count: int = 33) -> Array:
        """Those of the scene's course, and as many below its start if they begin there."""
        angles = np.linspace(self.start, high, count)
        if self._ends_steeply:
            angles = np.union1d(angles, LATE[self.start < LATE])
        if low < self.start - _APART:
            angles = np.union1d(angles, np.linspace(low, self.start, count))
        return angles


def _margin(drive: float, required: float) -> float:
    """-1 where nothing drives, or the ring is held."""
    if required > 0.0:
        return drive / required - 1.0
    return math.inf if drive > 0.0 else -1.0
