"""The energy balance of a run: kinetic, elastic, work of the loads, power lost."""

from __future__ import annotations

import math
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState
from ringsim.engine.faults import Faults
from ringsim.engine.model import Model
from ringsim.engine.readings import JointGroup, State
from ringsim.engine.work import StepWork
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section
from ringsim.stepping.instant import Energies

Array = NDArray[np.float64]
_KINETIC = exu.OutputVariableType.KineticEnergy
_POTENTIAL = exu.OutputVariableType.PotentialEnergy
Damping = tuple[Array, Array]
"""Damping forces and the rates that they act against."""
_NOTHING: Damping = (np.zeros(0), np.zeros(0))


class EnergyMeter:
    """Measures the energies of a ring model.

    Rods and bodies report theirs through exudyn; stops, net, loads and losses are evaluated
    here.  What damping in the rods takes is read from their dampers; exudyn's slope-vector beams
    damp inside and do not tell, so with damping their balance is unknown (NaN).
    """

    def __init__(self, model: Model, hub: Any, faults: Faults) -> None:
        self._model, self._faults = model, faults
        assembly, layout = model.assembly, model.layout
        place = assembly.coordinates_of
        self._output = assembly.system.GetObjectOutputBody
        self._elements = [element for rod in model.rods for element in rod.elements]
        self._lifts = np.array(
            [place(model.joints[joint].nodes[0])[:3] for joint, _ in layout.forces], dtype=np.int64
        )
        self._forces = np.array([force for _, force in layout.forces])
        self._friction = self._friction_groups()
        self._since = StepWork()
        self._springs = [
            (spring, place(model.bodies[spring.first][1]), place(model.bodies[spring.second][1]))
            for spring in layout.springs
        ]
        self._contacts = [
            (contact, place(model.bodies[contact.body][1])[contact.axis])
            for contact in layout.contacts
        ]
        if layout.net is not None:
            self._corners = np.array([place(model.bodies[b][1])[:3] for b in layout.net.bodies])
            self._hub = place(hub)[:3]

    def read(
        self,
        time: float,
        state: State,
        angles: Array,
        rates: Array,
        latched: Array,
        chain: ChainState | None = None,
    ) -> Energies:
        """Energies at the current state, and what passed since the one that was kept last.

        Parameters
        ----------
        angles, rates, latched
            Opening angles, their rates and whether the latches hold, shape (2, sections).
        chain
            The cables, if there are any.

        """
        kinetic = sum(self._output(body, _KINETIC) for body in self._model.assembly.bodies)
        elastic = float(sum(self._output(element, _POTENTIAL) for element in self._elements))
        moved = (state.position - state.reference)[self._lifts]
        in_stops, stop_damping = self._stop_energy(angles, rates, latched)
        damped = [stop_damping]
        for law, group in self._friction:
            rate = group.rate(state)
            damped.append((law.torque(rate), rate))
        stored, net_damping = self._net_energy(state)
        stuck, stuck_damping = self._faults.stuck_energy(angles, rates)
        inside, spring_damping = self._spring_energy(state)
        damped += [net_damping, stuck_damping, spring_damping]
        elastic += inside + stored + stuck + in_stops
        if chain is not None:
            elastic += float(chain.elastic_energy.sum())
        passed = self._since.since(
            time,
            np.concatenate([force for force, _ in damped]),
            np.concatenate([rate for _, rate in damped]),
            chain,
        )
        return Energies(
            float(kinetic),
            elastic,
            float(np.sum(self._forces * moved)),
            passed.lost + self._lost_in_rods(time),
            passed.driven,
        )

    def keep(self) -> None:
        """Count from the last reading on."""
        self._since.keep()
        self._model.assembly.dampers.keep()

    def note(self) -> str:
        """What a run's reason must add about its balance; empty if it is known."""
        if not self._untold:
            return ""
        return (
            "; the energy balance is unknown, since slope-vector rods do not tell what their "
            "damping takes: set rods.damping = 0 to have it"
        )

    @property
    def _untold(self) -> bool:
        return self._model.scene.rods.damping > 0.0 and not self._model.formulation.has_strains

    def _lost_in_rods(self, time: float) -> float:
        model = self._model
        if self._untold:
            return math.nan
        return model.assembly.dampers.lost(model.assembly.system, time)

    def _friction_groups(self) -> list[tuple[JointFriction, JointGroup]]:
        found = []
        for family, law in self._model.scene.joints.present().items():
            joints = [joint for joint in self._model.joints if joint.family == family]
            group = JointGroup(self._model, joints)
            found.append((at_section(law, group.sections), group))
        return found

    def _stop_energy(self, angles: Array, rates: Array, latched: Array) -> tuple[float, Damping]:
        stop = self._model.scene.stop
        if stop is None:
            return 0.0, _NOTHING
        reaction = stop.torque(np.pi - angles, -rates, latched)
        return float(np.sum(reaction.stored)), (reaction.damping.ravel(), -rates.ravel())

    def _spring_energy(self, state: State) -> tuple[float, Damping]:
        """Energy in springs and contacts of the structure, J, and their damping."""
        found, rates = [], []
        for spring, near, far in self._springs:
            arm = (state.position[far] - state.position[near])[:3]
            length = float(np.linalg.norm(arm))
            rates.append(float((state.velocity[far] - state.velocity[near])[:3] @ arm) / length)
            found.append(spring.law.tension(length, rates[-1]))
        for contact, where in self._contacts:
            rates.append(-float(state.velocity[where]))
            found.append(contact.law.push(contact.room - float(state.position[where]), rates[-1]))
        stored = float(sum(one.stored for one in found))
        return stored, (np.array([one.damping for one in found]), np.array(rates))

    def _net_energy(self, state: State) -> tuple[float, Damping]:
        net = self._model.scene.net
        if net is None:
            return 0.0, _NOTHING
        arms = state.position[self._corners] - state.position[self._hub]
        moving = state.velocity[self._corners] - state.velocity[self._hub]
        lengths = np.linalg.norm(arms, axis=1)
        stretch, rate = lengths - net.neutral_length, np.sum(arms * moving, axis=1) / lengths
        tension = at_section(net, np.arange(len(arms))).tension(stretch, rate)
        return float(np.sum(tension.stored)), (tension.damping, rate)
