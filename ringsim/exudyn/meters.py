"""What is read of every state of a run: energies, stress, the base, corners."""

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import exudyn as exu
import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.core.chain import work_between
from ringsim.exudyn.assembly import Array, Indices, axes_of, cross, spin
from ringsim.exudyn.build import Built
from ringsim.exudyn.cable_path import Direction
from ringsim.exudyn.model import Multibody, State
from ringsim.exudyn.rods import Ancf, beam_section
from ringsim.layout.bodies import InSpace, OnBody
from ringsim.layout.points import points_of
from ringsim.outputs.meters import Bodies, Meters, Places
from ringsim.parts.laws import Switches
from ringsim.rigid.statics import body_reaction, first_reaction
from ringsim.stepping.instant import Energies, Passing, lost_between

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


# Energies of every state, and their balance.


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
            "; the energy balance is unknown, since exudyn does not give the damping energy of "
            "ancf rods: set rods.damping = 0 to have it"
        )
        return unknown if self._untold else ""


# What outputs read of a state, in exudyn.


_CLAMP = _KIND.ForceLocal, _KIND.TorqueLocal
"""Along the axes of the ground's marker, which are those of space."""
_SENSES = np.array([[-1.0, -1.0, -1.0], [-1.0, 1.0, 1.0]])
"""exudyn tells multipliers: those of displacements, and of z_0 . y_1, z_0 . x_1 and x_0 . y_1, the
rates of which are w_x, -w_y and -w_z of the body."""


class FullMeters(Meters):
    """Measures the current state of a model, at what has been read of it."""

    def __init__(self, built: Built, state: State) -> None:
        model = built.model
        super().__init__(model.scene, model.layout)
        self._model, self._state, self._angles = model, state, built.angles
        self._system, size = model.assembly.system, model.assembly.coordinates_of
        self._nodes = np.array([size(node) for _, node in model.bodies])
        clamps = [j.holder for j in model.joints if isinstance(j.part.first, InSpace)]
        self._clamp = clamps[0] if clamps else None
        # All elements have a damper each, in their order, or none has.
        elements = (int(element) for rod in model.rods for element in rod.elements)
        damped = model.scene.rods.damping > 0.0
        self._dampers = {e: k for k, e in enumerate(elements)} if damped else {}
        self._known: dict[Places, tuple[SectionForces, list[int]]] = {}

    @property
    def switches(self) -> Switches:
        """Those of the model."""
        return self._angles.switches

    def bodies(self) -> Bodies:
        """From their nodes' Euler parameters."""
        places, rates = (x[self._nodes] for x in (self._state.position, self._state.velocity))
        return Bodies(places[:, :3], rates[:, :3], axes_of(places[:, 3:7]))

    def accelerations(self) -> Array:
        """Of the nodes; exudyn's solver takes the initial ones over in its first step."""
        data, kind = self._system.systemData, exu.ConfigurationType
        found = data.GetODE2Coordinates_tt(kind.Current if data.GetTime() > 0.0 else kind.Initial)
        return np.asarray(np.asarray(found, dtype=float)[self._nodes[:, :3]])

    def points(self) -> Array:
        """On nodes, and beside the nodes of bodies."""
        where, aside, arms, turning = self._points
        state = self._state
        found = np.stack([state.position[where], state.velocity[where]], axis=1)
        if aside:
            turns = state.position[turning]
            reach = np.einsum("nij,nj->ni", axes_of(turns), arms)
            spins = spin(turns, state.velocity[turning])
            found[aside] += np.stack([reach, cross(spins, reach)], axis=1)
        return found

    def section_forces(self, places: Places, *, damped: bool) -> tuple[Array, Array]:
        """As exudyn tells them, and what the rods' dampers carry."""
        if places not in self._known:
            elements = [int(self._model.rods[rod].elements[k]) for rod, k in places]
            dampers = [self._dampers[element] for element in elements] if self._dampers else []
            self._known[places] = section_forces(self._model, places), dampers
        read, dampers = self._known[places]
        force, torque = read(self._state)
        if damped and dampers:
            carried = self._model.assembly.dampers.latest.forces[dampers].T
            return force + carried[:3], torque + carried[3:]
        return force, torque

    def rod_energy(self) -> float:
        """The elements' own."""
        output = self._system.GetObjectOutputBody
        elements = (element for rod in self._model.rods for element in rod.elements)
        return sum(float(output(element, _KIND.PotentialEnergy)) for element in elements)

    def reaction(self) -> Array | None:
        """What exudyn's clamp of the ground carries, and of a spacecraft what accelerates it."""
        layout = self.layout
        if self.now.time == 0.0:  # the clamp has not been solved for yet
            return first_reaction(layout, self._model.moving)
        if self._clamp is not None:
            found = [self._system.GetObjectOutput(self._clamp, kind) for kind in _CLAMP]
            return np.asarray(_SENSES * found)
        craft, base = layout.spacecraft, layout.base
        if craft is None or base is None:
            return None
        node = self._model.bodies[base][1]
        moving, *turning = (
            np.asarray(self._system.GetNodeOutput(node, kind))
            for kind in (_KIND.Acceleration, _KIND.AngularAcceleration, _KIND.AngularVelocity)
        )
        gravity = np.zeros(3) if layout.gravity is None else layout.gravity
        return body_reaction(craft, self.bodies().axes[base], moving - gravity, *turning)

    def spin(self) -> Array:
        """That of the node that carries the boom's upper end."""
        base = self.layout.base
        assert base is not None
        node = self._model.bodies[base][1]
        return np.asarray(self._system.GetNodeOutput(node, _KIND.AngularVelocity), dtype=float)

    @cached_property
    def _points(self) -> tuple[Indices, list[int], Array, Indices]:
        """Coordinates of all points; which stand aside of their nodes, their arms and turns."""
        model, points = self._model, points_of(self.layout, self.scene.structure.planes)
        nodes, arms = [], []
        for where in points.mounts:
            node, arm = (
                (model.loose[where], np.zeros(3)) if isinstance(where, str)
                else model.side_of(where)
            )  # fmt: skip
            nodes.append(model.assembly.coordinates_of(node))
            arms.append(arm)
        aside = [k for k, arm in enumerate(arms) if arm.any()]
        assert all(isinstance(points.mounts[k], OnBody) for k in aside)
        turns = np.array([nodes[k][3:7] for k in aside], dtype=np.int64).reshape(-1, 4)
        reach = np.array([arms[k] for k in aside]).reshape(-1, 3)
        return np.array([own[:3] for own in nodes]), aside, reach, turns
