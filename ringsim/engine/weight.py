"""Weight of all masses of a model, and its work."""

from functools import partial
from typing import Any

import exudyn.itemInterface as item
import numpy as np

from ringsim.engine.model import Multibody
from ringsim.engine.readings import State
from ringsim.engine.rotations import Array, axes_of
from ringsim.layout.layout import Hung


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
