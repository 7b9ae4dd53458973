"""Tangents of all forces on the points of each rope, assembled from those of its tensions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


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


def tangents(chain, state, velocities):
    """F = -D^T f with f_i = T_i u_i, rope by rope: d(T_i u_i) = u_i dT_i + T_i du_i."""
    ropes, left = state.ropes, np.ones(len(state.natural))
    by_place, by_rate = (
        {
            rope: (pulls, changes)
            for rope, pulls, changes in chain.changes(
                state, velocities, state.exponent_slopes, left, *by, passing=0.0
            )
        }
        for by in ((1.0, 0.0), (0.0, 1.0))
    )
    found = []
    for rope, (first, last) in enumerate(zip(ropes.starts, ropes.ends, strict=True)):
        unit, count = state.directions[first:last], last - first
        apart = differences_of(count)

        def on_points(factors, unit=unit, apart=apart, count=count):
            by_difference = np.einsum("kn,kmi->nmi", *factors)
            pull = unit[:, :, None, None] * by_difference[:, None]
            return -apart.T @ pull.reshape(3 * count, 3 * count) @ apart

        across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
        turned = np.zeros((count, 3, count, 3))
        held = state.tensions[first:last] / state.lengths[first:last]
        turned[range(count), :, range(count)] = held[:, None, None] * across
        none = np.zeros((1, count)), np.zeros((1, count, 3))
        place, rate = by_place.get(rope, none), by_rate.get(rope, none)
        near = int(ropes.near[first])
        found.append(
            PointTangent(
                points=slice(near, near + count + 1),
                material=on_points([each[:1] for each in place]),
                decay=on_points([each[1:] for each in place]),
                geometric=-apart.T @ turned.reshape(3 * count, 3 * count) @ apart,
                damping=on_points(rate),
            )
        )
    return found
