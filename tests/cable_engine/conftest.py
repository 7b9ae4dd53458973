"""Long tests are left to ``pytest -m slow``."""

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.option.markexpr:
        return
    skip = pytest.mark.skip(reason="long: run it with -m slow")
    for item in items:
        if item.get_closest_marker("slow") and "cable_engine" in item.path.parts:
            item.add_marker(skip)
