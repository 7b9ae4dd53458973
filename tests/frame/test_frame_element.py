"""The rod element of frames by itself and against exudyn's."""

import numpy as np
import pytest

from one_element import (
    LENGTH,
    STIFFNESS,
    Ends,
    bent,
    cantilever,
    differences,
    energy,
    exudyn_cantilever,
    forces,
    rotation,
    strains,
    tangent,
)

pytestmark = pytest.mark.quick

BENDS = [1e-4, 0.99e-3, 1.01e-3, 0.02, 0.3, 1.0, 2.0]
"""Bends, rad: both sides of where coefficients are taken by series, and more than rods survive."""


@pytest.mark.parametrize("bend", BENDS)
def test_forces_are_the_derivative_of_the_energy(bend: float) -> None:
    """Central differences of a step of 1e-6 are good to 1e-10 of energies of this size."""
    ends = bent(np.random.default_rng(1), bend)
    found = forces(ends)
    assert found == pytest.approx(differences(energy, ends), abs=1e-8 * np.abs(found).max())


@pytest.mark.parametrize("bend", [1e-3, 1e-2, 0.1, 0.3])
def test_tangent_is_right_to_second_order_of_the_bend(bend: float) -> None:
    """It leaves out terms of psi^2 times the stiffness of the rod along itself: Z and what it
    changes with, 1/24 + 1/12; 0.02 to 0.08 has been found.
    """
    ends = bent(np.random.default_rng(2), bend)
    found = tangent(ends)
    error = np.abs(found - differences(forces, ends)).max() / np.abs(found).max()
    assert error < 0.125 * bend**2 + 1e-9


@pytest.mark.parametrize("bend", [0.0, 0.5, 2.0])
def test_a_rigid_motion_strains_nothing(bend: float) -> None:
    """To round-off of coordinates of a few metres, 1e-15 m."""
    rng = np.random.default_rng(3)
    ends = bent(rng, bend)
    moved = ends.carried_along(rng.normal(size=3), rotation(rng.normal(size=3)))
    for before, after in zip(strains(ends), strains(moved), strict=True):
        assert after == pytest.approx(before, abs=1e-14)


def test_forces_of_a_rigid_motion_turn_with_it() -> None:
    rng = np.random.default_rng(4)
    ends, turn = bent(rng, 0.7), rotation(rng.normal(size=3))
    moved = forces(ends.carried_along(rng.normal(size=3), turn))
    expected = (turn @ forces(ends).reshape(4, 3).T).T.ravel()
    assert moved == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("bend", BENDS)
def test_forces_balance(bend: float) -> None:
    """Internal forces do no work in a rigid motion: they and their moments sum to zero."""
    ends = bent(np.random.default_rng(5), bend)
    f1, m1, f2, m2 = forces(ends).reshape(4, 3)
    largest = np.abs(forces(ends)).max()
    assert f1 + f2 == pytest.approx(np.zeros(3), abs=1e-14 * largest)
    moment = m1 + m2 + np.cross(ends.x1, f1) + np.cross(ends.x2, f2)
    assert moment == pytest.approx(np.zeros(3), abs=1e-13 * largest)


@pytest.mark.parametrize("bend", BENDS)
def test_both_ends_are_alike(bend: float) -> None:
    ends = bent(np.random.default_rng(6), bend)
    other = forces(ends.exchanged())
    expected = forces(ends)
    largest = np.abs(expected).max()
    # Differences of places and axes lose digits where the bend is small.
    bound = 1e-14 / min(bend, 1.0) * largest
    assert np.concatenate([other[6:], other[:6]]) == pytest.approx(expected, abs=bound)


def test_pure_bending_gives_a_circle() -> None:
    """The chord of an arc of L under an angle t is L sin(t / 2) / (t / 2): to Newton's 1e-9."""
    angle = 0.8
    ends = cantilever(np.zeros(3), np.array([0.0, 0.0, angle * STIFFNESS[1][2]]))
    chord = LENGTH * np.sin(0.5 * angle) / (0.5 * angle)
    assert np.linalg.norm(ends.x2) == pytest.approx(chord, rel=1e-9)
    assert ends.r2 == pytest.approx(rotation(np.array([0.0, 0.0, angle])), abs=1e-9)


def test_a_cantilever_bends_by_beam_theory() -> None:
    """F L^3 / 3 EI and F L^2 / 2 EI at a small force, with S = 12 EI / L^2: to first order."""
    bending, across = STIFFNESS[1][2] * LENGTH, 1e-4
    stiff = 12.0 * bending / LENGTH**3
    added = across * LENGTH * (1.0 / (STIFFNESS[0][1] * LENGTH) - 1.0 / (stiff * LENGTH))
    ends = cantilever(np.array([0.0, across, 0.0]), np.zeros(3))
    deflection = across * LENGTH**3 / (3.0 * bending) + added
    # Second-order terms are of the slope, 1e-6, squared, and Newton leaves 1e-9.
    assert ends.x2[1] == pytest.approx(deflection, rel=1e-8)
    assert ends.r2[1, 0] == pytest.approx(across * LENGTH**2 / (2.0 * bending), rel=1e-8)


@pytest.mark.parametrize("size", [1e-3, 0.1, 0.6, 2.0])
@pytest.mark.parametrize(
    ("force", "moment"),
    [
        ([0.4, 3.0, -2.0], [0.0, 0.0, 0.0]),
        ([0.0, 0.0, 0.0], [0.1, 0.3, 0.4]),
        ([5.0, 3.0, -2.0], [0.1, 0.3, 0.4]),
        ([-5.0, 0.3, 0.0], [0.0, 0.0, 0.0]),
    ],
    ids=["across", "moment", "tension", "compression"],
)
def test_it_is_exudyns_element(force: list[float], moment: list[float], size: float) -> None:
    """Bent by up to 0.4 rad both stand at the same place, to what their Newtons leave (1e-9 of the
    load here, over stiffnesses that differ by 30 between bending and stretching).
    """
    load = size * np.array(force), size * np.array(moment)
    here, there = cantilever(*load), exudyn_cantilever(*load)
    moved = np.linalg.norm(here.x2 - [LENGTH, 0.0, 0.0])
    assert here.x2 == pytest.approx(there.x2, abs=1e-7 * moved)
    turned = np.abs(here.r2 - np.eye(3)).max()
    assert here.r2 == pytest.approx(there.r2, abs=1e-7 * turned + 1e-12)


def test_ends_count_rotations_in_space() -> None:
    """What ``differences`` does: a turn of both ends about the first one strains nothing."""
    ends = bent(np.random.default_rng(7), 0.4)
    turn = 1e-3 * np.array([1.0, 2.0, -1.0])
    swung = ends.x1 + rotation(turn) @ (ends.x2 - ends.x1)
    step = np.concatenate([np.zeros(3), turn, swung - ends.x2, turn])
    moved = ends.moved(step)
    assert isinstance(moved, Ends)
    assert energy(moved) == pytest.approx(energy(ends), rel=1e-12)
