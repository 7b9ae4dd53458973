"""The lines that make up a drawing of the ring in one fold state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.scene import Scene
from ringsim.structures.ring_geometry import RingGeometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """Straight lines of one kind: name and end points, shape (lines, 2, 3), in metre."""

    name: str
    lines: Array


def ring_parts(scene: Scene, opening: Array) -> list[Part]:
    """Lines of the ring, of its boom and of its net, centred on the vertical axis.

    Corners and diagonals follow the ideal fold state of the mean opening angle; every V-joint
    sits at the depth of its own opening angle.

    Parameters
    ----------
    scene
        The scene; boom and net are there if it has them.
    opening
        Opening angles, shape (2, sections), in degree.
    """
    geometry = scene.structure.geometry()
    phi = np.radians(90.0 - 0.5 * opening)
    fold = geometry.fold(float(phi.mean()))
    vjoints = fold.vjoints.copy()
    half_height = 0.5 * geometry.height(float(phi.mean()))
    vjoints[..., 2] = np.array([[1.0], [-1.0]]) * (half_height - geometry.half_bar * np.sin(phi))
    ends = np.roll(np.arange(fold.corners.shape[1]), -1)[: geometry.sections]
    starts = np.arange(geometry.sections)
    parts = [
        Part("diagonals", _joined(
            (fold.left[1], fold.pivots), (fold.pivots, fold.right[0]),
            (fold.left[0], fold.pivots), (fold.pivots, fold.right[1]),
        )),
        Part("folding bars", _joined((fold.left, vjoints), (vjoints, fold.right))),
        Part("hinge assemblies", _joined(
            (fold.corners[:, starts], fold.left), (fold.right, fold.corners[:, ends]),
        )),
    ]  # fmt: skip
    if scene.boom is not None:
        foot = fold.corners[0, 0] - [0.0, 0.0, scene.boom.length]
        parts.append(Part("boom", _joined((fold.corners[0, 0], foot))))
    if scene.net is not None:
        parts += _net(fold.corners[0], scene.net.neutral_length, two_sided=scene.net.two_sided)
    shift = _middle(fold.corners)
    return [Part(part.name, part.lines - shift) for part in parts]


def facing_azimuth(geometry: RingGeometry) -> float:
    """Direction to look from, degree: the boom to the left in front; an arc from outside."""
    outward = geometry.normals.mean(axis=0)
    if geometry.closed or np.hypot(*outward[:2]) < 1e-6:
        return 42.0
    return float(np.degrees(np.arctan2(outward[1], outward[0]))) + 35.0


def _joined(*pairs: tuple[Array, Array]) -> Array:
    lines = [np.stack(np.broadcast_arrays(a, b), axis=-2).reshape(-1, 2, 3) for a, b in pairs]
    return np.concatenate(lines)


def _middle(corners: Array) -> Array:
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    return np.array([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.0])


def _net(upper: Array, neutral_length: float, *, two_sided: bool) -> list[Part]:
    """Springs from the upper corners, shape (corners, 3), to the hub amid them."""
    hub = upper.mean(axis=0)
    springs = _joined((upper, hub))
    taut = np.linalg.norm(upper - hub, axis=-1) > neutral_length
    taut |= two_sided
    return [Part("net, taut", springs[taut]), Part("net, slack", springs[~taut])]
