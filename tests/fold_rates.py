"""Derivatives of fold states, by the complex step."""

from dataclasses import fields

import numpy as np

from ringsim.layout.bodies import STEP
from ringsim.structures.pantograph_ring import Fold, RingGeometry


def fold_rate(ring: RingGeometry, phi: float) -> Fold:
    """Derivatives of all points after phi, m/rad."""
    fold = ring.fold(phi + 1j * STEP)
    return Fold(**{f.name: np.imag(getattr(fold, f.name)) / STEP for f in fields(Fold)})
