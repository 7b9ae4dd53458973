"""What pushes, pulls and brakes between the parts of a model, and the faults that strike it.

Each law of ``ringsim.parts`` acts in exudyn's connectors, as exudyn's expression, while a step is
solved, and is evaluated again with numpy for the energy balance.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.faults.family import CableFault
from ringsim.cable.state import ChainState
from ringsim.engine.assembly import SYMBOLIC, TORSION
from ringsim.engine.cables import CableDrive
from ringsim.engine.hanging import Hanging
from ringsim.engine.model import BuiltJoint, Multibody
from ringsim.engine.readings import JointGroup, State
from ringsim.engine.rotations import Array
from ringsim.engine.weight import Weight
from ringsim.layout.layout import Contact, HubNet
from ringsim.layout.pose import turned_about_z
from ringsim.parts.faults.family import AT_ONCE
from ringsim.parts.faults.stuck_vjoint import StuckVJoint
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.net import Net
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
        planes = _opening_joints(model, "stop", 'stop = "none"')
        self._objects = [[self._add(model, *one) for one in plane] for plane in planes]
        self._latched = np.zeros((len(planes), len(planes[0])), dtype=bool)

    def _add(self, model: Multibody, joint: BuiltJoint, sense: float) -> Any:
        def torque(angle: Any, rate: Any, offset: Any) -> Any:
            folded = sense * angle + 0.5 * math.pi
            return sense * self._law.torque(folded, sense * rate, offset > 0.5, SYMBOLIC).total

        quarter = turned_about_z(sense * 0.5 * math.pi)
        markers = model.assembly.node_marker(joint.nodes[0], quarter), joint.markers[1]
        law = model.assembly.symbolic_law(TORSION, ("stop", sense), torque)
        return _torsion(model, markers, **law)

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


class StuckJoint:
    """A V-joint that a fault will hold: a torsion spring that lies inactive until then."""

    def __init__(self, model: Multibody, fault: StuckVJoint) -> None:
        self._law, self._system = fault, model.assembly.system
        self._place = model.scene.structure.planes.index(fault.plane), fault.section - 1
        planes = _opening_joints(model, 'faults of kind "stuck-vjoint"', "faults")
        joint, self._sense = planes[self._place[0]][self._place[1]]
        linear = {"stiffness": fault.stiffness, "damping": fault.damping, "activeConnector": False}
        self._object, self._angle = _torsion(model, joint.markers, **linear), math.nan

    def strike(self, angles: Array) -> None:
        """Hold the joint at the opening angle that it has now."""
        self._angle = float(angles[self._place])
        offset = self._sense * (math.pi - self._angle)
        self._system.SetObjectParameter(self._object, "offset", offset)
        self._system.SetObjectParameter(self._object, "activeConnector", True)

    def reaction(self, state: State, angles: Array, rates: Array) -> tuple[Reaction, Array]:
        """See ``Reacting``."""
        rate = rates[self._place]
        if math.isnan(self._angle):  # the fault has not struck
            return Reaction(0.0, 0.0, 0.0), rate
        return self._law.torque(float(angles[self._place]) - self._angle, rate), rate


class Faults:
    """The faults of a scene, in the order of their times, each struck between two steps.

    ``joints`` are the V-joints that will stick.
    """

    def __init__(self, model: Multibody, drive: CableDrive | None) -> None:
        self._drive = drive
        self._waiting = [
            (fault, StuckJoint(model, fault) if isinstance(fault, StuckVJoint) else None)
            for fault in sorted(model.scene.faults, key=lambda fault: fault.time)
        ]
        self.joints = [joint for _, joint in self._waiting if joint is not None]

    @property
    def next_time(self) -> float:
        """Time of the next fault, s; infinite if there is none left."""
        return self._waiting[0][0].time if self._waiting else math.inf

    def strike(self, time: float, angles: Array, state: ChainState | None) -> bool:
        """Strike all faults that are due, at opening angles (rad) of shape (planes, sections) and
        a state of the cables; returns whether there was one.
        """
        due = [one for one in self._waiting if one[0].time <= time + AT_ONCE]
        del self._waiting[: len(due)]
        for fault, joint in due:
            if joint is not None:
                joint.strike(angles)
            elif isinstance(fault, CableFault) and self._drive is not None and state is not None:
                self._drive.ropes = fault.strike(self._drive.ropes, state)
        return bool(due)


def _opening_joints(model: Multibody, part: str, out: str) -> list[list[tuple[BuiltJoint, float]]]:
    planes = model.openings()
    if not all(planes):
        raise InputError(
            f"{part}: this structure has no joints that open, which would be held: leave it out "
            f"({out})"
        )
    return planes


def _torsion(model: Multibody, markers: Sequence[Any], **settings: Any) -> Any:
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

    def settings(own: JointFriction) -> dict[str, Any]:
        damping = own.linear_damping()
        if damping is not None:
            return {"damping": damping} if damping > 0.0 else {}
        return model.assembly.symbolic_law(
            TORSION, own, lambda _angle, rate, _: own.torque(rate, SYMBOLIC)
        )

    for joint in joints:
        if found := settings(at_section(law, joint.part.section)):
            _torsion(model, joint.markers, **found)
    group = JointGroup(model, joints)
    each = at_section(law, np.array([joint.part.section for joint in joints]))

    def reaction(state: State, _angles: Array, _rates: Array) -> tuple[Reaction, Array]:
        rate = group.rate(state)
        return Reaction(0.0, each.torque(rate), 0.0), rate

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
    mass = item.ObjectMassPoint(nodeNumber=hub, mass=net.hub_mass)
    assembly.bodies.append(assembly.system.AddObject(mass))
    if weight is not None:
        weight.add_point(hub, net.hub_mass)

    def settings(law: Net) -> dict[str, Any]:
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
