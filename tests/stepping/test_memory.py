"""What a run remembers comes back from text and numbers bit by bit, and is never executed."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ringsim.stepping.instant import Energies, Instant
from ringsim.stepping.memory import instant, kept, pack, restore, unpack
from ringsim.variables import Fate

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


class Thing:
    def __init__(self) -> None:
        self.past: deque[tuple[float, float]] = deque([(1.0, 2.0)])
        self.largest = {False: math.inf, True: 0.5}
        self.fate = Fate.STALLED
        self.now = Instant(0.1, np.eye(2), np.eye(2), Energies(1.0, 2.0, 3.0, 4.0))


def test_attributes_come_back_in_their_types() -> None:
    names = ("past", "largest", "fate", "now")
    one, other = Thing(), Thing()
    other.past.clear()
    other.largest, other.fate = {}, Fate.NONE
    other.now = Instant(0.0, np.zeros(1), np.zeros(1), Energies(0.0, 0.0, 0.0, 0.0))
    restore(other, unpack(*pack(kept(one, names))))
    assert other.past.popleft() == [1.0, 2.0]
    assert other.largest == one.largest
    assert other.fate is Fate.STALLED
    assert other.now.energies == one.now.energies
    assert isinstance(other.now.energies, Energies)
    assert (other.now.angles == one.now.angles).all()


def test_an_instant_without_cables_comes_back() -> None:
    now = Thing().now
    assert instant(unpack(*pack({"now": now}))["now"]).tensions is None
