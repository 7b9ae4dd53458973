"""Campaigns over cables with one winch and with two, which have a span and a pulley more."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import TypeAdapter

from ringsim.refusal import InputError
from ringsim.sampling.columns import Table
from ringsim.sampling.table import AnyDesign, AnyDistribution, draw
from ringsim.scene import Scene, load_scene


def drawn(base: Scene, inputs: dict[str, object]) -> Table:
    return draw(
        base,
        TypeAdapter(dict[str, AnyDistribution]).validate_python(inputs),
        (),
        TypeAdapter(AnyDesign).validate_python({"kind": "random", "samples": 8}),
        seed=1,
        folder=Path(),
    )


def test_a_campaign_does_not_mix_cables_of_different_spans() -> None:
    ends = {"kind": "discrete", "values": ["first", "both"]}
    with pytest.raises(InputError, match="of 6 and of 7 spans"):
        drawn(load_scene("truss2"), {"cables.upper.end": ends})
    ends["values"] = ["first", "last"]
    assert drawn(load_scene("truss2"), {"cables.upper.end": ends}).samples == 8


def test_coefficients_of_two_lengths_lie_in_two_dimensions() -> None:
    law = {"kind": "uniform", "low": 2e-4, "high": 4e-4, "each_section": True}
    base = load_scene("truss2").with_values({"cables.upper.end": "both"})
    paths = [f"cables.{plane}.friction.coefficient" for plane in ("upper", "lower")]
    upper, lower = drawn(base, dict.fromkeys(paths, law)).columns
    assert (upper.dim, upper.values.shape) == ("pulley_of_two_winches", (8, 6))
    assert (lower.dim, lower.values.shape) == ("pulley", (8, 5))
