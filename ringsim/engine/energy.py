"""The energy balance of a run: kinetic, elastic, work of the loads, power lost."""

from __future__ import annotations

import math

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState
from ringsim.engine.faults import Faults
from ringsim.engine.joints import friction_torque, stop_torque
from ringsim.engine.net import HubNet, net_forces
from ringsim.engine.pantograph_ring import RingModel
from ringsim.engine.readings import JointGroup, State
from ringsim.engine.work import StepWork
from ringsim.outputs.instant import Energies
from ringsim.parts.joints import JointFriction

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

    def __init__(self, model: RingModel, net: HubNet | None, forces: Array, faults: Faults) -> None:
        self._model, self._net, self._forces, self._faults = model, net, forces, faults
        assembly = model.assembly
        self._output = assembly.system.GetObjectOutputBody
        self._elements = [e for rods in model.rods.values() for rod in rods for e in rod.elements]
        self._lifts = np.array(
            [[assembly.coordinates_of(j.gap[0])[2] for j in plane] for plane in model.vjoints]
        )
        self._friction = self._friction_groups()
        self._since = StepWork()
        if net is not None:
            self._corners = np.array(
                [assembly.coordinates_of(node)[:3] for _, node in model.hinges[0]]
            )
            self._hub = assembly.coordinates_of(net.hub)[:3]

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
        lifted = (state.position - state.reference)[self._lifts]
        damped = [self._stop_damping(angles, rates, latched)]
        for law, group, sections in self._friction:
            rate = group.rate(state)
            damped.append((friction_torque(law, group.sections, sections, rate), rate))
        stored, net_damping = self._net_energy(state)
        stuck, stuck_damping = self._faults.stuck_energy(angles, rates)
        damped += [net_damping, stuck_damping]
        elastic += stored + stuck + self._stored_in_stops(angles, latched)
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
            float(np.sum(self._forces * lifted)),
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

    def _friction_groups(self) -> list[tuple[JointFriction, JointGroup, int]]:
        laws = self._model.scene.joints
        found = []
        for family, law in (("pivot", laws.pivot), ("hinge", laws.hinge), ("vjoint", laws.vjoint)):
            if law is not None:
                joints = [joint for joint in self._model.joints if joint.family == family]
                group = JointGroup(self._model, joints)
                found.append((law, group, self._model.geometry.sections))
        return found

    def _stored_in_stops(self, angles: Array, latched: Array) -> float:
        stop = self._model.scene.stop
        if stop is None:
            return 0.0
        folded = np.pi - angles
        stowed = np.pi - np.radians(stop.stowed_angle)
        ends = np.maximum(-folded, 0.0) + np.maximum(folded - stowed, 0.0)
        return 0.5 * stop.stiffness * float(np.sum(np.where(latched, folded, ends) ** 2))

    def _stop_damping(self, angles: Array, rates: Array, latched: Array) -> Damping:
        stop = self._model.scene.stop
        if stop is None:
            return _NOTHING
        folded, turning = np.pi - angles, -rates
        spring = stop_torque(stop, folded, np.zeros_like(turning), latched)
        torque = stop_torque(stop, folded, turning, latched)
        return (torque - spring).ravel(), turning.ravel()

    def _net_energy(self, state: State) -> tuple[float, Damping]:
        net = self._model.scene.net
        if self._net is None or net is None:
            return 0.0, _NOTHING
        arms = state.position[self._corners] - state.position[self._hub]
        moving = state.velocity[self._corners] - state.velocity[self._hub]
        lengths = np.linalg.norm(arms, axis=1)
        stretch, rate = lengths - net.neutral_length, np.sum(arms * moving, axis=1) / lengths
        spring, damper = net_forces(
            stretch, rate, self._net.stiffness, net.damping, two_sided=net.two_sided
        )
        return 0.5 * float(np.sum(spring * stretch)), (damper, rate)
