"""Corners on lines, where a ring of rigid rods takes them."""

from typing import NamedTuple

import numpy as np

from ringsim.layout.bodies import OnBody
from ringsim.layout.pose import Array
from ringsim.parts.offload import Offload
from ringsim.scene import Scene
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.ideal_points import body_of


class Lines(NamedTuple):
    """Of n lines, shape (n,): pull, N; height of the corner over that at the start, m; how far it
    rises, and how far its trolley goes on the grid, for the opening angle, m/rad.
    """

    law: Offload
    pulls: Array
    heights: Array
    climbs: Array
    ways: Array


class Carried:
    """The corners that hang on lines, of a ring that folds.

    Beside the body that is held, or, of a ring that floats, without momentum along the grid and at
    the height that leaves the sum of the pulls: its weight stays as it is.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        layout = mechanism.points.layout
        assert layout.hung is not None
        self._hung, self._mechanism = layout.hung, mechanism
        self._corners = mechanism.points.places([OnBody(body) for body in layout.hung.bodies])
        held = [body_of(support.second) for support in layout.supports]
        self._base = mechanism.points.frame(held[0])[0] if held else None
        self._start = self._height(mechanism.at(scene.structure.coordinate))

    def at(self, now: Configuration) -> Lines:
        """At a coordinate."""
        places, rates = now.places(self._corners), now.velocities(self._corners)
        rigid = self._mechanism.rates(now)
        # The angle opens by two for one that the coordinate falls.
        moving = -0.5 * (rigid[:3] + np.cross(rigid[3:6], places) + rates)
        up, law = self._up(now), self._hung.law
        climbs = moving @ up
        level = moving - climbs[:, None] * up
        heights = self._height(now) - self._start
        if self._base is None:
            heights, climbs = heights - heights.mean(), climbs - climbs.mean()
        pulls = self._hung.lifts - law.stiffness * heights
        return Lines(law, pulls, heights, climbs, np.linalg.norm(level, axis=1))

    def _height(self, now: Configuration) -> Array:
        places = now.places(self._corners)
        if self._base is not None:
            places = places - self._base @ now.values
        return np.asarray(places @ self._up(now))

    def _up(self, now: Configuration) -> Array:
        """Against gravity, in the structure's axes."""
        down = self._mechanism.gravity(now)
        return -down / np.linalg.norm(down)
