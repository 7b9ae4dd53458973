"""Pins that do not stand where they are drawn: the structure that comes of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from loops import for_each

from ringsim.layout.layout import layout_at_opening, layout_of
from ringsim.parts.rods import LengthError
from ringsim.refusal import InputError
from ringsim.rigid.assembling import assembled, deployed
from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.structures.family import HingeError
from test_length_errors import Bar, of_pin_jointed_truss, ring, scattered

PINS = tuple(HingeError.model_fields)


def misplaced(size: float, sections: int = 4, seed: int = 2) -> dict[str, list[float]]:
    draw = np.random.default_rng(seed)
    return {name: (size * draw.standard_normal(sections)).tolist() for name in PINS}


def test_equal_errors_are_a_ring_drawn_with_another_offset() -> None:
    """Not to first order alone: places, heights and angles of the drawing with that offset."""
    wrong = ring(structure__hinge_error=dict.fromkeys(PINS, 2e-3))
    drawn = layout_of(ring(structure__hinge_offset=0.006554 + 2e-3))
    found = assembled(layout_of(wrong), wrong.rods)
    assert found.energy < 1e-15

    def corners(layout: Any) -> np.ndarray:
        places = np.array([[layout.bodies[k].pose.place for k in p] for p in layout.corners])
        apart = places.reshape(-1, 1, 3) - places.reshape(1, -1, 3)
        return np.linalg.norm(apart, axis=2)

    assert np.abs(corners(found.layout) - corners(drawn)).max() < 1e-11
    at_drawing = corners(layout_of(wrong))
    assert np.abs(at_drawing - corners(drawn)).max() > 1e-3


def test_a_run_with_equal_errors_is_that_with_another_offset() -> None:
    """To a thousandth of what the offset changes, in either engine."""
    short: dict[str, Any] = {"solver__end_time": 0.4, "record__interval": 0.1}
    for engine in ("frame", "full"):
        plain, wrong, drawn = (
            np.asarray(simulate(ring(**short, **values), engine).opening_angle)
            for values in (
                {},
                {"structure__hinge_error": dict.fromkeys(PINS, 5e-3)},
                {"structure__hinge_offset": 0.006554 + 5e-3},
            )
        )
        assert np.abs(wrong - drawn).max() < 1e-3 * np.abs(plain - drawn).max()


def test_corners_of_a_deployed_ring_of_three_are_those_of_a_pin_jointed_truss() -> None:
    """Pins on the corners' lines: one that stands off by d along the section lengthens its bar by d
    and its diagonal by d times the cosine between both.
    """
    off = {name: np.abs(sizes).tolist() for name, sizes in misplaced(1e-5, 3).items()}
    scene = ring(3, structure__hinge_offset=0.0, structure__hinge_error=off)
    drawn = layout_at_opening(scene, math.pi)
    at = np.array([[drawn.bodies[k].pose.place for k in plane] for plane in drawn.corners])
    bars: list[Bar] = []
    for k in range(3):
        following = (k + 1) % 3
        level = at[0, following] - at[0, k]
        level /= np.linalg.norm(level)
        for left, right in ((0, 0), (1, 1), (1, 0), (0, 1)):
            along = at[right, following] - at[left, k]
            name = ("upper", "lower")
            gone = off[f"{name[left]}_left"][k] + off[f"{name[right]}_right"][k]
            # The rod keeps its length, and its corners are so much further apart.
            longer = gone * float(level @ along) / float(np.linalg.norm(along))
            bars.append(((left, k), (right, following), longer))
    expected = of_pin_jointed_truss(at, bars)
    found = deployed(scene).deviations.ravel()
    assert np.abs(found - expected).max() < 5e-3 * expected.max()


def test_an_offset_alone_is_an_error_of_both_halves_and_both_diagonals() -> None:
    """A section whose pins all stand off by d, deployed, is one with longer rods: a ring with
    these length errors, all to first order, lies where one with the pins' errors does.
    """
    d, section = 1e-5, 1
    off = {name: [d * (k == section) for k in range(4)] for name in PINS}
    scene = ring(structure__hinge_error=off)
    shape = scene.structure
    bar = [d / shape.half_bar * (k == section) for k in range(4)]
    share = shape.half_bar / shape.half_diagonal
    diagonal = [d * share / shape.half_diagonal * (k == section) for k in range(4)]
    names = {n: bar if n.startswith("bar") else diagonal for n in LengthError.model_fields}
    pair = [deployed(ring(**values)).deviations for values in (
        {"structure__hinge_error": off}, {"rods__length_error": names},
    )]  # fmt: skip
    assert np.abs(pair[0] - pair[1]).max() < 1e-3 * pair[0].max()


def test_both_engines_start_and_move_alike() -> None:
    values: dict[str, Any] = {
        "structure__hinge_error": misplaced(2e-5), "rods__length_error": scattered(1e-5),
        "solver__end_time": 0.4, "record__interval": 0.1, "solver__tolerance": 1e-4,
    }  # fmt: skip
    frames, full = (simulate(ring(**values), engine) for engine in ("frame", "full"))
    assert float(frames["prestress_energy"]) > 1e-9
    assert float(full["prestress_energy"]) == pytest.approx(
        float(frames["prestress_energy"]), rel=1e-6
    )
    apart = np.asarray(frames["opening_angle"]) - np.asarray(full["opening_angle"])
    assert np.abs(apart).max() < 1e-4


@for_each(("name", "values", "words"), [
    ("ring18", {"structure.hinge_error": {"upper_left": 0.02}}, "upper_left"),
    ("ring18", {"structure.hinge_error": {"upper_left": [1e-5, 2e-5]}}, "18"),
    ("ring18", {"structure.hinge_error": {"upper_left": 1e-5}, "rods.kind": "ancf"},
     r"structure\.hinge_error needs rods\.kind"),
    ("planar-truss", {"structure.hinge_error": {"upper_left": 1e-5}}, "hinge_error"),
])  # fmt: skip
def test_bad_input_is_refused(name: str, values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_scene(name).with_values(values)


def test_a_pin_beyond_the_line_of_its_hinge_assembly_is_refused() -> None:
    words = r"lower_left = -0\.009 m must be at least -0\.006554.*raise it"
    with pytest.raises(InputError, match=words):
        ring(structure__hinge_error={"lower_left": [0.0, -9e-3, 0.0, 0.0]})
