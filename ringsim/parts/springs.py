"""Springs with dampers, of which nets, stops and contacts are made; each law is written once.

A law takes the functions that it needs (``minimum``, ``maximum``, ``where``, ``tanh``, ``exp``,
``sqrt``, ``abs``, ``sign``) from ``xp``: numpy, or an engine's namespace of the same names for its
own expressions.  Forces resist the growth of the law's coordinate.
"""

from typing import Any, NamedTuple

import numpy as np


class Reaction(NamedTuple):
    """What resists a coordinate; numbers, arrays or an engine's expressions."""

    elastic: Any
    """Derivative of ``stored`` after the coordinate, N (N m for an angle)."""
    damping: Any
    """The rest; times the rate it is the power lost, never negative, N (N m)."""
    stored: Any
    """Elastic energy, J."""

    @property
    def total(self) -> Any:
        """Elastic and damping part together."""
        return self.elastic + self.damping


def two_sided(stretch: Any, rate: Any, stiffness: Any, damping: Any) -> Reaction:
    """A linear spring and damper, for a stretch in m (rad) and its rate."""
    elastic = stiffness * stretch
    return Reaction(elastic, damping * rate, 0.5 * elastic * stretch)


def one_sided(
    stretch: Any, rate: Any, stiffness: Any, damping: Any, onset: float, xp: Any = np
) -> Reaction:
    """A spring that acts while its stretch is positive, with a damper that never turns it round.

    k s + d s' min(s / onset, 1), but not below 0: a damper in full force from the first touch
    would let the force jump, and Newton would find no solution in the step that meets it.
    """
    taut = xp.maximum(stretch, 0.0)
    elastic = stiffness * taut
    damper = xp.maximum(damping * rate * xp.minimum(taut / onset, 1.0), -elastic)
    return Reaction(elastic, damper, 0.5 * elastic * taut)
