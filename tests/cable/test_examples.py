"""The examples in the docstrings of the cables' public functions."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import pytest

import ringsim.cable

MODULES = [m.name for m in pkgutil.walk_packages(ringsim.cable.__path__, "ringsim.cable.")]
WITH_EXAMPLES = {
    "ringsim.cable.chain", "ringsim.cable.slack", "ringsim.cable.regularisation",
    "ringsim.cable.friction.bearing", "ringsim.cable.friction.bearing_exact",
    "ringsim.cable.friction.capstan", "ringsim.cable.friction.frictionless",
}  # fmt: skip


@pytest.mark.parametrize("name", MODULES)
def test_examples_give_what_they_say(name):
    found = doctest.testmod(importlib.import_module(name))
    assert found.failed == 0
    assert (found.attempted > 0) or name not in WITH_EXAMPLES
