"""A winch at either end: equal winches on a symmetric structure pull symmetrically."""

from __future__ import annotations

import numpy as np
import pytest
from loops import for_each

from driven import Bench, truss
from ringsim.refusal import InputError
from ringsim.simulation import run_frame

pytestmark = pytest.mark.quick

ROUND_OFF = 1e-12
"""Sums and exponentials of some ten spans in doubles, relative; points are 1 m from the origin."""


def bench(sections: int, **values: object) -> Bench:
    """An arc with two winches; sections of one polygon side stand in mirror symmetry."""
    fields = {
        "both__end": "both",
        "both__friction__coefficient": 0.003,
        "both__initial_slack": -1e-3,
        "structure__opening_angle": 70.0,
        "structure__polygon_sections": 12,
        "structure__aspect_ratio": 1.0,
        "boom": "none",
    }
    return Bench(truss(sections, **(fields | values)))


@pytest.mark.parametrize("sections", [1, 2, 3])
def test_equal_winches_give_symmetric_tensions_and_speeds(sections: int) -> None:
    bed = bench(sections)
    phi = bed.scene.structure.coordinate
    still = bed.reference
    bed.drive.winches.advance(0.0, bed.drive.evaluate(still, 0.0 * still, 0.0)[0], np.zeros(2))
    state, _ = bed.drive.evaluate(still, np.zeros_like(still), 3.0)
    assert 0.0 < phi < np.pi / 2
    for plane in range(2):
        spans = slice(plane * (3 * sections + 1), (plane + 1) * (3 * sections + 1))
        pulleys = slice(plane * 3 * sections, (plane + 1) * 3 * sections)
        lengths, tension = state.lengths[spans], state.tensions[spans]
        speed = state.speeds[pulleys]
        assert lengths == pytest.approx(lengths[::-1], rel=ROUND_OFF)
        assert lengths[0] == pytest.approx(0.3, rel=ROUND_OFF)
        assert tension == pytest.approx(tension[::-1], rel=ROUND_OFF)
        # Rope runs to the nearer winch, and rests in the middle.
        assert speed == pytest.approx(-speed[::-1], abs=ROUND_OFF * np.abs(speed).max())
        assert speed[0] > 0.001
        # Friction takes its share from the winch on: the test can fail.
        assert tension[0] > 1.2 * tension.min() > 0.0


def test_the_last_hinge_pulley_has_a_coefficient_a_fault_and_a_span_of_its_own() -> None:
    scene = truss(
        both__end="both",
        **{"cables__upper__friction__coefficient[6]": 0.002},
        faults=[{"kind": "jammed-pulley", "time": 1.0, "pulley": 6}],
    )
    assert scene.cables is not None
    assert scene.cables.upper is not None
    assert scene.cables.upper.friction.coefficients.tolist() == [4e-4] * 5 + [0.002]
    assert Bench(scene).drive.path.per_cable == [8, 8]
    mixed = truss(cables__upper__end="both", solver__end_time=1.0)
    tension = run_frame(mixed).values["cable_tension"]
    assert tension.shape[1] == 7
    assert np.isfinite(tension[0]).all()
    # The lower cable has one winch and one span less.
    assert np.isfinite(tension[1, :6]).all()
    assert np.isnan(tension[1, 6]).all()


@for_each(
    ("values", "text"),
    [
        ({"both__friction__coefficient[7]": 1e-4}, "choose one from 1 to 6"),
        ({"both__friction__coefficient": [1e-4] * 5}, "has 5 values, but the structure needs 6"),
        (
            {"faults": [{"kind": "cut-cable", "time": 1.0, "span": 8}]},
            "faults[1].span = 8 must be at most 7",
        ),
    ],
)
def test_places_beyond_the_far_winch_are_refused(values: dict[str, object], text: str) -> None:
    with pytest.raises(InputError) as refused:
        truss(both__end="both", **values)
    assert text in str(refused.value)
