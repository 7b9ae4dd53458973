"""The growing model: nodes with their initial accelerations, markers, joints, symbolic laws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from exudyn.advancedUtilities import CreateSymbolicUserFunction
from numpy.typing import NDArray

from ringsim.engine.rod_dampers import RodDampers
from ringsim.engine.rotations import turn_of, turn_rates

Array = NDArray[np.float64]
exu.config.printToConsole = False


@dataclass(frozen=True)
class Frame:
    """A body-fixed frame at rest with the acceleration at which it starts to move.

    Attributes
    ----------
    position, axes
        Origin, shape (3,), and axes as columns, shape (3, 3), in global coordinates.
    acceleration, turn
        Initial acceleration of the origin and angular acceleration, shape (3,), m/s^2, rad/s^2.

    """

    position: Array
    axes: Array
    acceleration: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: np.zeros(3))


@dataclass
class Assembly:
    """An exudyn system under construction.

    Attributes
    ----------
    system
        exudyn's MainSystem.
    starts
        Initial accelerations of coordinates by node number.
    bodies
        Objects with kinetic energy and, where elastic, potential energy.
    rigid_nodes
        Nodes with Euler parameters.
    dampers
        Dampers of the rods.

    """

    container: Any = field(default_factory=exu.SystemContainer)
    system: Any = None
    starts: dict[int, Array] = field(default_factory=dict)
    bodies: list[Any] = field(default_factory=list)
    rigid_nodes: list[Any] = field(default_factory=list)
    dampers: RodDampers = field(default_factory=RodDampers)
    _laws: dict[Any, Any] = field(default_factory=dict)
    _ground: Any = None

    def __post_init__(self) -> None:
        if self.system is None:
            self.system = self.container.AddSystem()

    def add_rigid_node(self, frame: Frame) -> Any:
        """A node with Euler parameters."""
        turn = turn_of(frame.axes)
        node = self.system.AddNode(
            item.NodeRigidBodyEP(referenceCoordinates=[*frame.position, *turn])
        )
        turning = turn_rates(turn[None], frame.turn[None])[0]
        self.starts[int(node)] = np.concatenate([frame.acceleration, turning])
        self.rigid_nodes.append(node)
        return node

    def add_body(self, node: Any, mass: float, inertia: Array, centre: Array | None = None) -> Any:
        """A rigid body on a rigid node.

        Parameters
        ----------
        inertia
            Tensor about the node, shape (3, 3), kg m^2.
        centre
            Centre of mass in body coordinates, shape (3,), m.

        """
        terms = inertia[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
        body = self.system.AddObject(
            item.ObjectRigidBody(
                nodeNumber=node,
                mass=mass,
                inertia=list(terms),
                centerOfMass=[0.0, 0.0, 0.0] if centre is None else list(centre),
            )
        )
        if mass > 0.0:
            self.bodies.append(body)
        return body

    def body_marker(self, body: Any, place: Array, axes: Array | None = None) -> Any:
        """A marker with position and orientation on a body, in body coordinates."""
        frame = exu.HT(rotation=np.eye(3) if axes is None else axes, translation=list(place))
        return self.system.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localHT=frame))

    def node_marker(self, node: Any, axes: Array | None = None) -> Any:
        """A marker with position and orientation on a node."""
        if axes is None:
            return self.system.AddMarker(item.MarkerNodeRigid(nodeNumber=node))
        frame = exu.HT(rotation=axes, translation=[0.0, 0.0, 0.0])
        return self.system.AddMarker(item.MarkerNodeRigid(nodeNumber=node, localHT=frame))

    def ground_marker(self, place: Array) -> Any:
        """A marker fixed in space."""
        if self._ground is None:
            self._ground = self.system.AddObject(item.ObjectGround())
        return self.body_marker(self._ground, place)

    def revolute(self, first: Any, second: Any) -> Any:
        """A revolute joint about the common z axis of two markers."""
        return self.system.AddObject(
            item.ObjectJointRevoluteZ(
                markerNumbers=[first, second],
            )
        )

    def generic_joint(self, first: Any, second: Any, axes: list[int]) -> Any:
        """A joint that holds the flagged translations and rotations."""
        return self.system.AddObject(
            item.ObjectJointGeneric(
                markerNumbers=[first, second],
                constrainedAxes=axes,
            )
        )

    def prismatic(self, first: Any, second: Any) -> Any:
        """A joint that slides along the common x axis of two markers."""
        return self.system.AddObject(item.ObjectJointPrismaticX(markerNumbers=[first, second]))

    def torsion_spring(self, first: Any, second: Any, **settings: Any) -> Any:
        """A torsion spring-damper about the common z axis of two markers."""
        return self.system.AddObject(
            item.ObjectConnectorTorsionalSpringDamper(markerNumbers=[first, second], **settings)
        )

    def symbolic(self, key: Any, law: Callable[..., Any], kind: str, argument: str) -> Any:
        """A force law compiled to exudyn's expression trees; equal keys share one."""
        if key not in self._laws:
            self._laws[key] = CreateSymbolicUserFunction(
                self.system, law, argument, itemTypeName=kind
            )
        return self._laws[key]

    def finish(self) -> None:
        """Assemble the system and set its initial accelerations."""
        self.system.Assemble()
        data = self.system.systemData
        start = np.zeros(data.ODE2Size())
        for node, values in self.starts.items():
            start[self.coordinates_of(node)] = values
        data.SetODE2Coordinates_tt(start, exu.ConfigurationType.Initial)

    def coordinates_of(self, node: Any) -> NDArray[np.int64]:
        """Indices of a node's coordinates in the system vector; after ``finish``."""
        return np.asarray(self.system.systemData.GetNodeLTGODE2(int(node)), dtype=np.int64)
