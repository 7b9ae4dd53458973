"""What outputs read of a state, as far as the scene records it."""

import numpy as np

from ringsim.frame.accelerations import AccelerationMeter
from ringsim.frame.base import BaseMeter
from ringsim.frame.kernels import Strains
from ringsim.frame.model import FrameModel
from ringsim.frame.positions import PositionMeter
from ringsim.frame.shape import ShapeMeter
from ringsim.frame.state import State
from ringsim.frame.stresses import StressMeter
from ringsim.outputs.series import Reading
from ringsim.scene.substituted import strained
from ringsim.stepping.instant import Instant


class Readings:
    """All meters that a model's scene asks for; ``coordinates`` are those of what they read."""

    def __init__(self, model: FrameModel) -> None:
        self._model, record = model, model.scene.record
        shaped = record.shape or strained(model.scene)
        self._stress = StressMeter(model.mesh, model.layout) if record.stress else None
        self._position = PositionMeter(model) if record.positions else None
        self._base = BaseMeter(model) if record.reactions else None
        self._shock = AccelerationMeter(model) if record.accelerations else None
        self._shape = ShapeMeter(model) if shaped else None
        self.coordinates = {"rod": np.array(list(model.layout.halves()))}
        for meter in (self._position, self._shock, self._shape):
            self.coordinates |= {} if meter is None else meter.coordinates

    def read(self, now: Instant, state: State, strains: Strains) -> Reading:
        """An instant with what there is to tell of its state."""
        cables, edge = self._model.cables, self._model.edge
        return Reading(
            **vars(now),
            chain=state.chain,
            planes=() if cables is None else tuple((plane,) for plane, _ in cables.present),
            stress=None if self._stress is None else self._stress.read(strains),
            places=None if self._position is None else self._position.read(state),
            carried=None if self._base is None else self._base.read(state),
            accelerations=None if self._shock is None else self._shock.read(state),
            put=None if self._shape is None else self._shape.read(state),
            edge=None if edge is None else edge.tensions(state.pose.place),
        )
