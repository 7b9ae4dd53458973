"""Joints as they are built in exudyn, and what a structure without the right ones is refused."""

from __future__ import annotations

import re
from typing import Any

import pytest
from loops import for_each

from ring_runs import ring
from ringsim.exudyn.build import build
from ringsim.layout.bodies import OnBody, OnRod
from ringsim.parts.faults import StuckVJoint
from ringsim.parts.joints import Joints, SpringDamperStop
from ringsim.refusal import InputError
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick


@pytest.mark.parametrize("kind", ["geometrically-exact", "ancf"])
def test_a_hinge_turns_about_the_axis_of_its_body(kind: str) -> None:
    """exudyn holds rotations along the axes of the first marker.

    Those of a body stay orthonormal, those of a rod with slope vectors do not: a rod's hinge on a
    body has the body's marker first, whichever side the layout names first.
    """
    model = build(ring(3, boom="none", rods__kind=kind)).model
    system = model.assembly.system
    objects = [system.GetObject(k) for k in range(system.systemData.NumberOfObjects())]
    built = [one for one in objects if one["objectType"] == "JointRevoluteZ"]
    first = {tuple(sorted(map(int, one["markerNumbers"]))): int(one["markerNumbers"][0])
             for one in built}  # fmt: skip
    orders = set()
    for joint in model.joints:
        assert joint.part.kind == "revolute"
        mounts = joint.part.first, joint.part.second
        axes = system.GetMarker(first[tuple(sorted(map(int, joint.markers)))])
        if any(isinstance(mount, OnBody) for mount in mounts):
            orders.add(tuple(type(mount) for mount in mounts))
            assert axes["markerType"] == "BodyRigid", joint.part
        else:
            assert int(axes["nodeNumber"]) == int(joint.nodes[0])
    assert len(built) == len(model.joints)
    assert (OnRod, OnBody) in orders  # without these nothing would have to be turned round


@for_each(
    ("values", "text"),
    [
        (
            {"joints": Joints(vjoint={"coulomb": 1e-4})},
            "joints.vjoint: this structure has no joint",
        ),
        (
            {"stop": SpringDamperStop()},
            "opening joints for it to act on: leave it out (stop =",
        ),
        (
            {"faults": (StuckVJoint(time=0.1, section=1),)},
            "faults[1]: this structure has no opening joints",
        ),
    ],
)
def test_parts_that_a_structure_has_no_joint_for_are_refused(
    values: dict[str, Any], text: str
) -> None:
    """Also where the structure itself does not refuse them."""
    scene = load_scene("planar-truss").model_copy(update=values)
    with pytest.raises(InputError, match=re.escape(text)):
        build(scene)
