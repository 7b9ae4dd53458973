"""Energy of the built-in scenes: frames lose no more than exudyn at the same settings."""

from typing import Any

import pytest

from ringsim.engine.integrate import solve as by_exudyn
from ringsim.frame.integrate import solve as by_frames
from ringsim.scene import load_scene


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("ring18", {"structure.sections": 6}),
        ("truss2", {"solver.end_time": 5.0}),
        pytest.param("ring18", {}, marks=pytest.mark.slow),
        pytest.param("truss2", {}, marks=pytest.mark.slow),
        pytest.param("ring18-cable", {}, marks=pytest.mark.slow),
    ],
    ids=["ring6", "truss2-short", "ring18", "truss2", "ring18-cable"],
)
def test_energy_is_kept_as_well(name: str, values: dict[str, Any]) -> None:
    """Both choose their steps by what goes missing, which is luck to a fifth: where a step is
    repeated by one and not by the other.
    """
    scene = load_scene(name).with_values(values)
    here, there = (float(solve(scene).values["energy_error"]) for solve in (by_frames, by_exudyn))
    assert here < 1.2 * there
