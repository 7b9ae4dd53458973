"""How far a replay is apart from the stored result: beside its size, and beside its error bar."""

import numpy as np
import pytest

from ringsim.cli.campaign import judged

pytestmark = pytest.mark.quick

OLD = {
    "deployment_time": np.array(20.0),
    "opening_angle": np.array([[[60.0, 120.0, np.nan]]]),
    "latch_rate": np.array([0.5, -2.0]),
    "asynchrony_laggard_plane": np.array([0, 1]),
}
BARS = {"deployment_time": np.array(0.05), "opening_angle": np.array(0.2)}


def moved(**by: object) -> dict[str, np.ndarray]:
    return OLD | {name: OLD[name] + np.asarray(each) for name, each in by.items()}


def test_the_largest_relative_difference_is_named() -> None:
    """0.04 of -2 is 2 %, 0.12 of 120 deg 0.1 %; of series that end elsewhere both values count."""
    new = moved(latch_rate=[0.0, 0.04], opening_angle=[0.0, 0.12, 0.0])
    new["opening_angle"][0, 0, 2] = 130.0
    lines = judged(["latch_rate", "opening_angle"], new, OLD, BARS)
    assert lines[0] == "largest relative difference: 0.02 (latch_rate)"
    assert lines[1] == "below the error bars: opening_angle by 0.12 of 0.2 deg"


def test_what_exceeds_its_bar_is_named_alone() -> None:
    new = moved(deployment_time=0.1, opening_angle=[0.0, 0.12, 0.0])
    told = judged(["deployment_time", "opening_angle"], new, OLD, BARS)[1]
    assert told == "ABOVE the error bars: deployment_time by 0.1 of 0.05 s"


def test_codes_have_no_size_and_not_everything_has_a_bar() -> None:
    new = moved(asynchrony_laggard_plane=[1, 0])
    assert judged(["asynchrony_laggard_plane"], new, OLD, BARS) == [
        "none of these outputs has an error bar"
    ]
    assert judged(["latch_rate"], moved(latch_rate=[0.0, 0.1]), OLD, {})[1:] == [
        "none of these outputs has an error bar"
    ]
