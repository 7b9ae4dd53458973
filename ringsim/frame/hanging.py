"""Lines that carry corners, on their followed places."""

import numpy as np

from ringsim.frame.mesh import Mesh
from ringsim.frame.state import State
from ringsim.layout.layout import Hung
from ringsim.layout.pose import Array
from ringsim.parts.offload import Hold


class Hanging:
    """Adds what lines and trolleys do to residual, tangent and energies."""

    def __init__(self, hung: Hung, mesh: Mesh, start: Array) -> None:
        self._hung, self._mesh, self._start = hung, mesh, start
        self._spots = mesh.home[list(hung.bodies)][:, None] + np.arange(3)
        self._level = np.eye(3) - np.outer(hung.up, hung.up)
        self._trolley = hung.law.trolley_mass

    def hold(self, state: State) -> Hold:
        """What the lines do at a state."""
        moved, rates = state.place.hung - self._start, state.rate.hung
        return self._hung.law.hold(self._hung.up, self._hung.lifts, moved, rates)

    def push(self, state: State, g: Array) -> None:
        """Add to the residual."""
        pulled = self._trolley * state.acceleration.hung @ self._level
        g[self._spots] += pulled - self.hold(state).force

    def add_tangent(self, state: State, by_rate: float, by_place: float, fronts: Array) -> None:
        """Add to the fronts."""
        moved, rates = state.place.hung - self._start, state.rate.hung
        slopes = self._hung.law.slopes(self._hung.up, self._hung.lifts, moved, rates, by_rate)
        blocks = self._trolley * by_place * self._level - slopes
        for body, block in zip(self._hung.bodies, blocks, strict=True):
            front, spot = self._mesh.frame_local[body]
            fronts[front, spot : spot + 3, spot : spot + 3] += block

    def work(self, state: State) -> float:
        """Of what the lines carry at the start, since then, J."""
        return float(self._hung.lifts @ ((state.place.hung - self._start) @ self._hung.up))

    def kinetic(self, state: State) -> float:
        """Of the trolleys, J."""
        return 0.5 * self._trolley * float(np.sum((state.rate.hung @ self._level) ** 2))
