"""Cables and faults by ``--set``, and places that do not exist."""

from __future__ import annotations

import pytest
from loops import for_each

from driven import truss
from ringsim.overrides import parse_assignment
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene

pytestmark = pytest.mark.quick

TRUSS = truss()


def changed(*assignments: str, scene: Scene = TRUSS) -> Scene:
    return scene.with_values(dict(parse_assignment(text) for text in assignments))


def test_one_coefficient_for_all_pulleys_or_for_one() -> None:
    scene = changed(
        "cables.upper.friction.coefficient=0.003",
        "cables.upper.friction.coefficient[5]=0.001",
        "cables.lower.winch.winding.speed=0.02",
    )
    assert scene.cables is not None
    upper, lower = scene.cables.upper, scene.cables.lower
    assert upper is not None
    assert lower is not None
    assert upper.friction.coefficients.tolist() == [0.003] * 4 + [0.001]
    assert lower.friction.coefficients == 0.0004
    assert lower.winch.winding.speed == 0.02
    assert upper.winch.winding.speed == 0.01


def test_another_kind_of_friction_and_of_winding() -> None:
    scene = changed(
        "cables.upper.friction={ kind = 'none' }",
        "cables.lower.friction.kind=capstan",
        "cables.lower.winch.winding.kind=ramp",
        "cables.lower.winch.winding.duration=2.0",
    )
    assert scene.cables is not None
    assert scene.cables.upper.friction.kind == "none"
    assert scene.cables.lower.friction.kind == "capstan"
    assert scene.cables.lower.winch.winding.duration == 2.0


def test_a_cable_less() -> None:
    scene = changed("cables.lower=none")
    assert scene.cables is not None
    assert [plane for plane, _ in scene.cables.present()] == [0]
    assert changed("cables=none").cables is None


FAULTS = (
    "{ kind = 'jammed-pulley', time = 1.0, cable = 2, pulley = 5 }",
    "{ kind = 'cut-cable', time = 1.0, span = 6 }",
    "{ kind = 'stuck-vjoint', time = 1.0, plane = 'lower', section = 2 }",
)


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_at_the_last_place_that_there_is(fault: str) -> None:
    (found,) = changed(f"faults=[{fault}]").faults
    assert found.time == 1.0
    again = load_scene("truss2").with_values({"faults": [found.model_dump(mode="json")]})
    assert again.faults == (found,)


REFUSED = {
    "cables.upper.friction.coefficient[6]=0.003": "choose one from 1 to 5",
    "cables.upper.friction.coefficient[0]=0.003": "choose one from 1 to 5",
    "cables.upper.friction.coefficient=[0.001, 0.002]": "has 2 values, but the structure needs 5",
    "cables.upper.friction.coefficient[2]=0.01": "must be below pulley_radius = 0.01 m",
    "cables.upper.friction={ kind = 'none', coefficient = 1e-3 }": "coefficient is not a known",
    "cables.upper.winch.winding.kind=ramp": "winding.duration is missing",
    "cables.uper.axial_stiffness=1e5": "did you mean upper?",
    "cables.upper.far_winch.winding={ kind = 'constant', speed = 0.02 }": 'needs end = "both"',
    "faults=[{ kind = 'jammed-pulley', time = 1.0, pulley = 6 }]": "faults[1].pulley = 6 must be",
    "faults=[{ kind = 'jammed-pulley', time = 1.0, pulley = 0 }]": "faults[1].pulley = 0 must be",
    "faults=[{ kind = 'jammed-pulley', time = 1.0 }]": "faults[1].pulley is missing",
    "faults=[{ kind = 'jamed-pulley', time = 1.0 }]": "did you mean jammed-pulley?",
    "faults=[{ kind = 'cut-cable', time = 1.0, span = 7 }]": "faults[1].span = 7 must be at most 6",
    "faults=[{ kind = 'cut-cable', time = 1.0, span = 1, cable = 3 }]": "faults[1].cable = 3 must",
    "faults=[{ kind = 'cut-cable', time = -1.0, span = 1 }]": "faults[1].time = -1.0",
    "faults=[{ kind = 'stuck-vjoint', time = 1.0, section = 3 }]": "faults[1].section = 3 must be",
}


@for_each("assignment", REFUSED)
def test_places_that_do_not_exist_are_refused(assignment: str) -> None:
    with pytest.raises(InputError) as refused:
        changed(assignment)
    assert REFUSED[assignment] in str(refused.value)


def test_faults_of_cables_that_are_not_there() -> None:
    cut = "faults=[{ kind = 'cut-cable', time = 1.0, span = 1, cable = 2 }]"
    with pytest.raises(InputError, match=r"faults\[1\].cable = 2 must be at most 1"):
        changed(cut, scene=changed("cables.lower=none"))
    with pytest.raises(InputError, match="the scene has none"):
        changed(cut, scene=load_scene("ring18"))
