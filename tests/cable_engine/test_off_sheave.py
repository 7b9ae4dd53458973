"""Ropes that were slack for long, and ropes that have left a pulley."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

import ringsim
from ringsim.outputs.rods_and_cables import longest_above
from ringsim.refusal import InputError
from ringsim.variables import Fate

TRUSS = ringsim.load_scene("truss2")
SHORT: dict[str, Any] = {"solver.end_time": 0.6, "record.interval": 0.001}
ENGINES = pytest.mark.parametrize(
    "fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)]
)


def run(fidelity: str, **values: Any) -> xr.Dataset:
    named = {name.replace("__", "."): value for name, value in values.items()}
    return ringsim.simulate(TRUSS.with_values(SHORT | named), fidelity)


def stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    """First and one more than the last of each run of flags that are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


@ENGINES
def test_the_longest_slack_is_that_of_the_recorded_strains(fidelity: str) -> None:
    """Free rope of a span of length L at the mean strain e < 0 is -e L / (1 + e)."""
    found = run(fidelity, limits__slack_length=0.0)
    strain = found["rope_strain"].values
    slack = {
        (plane, first): last - first
        for plane in range(2)
        for first, last in stretches(strain[plane] < 0.0)
    }
    (plane, first), most = max(slack.items(), key=lambda one: one[1])
    assert most > 200  # it is slack for a while: see docs/theory/truss2.md
    assert float(found["longest_slack"]) == pytest.approx(0.001 * most, abs=0.003)
    assert float(found["longest_slack_time"]) == pytest.approx(0.001 * first, abs=0.003)
    assert str(found["longest_slack_plane"].item()) == found["plane"].values[plane]
    # The longest span holds most of the free rope: the first one, which comes up the boom.
    half_bar, offset = TRUSS.structure.half_bar, TRUSS.cables.upper.block_offset
    angle = math.radians(float(found["opening_angle"][plane, 0, first]))
    over = math.sqrt(half_bar**2 + offset**2 + 2 * half_bar * offset * math.cos(angle / 2))
    span = int(found["longest_slack_span"])
    assert (span == 1) == (TRUSS.boom.length > over) or span in (2, 3, 5, 6)


def test_more_slack_than_a_scene_allows_has_an_outcome_of_its_own() -> None:
    any_slack = {"slack_length": 0.0}
    longest = float(run("frame", limits=any_slack)["longest_slack"])
    allowed, passed = (
        run("frame", limits=any_slack | {"slack_duration": share * longest})
        for share in (1.01, 0.99)
    )
    assert int(allowed["outcome"]) == Fate.CUT_OFF
    assert int(passed["outcome"]) == Fate.SLACKENED
    assert "it may have left its pulleys" in passed.attrs["reason"]
    assert f"limits.slack_duration = {0.99 * longest:g} s" in passed.attrs["reason"]
    # Spans that may hold free rope count for less time, and none for none.
    loosest = -float(allowed["rope_strain"].min())  # times 0.4 m of a span, half of it
    some = run("frame", limits={"slack_duration": 1.0, "slack_length": 0.2 * loosest})
    none = run("frame", limits={"slack_duration": 0.0, "slack_length": 0.5})
    assert 0.0 < float(some["longest_slack"]) < longest
    assert (float(none["longest_slack"]), int(none["outcome"])) == (0.0, Fate.CUT_OFF)
    assert float(allowed["longest_slack"]) == longest


def test_how_long_values_are_above_zero() -> None:
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.1, 1.0, 12))
    values, until = rng.normal(size=(12, 4, 5)), rng.uniform(3.0, 8.0, (4, 5))
    longest, begun = longest_above(times, values, until)
    for place in np.ndindex(4, 5):
        fine = np.linspace(times[0], min(until[place], times[-1]), 200_001)
        above = stretches(np.interp(fine, times, values[(..., *place)]) > 0.0)
        best = max(((fine[b - 1] - fine[a], fine[a]) for a, b in above), default=(0.0, math.nan))
        found = longest[place], begun[place]
        assert found == pytest.approx(best, abs=2e-4, nan_ok=True)


def test_a_rope_that_parts_is_slack_no_longer() -> None:
    times = np.array([0.0, 1.0, 2.0, 2.0, 3.0])
    values = np.array([[1.0, 1.0, 1.0, -np.inf, -np.inf], [np.nan] * 5]).T
    longest, begun = longest_above(times, values, np.array(math.inf))
    np.testing.assert_allclose(longest, [2.0, math.nan], rtol=1e-8)
    np.testing.assert_array_equal(begun, [0.0, math.nan])


WEDGED = ("wedged", {"kind": "jammed-pulley", "pulley": "section 1 V"})
FREE = ("free", {"kind": "cut-cable", "span": "section 1 V to second hinge"})


@pytest.mark.parametrize(
    ("fidelity", "rope", "alike"),
    [
        ("frame", *WEDGED),
        ("frame", *FREE),
        pytest.param("full", *WEDGED, marks=pytest.mark.slow),
        pytest.param("full", *FREE, marks=pytest.mark.slow),
    ],
)
def test_off_its_sheave_a_rope_is_held_or_carries_nothing(
    fidelity: str, rope: str, alike: dict[str, Any]
) -> None:
    fault = {"kind": "off-sheave", "pulley": "section 1 V", "rope": rope}
    # The same steps, whatever they are.
    plain: dict[str, Any] = {
        "solver__end_time": 0.6, "record__interval": 0.05, "solver__tolerance": 3e-3,
    }  # fmt: skip
    found, other = (
        run(fidelity, faults=[one | {"cable": "upper", "time": 0.45}], **plain)
        for one in (fault, alike)
    )
    for name in ("opening_angle", "cable_tension"):
        np.testing.assert_array_equal(found[name].values, other[name].values)
    assert int(found["outcome"]) == int(other["outcome"])
    late = found["cable_tension"].sel(plane="upper").isel(time=-1)
    lost = bool((late == 0.0).all())
    assert lost == (rope == "free")


def test_a_limit_of_slack_without_a_rope_is_refused() -> None:
    with pytest.raises(InputError, match=r"limits\.slack_duration = 1 s needs a cable"):
        ringsim.load_scene("ring18").with_values({"limits.slack_duration": 1.0})
