"""The family of structures."""

from __future__ import annotations

from ringsim.units import Model


class Structure(Model):
    """Any deployable structure that a scene can hold."""
