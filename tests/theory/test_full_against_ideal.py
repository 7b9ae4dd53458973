"""The full model against the ideal ring: two truths that share no integration and no mechanics.

What is left between them is the rods' elasticity.  It holds the mean angle back in proportion to
the driving forces and to 1 / E, and lets the sections open apart, which lowers the tension at the
winch: in proportion to 1 / E and to the square of the pulleys' friction.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from ideal_cases import six
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run, run_ideal
from ringsim.variables import Outcome

ANGLE = 0.1
"""Deg; asked for."""
TENSION = 0.02
"""Relative; asked for while the cables are taut."""
WHOLE = 170.0
"""Compared up to this angle, deg: beyond it the first V-joints lock one after another."""


@dataclass(frozen=True)
class Pair:
    """Mean opening angle (deg), tension at the winches (2, times) and asynchrony of both."""

    times: np.ndarray
    full: np.ndarray
    ideal: np.ndarray
    tension: np.ndarray
    ideal_tension: np.ndarray
    asynchrony: np.ndarray

    def held_back(self, where) -> np.ndarray:
        return np.asarray(np.abs(self.full - self.ideal)[where])

    def missing(self, where) -> np.ndarray:
        return np.asarray((1.0 - self.tension / self.ideal_tension)[:, where])


def both(scene: Scene) -> Pair:
    return beside(run_ideal(scene), run(scene))


def beside(ideal: Outcome, full: Outcome) -> Pair:
    """Over the times of the full run."""
    assert not full.status.failed
    assert not ideal.status.failed
    times = full.coordinates["time"]
    assert (times == ideal.coordinates["time"][: len(times)]).all()
    return Pair(
        times,
        full.values["opening_angle"].mean(axis=(0, 1)),
        ideal.values["opening_angle"][0, 0, : len(times)],
        full.values["cable_tension"][:, 0],
        ideal.values["cable_tension"][:, 0, : len(times)],
        full.values["asynchrony"],
    )


def six_sections(**values: Any) -> Scene:
    """Wound at 0.06 m/s, to 170 deg in 16 s."""
    fields = {"cable__winch__winding__speed": 0.06, "solver__step": 0.1, "solver__end_time": 16.0}
    return six(**(fields | values))


@functools.cache
def rigid() -> Outcome:
    """Whatever its rods are made of."""
    return run_ideal(six_sections())


@functools.cache
def usual() -> Pair:
    return beside(rigid(), run(six_sections()))


def test_six_sections_move_as_the_ideal_ring():
    pair = usual()
    whole = pair.ideal < WHOLE
    assert whole.sum() > 150
    assert pair.held_back(whole).max() < ANGLE
    # The winch's ramp lasts 1 s; during it the elastic rods take up part of the first pull.
    taut = whole & (pair.times >= 1.0)
    assert np.abs(pair.missing(taut)).max() < TENSION / 3.0


def test_what_is_left_is_elasticity():
    hard_rods = six_sections(solver__end_time=4.0, rods__young_modulus=480e9)
    soft, hard = usual(), beside(rigid(), run(hard_rods))
    late = (hard.times > 1.5) & (hard.times < 3.9)
    first = np.append(late, np.zeros(len(soft.times) - len(late), dtype=bool))
    ratio = soft.held_back(first) / hard.held_back(late)
    # Four times as stiff; the solver's own error in the angle is below a thousandth of a degree.
    np.testing.assert_allclose(ratio, 4.0, rtol=0.1)
    np.testing.assert_allclose(soft.asynchrony[first] / hard.asynchrony[late], 4.0, rtol=0.1)


@pytest.mark.slow
def test_eighteen_sections_move_as_the_ideal_ring():
    """The built-in ring with cables, after the ramp of its winches.

    While they start, within a second, the elastic ring lags by up to 0.11 deg, however fine the
    steps are: it is thrown into a swing on its ropes, which the ideal ring knows less of.

    The angle agrees up to 170 deg; the tension while the sections are less than 4 deg apart.

    Beyond, they are up to 15 deg apart at 170 deg, and the winch pulls up to 8 % less.
    """
    pair = both(load_scene("ring18-cable").with_values({"solver.end_time": 23.5}))
    whole = (pair.ideal < WHOLE) & (pair.times > 1.05)
    assert pair.held_back(whole).max() < ANGLE
    taut = whole & (pair.ideal > 40.0)
    together = taut & (pair.asynchrony < 3.0)
    assert together.sum() > 50
    assert np.abs(pair.missing(together)).max() < TENSION
    assert np.abs(pair.missing(taut)).max() < 0.1


@pytest.mark.slow
def test_eighteen_sections_with_half_the_friction_lose_a_quarter_as_much():
    half = {f"cables.{plane}.friction.coefficient": 2e-4 for plane in ("upper", "lower")}
    scene = load_scene("ring18-cable").with_values(half | {"solver.end_time": 23.5})
    pair = both(scene)
    taut = (pair.ideal < WHOLE) & (pair.ideal > 40.0)
    assert pair.held_back(taut).max() < ANGLE
    assert np.abs(pair.missing(taut)).max() < 1.2 * TENSION


@pytest.mark.slow
def test_truss_moves_as_the_ideal_ring_but_for_its_slack_phase():
    """Light joints let the first jerk throw the truss ahead, and the cables go slack.

    How far it flies depends on the energy of the jerk, part of which the elastic rods keep: up to
    a quarter of a degree.  Once the winch has caught up the memory of it is gone.
    """
    pair = both(load_scene("truss2"))
    whole = pair.ideal < WHOLE
    assert pair.held_back(whole).max() < 0.4
    caught = whole & (pair.times > 3.0)
    assert pair.held_back(caught).max() < 0.01
    # The lower corners at the open end hang on the rods alone: 1 % at 170 deg.
    assert np.abs(pair.missing(caught)).max() < TENSION
