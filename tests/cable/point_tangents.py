"""Tangents of all forces on the points of each rope, assembled from those of its tensions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringsim.cable.chain import decay_tangent, rope_tangent


@dataclass
class PointTangent:
    """Parts of dF/dx (N/m) and dF/dv (N s/m) on p points, shape (3 p, 3 p) each."""

    points: slice
    material: np.ndarray
    decay: np.ndarray
    geometric: np.ndarray
    damping: np.ndarray

    @property
    def stiffness(self):
        return self.material + self.decay + self.geometric


def differences_of(count):
    """D with x_i+1 - x_i = D x, shape (3 n, 3 n + 3)."""
    single = np.eye(count, count + 1, 1) - np.eye(count, count + 1)
    return np.kron(single, np.eye(3))


def tangents(state, velocities):
    """F = -D^T f with f_i = T_i u_i, rope by rope."""
    found = []
    for rope in range(len(state.natural)):
        tangent = rope_tangent(state, velocities, rope)
        decay, drag = decay_tangent(state, tangent, rope, state.exponent_slopes)
        share, unit = state.shares[tangent.spans], state.directions[tangent.spans]
        count, apart = len(unit), differences_of(len(unit))

        def on_points(by_difference, unit=unit, apart=apart, count=count):
            pull = unit[:, :, None, None] * by_difference[:, None]
            return -apart.T @ pull.reshape(3 * count, 3 * count) @ apart

        by_direction = np.zeros((count, 3, count, 3))
        by_direction[range(count), :, range(count)] = tangent.by_direction
        weight = share[:, None, None]
        first = int(state.ropes.near[tangent.spans.start])
        found.append(
            PointTangent(
                points=slice(first, first + count + 1),
                material=on_points(weight * tangent.mean_by_place),
                decay=on_points(decay),
                geometric=-apart.T @ by_direction.reshape(3 * count, 3 * count) @ apart,
                damping=on_points(weight * tangent.mean_by_velocity + drag),
            )
        )
    return found
