"""A V-joint that sticks needs no cable."""

import pytest

from ringsim.scene import load_scene

pytestmark = pytest.mark.quick


def test_a_ring_without_cables_may_have_a_stuck_joint():
    fault = {"kind": "stuck-vjoint", "section": 2, "time": 1.0}
    scene = load_scene("ring18").with_values({"faults": [fault]})
    assert scene.cables is None
    assert [each.section for each in scene.faults] == [2]
