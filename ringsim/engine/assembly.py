"""The growing model: nodes with their initial accelerations, bodies, markers."""

from collections.abc import Callable, Hashable
from types import SimpleNamespace
from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from exudyn.advancedUtilities import CreateSymbolicUserFunction

from ringsim.engine.dry_joints import DryJoints
from ringsim.engine.rod_dampers import RodDampers
from ringsim.engine.rotations import Array, Indices, turn_of, turn_rates
from ringsim.layout.pose import Pose

_SAME, _ORIGIN = np.eye(3), np.zeros(3)
exu.config.printToConsole = False

SYMBOLIC = SimpleNamespace(
    minimum=exu.symbolic.min,
    maximum=exu.symbolic.max,
    where=exu.symbolic.IfThenElse,
    **{name: getattr(exu.symbolic, name) for name in ("tanh", "exp", "sqrt", "abs", "sign")},
)
"""What a law of ``ringsim.parts`` takes as its ``xp``: numpy's names for exudyn's functions."""

TORSION = "ObjectConnectorTorsionalSpringDamper"


class Assembly:
    """An exudyn system under construction.

    Attributes
    ----------
    size
        Number of coordinates of the nodes so far.
    starts
        Accelerations (m/s^2, 1/s^2) at which coordinates start, by node, in the nodes' order.
    bodies
        Objects with kinetic energy.
    beams
        Elements with potential energy that are no rods'.
    rigid_nodes, dampers, dry_joints
        Nodes with Euler parameters, dampers of the rods, and joints with dry friction.
    """

    def __init__(self) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.starts: dict[int, Array] = {}
        self.bodies: list[Any] = []
        self.beams: list[Any] = []
        self.rigid_nodes: list[Any] = []
        self.dampers = RodDampers(self.system)
        self.dry_joints = DryJoints(self.system)
        self._laws: dict[Hashable, Any] = {}
        self._places: dict[int, Indices] = {}
        self.size = 0

    def add_node(self, node: Any, acceleration: Array) -> Any:
        """A node whose coordinates have an initial acceleration, shape (coordinates,)."""
        number = self.system.AddNode(node)
        self.starts[int(number)] = acceleration
        self._places[int(number)] = np.arange(self.size, self.size + len(acceleration))
        self.size += len(acceleration)
        return number

    def coordinates_of(self, node: Any) -> Indices:
        """Indices of a node's coordinates in the system vector: exudyn keeps the nodes' order."""
        return self._places[int(node)]

    def add_rigid_node(self, pose: Pose, natural: Pose | None = None) -> Any:
        """A node with Euler parameters, of a body at rest: the pose's rates are accelerations.

        Elements are free of strain where their nodes are at their ``natural`` poses.
        """
        turn = turn_of(pose.axes)
        turning = turn_rates(turn[None], pose.turn[None])[0]
        made = item.NodeRigidBodyEP(referenceCoordinates=[*pose.place, *turn])
        if natural is not None:
            reference = np.concatenate([natural.place, turn_of(natural.axes)])
            # Of the two quaternions of a rotation the one that is near the reference.
            same = np.copysign(1.0, turn @ reference[3:])
            turning = same * turning
            made.referenceCoordinates = reference.tolist()
            made.initialCoordinates = [
                *(pose.place - reference[:3]),
                *(same * turn - reference[3:]),
            ]
        node = self.add_node(made, np.concatenate([pose.rate, turning]))
        self.rigid_nodes.append(node)
        return node

    def add_body(self, node: Any, mass: float, inertia: Array, centre: Array = _ORIGIN) -> Any:
        """A rigid body on a rigid node, in its axes.

        ``inertia`` is the tensor about the node, shape (3, 3), kg m^2, and ``centre`` the centre
        of mass, shape (3,), m.
        """
        terms = inertia[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
        body = self.system.AddObject(
            item.ObjectRigidBody(
                nodeNumber=node, mass=mass, inertia=list(terms), centerOfMass=list(centre)
            )
        )
        if mass > 0.0:
            self.bodies.append(body)
        return body

    def body_marker(self, body: Any, place: Array, axes: Array = _SAME) -> Any:
        """A marker with position and orientation on a body, in body coordinates."""
        frame = exu.HT(rotation=axes, translation=list(place))
        return self.system.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localHT=frame))

    def node_marker(self, node: Any, axes: Array = _SAME) -> Any:
        """A marker with position and orientation on a node."""
        frame = exu.HT(rotation=axes, translation=list(_ORIGIN))
        return self.system.AddMarker(item.MarkerNodeRigid(nodeNumber=node, localHT=frame))

    def symbolic_law(
        self, kind: str, key: Hashable, law: Callable[[Any, Any, Any], Any]
    ) -> dict[str, Any]:
        """The setting that gives a spring-damper connector (a type of exudyn's) its law, a force or
        torque from displacement (angle), rate and last parameter; equal keys share one.
        """

        def function(
            mbs: Any, t: Any, item: Any, x: Any, rate: Any, stiffness: Any, damping: Any, last: Any
        ) -> Any:
            return law(x, rate, last)

        argument = "springTorqueUserFunction" if kind == TORSION else "springForceUserFunction"
        if key not in self._laws:
            self._laws[key] = CreateSymbolicUserFunction(
                self.system, function, argument, itemTypeName=kind
            )
        return {argument: self._laws[key]}

    def finish(self) -> None:
        """Assemble the system and set its initial accelerations."""
        self.system.Assemble()
        data = self.system.systemData
        start = np.zeros(data.ODE2Size())
        start[: self.size] = np.concatenate([*self.starts.values()])
        data.SetODE2Coordinates_tt(start, exu.ConfigurationType.Initial)
