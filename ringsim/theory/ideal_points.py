"""Every point of a structure with rigid rods as a linear function of a few numbers.

Where a structure has a basis s(q) (``Structure.basis``), every point is r = P s with a constant P,
found from places and derivatives of the layout at three coordinates; then r' = P s' and
r'' = P s''.  Elsewhere P = (r, r') and s = (1, 0), s' = (0, 1), good at one coordinate alone.

The hinge assemblies at the ends of an open arc swing on the pins of one section each by angles psi:
a point of theirs at the arm a from the pin, a = b + c with b along the pin's axis n, stands at

    pin + b + cos(psi) c + sin(psi) n x a,

linear in two more functions for each of them.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property

import numpy as np

from ringsim.cable.sheaves import FixedSheave
from ringsim.layout.bodies import Mount, OnBody
from ringsim.layout.layout import Layout, layout_of
from ringsim.layout.pose import Array
from ringsim.scene import Scene

Pairs = tuple[Array, Array]
"""Places, or axes, and their derivatives after the coordinate, shape (..., 3) each."""

UP = np.array([0.0, 0.0, 1.0])
NODES = (0.2, 0.8, 1.4)
"""Coordinates at which the layout is built, rad: apart, and away from both ends of the travel."""
_CLOSE = 1e-10
"""What the basis may leave over of a place of size 1: round-off leaves 1e-14."""


class Points:
    """Coefficients P of the points of a scene.

    ``basis`` is that of the structure; ``layout`` one of those that P was found from.  The bodies
    ``swinging`` are left upper, left lower, right upper, right lower of an open arc with a basis;
    ``pins`` are their pins' coefficients, shape (swinging, 3, functions of the structure), and
    ``normals`` these pins' axes, shape (swinging, 3).
    """

    def __init__(self, scene: Scene, at: float | None = None, layout: Layout | None = None) -> None:
        """Everywhere, or at one coordinate (rad) alone, of which a ``layout`` may be given."""
        self.basis = scene.structure.basis if at is None else lambda _: np.eye(3, 2)
        nodes = NODES if at is None else (at,)
        self._layouts = [layout_of(scene, q) for q in nodes] if layout is None else [layout]
        self._known = np.concatenate([self.basis(q)[:2] for q in nodes])
        self.layout = self._layouts[0]
        hinges = [] if at is not None else _end_hinges(self.layout)
        self.swinging = tuple(hinge.body for hinge in hinges)
        self.pins = self.fit(lambda layout: _stacked(layout.pose(h).at(0.0 * UP) for h in hinges))
        self.normals = np.array([self.layout.pose(hinge).axes[:, 2] for hinge in hinges])

    def fit(self, read: Callable[[Layout], Pairs]) -> Array:
        """Coefficients of what is read of a layout, shape (..., 3, functions of the structure).

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

    def swung(self, read: Callable[[Layout], Pairs], bodies: Iterable[int]) -> Array:
        """Coefficients of points that are read, with the swings of their ``bodies`` (-1 for any
        part that cannot swing); shape (points, 3, functions), m.
        """
        rigid, bodies = self.fit(read), np.array(list(bodies), dtype=int)
        more = np.zeros((*rigid.shape[:-1], 2 * len(self.swinging)))
        for number, body in enumerate(self.swinging):
            own = bodies == body
            ahead = np.cross(self.normals[number], rigid[own, :, 0] - self.pins[number, :, 0])
            across = np.cross(ahead, self.normals[number])
            rigid[own, :, 0] -= across
            more[own, :, 2 * number], more[own, :, 2 * number + 1] = across, ahead
        return np.concatenate([rigid, more], axis=-1)

    def functions(self, p: Array, w: Array) -> Array:
        """The functions s at p = (q, psi), rad, with constant rates w, rad/s, shape (n,) each.

        The columns are s, its n derivatives after p, ds/dt and d^2s/dt^2; shape (functions, n + 3).
        """
        s = self.basis(float(p[0]))
        first, swings = s.shape[1], np.arange(len(self.swinging))
        found = np.zeros((first + 2 * len(swings), len(p) + 3))
        found[:first, :2] = s[:2].T
        found[:first, -2:] = s[1:].T * [w[0], w[0] ** 2]
        if not self.swinging:
            return found
        cosine, sine = np.cos(p[1:]), np.sin(p[1:])
        for k, value, slope in ((first, cosine, -sine), (first + 1, sine, cosine)):
            rows = k + 2 * swings
            found[rows, 0], found[rows, 2 + swings] = value, slope
            found[rows, -2], found[rows, -1] = w[1:] * slope, -(w[1:] ** 2) * value
        return found

    def frame(self, body: int) -> Array:
        """Coefficients of a body's origin, m, and of its axes; shape (4, 3, functions)."""
        axes = [OnBody(body, axes=np.roll(np.eye(3), -k, axis=1)) for k in range(3)]
        return np.concatenate([self.places(axes[:1]), self.directions(axes)])

    def places(self, mounts: Sequence[Mount], *, ahead: float = 0.0) -> Array:
        """Coefficients of mounts of ``layout``, or of points ahead of them along their x axes (m);
        shape (mounts, 3, functions), m.
        """
        arm = np.array([ahead, 0.0, 0.0])
        return self.swung(
            lambda layout: _stacked(layout.pose(mount).at(arm) for mount in mounts),
            map(body_of, mounts),
        )

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
        path = self.layout.paths[number]
        bodies = [body_of(s.node) if isinstance(s, FixedSheave) else -1 for s in path]
        return self.swung(lambda layout: _stacked(map(layout.sheave, layout.paths[number])), bodies)


def body_of(mount: Mount) -> int:
    """Number of a mount's body; -1 on rods and in space."""
    return mount.body if isinstance(mount, OnBody) else -1


def _stacked(pairs: Iterable[Sequence[Array]]) -> Pairs:
    found = np.array(list(pairs)).reshape(-1, 2, 3)
    return found[:, 0], found[:, 1]


def _end_hinges(layout: Layout) -> list[OnBody]:
    """A mount on each hinge assembly at an end of an arc, all of whose hinges share one axis."""
    revolutes = [joint for joint in layout.joints if joint.kind == "revolute"]
    mounts = [mount for joint in revolutes for mount in (joint.first, joint.second)]
    found = []
    for body in (plane[end] for end in (0, -1) for plane in layout.corners):
        hinges = [one for one in mounts if isinstance(one, OnBody) and one.body == body]
        if np.ptp([hinge.axes[:, 2] for hinge in hinges], axis=0).max() < _CLOSE:
            found.append(hinges[0])
    return found
