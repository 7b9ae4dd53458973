"""Analytic tangents against finite differences, taut, slack and in between."""

from __future__ import annotations

import numpy as np
import pytest
from stribeck import StribeckFriction

from cable_cases import LAWS, RADIUS, decays, random_case, still
from point_tangents import tangents

pytestmark = pytest.mark.quick

OF_SPEED = StribeckFriction(coefficient=0.3 * RADIUS, kinetic=0.3, speed=1e-3)

# Rope wound beyond the path: about 0.2 of the mean path taut; then within the smoothing; slack.
STRETCHES = {"taut": 0.01, "almost taut": 2e-5, "almost slack": -2e-5, "slack": -1e-3}
MATERIAL = {"axial_stiffness": 1e4, "slack_width": 0.5, "damping_time": 0.003}


def assembled(case, state):
    size = case.points.size
    stiffness, damping = np.zeros((size, size)), np.zeros((size, size))
    for tangent in tangents(case.chain, state, case.velocities):
        own = slice(3 * tangent.points.start, 3 * tangent.points.stop)
        stiffness[own, own] += tangent.stiffness
        damping[own, own] += tangent.damping
    return stiffness, damping


def differences(function, values, step):
    """Central differences of fourth order; columns after every component of ``values``."""
    columns = []
    for k in range(values.size):
        shift = np.zeros(values.size)
        shift[k] = step
        shift = shift.reshape(values.shape)
        near = function(values + shift) - function(values - shift)
        far = function(values + 2 * shift) - function(values - 2 * shift)
        columns.append((8.0 * near - far).ravel() / (12.0 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("law", [*LAWS.values(), OF_SPEED], ids=[*LAWS, "stribeck"])
@pytest.mark.parametrize("stretch", STRETCHES.values(), ids=STRETCHES)
def test_tangents_are_the_derivatives_of_the_forces(law, stretch):
    # Slow enough that the exponents of friction lie between -1 and 1.
    case = random_case(
        21,
        counts=(6, 4),
        speed=1e-3,
        wound=stretch,
        winding=1e-3,
        far_winding=2e-4,
        friction=law,
        slip_speed=2e-3,
        **MATERIAL,
    )
    state = case.state()
    stiffness, damping = assembled(case, state)
    by_position = differences(lambda x: case.state(points=x).point_forces, case.points, 2e-6)
    by_velocity = differences(
        lambda v: case.state(velocities=v).point_forces, case.velocities, 1e-5
    )
    # Fourth order: (step EA / (M width))^4 / 30 is below 1e-7; rounding 1e-16 EA / step below
    # 1e-8 of the largest entry.
    for analytic, numeric in [(stiffness, by_position), (damping, by_velocity)]:
        assert np.abs(numeric).max() > 0.0
        assert analytic == pytest.approx(numeric, rel=1e-6, abs=1e-6 * np.abs(numeric).max())


def test_a_translation_of_the_whole_cable_changes_no_force():
    case = random_case(4, wound=0.01, winding=0.3, friction=LAWS["bearing"], **MATERIAL)
    state = case.state()
    for k, tangent in enumerate(tangents(case.chain, state, case.velocities)):
        shift = np.tile(np.eye(3), (state.ropes.points_per_cable[k], 1))
        for part in (tangent.material, tangent.decay, tangent.geometric, tangent.damping):
            assert np.abs(part).max() > 0.0
            assert part @ shift == pytest.approx(0.0, abs=1e-12 * np.abs(part).max())


def test_the_material_part_at_rest_is_the_stated_rank_one_matrix():
    path = [[0, 0, 0], [1, 0, 0], [1.5, 0.6, 0], [2, 0, 0.4], [3, 0, 0]]
    case = still(path, 0.02, (1.0, 0.0), friction=LAWS["capstan"], axial_stiffness=1e4)
    state = case.state()
    (tangent,) = tangents(case.chain, state, case.velocities)
    gradients = np.zeros((4, 5, 3))
    spans = np.arange(4)
    gradients[spans, spans + 1] = state.directions
    gradients[spans, spans] = -state.directions
    gradients = gradients.reshape(4, 15)
    c, length = decays(state), state.lengths
    stiffness = 1e4 * state.paths[0] / state.natural[0] / np.sum(c * length)
    stated = -stiffness * np.outer(c @ gradients, gradients.sum(axis=0))
    assert tangent.material == pytest.approx(stated, abs=1e-12 * stiffness)
    assert np.linalg.matrix_rank(tangent.material, tol=1e-9 * stiffness) == 1


def test_without_friction_the_tangent_is_symmetric_and_resists():
    case = random_case(2, wound=0.01, speed=0.0, axial_stiffness=1e4)
    for tangent in tangents(case.chain, case.state(), case.velocities):
        largest = np.abs(tangent.stiffness).max()
        assert tangent.stiffness == pytest.approx(tangent.stiffness.T, abs=1e-12 * largest)
        assert np.linalg.eigvalsh(tangent.stiffness).max() < 1e-10 * largest


def test_a_cut_rope_has_no_tangent_and_a_straight_one_a_finite_one():
    points = np.outer(np.arange(5), [0.3, 0.4, 0.1])
    case = still(points, 0.001, friction=LAWS["bearing"])
    (tangent,) = tangents(case.chain, case.state(), case.velocities)
    assert np.all(np.isfinite(tangent.stiffness))
    case.ropes = case.ropes.cut(0, 2)
    (tangent,) = tangents(case.chain, case.state(), case.velocities)
    assert np.all(tangent.stiffness == 0.0)
    assert np.all(tangent.damping == 0.0)
