"""Constant forces on the V-joints."""

from __future__ import annotations

import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.pantograph_ring import RingModel
from ringsim.parts.persection import spread

Array = NDArray[np.float64]


def add_loads(model: RingModel) -> Array:
    """Apply the scene's forces; returns them along z, shape (2, sections), N.

    The direction is that of the space in which the ring was built, not of the ring: exudyn's
    force vectors are those of the global frame unless ``bodyFixed`` is set.
    """
    loads = model.scene.loads
    sections = model.geometry.sections
    force = spread(0.0 if loads is None else loads.force, sections)
    along = np.stack([force, -force])
    for plane in range(2):
        for joint, value in zip(model.vjoints[plane], along[plane], strict=True):
            if value != 0.0:
                model.assembly.system.AddLoad(
                    item.LoadForceVector(
                        markerNumber=joint.markers[0],
                        loadVector=[0.0, 0.0, float(value)],
                    )
                )
    return along
