"""The frame model's tangent by central differences of its residual."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.core.library import call
from ringsim.frame.model import FrameModel
from ringsim.frame.state import State
from ringsim.scene import Scene

Array = NDArray[np.float64]


class Probe:
    """A model a step after a start, away from balance.

    ``by`` are the changes of all unknowns over the step, ``time`` and ``step`` in s.
    """

    def __init__(self, scene: Scene, by: float | Array, time: float, step: float) -> None:
        self.model, self.time, self.step = FrameModel(scene), time, step
        self._start, size = self.model.start, self.model.size
        if isinstance(by, float):
            by = by * np.random.default_rng(0).normal(size=size)
        by = by.copy()
        by[self.model.mesh.fixed] = 0.0
        self.by = by

    def residual(self, by: Array) -> Array:
        self._now = self._moved(by)
        return self._unbalanced(self._now)

    def _unbalanced(self, now: State) -> Array:
        now.strains.lead[0] = 1.0 / self.step  # strains that rise from zero in the step
        given = self._start.table, now.table
        assert self.model.core("unbalance", self.time, self.step, now, *given) == 0
        return self.model.system.g.copy()

    def _moved(self, by: Array) -> State:
        state, unknowns = self._start.copy(), self.model.mesh.unknowns
        call("move", self.model.mesh, state.pose, by[:unknowns])
        if self.model.with_hub:
            state.hub += by[-3:]
        return state

    def differences(self, small: float = 1e-7) -> Array:
        """Derivatives of the residual after moves on top of ``by``; fixed unknowns as identity."""
        base = self._moved(self.by)
        size = self.model.size
        found = np.zeros((size, size))
        for k in range(size):
            sides = []
            for sign in (1.0, -1.0):
                step = np.zeros(size)
                step[k] = sign * small
                sides.append(self._on_top(base, step))
            found[:, k] = (sides[0] - sides[1]) / (2.0 * small)
        fixed = self.model.mesh.fixed
        found[fixed] = found[:, fixed] = 0.0
        found[fixed, fixed] = 1.0
        return found

    def _on_top(self, base: State, by: Array) -> Array:
        state, unknowns = base.copy(), self.model.mesh.unknowns
        call("move", self.model.mesh, state.pose, by[:unknowns])
        if self.model.with_hub:
            state.hub += by[-3:]
        return self._unbalanced(state)

    def solved(self) -> Array:
        """What the factored tangent gives for unit residuals: minus its inverse."""
        self.residual(self.by)
        now, model, found = self._now, self.model, np.eye(self.model.size)
        assert model.core("stiffen", self.time, self.step, now, now.table) == 0
        roped = model.unroped if model.cables is None else model.cables.roped
        for row in found:
            call("relax", model.system, roped, row)
        found = found.T
        fixed = self.model.mesh.fixed
        assert not found[fixed].any()  # they stay
        found[fixed, fixed] = -1.0
        return found


def error(probe: Probe) -> float:
    """Largest error of the tangent: of an entry over the root of the diagonal entries of its row
    and column, which counts soft unknowns as much as stiff ones.
    """
    expected, found = probe.differences(), -np.linalg.inv(probe.solved())
    scale = np.sqrt(np.abs(np.diag(expected)))
    return float(np.abs((found - expected) / np.outer(scale, scale)).max())
