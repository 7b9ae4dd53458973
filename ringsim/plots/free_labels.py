"""Words inside axes, put where they cover no curve."""

from collections.abc import Iterator
from itertools import product

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Bbox

FREE = "free-label"
"""Gid of the words that may be moved."""
_ACROSS = {"left": 0.02, "right": 0.98, "center": 0.5}
_HEIGHTS = (0.95, 0.8, 0.65, 0.5, 0.35, 0.2)
"""Upper edges that are tried, in shares of the axes, for lines that leave room in one corner."""


def free(text: Text) -> None:
    """Let these words be moved by :func:`settle`; where they stand now is preferred."""
    text.set_gid(FREE)


def settle(figure: Figure) -> None:
    """Move free words of a drawn figure to where they cover least, best of all nothing."""
    movable = [(a, [t for t in a.texts if t.get_gid() == FREE]) for a in figure.axes]
    if any(texts for _, texts in movable):
        figure.draw_without_rendering()  # settles the layout, on which positions depend
    for axes, texts in movable:
        curves, taken = list(_curves(axes)), list[Bbox]()
        for text in texts:
            own = (text.get_position(), text.get_horizontalalignment())
            places = [own, *(((_ACROSS[ha], y), ha) for y, ha in product(_HEIGHTS, _ACROSS))]
            costs = [_cost(axes, text, place, curves, taken) for place in places]
            _move(text, places[costs.index(min(costs))])
            taken.append(text.get_window_extent())


def _move(text: Text, place: tuple[tuple[float, float], str]) -> None:
    text.set(position=place[0], horizontalalignment=place[1])


def _cost(
    axes: Axes, text: Text, place: tuple[tuple[float, float], str], curves: list[Path],
    taken: list[Bbox],
) -> int:  # fmt: skip
    """How many curves words would cover there; other words and the frame count more."""
    _move(text, place)
    box, frame = text.get_window_extent(), axes.get_window_extent()
    words = sum(box.overlaps(other) for other in taken)
    outside = box.y0 < frame.y0 or box.x0 < frame.x0 or box.x1 > frame.x1
    covered = sum(bool(one.intersects_bbox(box.padded(2.0), filled=False)) for one in curves)
    return covered + (len(curves) + 1) * int(words + outside)


def _curves(axes: Axes) -> Iterator[Path]:
    """All curves and edges of bands, on the sheet."""
    for line in axes.lines:
        yield line.get_transform().transform_path(line.get_path()).cleaned(remove_nans=True)
    for collection in axes.collections:
        if isinstance(collection, (LineCollection, PolyCollection)):
            for path in collection.get_paths():
                yield collection.get_transform().transform_path(path).cleaned(remove_nans=True)
