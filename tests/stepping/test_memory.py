"""What a run remembers comes back from text and numbers bit by bit, and is never executed."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringsim.stepping.instant import Energies, Instant, Remembering, pack, unpack
from ringsim.stepping.locks import Overrun
from ringsim.variables import Cause, Fate, Reason

pytestmark = pytest.mark.quick

LEAVES = st.one_of(
    st.none(), st.booleans(), st.integers(-(10**9), 10**9), st.floats(allow_nan=False), st.text()
)
TREES = st.recursive(
    LEAVES, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20
)


@given(TREES)
def test_trees_come_back(tree: object) -> None:
    assert unpack(*pack(tree)) == tree


@given(st.lists(st.floats(), max_size=20))
def test_floats_come_back_bit_by_bit(values: list[float]) -> None:
    """In lists all but what a number that is none carries: texts have one NaN only."""
    array, listed = np.array(values, dtype=float), [one for one in values if not math.isnan(one)]
    found = unpack(*pack({"array": array, "list": listed, "none": math.nan}))
    assert found["array"].tobytes() == array.tobytes()
    assert np.array(found["list"]).tobytes() == np.array(listed).tobytes()
    assert math.isnan(found["none"])


def test_arrays_keep_shape_and_type() -> None:
    for array in (np.eye(3) > 0.0, np.arange(6).reshape(2, 3), np.zeros((0, 3)), np.array(1.5)):
        found = unpack(*pack([array, array]))[1]
        assert found.dtype == array.dtype
        assert found.shape == array.shape
        assert (found == array).all()


NOW = Instant(0.1, np.eye(2), np.eye(2), Energies(1.0, 2.0, 3.0, 4.0), tensions=np.ones(3))


class Thing(Remembering):
    changing = ("past", "largest", "fate", "worst", "reason", "now")

    def __init__(self) -> None:
        self.past: deque[tuple[float, float]] = deque()
        self.largest = {False: 0.0, True: 0.0}
        self.fate, self.worst, self.reason = Fate.NONE, Overrun(), Reason()
        self.now: Instant | None = None


def test_attributes_come_back_in_their_types() -> None:
    one, other = Thing(), Thing()
    one.past.append((1.0, 2.0))
    one.largest, one.fate, one.worst = {False: math.inf}, Fate.STALLED, Overrun(0.1, "upper 1", 2.0)
    one.reason, one.now = Reason(Cause.NEWTON, "it gave up"), NOW
    other.recall(unpack(*pack(one.memory())))
    assert other.past.popleft() == [1.0, 2.0]
    assert other.largest == one.largest
    assert other.fate is Fate.STALLED
    assert other.worst.joint == "upper 1"
    assert other.reason == "it gave up"
    assert other.reason.cause is Cause.NEWTON
    assert isinstance(other.now, Instant)
    assert isinstance(other.now.energies, Energies)
    assert other.now.energies == NOW.energies
    assert (other.now.angles == NOW.angles).all()


def test_an_instant_without_cables_comes_back() -> None:
    assert unpack(*pack([replace(NOW, tensions=None)]))[0].tensions is None
