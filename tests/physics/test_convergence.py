"""Orders of convergence, and two rod formulations that have nothing in common but the physics."""

import functools
import math

import numpy as np
import pytest

from ring_runs import ENGINES, UNTIL_LOCKED, Array, Run, ideal_time, ring, run


@ENGINES
def test_second_order_in_a_constant_step(engine: str) -> None:
    """Generalised-alpha is of second order in positions for index-3 constraints too.

    170 deg lies before the first contact, so the motion is smooth up to there; the crossing is
    interpolated by cubics, whose fourth order does not show.
    """
    times = [
        run(
            ring(3, solver__step=h, solver__step_control="constant", solver__end_time=2.48), engine
        ).reaches(170.0)
        for h in (0.04, 0.02, 0.01, 0.005)
    ]
    changes = np.abs(np.diff(times))
    orders = np.log2(changes[:-1] / changes[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)  # 1.94 and 2.016


@functools.cache
def nearly_open(tolerance: float, engine: str) -> Run:
    return run(ring(3, solver__tolerance=tolerance, solver__end_time=2.48), engine)


@ENGINES
@pytest.mark.parametrize("tolerance", [4e-4, 1e-4, 2.5e-5])
def test_a_moving_step_keeps_its_tolerance(tolerance: float, engine: str) -> None:
    found = nearly_open(tolerance, engine)
    # 1.5e-5 stands for what no step can take away: elastic strains, which the reference (the
    # limit of constant steps, 5.25e-5 later than the ideal ring) holds only at this modulus.
    limit = ideal_time(found.scene, 170.0) * (1.0 + 5.25e-5)
    assert found.reaches(170.0) == pytest.approx(limit, rel=tolerance + 1.5e-5)


@ENGINES
def test_a_tighter_tolerance_costs_steps_by_its_root(engine: str) -> None:
    """h ~ tolerance^(1/2) must hold also where the steps begin to see the rods vibrate."""
    coarse, fine = (len(nearly_open(t, engine).times) for t in (1e-4, 1e-5))
    assert fine < 1.3 * math.sqrt(10.0) * coarse


def refined(kind: str, young_modulus: float, counts: tuple[int, ...]) -> Array:
    """Changes of the mean angle, rad, from one number of elements a rod half to the next.

    All runs share their steps, so only space differs, and it shows above Newton's residual.
    """
    angles = []
    for elements in counts:
        found = run(
            ring(
                3,
                rods__kind=kind,
                rods__elements=elements,
                rods__young_modulus=young_modulus,
                solver__step=0.02,
                solver__step_control="constant",
                solver__end_time=2.44,
            )
        )
        angles.append(float(found.mean(2.44)))
    return np.abs(np.diff(angles))


@pytest.mark.slow
def test_refining_geometrically_exact_rods() -> None:
    """Second order or better, shown with rods soft enough for their own inertia to matter."""
    coarse, fine = refined("geometrically-exact", 1e9, (1, 2, 4))
    assert np.log2(coarse / fine) > 1.9
    # At the paper's stiffness one element is enough.
    assert refined("geometrically-exact", 120e9, (1, 2)).max() < math.radians(2e-4)


@pytest.mark.slow
def test_refining_ancf_rods() -> None:
    """Their cross-sections vibrate with the elements, so at this stiffness no order shows."""
    assert refined("ancf", 120e9, (1, 2, 4)).max() < math.radians(0.004)


def test_formulations_agree() -> None:
    """Shear-deformable beams with quaternions against slope vectors: same deployment time."""
    # Two elements: one ANCF element is stiffer, which shows in the fifth digit (4e-6 with two).
    exact, ancf = (
        run(ring(3, rods__kind=kind, rods__elements=2, **UNTIL_LOCKED), engine)
        for kind, engine in (("geometrically-exact", "frame"), ("ancf", "full"))
    )
    assert ancf.reaches(175.0) == pytest.approx(exact.reaches(175.0), rel=1e-5)
    assert ancf.locks.max() == pytest.approx(exact.locks.max(), rel=1e-4)
    np.testing.assert_allclose(ancf.locks, exact.locks, rtol=1e-4)
