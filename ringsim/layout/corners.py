"""The corners of a structure, by name."""

from collections.abc import Sequence

from ringsim.layout.layout import Layout


def corners_of(layout: Layout, planes: Sequence[str]) -> dict[str, int]:
    """Numbers of the bodies at all corners, by "upper corner 3"; a body has one name."""
    found: dict[int, str] = {}
    for plane, row in zip(planes, layout.corners, strict=False):
        for corner, number in enumerate(row, 1):
            found.setdefault(number, f"{plane} corner {corner}")
    return {name: number for number, name in found.items()}
