"""What is read of every state of a run: energies and their balance, stress and bending strain."""

import math

import exudyn as exu
import numpy as np

from ringsim.cable.state import ChainState, work_between
from ringsim.engine.build import Built
from ringsim.engine.model import Multibody
from ringsim.engine.readings import State
from ringsim.engine.rotations import Array
from ringsim.engine.section_forces import section_forces
from ringsim.stepping.instant import Energies
from ringsim.stepping.losses import Passing, lost_between

_KIND = exu.OutputVariableType


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
        self._elements += model.assembly.beams
        nodes = [model.joints[joint].nodes[0] for joint, _ in model.layout.forces]
        found = [model.assembly.coordinates_of(node)[:3] for node in nodes]
        self._loaded = np.array(found, dtype=np.int64)
        self._forces, self._done = model.forces, 0.0
        self._weight = built.weight
        self._lifted: float | None = None
        self._untold = model.scene.rods.damping > 0.0 and not model.formulation.has_strains
        self._kept: tuple[Passing, ChainState | None] | None = None
        self._last: tuple[Passing, ChainState | None] | None = None

    def read(
        self, time: float, state: State, angles: Array, rates: Array, chain: ChainState | None
    ) -> Energies:
        """Energies at the current state, and what passed since the one that was kept last.

        Opening angles and their rates have the shape (planes, sections), rad and rad/s.
        """
        kinetic = sum(self._output(body, _KIND.KineticEnergy) for body in self._assembly.bodies)
        elastic = self.strain_energy()
        forces, resisted = [np.zeros(0)], [np.zeros(0)]
        for connector in self._connectors:
            reaction, resisting = connector(state, angles, rates)
            elastic += np.sum(reaction.stored)
            forces.append(np.ravel(reaction.damping))
            resisted.append(np.ravel(resisting))
        if chain is not None:
            elastic += chain.elastic_energy.sum()
        passing = Passing(time, np.concatenate(forces), np.concatenate(resisted))
        self._last = passing, chain
        lost = math.nan if self._untold else self._assembly.dampers.lost(time)
        driven = 0.0
        if self._kept is not None:
            before, chain_before = self._kept
            lost += lost_between(before, passing)
            if chain is not None and chain_before is not None:
                driven, lost_in_cables = work_between(chain_before, chain)
                lost += lost_in_cables
        work = self._done + self._work(state)
        return Energies(float(kinetic), float(elastic), work, lost, driven)

    def _work(self, state: State) -> float:
        """Of loads and weight since the start, as they act now, J."""
        work = float(np.sum(self._forces * (state.position - state.begun)[self._loaded]))
        if self._weight is not None:
            done = self._weight.work(state)
            self._lifted = done if self._lifted is None else self._lifted
            work += done - self._lifted
        return work

    def go_on_from(self, work: float, state: State) -> None:
        """Let other forces act from this state on, up to which loads have done so much work, J."""
        self._done = work - self._work(state)

    def strain_energy(self) -> float:
        """Of rods and boom at the current state, J."""
        return sum(float(self._output(each, _KIND.PotentialEnergy)) for each in self._elements)

    def keep(self) -> None:
        """Count from the last reading on."""
        self._kept = self._last
        self._assembly.dampers.keep()

    def note(self) -> str:
        """What a run's reason must add about its balance; empty if it is known."""
        unknown = (
            "; the energy balance is unknown, since slope-vector rods do not tell what their "
            "damping takes: set rods.damping = 0 to have it"
        )
        return unknown if self._untold else ""


class StressMeter:
    """Stress |N| / A + |M| r / I of every rod half: the larger of its two ends.

    Elements have the elastic moment in their middle, the rods' dampers add what damping carries
    there; along it the moment follows the shear force, dM_z/dx = -Q_y and dM_y/dx = Q_z.
    """

    def __init__(self, model: Multibody) -> None:
        self._assembly = model.assembly
        rows = [*model.layout.halves().values()]
        self._shape = len(rows), len(rows[0]), 2
        places, numbers = [], []
        for half in (half for row in rows for half in row):
            part = model.layout.rods[half.rod]
            per_moment = 0.5 * part.tube.outer_diameter / part.tube.second_moment
            for k, end in ((half.first, -0.5), (half.last - 1, 0.5)):
                places.append((half.rod, k))
                numbers.append((end * part.lengths[k], part.tube.area, per_moment))
        # Places of the outer ends from the elements' middles (m); by what force is divided (m^2)
        # and moment multiplied (1/m^3) to give stress.
        self._outside, self._area, self._per_moment = np.array(numbers).T
        # All elements have a damper each, in their order, or none has.
        dampers = {int(e): k for k, e in enumerate(e for rod in model.rods for e in rod.elements)}
        damped = model.scene.rods.damping > 0.0
        elements = [model.rods[rod].elements[k] for rod, k in places]
        self._damped = [dampers[int(e)] for e in elements] if damped else None
        self._carried = section_forces(model, places)

    def read(self, state: State) -> Array:
        """Stresses at the current state, shape (rod halves, sections), Pa."""
        force, torque = self._carried(state)
        if self._damped is not None:
            carried = self._assembly.dampers.latest.forces[self._damped].T
            force, torque = force + carried[:3], torque + carried[3:]
        x = self._outside
        moment = np.hypot(torque[1] + force[2] * x, torque[2] - force[1] * x)
        stress = np.abs(force[0]) / self._area + moment * self._per_moment
        return np.asarray(stress.reshape(self._shape).max(axis=2))


class BendingMeter:
    """Bending strain of a rod's outer fibre at its nodes, on the side of its y axis's negative.

    Where two elements meet their moments differ by what turns the node alone; their mean counts.
    ``stations`` are the nodes' distances from the rod's first end, m.
    """

    def __init__(self, model: Multibody, name: str) -> None:
        number = next(k for k, rod in enumerate(model.layout.rods) if rod.name == name)
        rod = model.layout.rods[number]
        self._lengths = rod.lengths
        self.stations = np.array(rod.stations) * rod.length
        self._carried = section_forces(model, [(number, k) for k in range(len(rod.lengths))])
        self._per_moment = (
            0.5 * rod.tube.outer_diameter / (rod.young_modulus * rod.tube.second_moment)
        )

    def read(self, state: State) -> Array:
        """Strains at the current state, shape (nodes,)."""
        force, torque = self._carried(state)
        change = 0.5 * force[1] * self._lengths
        first, last = torque[2] + change, torque[2] - change
        at_nodes = np.concatenate([first[:1], 0.5 * (first[1:] + last[:-1]), last[-1:]])
        return np.asarray(-self._per_moment * at_nodes)
