"""A bracket that a gear keeps on the bisector of the bar halves."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ringsim.cable.bracket.family import Bracket
from ringsim.cable.ropes import Array


class BisectorBracket(Bracket):
    """The pulley at a constant distance h from the joint, away from the bars on their bisector.

    Both spans are alike at every angle.  Source: paper 000, eq. 20 and fig. 3 with constant h.
    """

    kind: Literal["bisector"] = "bisector"

    def place(self, phi: ArrayLike, distance: float) -> tuple[Array, Array]:
        """Offsets a = 0, b = h."""
        size = np.shape(phi)
        return np.zeros(size), np.full(size, distance)
