"""Whether a step that Newton has solved is good enough, and how long the next one may be."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState
from ringsim.engine.build import Built
from ringsim.engine.energy_control import EnergyControl
from ringsim.engine.scales import slight_energy, usual_energy
from ringsim.engine.tension_control import TensionControl
from ringsim.outputs.instant import Energies
from ringsim.outputs.recorder import History

Array = NDArray[np.float64]


class Reading(NamedTuple):
    """The state at the end of a step: time (s), angles (rad), rates (rad/s), energies, cables."""

    time: float
    angles: Array
    rates: Array
    energies: Energies
    chain: ChainState | None


class StepJudge:
    """Judges steps by their energy balance and, with cables, by how tensions bend.

    Tensions are judged until the last V-joint has locked: what they do afterwards is not in any
    result but the series.

    Attributes
    ----------
    locked
        Whether all V-joints have reached their stops.
    """

    def __init__(self, built: Built) -> None:
        scene, cables = built.ring.scene, built.cables
        self.locked = False
        slight = usual_energy(scene) if cables is None else slight_energy(cables)
        self._energy = EnergyControl(scene.solver, slight, tireless=cables is not None)
        self._tension: TensionControl | None = None
        if cables is not None:
            widest = max(cable.slack_width for cable in cables.chain.cables)
            self._tension = TensionControl(scene.solver, widest)

    @property
    def limit(self) -> float:
        """Largest next step, s."""
        tension = math.inf if self._tension is None or self.locked else self._tension.limit
        return min(self._energy.limit, tension)

    def shorter(self, taken: History, found: Reading) -> float | None:
        """A smaller step in s to repeat the one to ``found`` with; None if it is good enough."""
        step = found.time - taken.times[-1]
        wanted = [self._energy.shorter(step, taken.energies[-1], found.energies)]
        if self._tension is not None and found.chain is not None and not self.locked:
            wanted.append(self._tension.shorter(step, taken.tensions[-1], found.chain.tensions))
        return min((one for one in wanted if one is not None), default=None)

    def accept(self, taken: History, found: Reading) -> None:
        """Learn from a step that is taken, before it is noted among them."""
        step = found.time - taken.times[-1]
        self._energy.accept(step, taken.energies[-1], found.energies)
        if self._tension is not None and found.chain is not None:
            self._tension.accept(step, taken.tensions[-1], found.chain.tensions)

    def note(self) -> str:
        """What a run's reason must add about this; empty if every step was judged."""
        return self._energy.note()
