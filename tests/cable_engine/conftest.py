"""Engines that run a scene with cables; long tests are left to ``pytest -m slow``."""

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.option.markexpr:
        return
    skip = pytest.mark.skip(reason="long: run it with -m slow")
    for item in items:
        if item.get_closest_marker("slow") and "cable_engine" in item.path.parts:
            item.add_marker(skip)


@pytest.fixture(params=["frame", pytest.param("full", marks=pytest.mark.slow)])
def engine(request: pytest.FixtureRequest) -> str:
    """What a law does to a rope is the same by either engine, and tenfold as cheap by frames.

    That each law gives the same by both is tested in tests/frame/test_frame_laws.py.
    """
    return str(request.param)
