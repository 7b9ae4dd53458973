"""The cables of many samples as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import Cable
from ringsim.theory.ideal_path import PathShape

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CableBatch:
    """The cables of many samples with the same paths and kinds of friction.

    Attributes
    ----------
    half_bar
        Shape (samples, 1), m.
    fixed
        Lengths of the spans that do not fold, m, shape (samples, 1, spans).
    cosines
        Constants of the pulleys, shape (samples, 3, pulleys).
    offset, axial_stiffness, damping_time, slack_width, radius, slip_speed
        One value per cable, shape (samples, 1, cables).
    content, alive
        Natural length of each rope at the start (m), and whether it can carry tension, shape
        (samples, 1, ropes).
    coefficients
        Fields of each cable's friction, shape (samples, 1, 1 or pulleys).
    """

    half_bar: Array
    fixed: Array
    cosines: Array
    offset: Array
    axial_stiffness: Array
    damping_time: Array
    slack_width: Array
    radius: Array
    slip_speed: Array
    content: Array
    alive: Array
    coefficients: tuple[dict[str, Array], ...]

    def take(self, samples: NDArray[np.intp]) -> CableBatch:
        """The same of some samples."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "coefficients"}
        chosen = {name: array[samples] for name, array in arrays.items()}
        own = tuple({n: v[samples] for n, v in each.items()} for each in self.coefficients)
        return CableBatch(**chosen, coefficients=own)

    def with_ropes(self, content: Array, alive: Array) -> CableBatch:
        """The same after faults; shapes (samples, ropes)."""
        return replace(self, content=content[:, None], alive=alive[:, None].astype(float))


def stack(
    shapes: Sequence[Sequence[PathShape]], cables: Sequence[Sequence[Cable]], half_bars: list[float]
) -> CableBatch:
    """Batch of samples from the paths and records of each sample's cables."""

    def column(name: str) -> Array:
        return np.array([[getattr(c, name) for c in own] for own in cables], float)[:, None]

    slip = [
        [c.slip_speed_over(s.cosines.shape[1]) for c, s in zip(own, paths, strict=True)]
        for own, paths in zip(cables, shapes, strict=True)
    ]
    coefficients = []
    for k in range(len(cables[0])):
        laws = [own[k].friction for own in cables]
        names = [name for name in type(laws[0]).model_fields if name != "kind"]
        coefficients.append(
            {name: _stacked([getattr(law, name) for law in laws]) for name in names}
        )
    fixed = np.array([np.concatenate([s.fixed for s in own]) for own in shapes])
    cosines = np.array([np.concatenate([s.cosines for s in own], axis=1) for own in shapes])
    return CableBatch(
        half_bar=np.array(half_bars)[:, None],
        fixed=fixed[:, None],
        cosines=cosines,
        offset=column("block_offset"),
        axial_stiffness=column("axial_stiffness"),
        damping_time=column("damping_time"),
        slack_width=column("slack_width"),
        radius=column("pulley_radius"),
        slip_speed=np.array(slip)[:, None],
        content=np.zeros((len(cables), 1, 0)),
        alive=np.zeros((len(cables), 1, 0)),
        coefficients=tuple(coefficients),
    )


def _stacked(values: list[Any]) -> Array:
    rows = [np.atleast_1d(np.asarray(value, dtype=float)) for value in values]
    width = max(len(row) for row in rows)
    return np.array([np.broadcast_to(row, width) for row in rows])[:, None]
