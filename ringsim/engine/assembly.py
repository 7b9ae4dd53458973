"""The growing model: nodes with their initial accelerations, bodies, markers."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.rod_dampers import RodDampers
from ringsim.engine.rotations import turn_of, turn_rates
from ringsim.layout.pose import Pose

Array = NDArray[np.float64]
_SAME = np.eye(3)
exu.config.printToConsole = False


class Assembly:
    """An exudyn system under construction.

    Attributes
    ----------
    container, system
        exudyn's SystemContainer and MainSystem.
    starts
        Accelerations (m/s^2, 1/s^2) at which coordinates start, by node, in the nodes' order.
    bodies
        Objects with kinetic energy and, where elastic, potential energy.
    rigid_nodes
        Nodes with Euler parameters.
    dampers
        Dampers of the rods.
    laws
        Force laws in exudyn's expressions (``ringsim.engine.laws``).
    """

    def __init__(self) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.starts: dict[int, Array] = {}
        self.bodies: list[Any] = []
        self.rigid_nodes: list[Any] = []
        self.dampers = RodDampers()
        self.laws: dict[Any, Any] = {}
        self._places: dict[int, NDArray[np.int64]] = {}
        self._size = 0

    def add_node(self, node: Any, acceleration: Array) -> Any:
        """A node whose coordinates have an initial acceleration, shape (coordinates,)."""
        number = self.system.AddNode(node)
        self.starts[int(number)] = acceleration
        self._places[int(number)] = np.arange(self._size, self._size + len(acceleration))
        self._size += len(acceleration)
        return number

    def coordinates_of(self, node: Any) -> NDArray[np.int64]:
        """Indices of a node's coordinates in the system vector: exudyn keeps the nodes' order."""
        return self._places[int(node)]

    def add_rigid_node(self, pose: Pose) -> Any:
        """A node with Euler parameters, of a body at rest: the pose's rates are accelerations."""
        turn = turn_of(pose.axes)
        turning = turn_rates(turn[None], pose.turn[None])[0]
        node = self.add_node(
            item.NodeRigidBodyEP(referenceCoordinates=[*pose.place, *turn]),
            np.concatenate([pose.rate, turning]),
        )
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

    def body_marker(self, body: Any, place: Array, axes: Array = _SAME) -> Any:
        """A marker with position and orientation on a body, in body coordinates."""
        frame = exu.HT(rotation=axes, translation=list(place))
        return self.system.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localHT=frame))

    def node_marker(self, node: Any, axes: Array = _SAME) -> Any:
        """A marker with position and orientation on a node."""
        frame = exu.HT(rotation=axes, translation=[0.0, 0.0, 0.0])
        return self.system.AddMarker(item.MarkerNodeRigid(nodeNumber=node, localHT=frame))

    def finish(self) -> None:
        """Assemble the system and set its initial accelerations."""
        self.system.Assemble()
        data = self.system.systemData
        start = np.zeros(data.ODE2Size())
        start[: self._size] = np.concatenate([*self.starts.values()])
        data.SetODE2Coordinates_tt(start, exu.ConfigurationType.Initial)
