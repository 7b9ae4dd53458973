"""What is read of every state of a run: energies, stress, the base, corners."""

import math
from collections.abc import Callable, Sequence
from typing import Any, Self

import exudyn as exu
import numpy as np

from ringsim.cable.chain import ChainState, work_between
from ringsim.exudyn.assembly import Array, axes_of, cross, spin
from ringsim.exudyn.build import Built
from ringsim.exudyn.cable_path import Direction
from ringsim.exudyn.model import Multibody, State
from ringsim.exudyn.rods import Ancf, beam_section
from ringsim.layout.bodies import InSpace, OnBody
from ringsim.layout.points import points_of
from ringsim.outputs.family import Carried, Put
from ringsim.parts.laws import PairLaw
from ringsim.rigid.statics import body_reaction, first_reaction
from ringsim.stepping.instant import Energies, Instant, Passing, lost_between

# Force and moment in the middle of beam elements, by their formulation.
#
# exudyn tells those of geometrically exact elements.  Of those with slope vectors it does not: they
# are evaluated here from the nodes as its element does (Nachbagauer, Gruber and Gerstmayr,
# Structural and continuum mechanics approaches for a 3D shear deformable ANCF beam finite element,
# 2013).  With the means r', y and z of position's derivative and of the slopes in the middle, and
# their derivatives along the element, y' and z',
#
#     e3 = z / \|z\|,   e1 = y x z / \|y x z\|,   e2 = e3 x e1,
#     Gamma = (e1 . r' - 1, e2 . r', e3 . r'),   kappa = 1/2 sum e_k x e_k',
#
# in the axes e, and forces and moments are EA, kGA, kGA and GJ, EI, EI times these.


_KIND = exu.OutputVariableType
SectionForces = Callable[[State], tuple[Array, Array]]
"""Force (N) and moment (N m) in the axes of elements at a state, shape (3, elements) each."""


def section_forces(model: Multibody, places: Sequence[tuple[int, int]]) -> SectionForces:
    """Elastic ones in the middle of elements, each told by its rod and its place in the rod."""
    if isinstance(model.formulation, Ancf):
        return SlopeForces(model, places)
    output = model.assembly.system.GetObjectOutputBody
    elements = [model.rods[rod].elements[k] for rod, k in places]

    def read(state: State) -> tuple[Array, Array]:
        force, moment = (
            np.array([output(e, kind, [0.0] * 3) for e in elements]).T
            for kind in (_KIND.ForceLocal, _KIND.TorqueLocal)
        )
        return force, moment

    return read


class SlopeForces:
    """Those of elements with slope vectors."""

    def __init__(self, model: Multibody, places: Sequence[tuple[int, int]]) -> None:
        where = model.assembly.coordinates_of
        self._where = np.array(
            [[where(node) for node in model.rods[rod].nodes[k : k + 2]] for rod, k in places]
        )
        parts = [model.layout.rods[rod] for rod, _ in places]
        self._lengths = np.array(
            [part.natural_lengths[k] for part, (_, k) in zip(parts, places, strict=True)]
        )[:, None]
        rods = model.scene.rods
        self._stiffness = np.array(
            [np.diag(beam_section(rods, part, 0.0).stiffnessMatrix) for part in parts]
        ).T

    def __call__(self, state: State) -> tuple[Array, Array]:
        """As for ``SectionForces``."""
        first, last = state.position[self._where].swapaxes(0, 1)
        middle, along = 0.5 * (first + last), (last - first) / self._lengths
        y, z = middle[:, 3:6], middle[:, 6:]
        normal = np.cross(y, z)
        normal_along = np.cross(along[:, 3:6], z) + np.cross(y, along[:, 6:])
        e1, e1_along = _unit(normal, normal_along)
        e3, e3_along = _unit(z, along[:, 6:])
        e2, e2_along = np.cross(e3, e1), np.cross(e3_along, e1) + np.cross(e3, e1_along)
        axes = np.stack([e1, e2, e3], axis=1)
        turned = np.stack([e1_along, e2_along, e3_along], axis=1)
        strain = np.einsum("nij,nj->in", axes, along[:, :3])
        strain[0] -= 1.0
        bent = np.einsum("nij,nj->in", axes, 0.5 * np.cross(axes, turned).sum(axis=1))
        return self._stiffness[:3] * strain, self._stiffness[3:] * bent


def _unit(vectors: Array, along: Array) -> tuple[Array, Array]:
    """Unit vectors and their derivatives, from vectors and theirs, shape (n, 3) each."""
    direction = Direction(vectors)
    return direction.unit, np.einsum("nij,nj->ni", direction.first(), along)


# What is read of every state of a run: energies and their balance, stress and bending strain.


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


# What the base carries and how it turns.


class BaseMeter:
    """Reads the base of a model: what exudyn's clamp of the ground carries, and of a spacecraft
    what accelerates it.
    """

    def __init__(self, built: Built) -> None:
        model, layout = built.model, built.model.layout
        self._system, self._layout, self._angles = model.assembly.system, layout, built.angles
        self._first = first_reaction(layout, model.moving)
        self._node = None if layout.base is None else model.bodies[layout.base][1]
        clamps = [j.holder for j in model.joints if isinstance(j.part.first, InSpace)]
        self._clamp = clamps[0] if clamps else None

    def read(self, now: Instant) -> Carried:
        """At the current state."""
        torques = self._angles.switches.torques("stop", np.pi - now.angles, -now.rates)
        return Carried(self._reaction(), self._turn(), torques)

    def _reaction(self) -> Array | None:
        """Shape (2, 3), N and N m; None of a base that floats alone."""
        first, self._first = self._first, None
        if first is not None:  # the clamp has not been solved for yet
            return first
        if self._clamp is not None:
            found = [self._system.GetObjectOutput(self._clamp, kind) for kind in _CLAMP]
            return np.asarray(_SENSES * found)
        craft = self._layout.spacecraft
        if craft is None or self._layout.base is None:
            return None
        kinds = _KIND.Acceleration, _KIND.AngularAcceleration, _KIND.AngularVelocity
        moving, *turning = map(self._output, kinds)
        gravity = np.zeros(3) if self._layout.gravity is None else self._layout.gravity
        return body_reaction(craft, self._axes(), moving - gravity, *turning)

    def _turn(self) -> Array | None:
        """Rotation matrix since the start; None without a base."""
        if self._layout.base is None:
            return None
        return np.asarray(self._axes() @ self._layout.bodies[self._layout.base].pose.axes.T)

    def _axes(self) -> Array:
        return self._output(_KIND.RotationMatrix).reshape(3, 3)

    def _output(self, kind: Any) -> Array:
        return np.asarray(self._system.GetNodeOutput(self._node, kind))


_CLAMP = _KIND.ForceLocal, _KIND.TorqueLocal
"""Along the axes of the ground's marker, which are those of space."""
_SENSES = np.array([[-1.0, -1.0, -1.0], [-1.0, 1.0, 1.0]])
"""exudyn tells multipliers: those of displacements, and of z_0 . y_1, z_0 . x_1 and x_0 . y_1, the
rates of which are w_x, -w_y and -w_z of the body."""


# Places and velocities of a structure's points in exudyn.


class PositionMeter:
    """Reads points on nodes, and those beside the nodes of bodies."""

    def __init__(self, model: Multibody) -> None:
        points = points_of(model.layout, model.scene.structure.planes)
        self.coordinates = points.coordinates
        nodes, arms = [], []
        for where in points.mounts:
            node, arm = (
                (model.loose[where], np.zeros(3)) if isinstance(where, str)
                else model.side_of(where)
            )  # fmt: skip
            nodes.append(model.assembly.coordinates_of(node))
            arms.append(arm)
        assert all(len(nodes[k]) == 7 for k, arm in enumerate(arms) if arm.any())
        self._where = np.array([own[:3] for own in nodes])
        self._aside = [k for k, arm in enumerate(arms) if arm.any()]
        self._arms = np.array([arms[k] for k in self._aside]).reshape(-1, 3)
        turns = [nodes[k][3:7] for k in self._aside]
        self._turns = np.array(turns, dtype=np.int64).reshape(-1, 4)
        assert all(isinstance(points.mounts[k], OnBody) for k in self._aside)

    def read(self, state: State) -> Array:
        """Places (m) and velocities (m/s), shape (points, 2, 3)."""
        found = np.stack([state.position[self._where], state.velocity[self._where]], axis=1)
        if self._aside:
            turns = state.position[self._turns]
            arms = np.einsum("nij,nj->ni", axes_of(turns), self._arms)
            spins = spin(turns, state.velocity[self._turns])
            found[self._aside] += np.stack([arms, cross(spins, arms)], axis=1)
        return found


# Where corners are and what the rods store, in exudyn.


class ShapeMeter:
    """Reads corners and the elastic energy of the rods."""

    def __init__(self, model: Multibody) -> None:
        corners, size = model.layout.corners, model.assembly.coordinates_of
        self._where = np.array([[size(model.bodies[k][1])[:3] for k in plane] for plane in corners])
        self.coordinates = {"corner": np.arange(1, self._where.shape[1] + 1)}
        self._elements = [element for rod in model.rods for element in rod.elements]
        self._output = model.assembly.system.GetObjectOutputBody

    def read(self, state: State) -> Put:
        """At the current state."""
        kind = exu.OutputVariableType.PotentialEnergy
        energy = sum(float(self._output(element, kind)) for element in self._elements)
        return Put(state.position[self._where], energy)


# Accelerations of corners in exudyn.


class AccelerationMeter:
    """Reads the nodes of corners."""

    def __init__(self, model: Multibody) -> None:
        corners, size = model.layout.corners, model.assembly.coordinates_of
        self.coordinates = {"corner": np.arange(1, len(corners[0]) + 1)}
        self._where = np.array([[size(model.bodies[k][1])[:3] for k in plane] for plane in corners])
        self._data = model.assembly.system.systemData
        # exudyn's solver takes the initial ones over in its first step.
        self._next = exu.ConfigurationType.Initial

    def read(self) -> Array:
        """Shape (planes, corners, 3), m/s^2, at the current state."""
        found = self._data.GetODE2Coordinates_tt(self._next)
        self._next = exu.ConfigurationType.Current
        return np.asarray(np.asarray(found, dtype=float)[self._where])


# Tension of a net's cables in exudyn.


class NetMeter:
    """Reads the nodes of all bodies for a law that tells of each of its pairs."""

    def __init__(self, model: Multibody, law: PairLaw) -> None:
        openings = model.layout.openings
        self._law, self._shape = law, (len(openings), len(openings[0]))
        self._where = np.array(
            [model.assembly.coordinates_of(node)[:3] for _, node in model.bodies]
        )

    @classmethod
    def of(cls, model: Multibody) -> Self | None:
        """None without such a law."""
        told = [law for law in model.layout.pair_laws if law.places]
        return cls(model, told[0]) if told else None

    def read(self, state: State) -> Array:
        """Shape (planes, sections), N; NaN in planes without."""
        both = state.position[self._where], state.velocity[self._where]
        return self._law.tensions(*both, self._shape)
