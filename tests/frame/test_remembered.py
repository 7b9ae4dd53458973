"""What a run that goes on from a stored state has in its objects: all that the first run had there.

Bit-equal results (``test_going_on.py``) would not show what a later step needs, and a field that
is forgotten is found here by its name.
"""

from __future__ import annotations

from collections import deque
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from law_scenes import STOPS, of_cables, of_forces
from ringsim.core.chain import Seen
from ringsim.core.winches import Winches
from ringsim.dataset import save
from ringsim.frame.integrate import Storing
from ringsim.frame.model import FrameModel
from ringsim.frame.readings import EnergyMeter, FrameMeters
from ringsim.scene import Scene
from ringsim.simulation import simulate
from ringsim.stepping.repeats import Indicator
from ringsim.stored_state import read_state


class Reached(Exception):  # noqa: N818
    """The time of the state."""


class Stopped(Storing):
    """A run up to a time."""

    until: float

    def _accept(self, *step: Any) -> None:
        super()._accept(*step)
        if self._control.now.time >= self.until - 1e-9:
            raise Reached


def differing(one: Any, other: Any, path: str = "") -> list[str]:
    """Where two trees of objects are not equal bit by bit; models and functions are left out."""
    if isinstance(one, (FrameModel, Seen)) or callable(one):  # what Newton sees is of one step
        return []
    if isinstance(one, np.ndarray):
        return [] if np.array_equal(one, other, equal_nan=one.dtype.kind == "f") else [path]
    first, second = inside(one), inside(other)
    if first is None or second is None:
        return [] if one == other or (one != one and other != other) else [path]
    if first.keys() != second.keys():
        return [path]
    own = (differing(first[key], second[key], f"{path}.{key}") for key in first)
    return [found for each in own for found in each]


def inside(thing: Any) -> dict[Any, Any] | None:
    """What an object, a list or a table is made of; None of what is one value."""
    if isinstance(thing, (list, tuple, deque)):
        return dict(enumerate(thing))
    if isinstance(thing, dict):
        # Outputs, which have no names, are as good as their kinds.
        return {key if inside(key) is None else type(key): one for key, one in thing.items()}
    if is_dataclass(thing):
        # And no properties that are kept once they have been asked for.
        return {one.name: getattr(thing, one.name) for one in fields(thing)}
    plain = isinstance(thing, (BaseModel, Enum, str)) or not hasattr(thing, "__dict__")
    own = None if plain else vars(thing)
    if isinstance(thing, Winches):
        # These begin anew with every step.
        own = {name: one for name, one in own.items() if name not in ("_start", "_held", "_ropes")}
    if isinstance(thing, Indicator):
        # Of a step that is asked about again.
        own = {name: one for name, one in own.items() if name != "_judged"}
    if isinstance(thing, EnergyMeter):
        # Rooms are written before they are read.
        own = {name: one for name, one in own.items() if name != "_rooms"}
    if isinstance(thing, FrameMeters):
        # They look at a state when it is read.
        own = {name: one for name, one in own.items() if name not in ("now", "_state")}
    return own


BEGUN_ANEW = "until", "_states", "_cables", "_next", "_held"
"""Of cables see below: what they keep is of one step.  What has latched is looked at anew."""


def parts(run: Storing) -> dict[str, Any]:
    """All that a run has, but the states that it has stored."""
    own = {name: value for name, value in vars(run).items() if name not in BEGUN_ANEW}
    cables = run.model.cables
    assert run.history.readings  # by now: some are made of many steps at once
    own["laws"] = run.model.laws
    return own if cables is None else own | {"winches": cables.winches, "ropes": cables.ropes}


MOTION = {"solver.step_control": "motion", "solver.step": 0.02, "record.stress": True}
LATCH = {
    "stop.latch": True, "latch": {"peak_torque": 0.05, "min_rate": 0.01}
}  # fmt: skip
BROKEN = {
    "faults": [
        {"kind": "jammed-pulley", "cable": 1, "pulley": 3, "time": 0.02},
        {"kind": "stuck-vjoint", "plane": "lower", "section": 2, "time": 0.03},
        {"kind": "cut-cable", "cable": 2, "span": 4, "time": 0.3},
    ]
}


@pytest.mark.parametrize(
    ("scene", "time"),
    [
        (of_cables(MOTION | BROKEN), 0.1),
        (of_cables({"solver.step": 1e-3}), 0.1),
        (of_forces(STOPS | MOTION | LATCH), 0.1),
        (of_forces(STOPS | MOTION | LATCH), 0.2),
    ],
    ids=["cables", "constant", "latches", "locked"],
)
def test_nothing_is_forgotten(scene: Scene, time: float, tmp_path: Path) -> None:
    scene = scene.with_values({"record.state_interval": time, "solver.end_time": 1.2 * time})
    save(simulate(scene, "frame"), tmp_path / "run.nc")
    first = Stopped(FrameModel(scene))
    first.until = time
    with pytest.raises(Reached):
        first.run()
    again = Storing(FrameModel(scene), start=read_state(tmp_path / "run.nc", time))
    assert "\n".join(differing(parts(first), parts(again))) == ""
