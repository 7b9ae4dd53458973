"""Every point of a structure with rigid rods as a linear function of a few numbers.

Where a structure has a basis s(q) (``Structure.basis``), every point is r = P s with a constant P,
found from places and derivatives of the layout at three coordinates; then r' = P s'.  Elsewhere
P = (r, r') and s = (1, 0), s' = (0, 1), good at one coordinate alone.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property

import numpy as np

from ringsim.layout.bodies import Mount, OnBody
from ringsim.layout.layout import Layout, layout_of
from ringsim.layout.pose import Array
from ringsim.scene import Scene

Pairs = tuple[Array, Array]
"""Places, or axes, and their derivatives after the coordinate, shape (..., 3) each."""

NODES = (0.2, 0.8, 1.4)
"""Coordinates at which the layout is built, rad: apart, and away from both ends of the travel."""
_CLOSE = 1e-10
"""What the basis may leave over of a place of size 1: round-off leaves 1e-14."""


class Points:
    """Coefficients P of the points of a scene; ``layout`` is one of those that P was found from.

    ``functions`` gives s and s' at a coordinate (rad), shape (2, functions).
    """

    def __init__(self, scene: Scene, at: float | None = None, layout: Layout | None = None) -> None:
        """Everywhere, or at one coordinate (rad) alone, of which a ``layout`` may be given."""
        self.functions = scene.structure.basis if at is None else lambda _: np.eye(2)
        nodes = NODES if at is None else (at,)
        self._layouts = [layout_of(scene, q) for q in nodes] if layout is None else [layout]
        self._known = np.concatenate([self.functions(q) for q in nodes])
        self.layout = self._layouts[0]

    def fit(self, read: Callable[[Layout], Pairs]) -> Array:
        """Coefficients of what is read of a layout, shape (..., 3, functions).

        Raises
        ------
        ValueError
            If it is not linear in the basis, or the basis cannot be told apart.
        """
        values = np.stack([part for layout in self._layouts for part in read(layout)])
        flat = values.reshape(len(values), -1)
        found, _, rank, _ = np.linalg.lstsq(self._known, flat, rcond=None)
        if rank < len(found):
            raise ValueError(
                f"structure: basis() has {len(found)} functions, but only {rank} can be told apart "
                f"at {len(self._layouts)} coordinates: leave out those that depend on others"
            )
        left = np.abs(self._known @ found - flat).max(initial=0.0)
        if left > _CLOSE * max(np.abs(flat).max(initial=0.0), 1.0):
            raise ValueError(
                f"structure: a place is {left:.3g} m off what its basis says: list in basis() all "
                "functions of the coordinate that layout() uses"
            )
        return np.moveaxis(found.reshape(len(found), *values.shape[1:]), 0, -1)

    def frame(self, body: int) -> Array:
        """Coefficients of a body's origin, m, and of its axes; shape (4, 3, functions)."""
        axes = [OnBody(body, axes=np.roll(np.eye(3), -k, axis=1)) for k in range(3)]
        return np.concatenate([self.places(axes[:1]), self.directions(axes)])

    def places(self, mounts: Sequence[Mount], *, ahead: float = 0.0) -> Array:
        """Coefficients of mounts of ``layout``, or of points ahead of them along their x axes (m);
        shape (mounts, 3, functions), m.
        """
        arm = np.array([ahead, 0.0, 0.0])
        return self.fit(lambda layout: _stacked(layout.pose(mount).at(arm) for mount in mounts))

    def directions(self, mounts: Sequence[Mount]) -> Array:
        """Coefficients of the mounts' x axes, shape (mounts, 3, functions)."""
        return self.places(mounts, ahead=1.0) - self.places(mounts)

    @cached_property
    def forces(self) -> tuple[Array, Array]:
        """The loads, N, and where they act; shapes (forces, 3) and (forces, 3, functions)."""
        mounts = [self.layout.joints[joint].first for joint, _ in self.layout.forces]
        vectors = np.array([force for _, force in self.layout.forces]).reshape(-1, 3)
        return vectors, self.places(mounts)

    def path(self, number: int) -> Array:
        """Coefficients of a cable's sheaves, shape (sheaves, 3, functions), m."""
        return self.fit(lambda layout: _stacked(map(layout.sheave, layout.paths[number])))


def body_of(mount: Mount) -> int:
    """Number of a mount's body; -1 on rods and in space."""
    return mount.body if isinstance(mount, OnBody) else -1


def _stacked(pairs: Iterable[Sequence[Array]]) -> Pairs:
    found = np.array(list(pairs)).reshape(-1, 2, 3)
    return found[:, 0], found[:, 1]
