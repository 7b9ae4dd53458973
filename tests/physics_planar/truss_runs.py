"""A run of the planar truss and what the tests read from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringsim.scene import Scene
from ringsim.variables import Outcome

DEPLOYED, STOWED = 0.9, 0.1


@dataclass(frozen=True)
class TrussRun:
    """A run and its series: time, cable length, tension of the diagonal span, strain."""

    scene: Scene
    outcome: Outcome

    @property
    def time(self):
        return self.outcome.coordinates["time"]

    @property
    def station(self):
        return self.outcome.coordinates["station"]

    @property
    def length(self):
        return self.outcome.values["cable_length"][0]

    @property
    def tension(self):
        return self.outcome.values["cable_tension"][0, -1]

    @property
    def wound(self):
        return self.outcome.values["wound_length"][0]

    @property
    def strain(self):
        """Shape (stations, times)."""
        return self.outcome.values["bending_strain"]

    def free(self, shortest, longest):
        """Times at which the truss is off its rest, after the first second, in a range of lengths.

        The beams start straight under a loaded spring, so the first second holds a vibration.
        """
        inside = (self.length > shortest) & (self.length < longest)
        return np.flatnonzero(inside & (self.time > 1.0))
