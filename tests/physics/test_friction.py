"""Joint friction against the one-coordinate equation of the ideal ring, solved by scipy."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ring_runs import UNTIL_LOCKED, Array, ideal_time, ring, run
from ringsim.parts.joints import ViscousCoulombFriction
from ringsim.rigid.statics import OneCoordinate
from ringsim.scene import Scene

LAWS: dict[str, dict[str, Any]] = {
    "vjoint-viscous": {"vjoint": {"viscous": 5e-4}},
    "vjoint-coulomb": {"vjoint": {"coulomb": 5e-4}},
    "hinge-viscous": {"hinge": {"viscous": 4e-4}},
    "hinge-coulomb": {"hinge": {"coulomb": 2e-4}},
    "pivot-viscous": {"pivot": {"viscous": 2e-3}},
    "pivot-coulomb": {"pivot": {"coulomb": 1e-3}},
    "all": {
        "vjoint": {"viscous": 2e-4, "coulomb": 1e-4},
        "hinge": {"viscous": 1e-4, "coulomb": 1e-4, "rate": 0.05},
        "pivot": {"viscous": 2e-4, "coulomb": 1e-4},
    },
}


def joint_rates(scene: Scene, phi: float) -> dict[str, list[tuple[int, float]]]:
    """Number of joints and relative rate per rate of phi, by family.

    Bars turn by phi against the hinge assemblies, which do not turn, and by 2 phi against each
    other; a diagonal turns by theta, cos(theta) = l cos(phi) / d, two of them by 2 theta.
    """
    shape, count = scene.structure, scene.structure.sections
    cosine = shape.half_bar * math.cos(phi) / shape.half_diagonal
    theta = shape.half_bar * math.sin(phi) / shape.half_diagonal / math.sqrt(1.0 - cosine**2)
    return {
        "vjoint": [(2 * count, 2.0)],
        "pivot": [(count, 2.0 * theta)],
        "hinge": [(4 * count, 1.0), (4 * count, theta)],
    }


def friction(scene: Scene, phi: float, speed: float) -> float:
    """Generalised friction force on phi, J/rad."""
    total = 0.0
    for family, joints in joint_rates(scene, phi).items():
        law: ViscousCoulombFriction | None = getattr(scene.joints, family)
        if law is None:
            continue
        viscous, coulomb = float(law.viscous), float(law.coulomb)  # type: ignore[arg-type]
        for number, share in joints:
            rate = share * speed
            total += number * share * (viscous * rate + coulomb * math.tanh(rate / law.rate))
    return total


def ideal_time_with_friction(scene: Scene, angle: float) -> float:
    """Time at which the ideal ring with friction reaches ``angle`` (deg)."""
    ideal = OneCoordinate(scene)

    def change(time: float, state: Array) -> list[float]:
        phi, speed = state
        inertia = ideal.motion(phi).inertia
        slope = (ideal.motion(phi + 1e-5).inertia - ideal.motion(phi - 1e-5).inertia) / 2e-5
        pull = ideal.work_rate(phi) - 0.5 * slope * speed**2 - friction(scene, phi, speed)
        return [speed, pull / inertia]

    def there(time: float, state: Array) -> float:
        return float(state[0] - 0.5 * (math.pi - math.radians(angle)))

    there.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(
        change, (0.0, 60.0), [scene.structure.coordinate, 0.0], events=there, rtol=1e-8, atol=1e-10
    )
    return float(found.t_events[0][0])


def test_the_equation_without_friction_is_the_quadrature() -> None:
    scene = ring(3)
    assert ideal_time_with_friction(scene, 175.0) == pytest.approx(
        ideal_time(scene, 175.0), rel=1e-7
    )


@pytest.mark.parametrize(
    ("name", "engine"),
    [
        *(
            pytest.param(
                x, "full", marks=pytest.mark.quick if x == "pivot-coulomb" else pytest.mark.slow
            )
            for x in LAWS
        ),
        ("all", "frame"),  # the coulomb friction of all joints together
    ],
)
def test_friction_slows_the_ring_as_the_ideal_equation_says(name: str, engine: str) -> None:
    # Ten times the paper's stiffness: slow rings dwell where elasticity tells (2.5e-4 else).
    scene = ring(3, joints=LAWS[name], rods__young_modulus=120e10, **UNTIL_LOCKED)
    found = run(scene, engine)
    reached, expected = found.reaches(170.0), ideal_time_with_friction(scene, 170.0)
    slowed = expected / ideal_time(scene, 170.0) - 1.0
    assert slowed > 0.02
    # 1e-4 of step control and what is left of the rods' share.
    assert reached == pytest.approx(expected, rel=2e-4)
    energies = np.array(found.history.energies)
    before = found.before_contact()
    assert (energies[1:, 3][before[1:]] > 0.0).all()
    # What the balance lists as lost is work less kinetic and elastic energy, as far as the
    # velocities are exact (ten times the step tolerance).
    assert np.abs(found.balance()[before]).max() < 2e-3


def test_dry_friction_above_the_drive_holds_the_ring() -> None:
    """Regularised friction creeps: the rate stays where tanh balances the drive."""
    scene = ring(3, joints={"vjoint": {"coulomb": 0.1}}, solver__end_time=50.0)
    found = run(scene)
    phi = scene.structure.coordinate
    drive = -OneCoordinate(scene).work_rate(phi)
    joints = 2 * scene.structure.sections
    creep = 0.5 * 0.01 * math.atanh(drive / (2.0 * joints * 0.1))
    assert found.history.fate.word == "stalled"
    # It is watched for 5 s: the angle, and with it the drive, changes by less than 5 %.
    assert found.rates[-1].mean() == pytest.approx(2.0 * creep, rel=0.05)
