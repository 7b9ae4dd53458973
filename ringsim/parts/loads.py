"""Prescribed forces."""

from __future__ import annotations

from ringsim.parts.persection import PerSection
from ringsim.units import Model, Newton


class Loads(Model):
    """Constant forces on the V-joints along z: +force on the upper, -force on the lower ones.

    Positive forces open the ring, negative ones fold it.  Source: paper 002.
    """

    force: PerSection[Newton]
    """One value, or one per section."""
