"""Cables along a net's edge, as exudyn's springs between the corners' nodes."""

from typing import Any

import exudyn.itemInterface as item
import numpy as np

from ringsim.engine.assembly import SYMBOLIC
from ringsim.engine.model import Multibody
from ringsim.engine.readings import State
from ringsim.engine.rotations import Array
from ringsim.layout.edge import natural_lengths
from ringsim.layout.layout import EdgeNet
from ringsim.parts.net.boundary import pull
from ringsim.parts.springs import Reaction


class EdgeCables:
    """Cables between the nodes of bodies."""

    def __init__(self, model: Multibody, edge: EdgeNet) -> None:
        self._present, natural = edge.present, natural_lengths(model.scene, edge)
        self._natural = natural[self._present]
        self._rates = edge.law.rates(natural)[self._present]
        assembly = model.assembly
        nodes = [[model.bodies[k][1] for k in pair] for pair in edge.pairs.tolist()]
        for pair, free, rate in zip(
            nodes, self._natural.tolist(), self._rates.tolist(), strict=True
        ):
            ends = [assembly.system.AddMarker(item.MarkerNodePosition(nodeNumber=k)) for k in pair]
            law = assembly.symbolic_law("ObjectConnectorSpringDamper", ("edge", rate), _law(rate))
            assembly.system.AddObject(
                item.ObjectConnectorSpringDamper(markerNumbers=ends, referenceLength=free, **law)
            )
        places = [[assembly.coordinates_of(node)[:3] for node in pair] for pair in nodes]
        self._first, self._second = np.array(places).transpose(1, 0, 2)

    def reaction(self, state: State, _angles: Array, _rates: Array) -> tuple[Reaction, Array]:
        """See ``ringsim.engine.connectors.Reacting``."""
        reaction = pull(self._stretched(state), self._rates)
        return reaction, np.zeros(len(self._rates))

    def tensions(self, state: State) -> Array:
        """Of the cables, N, shape (planes, sections); NaN in planes without."""
        found = np.full(self._present.shape, np.nan)
        found[self._present] = pull(self._stretched(state), self._rates).elastic
        return found

    def _stretched(self, state: State) -> Array:
        arms = state.position[self._second] - state.position[self._first]
        return np.asarray(np.linalg.norm(arms, axis=1) - self._natural)


def _law(rate: float) -> Any:
    return lambda stretch, _rate, _offset: pull(stretch, rate, SYMBOLIC).elastic
