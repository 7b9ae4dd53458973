"""Which values of other origin are truths of an accuracy study."""

from __future__ import annotations

import pytest

from ringsim.campaign.studies import truths_of
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick


def test_the_quadrature_is_no_truth_of_a_damped_net() -> None:
    scene = load_scene("ring18").with_values({"structure.sections": 6})
    assert truths_of(scene)
    assert not truths_of(scene.with_values({"net.damping": 0.05}))
