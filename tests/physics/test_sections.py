"""Values per section act on that section; parts left out are not built."""

from collections import Counter
from typing import Any

import numpy as np
import pytest

from ring_runs import ENGINES, Array, ring, run
from ringsim.exudyn.build import build
from ringsim.scene import Scene

ROUND = {"boom": "none", "solver__end_time": 1.5}
"""A circle without a boom: every section is like every other."""

CHANGES: dict[str, dict[str, Any]] = {
    "rods.young_modulus": {"rods.young_modulus": 120e9, "section": 12e9},
    "loads.force": {"loads.force": 0.03, "section": 0.04},
    "joints.vjoint.viscous": {"joints.vjoint.viscous": 1e-5, "section": 1e-3},
    "joints.hinge.viscous": {"joints.hinge.viscous": 1e-5, "section": 1e-3},
    "joints.pivot.coulomb": {"joints.pivot.coulomb": 1e-5, "section": 1e-3},
}


def deviations(path: str, section: int, engine: str) -> Array:
    """Opening angles less their mean, deg, where one section differs; shape (2, sections)."""
    change = CHANGES[path]
    scene = ring(4, **ROUND).with_values(
        {path: change[path], f"{path}[{section}]": change["section"]}
    )
    last = run(scene, engine).angles[-1]
    return np.asarray(np.degrees(last - last.mean()))


@ENGINES
@pytest.mark.parametrize("path", CHANGES)
def test_a_value_acts_on_its_own_section(path: str, engine: str) -> None:
    """Moving the odd section along a circle moves the answer along."""
    first, third = (deviations(path, section, engine) for section in (1, 3))
    # Newton leaves 1e-5 of the driving forces: 1e-5 of the deviations, and some.
    np.testing.assert_allclose(np.roll(first, 2, axis=1), third, atol=1e-3 * np.ptp(first))
    assert np.ptp(first) > 1e-5
    if path != "rods.young_modulus":
        pulled = path == "loads.force"
        extreme = first.mean(axis=0).argmax() if pulled else first.mean(axis=0).argmin()
        assert extreme == 0


def built(scene: Scene) -> Counter[str]:
    system = build(scene).model.assembly.system
    count = system.systemData.NumberOfObjects()
    return Counter(system.GetObject(k)["objectType"] for k in range(count))


def test_only_what_is_named_is_built() -> None:
    bare = built(ring(3, boom="none", stop="none", loads="none"))
    # Per section 2 diagonals of two elements and 4 bar halves, 8 hinges, a pivot, 2 V-joints;
    # bodies are 2 hinge assemblies a corner and 2 masses at V-joints.
    assert bare == {
        "RigidBody": 3 * 4,
        "BeamGeometricallyExact3D": 3 * 8,
        "JointRevoluteZ": 3 * 11,
    }


@pytest.mark.parametrize(
    ("values", "more"),
    [
        pytest.param({"stop": {}}, {"ConnectorTorsionalSpringDamper": 6}, id="stops"),
        pytest.param(
            {"net": {"neutral_length": 0.1}}, {"MassPoint": 1, "ConnectorSpringDamper": 3}, id="net"
        ),
        pytest.param(
            {"joints.pivot.viscous": 0.1}, {"ConnectorTorsionalSpringDamper": 3}, id="pivots"
        ),
        pytest.param(
            {"joints.hinge.coulomb": 0.1}, {"ConnectorTorsionalSpringDamper": 24}, id="hinges"
        ),
        pytest.param({"joints.vjoint.viscous": 0.0}, {}, id="no-friction-at-all"),
        pytest.param({"boom": {"kind": "rigid"}}, {"JointGeneric": 1}, id="rigid-boom"),
        pytest.param(
            {"boom": {"kind": "rigid", "base": "fixed"}},
            {"JointGeneric": 2, "Ground": 1},
            id="fixed-boom",
        ),
        pytest.param(
            {"boom": {"kind": "flexible", "elements": 5}},
            {"ANCFCable": 5, "JointSpherical": 2, "JointSliding": 1},
            id="flexible-boom",
        ),
        pytest.param({"rods.elements": 3}, {"BeamGeometricallyExact3D": 48}, id="elements"),
        pytest.param(
            {"rods.damping": 0.001},
            {"RigidBody": 48, "ConnectorRigidBodySpringDamper": 24},
            id="damped-rods",
        ),
        pytest.param({"structure.vjoint_mass": 0.0}, {"RigidBody": -6}, id="no-masses"),
    ],
)
def test_a_part_brings_what_it_needs(values: dict[str, Any], more: dict[str, int]) -> None:
    bare = ring(3, boom="none", stop="none", loads="none")
    found = built(bare.with_values(values))
    found.subtract(built(bare))
    assert {kind: count for kind, count in found.items() if count} == more
