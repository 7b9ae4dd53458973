"""Settings that all tests share."""

import gc
import os

from ringsim.threads import one_thread_from_here_on

one_thread_from_here_on()  # as the command does, before numpy is loaded
# Each process would look through all that is installed for what nobody has: a tenth of its start.
os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

gc.disable()  # modules and tests that are collected stay: there is nothing to be found among them

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Whoever asks for the quick tests must not get slow ones, which -m quick lets in."""
    both = [x.nodeid for x in items if {"quick", "slow"} <= {m.name for m in x.iter_markers()}]
    if both:
        raise pytest.UsageError(f"both quick and slow: {', '.join(both)}")


def pytest_collection_finish() -> None:
    """Leave alone what lives as long as the tests; what they make is collected as ever."""
    gc.collect()
    gc.freeze()
    gc.enable()
