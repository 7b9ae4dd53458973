"""Prescribed forces."""

from ringsim.parts.persection import PerSection
from ringsim.units import Model, Newton, Second


class Loads(Model):
    """Constant forces on the V-joints along z: +force on the upper, -force on the lower ones.

    Positive forces open the ring, negative ones fold it.  They keep their direction in space: a
    free ring that pitches turns under them, so that each pair of forces +F and -F, a height h apart
    in the ring and pitched by t, has the moment F h sin(t) that turns it back, and does the work of
    h cos(t) instead of h.  docs/loads.md says how much that is.  Source: paper 002.
    """

    force: PerSection[Newton]
    """Force on the V-joints of a section, up on the upper and down on the lower one."""
    reversal_time: Second | None = None
    """From this time on all forces act the other way round, as where a ring is folded and then
    deployed in one run, which no stop that it reaches before ends.  Left out, they never do."""
