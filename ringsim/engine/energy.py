"""The energy balance of a run: kinetic, elastic, work of the loads, energy lost and put in."""

from __future__ import annotations

import math

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState, work_between
from ringsim.engine.build import Built
from ringsim.engine.readings import State
from ringsim.stepping.instant import Energies

Array = NDArray[np.float64]
_KINETIC = exu.OutputVariableType.KineticEnergy
_POTENTIAL = exu.OutputVariableType.PotentialEnergy
_Passing = tuple[float, Array, Array, ChainState | None]
"""Time (s), damping forces (N, N m) and the rates that they resist (m/s, rad/s), cables."""


class EnergyMeter:
    """Measures the energies of a model.

    Rods and bodies report theirs through exudyn; connectors, loads and losses are evaluated here.
    What damping in the rods takes is read from their dampers; exudyn's slope-vector beams damp
    inside and do not tell, so with damping their balance is unknown (NaN).
    """

    def __init__(self, built: Built) -> None:
        model = built.model
        self._assembly, self._connectors = model.assembly, built.connectors
        self._output = model.assembly.system.GetObjectOutputBody
        self._elements = [element for rod in model.rods for element in rod.elements]
        nodes = [model.joints[joint].nodes[0] for joint, _ in model.layout.forces]
        found = [model.assembly.coordinates_of(node)[:3] for node in nodes]
        self._loaded = np.array(found, dtype=np.int64)
        self._forces = np.array([force for _, force in model.layout.forces])
        self._untold = model.scene.rods.damping > 0.0 and not model.formulation.has_strains
        self._kept: _Passing | None = None
        self._last: _Passing | None = None

    def read(
        self,
        time: float,
        state: State,
        angles: Array,
        rates: Array,
        chain: ChainState | None = None,
    ) -> Energies:
        """Energies at the current state, and what passed since the one that was kept last.

        Parameters
        ----------
        angles, rates
            Opening angles and their rates, shape (planes, sections), rad and rad/s.
        chain
            The cables, if there are any.
        """
        kinetic = sum(self._output(body, _KINETIC) for body in self._assembly.bodies)
        elastic = sum(self._output(element, _POTENTIAL) for element in self._elements)
        moved = (state.position - state.reference)[self._loaded]
        forces, resisted = [np.zeros(0)], [np.zeros(0)]
        for connector in self._connectors:
            reaction, resisting = connector(state, angles, rates)
            elastic += np.sum(reaction.stored)
            forces.append(np.ravel(reaction.damping))
            resisted.append(np.ravel(resisting))
        if chain is not None:
            elastic += chain.elastic_energy.sum()
        self._last = now = time, np.concatenate(forces), np.concatenate(resisted), chain
        driven, lost = self._passed(now)
        work = float(np.sum(self._forces * moved))
        return Energies(float(kinetic), float(elastic), work, lost, driven)

    def keep(self) -> None:
        """Count from the last reading on."""
        self._kept = self._last
        self._assembly.dampers.keep()

    def note(self) -> str:
        """What a run's reason must add about its balance; empty if it is known."""
        if not self._untold:
            return ""
        return (
            "; the energy balance is unknown, since slope-vector rods do not tell what their "
            "damping takes: set rods.damping = 0 to have it"
        )

    def _passed(self, now: _Passing) -> tuple[float, float]:
        """Energy put in by the winches and lost, J: mean force times displacement.

        The displacement of a damper is the mean of its rates times the step, which differs from
        that of generalised-alpha by a hundredth of the rates' change over the step at most.
        """
        time, forces, rates, chain = now
        lost = math.nan if self._untold else self._assembly.dampers.lost(time)
        driven = 0.0
        if self._kept is not None:
            begin, old_forces, old_rates, old_chain = self._kept
            lost += 0.25 * (time - begin) * float((forces + old_forces) @ (rates + old_rates))
            if chain is not None and old_chain is not None:
                driven, lost_in_cables = work_between(old_chain, chain)
                lost += lost_in_cables
        return driven, lost
