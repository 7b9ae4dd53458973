"""Lines that carry corners, and their trolleys, as objects on the corners' nodes."""

from typing import Any

import exudyn.itemInterface as item
import numpy as np

from ringsim.engine.model import Multibody
from ringsim.engine.readings import State
from ringsim.engine.rotations import Array
from ringsim.layout.layout import Hung
from ringsim.parts.springs import Reaction


class Hanging:
    """Mass, stiffness, constant force and friction on the places of bodies; see ``Offload``."""

    def __init__(self, model: Multibody, hung: Hung) -> None:
        self._hung = hung
        assembly, law, up = model.assembly, hung.law, hung.up
        along, level = np.zeros((7, 7)), np.zeros((7, 7))
        along[:3, :3] = np.outer(up, up)
        level[:3, :3] = np.eye(3) - along[:3, :3]
        for body, lift in zip(hung.bodies, hung.lifts.tolist(), strict=True):
            rub = {} if law.friction == 0.0 else {"forceUserFunction": _friction(hung, lift)}
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
        """See ``ringsim.engine.connectors.Reacting``."""
        moved = (state.position - state.begun)[self._where]
        rates = state.velocity[self._where]
        found = self._hung.law.hold(self._hung.up, self._hung.lifts, moved, rates)
        return Reaction(0.0, -found.friction, found.stored), rates


def _friction(hung: Hung, lift: float) -> Any:
    """What exudyn calls for a trolley's friction."""
    lifts = np.array([lift])

    def force(_mbs: Any, _t: float, _item: int, q: Any, q_t: Any) -> list[float]:
        moved, rates = np.array([q[:3]]), np.array([q_t[:3]])
        found = hung.law.hold(hung.up, lifts, moved, rates)
        return [*found.friction[0].tolist(), 0.0, 0.0, 0.0, 0.0]

    return force
