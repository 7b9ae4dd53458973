"""Parts, blocks and fronts: in which order unknowns are eliminated.

Bodies of all planes at a corner are a block of unknowns, which comes after the inner ones; inner
unknowns that elements hold together form a part, and a part touches one block, or two that are
neighbours.
"""

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ringsim.frame.skeleton import CURE, NOT_HERE, Element, End, Skeleton
from ringsim.refusal import InputError

Indices = NDArray[np.int64]


class Parts:
    """Places of all unknowns in the system, and the fronts that eliminate them.

    Attributes
    ----------
    home, angle_home
        First unknown of each frame, and that of each angle.
    of_element
        Part, and front, of each element.
    unknowns, gone, size, spots, parent, up
        See ``ringsim.frame.mesh.Mesh``.
    """

    def __init__(
        self, skeleton: Skeleton, elements: Sequence[Element], touching: Sequence[int]
    ) -> None:
        """Order the unknowns; the last element's part touches the bodies ``touching`` as well.

        Raises
        ------
        InputError
            If the structure is not a chain of corners with parts between neighbours.
        """
        corners = np.array(skeleton.layout.corners).T
        self._bodies = len(skeleton.layout.bodies)
        self._inner_frames = len(skeleton.places) - self._bodies
        if sorted(corners.ravel().tolist()) != list(range(self._bodies)):
            raise InputError(f"{NOT_HERE} bodies that are no corners: {CURE}")
        members = self._join(len(skeleton.angles), elements)
        self.home = np.zeros(len(skeleton.places), dtype=np.int64)
        self.angle_home = np.zeros(len(skeleton.angles), dtype=np.int64)
        parts, place = [], 0
        for own in members:
            first = place
            for k in own:
                if k < self._inner_frames:
                    self.home[self._bodies + k] = place
                else:
                    self.angle_home[k - self._inner_frames] = place
                place += 6 if k < self._inner_frames else 1
            parts.append(list(range(first, place)))
        self._start, self._width, self._blocks = place, 6 * corners.shape[1], len(corners)
        self.unknowns = place + self._width * self._blocks
        for number, corner in enumerate(corners):
            self.home[corner] = place + self._width * number + 6 * np.arange(len(corner))
        inner = [len(spots) for spots in parts]
        touched: list[set[int]] = [set() for _ in parts]
        for part, element in zip(self.of_element.tolist(), elements, strict=True):
            touched[part] |= {element.first.frame, element.second.frame}
        touched[int(self.of_element[-1])] |= set(touching)
        for spots, frames in zip(parts, touched, strict=True):
            bodies = sorted(int(self.home[frame]) for frame in frames if frame < self._bodies)
            self._require_neighbours({(home - place) // self._width for home in bodies})
            spots += [home + k for home in bodies for k in range(6)]
        self._add_fronts(parts, inner)

    def local(self, front: int, ends: Sequence[tuple[int, int]]) -> list[int]:
        """Places in a front of the unknowns of frames and angles: six and one, -1 for no angle."""
        where = {int(spot): k for k, spot in enumerate(self.spots[front, : self.size[front]])}
        found: list[int] = []
        for frame, angle in ends:
            found += [where[int(self.home[frame]) + k] for k in range(6)]
            found.append(where[int(self.angle_home[angle])] if angle >= 0 else -1)
        return found

    def front_of(self, unknown: int) -> tuple[int, int]:
        """The front that eliminates an unknown, and its place there."""
        front = bisect_right(self._firsts, unknown) - 1
        return front, unknown - self._firsts[front]

    def _inner_of(self, end: End) -> list[int]:
        """Inner frames, and angles behind them, of an end."""
        frame = [] if end.frame < self._bodies else [end.frame - self._bodies]
        return frame + ([] if end.angle < 0 else [self._inner_frames + end.angle])

    def _join(self, angles: int, elements: Sequence[Element]) -> list[list[int]]:
        """What each part holds: inner frames and angles that elements join (union-find)."""
        root = list(range(self._inner_frames + angles))

        def find(k: int) -> int:
            while root[k] != k:
                k = root[k] = root[root[k]]
            return k

        for element in elements:
            held = self._inner_of(element.first) + self._inner_of(element.second)
            if not held:
                raise InputError(f"{NOT_HERE} rods without joints between two bodies: {CURE}")
            for k in held[1:]:
                root[find(k)] = find(held[0])
        members: dict[int, list[int]] = {}
        # Angles first: each occurs in one or two elements only, so that little is left of it.
        for k in (*range(self._inner_frames, len(root)), *range(self._inner_frames)):
            members.setdefault(find(k), []).append(k)
        numbers = {top: number for number, top in enumerate(members)}
        held_first = [
            (self._inner_of(element.first) + self._inner_of(element.second))[0]
            for element in elements
        ]
        self.of_element = np.array([numbers[find(k)] for k in held_first])
        return list(members.values())

    def _require_neighbours(self, blocks: set[int]) -> None:
        apart = max(blocks) - min(blocks)
        if len(blocks) > 2 or apart not in (0, 1, self._blocks - 1):
            raise InputError(f"{NOT_HERE} rods between corners that are no neighbours: {CURE}")

    def _add_fronts(self, parts: list[list[int]], inner: list[int]) -> None:
        """The fronts of parts, then of blocks: each block is eliminated into the next one and the
        last, which a closed ring's first one is coupled to.
        """
        lists, width, start = list(parts), self._width, self._start
        for k in range(self._blocks):
            rest = sorted({k + 1, self._blocks - 1} & set(range(k + 1, self._blocks)))
            lists.append(
                [start + width * one + place for one in (k, *rest) for place in range(width)]
            )
        self._firsts = [spots[0] for spots in lists]
        self.gone = np.array([*inner, *[width] * self._blocks])
        self.size = np.array([len(spots) for spots in lists])
        shape = len(lists), int(self.size.max())
        self.spots, self.up = np.full(shape, -1), np.full(shape, -1)
        self.parent = np.full(len(lists), -1)
        for number, spots in enumerate(lists):
            self.spots[number, : len(spots)] = spots
            rest = spots[int(self.gone[number]) :]
            if rest:
                parent = len(parts) + min((spot - start) // width for spot in rest)
                places = {spot: k for k, spot in enumerate(lists[parent])}
                self.parent[number] = parent
                self.up[number, int(self.gone[number]) : len(spots)] = [
                    places[spot] for spot in rest
                ]
