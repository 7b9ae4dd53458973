"""The energy quadrature against closed forms, another quadrature, itself and the paper."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from ring_runs import ideal_time, ring
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene, load_scene

BARE = {"boom": "none", "rods__density": 1e-3}
"""Nothing but corners and V-joints: the rods weigh 1e-6 of them."""


def bare_inertia(scene: Scene, phi: float) -> float:
    """A circle of point masses: radial and vertical rates of corners and V-joints."""
    shape, count = scene.structure, scene.structure.sections
    width = 2.0 * shape.half_bar * math.cos(phi)
    narrowing = -2.0 * shape.half_bar * math.sin(phi)
    height = math.sqrt(4.0 * shape.half_diagonal**2 - width**2)
    rising = -0.5 * width * narrowing / height
    corner = (0.5 * narrowing / math.sin(math.pi / count)) ** 2 + rising**2
    inward = (0.5 * narrowing / math.tan(math.pi / count)) ** 2
    vjoint = inward + (rising - shape.half_bar * math.cos(phi)) ** 2
    return 2.0 * count * (shape.corner_mass * corner + shape.vjoint_mass * vjoint)


def bare_work(scene: Scene, phi: float) -> float:
    """The forces' work: each V-joint rises by half the height less the bars' own rise."""
    shape = scene.structure
    width = 2.0 * shape.half_bar * math.cos(phi)
    height = math.sqrt(4.0 * shape.half_diagonal**2 - width**2)
    force = scene.loads.force  # type: ignore[union-attr]
    return shape.sections * float(force) * (height - 2.0 * shape.half_bar * math.sin(phi))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("phi", "sections"),
    [
        pytest.param(phi, n, marks=pytest.mark.quick if n < 72 or phi == 0.3 else pytest.mark.slow)
        for n in (3, 6, 18, 72)
        for phi in (0.0, 0.3, 1.1, 1.5)
    ],
)
def test_inertia_of_a_circle_of_point_masses(sections: int, phi: float) -> None:
    scene = ring(sections, **BARE)
    # The rods' share: their mass over the points' mass, below 3e-6 at this density.
    assert OneCoordinate(scene).motion(phi).inertia == pytest.approx(
        bare_inertia(scene, phi), rel=3e-6
    )


@pytest.mark.quick
def test_the_same_time_by_adaptive_quadrature_of_the_closed_form() -> None:
    scene = ring(6, **BARE)
    start = scene.structure.coordinate

    def slowness(u: float) -> float:
        phi = start * (1.0 - u * u)
        gained = bare_work(scene, phi) - bare_work(scene, start)
        return 2.0 * start * u * math.sqrt(0.5 * bare_inertia(scene, phi) / gained)

    expected, _ = quad(slowness, 0.0, 1.0, epsabs=0.0, epsrel=1e-11)
    # Again the rods' mass, which enters by its square root.
    assert ideal_time(scene) == pytest.approx(expected, rel=3e-6)


def test_panels_converge() -> None:
    scene = ring(6)
    ideal, start = OneCoordinate(scene), scene.structure.coordinate
    best = opening_time(ideal, start, panels=64).time
    errors = [abs(opening_time(ideal, start, panels=n).time / best - 1.0) for n in (2, 4, 8)]
    # Eight nodes a panel: a smooth integrand gains far more than a factor 30 by halving.
    assert errors[1] < errors[0] / 30.0
    assert errors[2] < max(errors[1] / 30.0, 1e-13)


def test_a_net_that_comes_taut_on_the_way_is_told_in_the_uncertainty() -> None:
    scene = load_scene("ring18")
    ideal, start = OneCoordinate(scene), scene.structure.coordinate
    found = opening_time(ideal, start)
    best = opening_time(ideal, start, panels=192)
    assert abs(found.time - best.time) <= found.uncertainty
    assert found.uncertainty < 1e-6 * found.time


def test_times_shrink_with_the_root_of_the_force() -> None:
    slow, fast = ideal_time(ring(6, loads__force=0.01)), ideal_time(ring(6, loads__force=0.04))
    assert slow == pytest.approx(2.0 * fast, rel=1e-12)


def test_times_grow_with_the_root_of_all_masses() -> None:
    light = ring(6, boom="none")
    shape = light.structure
    heavy = light.with_values(
        {
            "structure.corner_mass": 4.0 * shape.corner_mass,
            "structure.vjoint_mass": 4.0 * shape.vjoint_mass,
            "rods.density": 4.0 * light.rods.density,
        }
    )
    assert ideal_time(heavy) == pytest.approx(2.0 * ideal_time(light), rel=1e-12)


def test_a_very_heavy_boom_is_as_good_as_a_fixed_one() -> None:
    heavy = {"boom__tube": {"outer_diameter": 1.0, "inner_diameter": 0.0}, "boom__density": 3e4}
    free, fixed = ring(6, **heavy), ring(6, boom__base="fixed")
    # The boom weighs 2e4 times the ring.
    assert ideal_time(free) == pytest.approx(ideal_time(fixed), rel=2e-4)


def test_a_free_ring_is_quicker_than_a_fixed_one() -> None:
    """Taking the rigid motion out can only take inertia away."""
    assert ideal_time(ring(6)) < ideal_time(ring(6, boom__base="fixed"))


@pytest.mark.quick
def test_the_force_is_the_slope_of_the_work() -> None:
    ideal = OneCoordinate(load_scene("ring18"))
    for phi in np.linspace(0.05, 1.15, 7):
        slope = (ideal.work(phi + 1e-5) - ideal.work(phi - 1e-5)) / 2e-5
        # Central differences: their own error is about 1e-10 of the work over the step.
        assert ideal.work_rate(phi) == pytest.approx(slope, rel=1e-6)


@pytest.mark.quick
@pytest.mark.parametrize(
    ("force", "published", "within"),
    [
        pytest.param(0.015, 17.58, 1e-4, id="calibrated"),
        pytest.param(0.02, 15.06, 0.01, id="predicted"),
        pytest.param(0.03, 12.16, 0.01, id="predicted-too"),
    ],
)
def test_published_deployment_times(force: float, published: float, within: float) -> None:
    scene = load_scene("ring18").with_values({"loads.force": force})
    assert ideal_time(scene) == pytest.approx(published, rel=within)
