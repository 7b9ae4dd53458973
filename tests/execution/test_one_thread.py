"""Runs called from Python use one thread of linear algebra, and leave the process as it was."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.simulation import run, run_frame, simulate
from ringsim.threads import ENVIRONMENT, thread_counts
from ringsim.variables import Outcome

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


MODULE = 'import runpy; runpy.run_module("ringsim", run_name="__main__")'
COMMAND = """
import sys
from importlib.metadata import entry_points
sys.argv = ["ringsim", "check", "truss2"]
(script,) = entry_points(group="console_scripts", name="ringsim")
try:
    script.load()()
except SystemExit:
    pass
import scipy.linalg
from ringsim.threads import thread_counts
print({get() for get, _ in thread_counts()})
"""


@pytest.mark.parametrize("start", [COMMAND, COMMAND.replace("script.load()()", MODULE)])
def test_commands_have_one_thread_whatever_the_user_has_set(start: str) -> None:
    """As solver processes have, else a replay ends in other digits than the campaign did."""
    environment = os.environ | dict.fromkeys(ENVIRONMENT, "2")
    done = subprocess.run(
        [sys.executable, "-P", "-c", start], env=environment, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[-1] == "{1}"


@pytest.mark.parametrize("engine", [run, run_frame])
def test_a_run_has_one_thread_and_gives_back_two(engine: Callable[..., Outcome]) -> None:
    seen = list[set[int]]()
    engine(SHORT, lambda _: seen.append(counts()))
    assert seen
    assert all(each == {1} for each in seen)
    assert counts() == {2}


def test_a_refused_run_gives_back_two_threads() -> None:
    with pytest.raises(InputError):
        simulate(SHORT.with_values({"rods.kind": "ancf"}), "frame")
    assert counts() == {2}
