"""The Jacobian that Newton sees against differences of the forces, and their virtual work."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from driven import Bench, Motion, truss
from ringsim.exudyn.assembly import turn_rates

pytestmark = pytest.mark.quick

Array = NDArray[np.float64]

STRETCHES = {"taut": 0.02, "almost taut": 5e-5, "almost slack": -5e-5, "slack": -5e-3}
"""Rope wound beyond the path, m."""
SPEEDS = {"full slip": 0.05, "slip reversal": 2e-4, "standstill": 0.0, "paying out": -2e-4}
"""Winding speed, m/s; the friction of a pulley turns round within 2e-3 m/s."""


def bench(stretch: float, speed: float, sections: int = 2, **values: object) -> Bench:
    """A rope soft enough for differences: its passage from slack to taut is 0.6 mm wide."""
    fields = {
        "both__axial_stiffness": 1e3,
        "both__slack_width": 0.5,
        "both__damping_time": 0.003,
        "both__slip_speed": 2e-3,
        "both__friction__coefficient": 0.003,
        "both__initial_slack": -stretch,
        "both__winch__winding__speed": speed,
    }
    return Bench(truss(sections, structure__opening_angle=70.0, **(fields | values)))


def centrally(function, step: float) -> Array:
    """Derivative at 0 to fourth order."""
    near, far = function(step) - function(-step), function(2 * step) - function(-2 * step)
    return np.asarray((8.0 * near - far) / (12.0 * step))


def disturbed(bed: Bench, rng: np.random.Generator, rate: float) -> tuple[Array, Array]:
    """Coordinates and rates off the symmetric reference; the path changes by micrometres."""
    place = bed.moved(bed.reference, bed.motion(rng, bed.reference), 2e-5)
    return place, rate * bed.rates(place, bed.motion(rng, place))


def by_place(bed: Bench, place: Array, rates: Array, motion: Motion) -> Array:
    """Derivative of the forces along a motion at fixed velocities of the points."""
    moving = bed.drive.path.place(place, rates).velocities
    return centrally(lambda s: bed.force_at(bed.moved(place, motion, s), moving), 1e-5)


def by_rates(bed: Bench, place: Array, rates: Array, motion: Motion) -> Array:
    """Derivative of the forces after the rates, towards those of a motion."""
    along = bed.rates(place, motion)
    return centrally(lambda s: bed.force(place, rates + s * along), 1e-5)


@pytest.mark.parametrize("speed", SPEEDS.values(), ids=SPEEDS)
@pytest.mark.parametrize("stretch", STRETCHES.values(), ids=STRETCHES)
def test_the_jacobian_is_the_derivative_of_the_forces(stretch: float, speed: float) -> None:
    """Over admissible directions: that is where the block stands on the bisector.

    Fourth order: (step / smoothing)^4 / 30 is below 1e-8 for steps of 1e-5 m and rad against a
    passage of 1e-3; rounding, 1e-16 of EA / step, is 1e-8 N/m against tangents of 1 N/m.
    """
    bed, rng = bench(stretch, speed), np.random.default_rng(3)
    place, rates = disturbed(bed, rng, 1e-3)
    stiffness = bed.jacobian(place, rates, 0.0)
    damping = 0.01 * (bed.jacobian(place, rates, 100.0) - stiffness)
    for _ in range(5):
        motion = bed.motion(rng, place)
        along = bed.rates(place, motion).ravel()
        for matrix, numeric in (
            (stiffness, by_place(bed, place, rates, motion)),
            (damping, by_rates(bed, place, rates, motion)),
        ):
            largest = np.abs(numeric).max()
            assert largest > 0.0
            assert -matrix @ along == pytest.approx(numeric, rel=0, abs=1e-6 * largest)


def test_the_jacobian_of_a_jammed_and_of_a_cut_cable() -> None:
    faults = [
        {"kind": "jammed-pulley", "time": 1.0, "cable": 1, "pulley": 4},
        {"kind": "cut-cable", "time": 1.0, "cable": 2, "span": 3},
    ]
    bed, rng = bench(0.02, 2e-4, sections=3, faults=faults), np.random.default_rng(5)
    place, rates = disturbed(bed, rng, 1e-3)
    before = bed.force(place, rates)
    bed.strike(place, rates, 1.0)
    assert np.abs(bed.force(place, rates) - before).max() > 1.0
    matrix = bed.jacobian(place, rates, 0.0)
    motion = bed.motion(rng, place)
    numeric = by_place(bed, place, rates, motion)
    largest = np.abs(numeric).max()
    along = bed.rates(place, motion).ravel()
    assert -matrix @ along == pytest.approx(numeric, rel=0, abs=1e-6 * largest)


def test_the_reduced_tangent_lacks_nothing_but_decay() -> None:
    """Without friction there is no decay to leave out; with it, little is left out."""
    for coefficient, most in ((0.0, 1e-12), (0.0004, 0.05)):
        bed = bench(0.02, 0.05, both__friction__coefficient=coefficient)
        place, rates = disturbed(bed, np.random.default_rng(3), 0.0)
        reduced, exact = (bed.jacobian(place, rates, 0.0, whole=w) for w in (False, True))
        assert np.abs(exact - reduced).max() < most * np.abs(exact).max()


@pytest.mark.parametrize("end", ["first", "last", "both"])
def test_virtual_work(end: str) -> None:
    """Power of the generalised forces is that of the point forces, and of spans that shorten."""
    bed, rng = bench(0.02, 0.05, sections=3, both__end=end), np.random.default_rng(8)
    for _ in range(10):
        place = bed.moved(bed.reference, bed.motion(rng, bed.reference), 1e-3)
        rates = bed.rates(place, bed.motion(rng, place))
        state, placed = bed.drive.evaluate(place, rates, 0.0)
        power = float(bed.force(place, rates) @ rates.ravel())
        by_points = float(np.sum(state.point_forces * placed.velocities))
        by_spans = -float(state.tensions @ state.rates)
        scale = float(np.sum(np.abs(state.point_forces * placed.velocities)))
        assert scale > 0.1
        # Sums of some hundred products in doubles.
        assert power == pytest.approx(by_points, abs=1e-13 * scale)
        assert power == pytest.approx(by_spans, abs=1e-13 * scale)


def test_velocities_are_the_rates_of_points() -> None:
    bed, rng = bench(0.02, 0.05), np.random.default_rng(9)
    place = bed.moved(bed.reference, bed.motion(rng, bed.reference), 1e-2)
    motion = bed.motion(rng, place)
    rates = bed.rates(place, motion)
    path = bed.drive.path
    difference = centrally(lambda s: path.place(bed.moved(place, motion, s), rates).points, 1e-4)
    # Fourth order: 1e-16 of truncation, 1e-12 of rounding.
    assert path.place(place, rates).velocities == pytest.approx(difference, abs=1e-10)


def test_forces_of_the_cables_are_internal() -> None:
    """Every pull has its counterpart: no net force, no net moment, whatever the ring does."""
    bed, rng = bench(0.02, 0.05, sections=4), np.random.default_rng(11)
    place = bed.moved(bed.reference, bed.motion(rng, bed.reference), 1e-2)
    rates = np.zeros_like(place)
    force = bed.force(place, rates).reshape(-1, 7)
    scale = np.abs(force[:, :3]).sum()
    assert scale > 1.0
    assert force[:, :3].sum(axis=0) == pytest.approx(0.0, abs=1e-13 * scale)
    for axis in np.eye(3):
        spins = np.broadcast_to(axis, (len(place), 3))
        moves = np.cross(spins, place[:, :3])
        turning = np.hstack([moves, turn_rates(place[:, 3:], spins)])
        assert force.ravel() @ turning.ravel() == pytest.approx(0.0, abs=1e-13 * scale)
