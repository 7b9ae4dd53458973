"""Examples in docstrings run and print what they say."""

import doctest
import importlib
import re
from pathlib import Path

from loops import for_each

PACKAGE = Path(__file__).parents[2] / "ringsim"
WITH_EXAMPLES = sorted(
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
    for path in PACKAGE.rglob("*.py")
    if re.search(r"^\s*>>> ", path.read_text(encoding="utf-8"), re.MULTILINE)
)


@for_each("name", WITH_EXAMPLES)
def test_examples_of_a_module(name: str) -> None:
    found = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert found.attempted > 0
    assert found.failed == 0


def test_the_public_words_have_examples() -> None:
    assert {"ringsim", "ringsim.scene", "ringsim.simulation"} <= set(WITH_EXAMPLES)
