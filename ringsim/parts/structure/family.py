"""The family of structures."""

from __future__ import annotations

from typing import Any, ClassVar

from ringsim.units import Model


class Structure(Model):
    """Any deployable structure that a scene can hold.

    A kind also says, as a field or a constant: ``sections`` and ``closed`` (how many values a
    list of a scene has), and ``pulleys`` (of each of its cables).
    """

    planes: ClassVar[tuple[str, ...]] = ("upper", "lower")
    """Planes that a cable can run in."""
    long_names: ClassVar[dict[str, str]] = {}
    """What variables of a result mean for this kind, where it differs from the ring."""
    shaping: ClassVar[tuple[str, ...]] = ()
    """Scene paths that decide where results are given: all samples of a campaign share them."""

    def check(self, scene: Any) -> None:
        """Refuse a scene whose other parts do not go with this structure.

        Raises
        ------
        ValueError
            Naming the part, its value and the cure.
        """
