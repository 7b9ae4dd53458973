"""The shape of a structure that has opened and locked."""

import math
from typing import NamedTuple

import numpy as np

from ringsim.layout.layout import layout_at_opening
from ringsim.layout.pose import Array
from ringsim.outputs.shape import deviations
from ringsim.scene import Scene
from ringsim.scene.substituted import substituted
from ringsim.theory.assembled import assembled


class Deployed(NamedTuple):
    """Deviations of the corners from the design, shape (planes, corners), m, and the elastic energy
    of the rods, J.
    """

    deviations: Array
    energy: float

    @property
    def rms(self) -> float:
        """Root of their mean square, m."""
        return float(np.sqrt(np.mean(self.deviations**2)))


def deployed(scene: Scene) -> Deployed:
    """At rest with every opening angle at 180 deg, unloaded: what is left where all vibrations are.

    Raises
    ------
    ValueError
        If nothing balances near the drawing.
    """
    scene = substituted(scene)
    drawn = layout_at_opening(scene, math.pi)
    found = assembled(drawn, scene.rods, locked=True)
    places, wanted = (
        np.array([[layout.bodies[k].pose.place for k in plane] for plane in layout.corners])
        for layout in (found.layout, drawn)
    )
    return Deployed(deviations(places, wanted), found.energy)
