"""A body that slides along the axis of another: a stiff spring across the axis."""

import numpy as np

from ringsim.frame.kernels import Pose
from ringsim.frame.mesh import Mesh
from ringsim.layout.pose import Array, cross

STIFFNESS = 100.0
"""Over that of the stiffest rod along its axis, EA / L: the gap is a hundredth of what rods give."""


class Slide:
    """Holds the origin of body ``low`` on the z axis of body ``top``."""

    def __init__(self, mesh: Mesh, top: int, low: int, stiffness: float) -> None:
        self._top, self._low, self._stiffness = top, low, stiffness
        self._spots = np.concatenate(
            [np.arange(6) + mesh.home[top], np.arange(3) + mesh.home[low]]
        )
        front, first = mesh.frame_local[top]
        self._front = int(front)
        self._places = np.concatenate(
            [np.arange(6) + first, np.arange(3) + mesh.frame_local[low, 1]]
        )

    def _gaps(self, pose: Pose) -> tuple[Array, Array]:
        """Gaps along x and y, (2,), m, and their derivatives, (2, 9)."""
        apart, axes = pose.place[self._low] - pose.place[self._top], pose.axes[self._top]
        rows = np.empty((2, 9))
        for k in range(2):
            rows[k, :3], rows[k, 6:] = -axes[:, k], axes[:, k]
            rows[k, 3:6] = cross(axes[:, k], apart)
        return apart @ axes[:, :2], rows

    def gap(self, pose: Pose) -> float:
        """Distance from the axis, m."""
        return float(np.hypot(*self._gaps(pose)[0]))

    def hold(self, pose: Pose, g: Array) -> None:
        """Add its force to the residual."""
        gaps, rows = self._gaps(pose)
        g[self._spots] += self._stiffness * (gaps @ rows)

    def add_tangent(self, pose: Pose, fronts: Array) -> None:
        """Add to the fronts; gaps are so small that how the rows turn does not matter."""
        _, rows = self._gaps(pose)
        fronts[self._front][np.ix_(self._places, self._places)] += self._stiffness * (rows.T @ rows)
