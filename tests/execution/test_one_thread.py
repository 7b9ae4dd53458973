"""Runs called from Python use one thread of linear algebra, and leave the process as it was."""

from collections.abc import Iterator

import pytest

from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.simulation import run, simulate
from ringsim.threads import thread_counts

SHORT = load_scene("truss2").with_values({"solver.end_time": 0.2})


def counts() -> set[int]:
    return {get() for get, _ in thread_counts()}


@pytest.fixture
def _two_threads() -> Iterator[None]:
    before = [(give, get()) for get, give in thread_counts()]
    for give, _ in before:
        give(2)
    yield
    for give, count in before:
        give(count)


pytestmark = pytest.mark.usefixtures("_two_threads")


def test_the_libraries_of_numpy_and_scipy_are_found() -> None:
    assert len(thread_counts()) >= 2
    assert counts() == {2}


def test_a_run_has_one_thread_and_gives_back_two() -> None:
    seen = list[set[int]]()
    run(SHORT, lambda _: seen.append(counts()))
    assert seen
    assert all(each == {1} for each in seen)
    assert counts() == {2}


def test_a_refused_run_gives_back_two_threads() -> None:
    with pytest.raises(InputError):
        simulate(SHORT.with_values({"rods.kind": "ancf"}), "frame")
    assert counts() == {2}
