"""What pushes, pulls and brakes between the parts of a model."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import exudyn.itemInterface as item
import numpy as np

from ringsim.exudyn.assembly import SYMBOLIC, TORSION, Array, Assembly, axes_of
from ringsim.exudyn.model import BuiltJoint, JointGroup, Multibody, State
from ringsim.layout.bodies import turned_about_z
from ringsim.layout.layout import Contact, Hung
from ringsim.layout.points import HUB
from ringsim.parts.laws import FREE_HUB, AngleLaw, PairLaw, Reaction, Rub, Switches
from ringsim.units import at_section

# Lines that carry corners, and their trolleys, as objects on the corners' nodes.


class Hanging:
    """Mass, stiffness, constant force and friction on the places of bodies; see ``Offload``."""

    def __init__(self, model: Multibody, hung: Hung) -> None:
        self._hung = hung
        assembly, law, up = model.assembly, hung.law, hung.up
        along, level = np.zeros((7, 7)), np.zeros((7, 7))
        along[:3, :3] = np.outer(up, up)
        level[:3, :3] = np.eye(3) - along[:3, :3]
        for body, lift in zip(hung.bodies, hung.lifts.tolist(), strict=True):
            rub = (
                {} if law.friction == 0.0 else {"forceUserFunction": _trolley_friction(hung, lift)}
            )
            line = item.ObjectGenericODE2(
                nodeNumbers=[model.bodies[body][1]],
                massMatrix=law.trolley_mass * level,
                stiffnessMatrix=law.stiffness * along,
                forceVector=[*(lift * up), *[0.0] * 4],
                **rub,
            )
            number = assembly.system.AddObject(line)
            if law.trolley_mass > 0.0:
                assembly.bodies.append(number)
        nodes = [model.bodies[body][1] for body in hung.bodies]
        self._where = np.array([assembly.coordinates_of(node)[:3] for node in nodes])

    def reaction(self, state: State, _angles: Array, _rates: Array) -> tuple[Reaction, Array]:
        """See ``ringsim.exudyn.laws.Reacting``."""
        moved = (state.position - state.begun)[self._where]
        rates = state.velocity[self._where]
        found = self._hung.law.hold(self._hung.up, self._hung.lifts, moved, rates)
        return Reaction(0.0, -found.friction, found.stored), rates


def _trolley_friction(hung: Hung, lift: float) -> Any:
    """What exudyn calls for a trolley's friction."""
    lifts = np.array([lift])

    def force(_mbs: Any, _t: float, _item: int, q: Any, q_t: Any) -> list[float]:
        moved, rates = np.array([q[:3]]), np.array([q_t[:3]])
        found = hung.law.hold(hung.up, lifts, moved, rates)
        return [*found.friction[0].tolist(), 0.0, 0.0, 0.0, 0.0]

    return force


# Weight of all masses of a model, and its work.


class Weight:
    """Loads in a uniform field, in a model before it is assembled.

    An element that is straight between two nodes weighs on each by half.
    """

    def __init__(self, model: Multibody, gravity: Array) -> None:
        self._assembly, self._gravity = model.assembly, gravity
        self._masses: list[float] = []
        self._places: list[Any] = []
        for part, rod in zip(model.layout.rods, model.rods, strict=True):
            own = np.zeros(len(rod.nodes))
            shares = 0.5 * part.density * part.tube.area * part.lengths
            own[:-1] += shares
            own[1:] += shares
            for station, mass, _ in part.masses:
                own[station] += mass
            for node, mass in zip(rod.nodes, own.tolist(), strict=True):
                self.add_point(node, mass)
        bodies = model.layout.bodies
        for body, (number, _) in zip(bodies, model.bodies, strict=True):
            self._load(model.assembly.body_marker(number, body.centre), body.mass)
        self._bodies = np.array([b.mass for b in bodies]), np.array([b.centre for b in bodies])
        self._where = np.array([model.assembly.coordinates_of(node) for _, node in model.bodies])

    def add_point(self, node: Any, mass: float) -> None:
        """A mass (kg) at a node."""
        marker = item.MarkerNodePosition(nodeNumber=node)
        self._load(self._assembly.system.AddMarker(marker), mass)
        self._masses.append(mass)
        self._places.append(self._assembly.coordinates_of(node)[:3])

    def add_beam(self, cables: list[Any], nodes: list[Any], mass: float, length: float) -> None:
        """ANCF cables of a length (m) between nodes; ``mass`` is that of each, kg.

        Their cubic curves have the mean place (x_1 + x_2) / 2 + L (s_1 - s_2) / 12, with slopes s.
        """
        system, load = self._assembly.system, item.LoadMassProportional
        for k, cable in enumerate(cables):
            marker = system.AddMarker(item.MarkerBodyMass(bodyNumber=cable))
            system.AddLoad(load(markerNumber=marker, loadVector=list(self._gravity)))
            for node, sign in zip(nodes[k : k + 2], (1.0, -1.0), strict=True):
                where = self._assembly.coordinates_of(node)
                self._masses += [0.5 * mass, sign * mass * length / 12.0]
                self._places += [where[:3], where[3:6]]

    def add_lines(self, hung: Hung) -> None:
        """Count the work of what lines carry: as much less mass that weighs."""
        for place, lift in zip(hung.bodies, hung.lifts.tolist(), strict=True):
            self._masses.append(-lift / float(np.linalg.norm(self._gravity)))
            self._places.append(self._where[place, :3])

    def work(self, state: State) -> float:
        """Up to a constant, J."""
        masses, centres = self._bodies
        turned = np.einsum("nij,nj->ni", axes_of(state.position[self._where[:, 3:7]]), centres)
        moments = masses @ (state.position[self._where[:, :3]] + turned)
        moments += np.array(self._masses) @ state.position[np.array(self._places)]
        return float(moments @ self._gravity)

    def _load(self, marker: Any, mass: float) -> None:
        force = partial(item.LoadForceVector, loadVector=list(mass * self._gravity))
        self._assembly.system.AddLoad(force(markerNumber=marker))


# What pushes, pulls and brakes between the parts of a model.
#
# Each law of ``ringsim.parts`` acts in exudyn's connectors, as exudyn's expression, while a step is
# solved, and is evaluated again with numpy for the energy balance.


Reacting = Callable[[State, Array, Array], tuple[Reaction, Array]]
"""The reactions of one law at all its places, and the rates (m/s or rad/s) that they resist, from
the state, the opening angles and their rates, shape (planes, sections), rad and rad/s."""


def connect(model: Multibody, weight: Weight | None = None) -> list[Reacting]:
    """Springs, contacts, net and friction of a model; before ``Assembly.finish``."""
    layout = model.layout
    if layout.hub is not None:
        _add_hub(model, weight)
    found: list[Reacting] = [PairForces(model, law).reaction for law in layout.pair_laws]
    found += [_contact(model, contact) for contact in layout.contacts]
    if layout.hung is not None and weight is not None:
        weight.add_lines(layout.hung)
        found.append(Hanging(model, layout.hung).reaction)
    return found + [_friction(model, rub) for rub in layout.rubs]


class AngleForces:
    """All laws on V-joints, as torsion springs with exudyn's expressions of them.

    exudyn measures the angle from the half-open joint, a quarter turn away, so that neither end of
    the range lies near the jump of the measured angle at 180 deg.  A law's ``setting`` is the
    connector's offset, for which a torque of an expression has no other use.
    """

    def __init__(self, model: Multibody) -> None:
        self.switches, self._system = Switches(model.layout.angle_laws), model.assembly.system
        openings = model.openings()
        self._objects = [
            [self._add(model, law, k, *openings[p][n]) for k, (p, n) in enumerate(law.places)]
            for law in self.switches.laws
        ]
        self._given = [self._now(number) for number in range(len(self._objects))]

    def _add(self, model: Multibody, law: AngleLaw, k: int, joint: BuiltJoint, sense: float) -> Any:
        own = law.record.at(law.places[k][1])

        def torque(angle: Any, rate: Any, setting: Any) -> Any:
            folded = sense * angle + 0.5 * math.pi
            return sense * own.reaction(folded, sense * rate, setting, SYMBOLIC).total

        quarter = turned_about_z(sense * 0.5 * math.pi)
        markers = model.assembly.node_marker(joint.nodes[0], quarter), joint.markers[1]
        expression = model.assembly.symbolic_law(TORSION, (own, sense), torque)
        active, offset = bool(law.on[k]), float(law.setting[k])
        return torsion(model, markers, activeConnector=active, offset=offset, **expression)

    def follow(self) -> None:
        """Tell exudyn what faults and latches have changed; due after each change."""
        for number, objects in enumerate(self._objects):
            given, now = self._given[number], self._now(number)
            for k in np.flatnonzero((given != now).any(axis=0)):
                self._system.SetObjectParameter(objects[k], "activeConnector", bool(now[0, k]))
                self._system.SetObjectParameter(objects[k], "offset", float(now[1, k]))
            self._given[number] = now

    def reaction(self, number: int) -> Reacting:
        """That of a law."""

        def reacting(_: State, angles: Array, rates: Array) -> tuple[Reaction, Array]:
            law = self.switches.laws[number]
            resisted = -rates[tuple(np.array(law.places).T)]
            return self.switches.reaction(number, np.pi - angles, -rates), resisted

        return reacting

    def _now(self, number: int) -> Array:
        return np.array([self.switches.on[number], self.switches.setting[number]])


def torsion(model: Multibody, markers: Sequence[Any], **settings: Any) -> Any:
    """A torsion spring-damper about the common z axis of two markers."""
    return model.assembly.system.AddObject(
        item.ObjectConnectorTorsionalSpringDamper(markerNumbers=list(markers), **settings)
    )


def _friction(model: Multibody, rub: Rub) -> Reacting:
    """Friction of the joints of a family."""
    joints = [model.joints[number] for number in rub.joints]
    dry = []
    for k, joint in enumerate(joints):
        damping = at_section(rub.law, int(rub.sections[k])).linear_damping()
        if damping is None:
            dry.append(k)
        elif damping > 0.0:
            torsion(model, joint.markers, damping=damping)
    if dry:
        model.assembly.dry_joints.add(rub.of(dry), [joints[k].markers for k in dry])
    group, own = JointGroup(model, joints), rub.of(slice(None))

    def reaction(state: State, _angles: Array, _rates: Array) -> tuple[Reaction, Array]:
        rate = group.rate(state)
        return Reaction(0.0, own.torque(rate), 0.0), rate

    return reaction


def _add_hub(model: Multibody, weight: Weight | None) -> None:
    """The hub of a net, a point with mass.

    It starts where its strings balance: from anywhere else it would swing for the whole run, next
    to weightless as it is, with the energy of its first stretch.
    """
    assembly, hub = model.assembly, model.layout.hub
    assert hub is not None
    ends = [body for law in model.layout.pair_laws if law.hung for body in law.bodies[:, 1]]
    nodes = [model.bodies[body][1] for body in ends]
    node = assembly.add_node(
        item.NodePoint(referenceCoordinates=list(hub.place)),
        np.mean([assembly.starts[int(node)][:3] for node in nodes], axis=0),
    )
    model.loose[HUB] = node
    mass = item.ObjectMassPoint(nodeNumber=node, mass=hub.mass)
    assembly.bodies.append(assembly.system.AddObject(mass))
    if weight is not None:
        weight.add_point(node, hub.mass)


class PairForces:
    """A law between bodies, as exudyn's springs with dampers between their nodes."""

    def __init__(self, model: Multibody, law: PairLaw) -> None:
        self._law, assembly = law, model.assembly
        nodes = [[_node(model, body) for body in pair] for pair in law.bodies.tolist()]
        for k, pair in enumerate(nodes):
            ends = [assembly.system.AddMarker(item.MarkerNodePosition(nodeNumber=n)) for n in pair]
            natural = float(law.natural[k])
            settings = self._settings(assembly, int(law.sections[k]), natural)
            assembly.system.AddObject(
                item.ObjectConnectorSpringDamper(
                    markerNumbers=ends, referenceLength=natural, **settings
                )
            )
        places = [[assembly.coordinates_of(node)[:3] for node in pair] for pair in nodes]
        self._first, self._second = np.array(places).transpose(1, 0, 2)

    def _settings(self, assembly: Assembly, section: int, natural: float) -> dict[str, Any]:
        own = self._law.record.at(section)
        if (linear := own.linear()) is not None:
            return dict(zip(("stiffness", "damping"), linear, strict=True))
        return assembly.symbolic_law(
            "ObjectConnectorSpringDamper",
            (own, natural),
            lambda stretch, rate, _: own.reaction(stretch, rate, natural, SYMBOLIC).total,
        )

    def reaction(self, state: State, _angles: Array, _rates: Array) -> tuple[Reaction, Array]:
        """See ``Reacting``."""
        arms, moving = (x[self._second] - x[self._first] for x in (state.position, state.velocity))
        lengths = np.linalg.norm(arms, axis=1)
        rates = np.sum(arms * moving, axis=1) / lengths
        return self._law.reaction(lengths, rates), rates


def _node(model: Multibody, body: int) -> Any:
    return model.loose[HUB] if body == FREE_HUB else model.bodies[body][1]


def _contact(model: Multibody, contact: Contact) -> Reacting:
    """One-sided contact of a body with a plane."""
    law, system, node = contact.law, model.assembly.system, model.bodies[contact.body][1]
    markers = [
        system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=end, coordinate=contact.axis))
        for end in (system.AddNode(item.NodePointGround()), node)
    ]
    settings = model.assembly.symbolic_law(
        "ObjectConnectorCoordinateSpringDamper",
        law,
        lambda moved, rate, room: -law.push(room - moved, -rate, SYMBOLIC).total,
    )
    start = float(model.layout.bodies[contact.body].pose.place[contact.axis])
    system.AddObject(
        item.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=markers, offset=contact.room - start, **settings
        )
    )
    where = model.assembly.coordinates_of(node)[contact.axis]

    def reaction(state: State, _angles: Array, _rates: Array) -> tuple[Reaction, Array]:
        closer = -state.velocity[where]
        return law.push(contact.room - state.position[where], closer), closer

    return reaction
