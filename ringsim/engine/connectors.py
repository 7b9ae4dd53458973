"""What pushes, pulls and brakes between the parts of a model.

Each law of ``ringsim.parts`` acts in exudyn's connectors, as exudyn's expression, while a step is
solved, and is evaluated again with numpy for the energy balance.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import SYMBOLIC, TORSION
from ringsim.engine.hanging import Hanging
from ringsim.engine.model import BuiltJoint, Multibody
from ringsim.engine.readings import JointGroup, State
from ringsim.engine.rotations import Array
from ringsim.engine.weight import Weight
from ringsim.layout.layout import Contact, HubNet
from ringsim.layout.points import HUB
from ringsim.layout.pose import turned_about_z
from ringsim.parts.hinge_spring.family import HingeSpring
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.latch import Latch
from ringsim.parts.net.hub import SpringNet
from ringsim.parts.persection import at_section
from ringsim.parts.springs import Reaction
from ringsim.parts.stop.family import Stop
from ringsim.refusal import InputError

Reacting = Callable[[State, Array, Array], tuple[Reaction, Array]]
"""The reactions of one law at all its places, and the rates (m/s or rad/s) that they resist, from
the state, the opening angles and their rates, shape (planes, sections), rad and rad/s."""


def connect(model: Multibody, weight: Weight | None = None) -> list[Reacting]:
    """Springs, contacts, net and friction of a model; before ``Assembly.finish``."""
    layout, found = model.layout, []
    for spring in layout.springs:
        law, ends = spring.law, [model.bodies[k][1] for k in (spring.first, spring.second)]
        linear = {"stiffness": law.stiffness, "damping": law.damping}
        found.append(_strings(model, [ends], law.tension, law.free_length, [linear]))
    found += [_contact(model, contact) for contact in layout.contacts]
    if layout.net is not None:
        found.append(_net(model, layout.net, weight))
    if layout.hung is not None and weight is not None:
        weight.add_lines(layout.hung)
        found.append(Hanging(model, layout.hung).reaction)
    return found + [_friction(model, *one) for one in model.scene.joints.present().items()]


class Stops:
    """A stop on every V-joint, with its latch.

    exudyn measures the angle from the half-open joint, a quarter turn away, so that neither end of
    the range lies near the jump of the measured angle at 180 deg.
    """

    def __init__(self, model: Multibody, stop: Stop) -> None:
        self._law, self._system = stop, model.assembly.system
        planes = opening_joints(model, "stop", 'stop = "none"')
        self._objects = [[self._add(model, *one) for one in plane] for plane in planes]
        self._latched = np.zeros((len(planes), len(planes[0])), dtype=bool)

    def _add(self, model: Multibody, joint: BuiltJoint, sense: float) -> Any:
        def torque(angle: Any, rate: Any, offset: Any) -> Any:
            folded = sense * angle + 0.5 * math.pi
            return sense * self._law.torque(folded, sense * rate, offset > 0.5, SYMBOLIC).total

        quarter = turned_about_z(sense * 0.5 * math.pi)
        markers = model.assembly.node_marker(joint.nodes[0], quarter), joint.markers[1]
        law = model.assembly.symbolic_law(TORSION, ("stop", sense), torque)
        return torsion(model, markers, **law)

    def latch(self, deployed: NDArray[np.bool_]) -> None:
        """Hold these V-joints, (planes, sections), from both sides from now on, if it latches."""
        if self._law.latch:
            for plane, section in np.argwhere(deployed & ~self._latched):
                # A stop has no use for the connector's offset; its law reads it as a switch.
                self._system.SetObjectParameter(self._objects[plane][section], "offset", 1.0)
            self._latched |= deployed

    def reaction(self, _: State | None, angles: Array, rates: Array) -> tuple[Reaction, Array]:
        """See ``Reacting``."""
        return self._law.torque(np.pi - angles, -rates, self._latched), -rates


class Springs:
    """A spring, or the ramp of a latch, in every V-joint; the angle is measured as in ``Stops``."""

    def __init__(self, model: Multibody, part: str, spring: HingeSpring | Latch) -> None:
        self._system = model.assembly.system
        planes = opening_joints(model, part, f'{part} = "none"')
        self._objects = [
            [self._add(model, *one, spring.at(k)) for k, one in enumerate(plane)]
            for plane in planes
        ]
        self._law = spring.at(np.arange(len(planes[0])))
        self._alive = np.ones((len(planes), len(planes[0])))

    def _add(
        self, model: Multibody, joint: BuiltJoint, sense: float, law: HingeSpring | Latch
    ) -> Any:
        def torque(angle: Any, rate: Any, _: Any) -> Any:
            return sense * law.torque(sense * angle + 0.5 * math.pi, SYMBOLIC).elastic

        quarter = turned_about_z(sense * 0.5 * math.pi)
        markers = model.assembly.node_marker(joint.nodes[0], quarter), joint.markers[1]
        return torsion(model, markers, **model.assembly.symbolic_law(TORSION, (law, sense), torque))

    def fail(self, place: tuple[int, int]) -> None:
        """Break the spring of a V-joint, (plane, section)."""
        self._alive[place] = 0.0
        self._system.SetObjectParameter(self._objects[place[0]][place[1]], "activeConnector", False)

    def reaction(self, state: State, angles: Array, rates: Array) -> tuple[Reaction, Array]:
        """See ``Reacting``."""
        reaction = self._law.torque(np.pi - angles)
        return Reaction(*(self._alive * part for part in reaction)), -rates


def opening_joints(model: Multibody, part: str, out: str) -> list[list[tuple[BuiltJoint, float]]]:
    """The V-joints with their senses, by plane; InputError, which names ``part``, without any."""
    planes = model.openings()
    if not all(planes):
        raise InputError(
            f"{part}: this structure has no joints that open, which would be held: leave it out "
            f"({out})"
        )
    return planes


def torsion(model: Multibody, markers: Sequence[Any], **settings: Any) -> Any:
    """A torsion spring-damper about the common z axis of two markers."""
    return model.assembly.system.AddObject(
        item.ObjectConnectorTorsionalSpringDamper(markerNumbers=list(markers), **settings)
    )


def _friction(model: Multibody, family: str, law: JointFriction) -> Reacting:
    """Friction of the joints of a family."""
    joints = [joint for joint in model.joints if joint.part.family == family]
    if not joints:
        known = ", ".join(sorted({joint.part.family for joint in model.joints} - {""}))
        raise InputError(
            f"joints.{family}: this structure has no joint of that family (it has: "
            f'{known or "none"}): leave it out (joints.{family} = "none")'
        )

    dry = []
    for joint in joints:
        damping = at_section(law, joint.part.section).linear_damping()
        if damping is None:
            dry.append(joint)
        elif damping > 0.0:
            torsion(model, joint.markers, damping=damping)

    def each(some: list[BuiltJoint]) -> JointFriction:
        return at_section(law, np.array([joint.part.section for joint in some]))

    if dry:
        model.assembly.dry_joints.add(each(dry), [joint.markers for joint in dry])
    group = JointGroup(model, joints)
    own = each(joints)

    def reaction(state: State, _angles: Array, _rates: Array) -> tuple[Reaction, Array]:
        rate = group.rate(state)
        return Reaction(0.0, own.torque(rate), 0.0), rate

    return reaction


def _net(model: Multibody, held: HubNet, weight: Weight | None) -> Reacting:
    """The net's strings and their hub.

    The hub starts where its strings balance: from anywhere else it would swing for the whole run,
    next to weightless as it is, with the energy of its first stretch.
    """
    assembly, net = model.assembly, held.law
    nodes = [model.bodies[number][1] for number in held.bodies]
    hub = assembly.add_node(
        item.NodePoint(referenceCoordinates=list(held.hub)),
        np.mean([assembly.starts[int(node)][:3] for node in nodes], axis=0),
    )
    model.loose[HUB] = hub
    mass = item.ObjectMassPoint(nodeNumber=hub, mass=net.hub_mass)
    assembly.bodies.append(assembly.system.AddObject(mass))
    if weight is not None:
        weight.add_point(hub, net.hub_mass)

    def settings(law: SpringNet) -> dict[str, Any]:
        if law.two_sided:
            return {"stiffness": law.stiffness, "damping": law.damping}
        return assembly.symbolic_law(
            "ObjectConnectorSpringDamper",
            law,
            lambda stretch, rate, _: law.tension(stretch, rate, SYMBOLIC).total,
        )

    own = [settings(at_section(net, k)) for k in range(len(nodes))]
    each, free = at_section(net, np.arange(len(nodes))), net.neutral_length
    pairs = [(hub, node) for node in nodes]
    return _strings(model, pairs, lambda s, rate: each.tension(s - free, rate), free, own)


def _strings(
    model: Multibody,
    pairs: Sequence[Sequence[Any]],
    law: Callable[[Array, Array], Reaction],
    free_length: float,
    settings: Sequence[dict[str, Any]],
) -> Reacting:
    """Springs with dampers along the lines between pairs of nodes, with exudyn's settings of each.

    ``law`` is the reaction to the lengths (m) and their rates (m/s).
    """
    system = model.assembly.system
    for pair, own in zip(pairs, settings, strict=True):
        ends = [system.AddMarker(item.MarkerNodePosition(nodeNumber=node)) for node in pair]
        system.AddObject(
            item.ObjectConnectorSpringDamper(markerNumbers=ends, referenceLength=free_length, **own)
        )
    places = [[model.assembly.coordinates_of(node)[:3] for node in pair] for pair in pairs]
    near, far = np.array(places).transpose(1, 0, 2)

    def reaction(state: State, _angles: Array, _rates: Array) -> tuple[Reaction, Array]:
        arms, moving = (x[far] - x[near] for x in (state.position, state.velocity))
        lengths = np.linalg.norm(arms, axis=1)
        rates = np.sum(arms * moving, axis=1) / lengths
        return law(lengths, rates), rates

    return reaction


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
