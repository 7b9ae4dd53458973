"""Hinge assemblies without a size: refused with cables where pulleys coincide, else sound."""

from __future__ import annotations

import pytest

from driven import outcome, truss
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.variables import Fate, Outcome


def opened(offset: float, sections: int = 2, end: float = 1.0, engine: str = "full") -> Outcome:
    return outcome(
        truss(
            sections,
            structure__hinge_offset=offset,
            structure__opening_angle=90.0,
            both__winch__winding={"kind": "ramp", "speed": 0.05, "duration": 0.5},
            solver__end_time=end,
        ),
        engine,
    )


@pytest.mark.parametrize("scene", ["truss2", "ring18-cable"])
def test_coinciding_hinge_pulleys_are_refused(scene: str) -> None:
    with pytest.raises(
        InputError, match=r"structure.hinge_offset = 0.0 m must be at least 1e-06 m"
    ):
        load_scene(scene).with_values({"structure.hinge_offset": 0.0})
    without = {"structure.hinge_offset": 0.0, "cables": "none"}
    assert load_scene(scene).with_values(without).structure.hinge_offset == 0.0


def test_a_single_section_has_no_span_between_hinges() -> None:
    assert opened(0.0, sections=1, end=0.2).fate is Fate.CUT_OFF


@pytest.mark.parametrize("engine", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_the_least_offset_that_is_allowed_is_the_limit(engine: str) -> None:
    """Results at 1e-6 and 1e-4 m differ by what the offset changes: a 1e-4 of lengths of 1 m."""
    small, larger = (opened(offset, engine=engine) for offset in (1e-6, 1e-4))
    for name, near in (("opening_angle", 1e-3), ("cable_tension", 1e-3)):
        one, other = small.values[name][..., -1], larger.values[name][..., -1]
        assert one == pytest.approx(other, rel=near)
    assert small.values["energy_error"] < 1e-3
