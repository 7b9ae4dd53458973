"""The closed form of the planar truss against what it was not derived from."""

from __future__ import annotations

import numpy as np
import pytest

from ringsim.scene import load_scene
from ringsim.theory.planar_truss import bending_moment, bending_strain, spring_force, tension

SCENE = load_scene("planar-truss")
TRUSS = SCENE.structure
LENGTHS = np.linspace(0.1001, 0.9, 33)


def test_cable_work_is_the_springs_energy():
    """The integral of T dc over the travel is what the spring releases: no ratio of rates in it."""
    points, weights = np.polynomial.legendre.leggauss(40)
    length = 0.5 + 0.4 * points
    work = 0.4 * weights @ tension(TRUSS, length)
    stored = [0.5 * float(spring_force(TRUSS, c)) ** 2 / TRUSS.spring.stiffness for c in (0.1, 0.9)]
    # The integrand is analytic on the travel; 40 points leave round-off.
    assert work == pytest.approx(stored[0] - stored[1], rel=1e-9)


def test_a_stiff_beam_is_bent_by_a_triangle():
    """With E I -> oo the moment is the polygon of a beam on two supports; forces in balance."""
    stiff = SCENE.with_values({"rods.young_modulus": 1e15})
    station = np.linspace(0.01, 0.62, 24)
    geometry = TRUSS.geometry()
    angle = geometry.angle(LENGTHS)
    push = spring_force(TRUSS, LENGTHS) * geometry.foot * np.sin(angle) / geometry.strut(angle)
    head, beam = geometry.head, geometry.beam
    x = station[:, None]
    polygon = np.where(x <= head, (beam - head) * x / beam, head * (beam - x) / beam) * push
    # N / (E I) is 6e-4 / m^2 here: sinh is straight to n^2 q^2 / 6 = 3e-5.
    np.testing.assert_allclose(bending_moment(stiff, LENGTHS, station), polygon, rtol=1e-4)


def test_a_taut_beam_obeys_its_equation():
    """Between joint and head M'' = N M / (E I), so M''/M is the same everywhere, and positive."""
    step = 0.01
    station = np.arange(0.02, 0.52, step)
    moment = bending_moment(SCENE, LENGTHS, station)
    bend = (moment[2:] - 2.0 * moment[1:-1] + moment[:-2]) / step**2 / moment[1:-1]
    assert np.all(bend > 0.0)
    # Differences of a hyperbolic sine: relative error n^2 step^2 / 12 < 1e-4, and round-off.
    np.testing.assert_allclose(bend, np.broadcast_to(bend[10], bend.shape), rtol=1e-3)


def test_the_moment_is_continuous_at_the_head_and_ends_at_the_joints():
    edges = [1e-9, TRUSS.strut_head, TRUSS.strut_head + 1e-9, TRUSS.beam_length - 1e-9]
    first, before, behind, last = bending_moment(SCENE, LENGTHS, edges)
    np.testing.assert_allclose(before, behind, rtol=1e-7)  # 1e-9 m of a slope of 12 / m
    assert np.abs(first / before).max() < 1e-7
    assert np.abs(last / before).max() < 1e-7


def test_the_design_shows_the_published_features():
    """Paper 001, figs 8 and 9, as far as they can be read."""
    pull = tension(TRUSS, LENGTHS) / 9.80665
    head = bending_strain(SCENE, LENGTHS, [TRUSS.strut_head])[0]
    assert 1.5 < pull.max() < 2.0
    assert pull.min() > 0.0
    assert 0.4 < LENGTHS[head.argmax()] < 0.6
    assert 1e-4 < head.max() < 5e-4
    assert max(head[0], head[-1]) < 0.15 * head.max()
    assert TRUSS.stowed_cable_length == pytest.approx(0.1, abs=1e-4)
