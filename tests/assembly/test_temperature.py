"""Temperatures: the same as what they make of lengths, stiffness and friction."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from loops import for_each

from ringsim.refusal import InputError
from ringsim.rigid.assembling import deployed
from ringsim.scene import Scene, load_scene
from ringsim.scene.substituted import substituted
from ringsim.simulation import run_frame
from test_length_errors import ring

HEAT = {
    "reference": 300.0,
    "diagonal": {"value": 350.0, "expansion": 2e-6},
    "bar": {
        "value": [200.0, 250.0, 300.0, 350.0], "expansion": -1e-6,
        "stiffness": {"temperatures": [150.0, 350.0], "factors": [1.2, 0.8]},
    },
    "joint": {
        "value": 250.0, "friction": {"temperatures": [200.0, 300.0], "factors": [3.0, 1.0]},
    },
}  # fmt: skip


def written() -> dict[str, Any]:
    """What HEAT makes of a ring of four, by hand."""
    bars = [1e-4, 5e-5, 0.0, -5e-5]
    return {
        "rods.length_error": {
            "diagonal_rising": 1e-4, "diagonal_falling": 1e-4,
"bar_upper_left": bars, "bar_upper_right": bars,
            "bar_lower_left": bars, "bar_lower_right": bars,
        },
        "rods.bar_young_modulus": [1.1 * 120e9, 120e9, 0.9 * 120e9, 0.8 * 120e9],
        "joints.vjoint.viscous": 0.004, "joints.vjoint.coulomb": 0.002,
    }  # fmt: skip


def rubbed(**values: Any) -> Scene:
    return ring(
        joints__vjoint={"viscous": 0.002, "coulomb": 0.001}, solver__end_time=0.3,
        record__interval=0.1, record__shape=True, **values,
    )  # fmt: skip


def close(one: Any, other: Any) -> bool:
    """Whether two tables hold the same but for round-off."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(close(one[k], other[k]) for k in one)
    if isinstance(one, (list, float)):
        return bool(np.allclose(one, other, rtol=1e-12, atol=1e-18))
    return bool(one == other)


def test_a_temperature_is_the_scene_with_its_values_substituted() -> None:
    made, by_hand = substituted(rubbed(temperature=HEAT)), rubbed().with_values(written())
    assert made.temperature is None
    assert close(made.to_table(), by_hand.to_table())


def test_a_run_at_a_temperature_equals_that_of_the_substituted_scene_bit_by_bit() -> None:
    warm = rubbed(temperature=HEAT)
    one, two = run_frame(warm).values, run_frame(substituted(warm)).values
    assert one.keys() == two.keys()
    assert float(one["prestress_energy"]) > 0.0
    for name in one.keys() - {"wall_time", "cpu_time"}:
        assert str(one[name].tolist()) == str(two[name].tolist()), name


def test_expansion_adds_to_length_errors() -> None:
    scene = rubbed(temperature=HEAT, rods__length_error={"diagonal_rising": 1e-3})
    made = substituted(scene).rods.length_error
    assert made is not None
    assert made.diagonal_rising == pytest.approx(1.001 * 1.0001 - 1.0, abs=1e-15)
    assert made.diagonal_falling == pytest.approx(1e-4, abs=1e-18)


def test_friction_of_pulleys_follows_their_temperature() -> None:
    table = {"temperatures": [100.0, 300.0], "factors": [2.0, 1.0]}
    scene = load_scene("ring18-cable").with_values(
        {"temperature": {"pulley": {"value": 200.0, "friction": table}}}
    )
    before, after = (s.cables.upper.friction.coefficients for s in (scene, substituted(scene)))
    assert np.allclose(after, 1.5 * before, rtol=1e-15)


def test_a_warm_ring_is_a_larger_one() -> None:
    """All rods longer by e: heights grow by e, chords by e l / (l + a), and nothing strains."""
    e = 1e-3
    warm = {"value": 393.15, "expansion": 1e-5}
    scene = ring(temperature={"reference": 293.15, "diagonal": warm, "bar": warm})
    found = deployed(scene)
    ring_of, plain = scene.structure, scene.structure.geometry().fold(0.0).corners.reshape(-1, 3)
    chord = e * ring_of.half_bar / (ring_of.half_bar + ring_of.hinge_offset)
    grown = np.real(plain - plain.mean(axis=0)) * np.array([chord, chord, e])
    expected = np.linalg.norm(grown, axis=1)
    assert found.energy < 1e-15
    # The offset does not grow, and h^2 = 4 d^2 - w^2 is that of rods and not of chords.
    assert np.abs(found.deviations.ravel() - expected).max() < 2e-3 * expected.max()


@for_each(("heat", "words"), [
    ({"bar": {"value": 500.0, "stiffness": {"temperatures": [1.0, 300.0], "factors": [1.0, 2.0]}}},
     r"temperature\.bar\.value = 500 K must lie within 1 \.\. 300 K.*bar\.stiffness\.temp"),
    ({"bar": {"stiffness": {"temperatures": [300.0, 100.0], "factors": [1.0, 2.0]}}},
     r"temperatures = \.\.\. 100 K must be above"),
    ({"bar": {"stiffness": {"temperatures": [100.0, 300.0], "factors": [1.0]}}},
     "factors has 1 values"),
    ({"joint": {"friction": {"temperatures": [100.0, 300.0], "factors": [1.0, 2.0]}}},
     r"temperature\.joint: no joint has friction"),
    ({"pulley": {"friction": {"temperatures": [100.0, 300.0], "factors": [1.0, 2.0]}}},
     r"temperature\.pulley: there is no cable"),
])  # fmt: skip
def test_bad_input_is_refused(heat: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        ring(temperature=heat, joints={})


def test_a_ring_warm_in_all_parts_is_a_drawing_of_another_scale() -> None:
    """Rods and hinge assemblies of one expansion: every length grows by e, and nothing strains."""
    e, warm = 1e-3, {"value": 393.15, "expansion": 1e-5}
    parts = dict.fromkeys(("diagonal", "bar", "hinge"), warm)
    scene = ring(temperature={"reference": 293.15} | parts)
    found = deployed(scene)
    plain = scene.structure.geometry().fold(0.0).corners.reshape(-1, 3)
    expected = e * np.linalg.norm(np.real(plain - plain.mean(axis=0)), axis=1)
    assert found.energy < 1e-15
    assert np.abs(found.deviations.ravel() - expected).max() < 1e-9


def test_expansion_of_hinge_assemblies_adds_to_errors_of_their_pins() -> None:
    warm = {"value": [300.0, 350.0, 400.0, 450.0], "expansion": 1e-5}
    scene = ring(
        temperature={"reference": 300.0, "hinge": warm},
        structure__hinge_error={"upper_left": 1e-4, "lower_right": [0.0, 1e-5, 0.0, 0.0]},
    )
    made = substituted(scene).structure.hinge_error
    offset, heat = scene.structure.hinge_offset, 1e-5 * np.array([0.0, 50.0, 100.0, 150.0])
    assert made.upper_left == pytest.approx(1e-4 + (offset + 1e-4) * heat, rel=1e-14)
    lower = np.array([0.0, 1e-5, 0.0, 0.0])
    assert made.lower_right == pytest.approx(lower + (offset + lower) * heat, rel=1e-14)
