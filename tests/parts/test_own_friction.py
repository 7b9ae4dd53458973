"""A friction law that ringsim does not know: one class, and everything else takes it."""

from __future__ import annotations

import math
import re
from typing import Any, Literal

import numpy as np
import pytest
from loops import for_each
from rigid_motion import RigidRing

from ringsim.choice import kinds_of
from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import Integration
from ringsim.parts.joints import JointFriction
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene, scene_from_toml
from ringsim.stepping.locks import lock_times
from ringsim.units import AngularRate, PerSection, Torque, unit_at


class StribeckFriction(JointFriction):
    """Dry friction that is larger near rest: (c + (s - c) exp(-(w/w_s)^2)) tanh(w/rate)."""

    kind: Literal["stribeck"] = "stribeck"
    sliding: PerSection[Torque]
    sticking: PerSection[Torque]
    stribeck_rate: AngularRate = 0.1
    rate: AngularRate = 0.01

    def torque(self, rate: Any) -> Any:
        share = np.exp(-((rate / self.stribeck_rate) * (rate / self.stribeck_rate)))
        size = self.sliding + (self.sticking - self.sliding) * share
        return size * np.tanh(rate / self.rate)

    def characteristic_rate(self) -> float:
        return min(self.rate, self.stribeck_rate)


LAW = {"kind": "stribeck", "sliding": 1e-4, "sticking": 3e-4, "stribeck_rate": 0.05}


def scene(sections: int, **values: Any) -> Scene:
    plain = {
        "structure.sections": sections, "structure.aspect_ratio": 1.0, "net": "none",
        "rods.damping": 0.0, "rods.young_modulus": 120e10, "loads.force": 0.03,
        "solver.tolerance": 1e-4, "solver.newton_tolerance": 1e-5, "joints.vjoint": dict(LAW),
        "solver.settling_time": 0.0,
    }  # fmt: skip
    return load_scene("ring18").with_values(
        plain | {k.replace("__", "."): v for k, v in values.items()}
    )


def lost_and_missing(found: Any) -> tuple[float, float]:
    """Energy lost in the joints, and missing from the balance, over the work, before contact."""
    energies = np.array(found.energies)
    lost = np.cumsum(energies[:, 3])
    missing = energies[:, 0] + energies[:, 1] - energies[0, 1] + lost - energies[:, 2]
    free = np.maximum.accumulate(np.array(found.angles).max(axis=(1, 2))) < math.pi
    work = energies[:, 2].max()
    return float(lost[free].max() / work), float(np.abs(missing[free]).max() / work)


def test_it_is_a_kind_as_others_are():
    assert kinds_of(JointFriction)["stribeck"] is StribeckFriction
    loaded = scene(3)
    assert loaded.joints.vjoint == StribeckFriction(**LAW)
    again = scene_from_toml(loaded.to_toml(), source="written")
    assert again == loaded
    assert unit_at(loaded, "joints.vjoint.sliding") == "N m"
    assert scene(3, joints__vjoint__sticking=[1e-3, 2e-3, 3e-3]).joints.vjoint is not None


@for_each(
    ("values", "named"),
    [
        ({"joints__vjoint__stickin": 1.0}, "joints.vjoint.stickin is not a known key (did you"),
        ({"joints__vjoint__sliding": -1.0}, "joints.vjoint.sliding = -1.0 N m must be at least 0"),
        ({"joints__vjoint__sticking": [1.0, 2.0]}, "joints.vjoint.sticking has 2 values"),
        ({"joints__hinge": {"kind": "stribek"}}, "did you mean stribeck?"),
        ({"joints__hinge": {"kind": "stribeck"}}, "joints.hinge.sliding is missing"),
        ({"joints__hinge": {"stribeck_rate": 1.0}}, "joints.hinge.stribeck_rate is not a known"),
    ],
)
def test_it_is_refused_as_others_are(values, named):
    with pytest.raises(InputError, match=re.escape(named)):
        scene(3, **values)


def test_it_closes_the_energy_balance_of_a_one_section_truss():
    truss = {"structure__closed": False, "boom__base": "fixed"}
    law = {"joints__vjoint__sliding": 4e-4, "joints__vjoint__sticking": 1e-3}
    found = Integration(build(scene(1, **truss, **law))).run()
    assert found.status.word == "ok"
    lost, missing = lost_and_missing(found)
    assert lost > 0.15
    # As for the kinds that ringsim has (test_friction.py): ten times the tolerance of the steps.
    assert missing < 1e-3


def test_rigid_and_elastic_rods_open_alike_against_it():
    case = scene(3)
    found = Integration(build(case)).run()
    times = np.array([0.0, 60.0])
    rigid = RigidRing(case).course(times).open_at
    plain = RigidRing(scene(3, joints__vjoint="none")).course(times).open_at
    assert lost_and_missing(found)[1] < 1e-3
    assert rigid / plain > 1.02
    # 1e-4 of step control and what is left of the rods' share, as in test_friction.py.
    assert np.nanmax(lock_times(*series(found))) == pytest.approx(rigid, rel=2e-4)


def series(found: Any) -> tuple[Any, Any, Any]:
    return np.array(found.times), np.array(found.angles), np.array(found.rates)
