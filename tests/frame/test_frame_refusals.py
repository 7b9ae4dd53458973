"""What frames do not represent is refused with the reason and the cure."""

from typing import Any

import pytest

from ringsim.frame.integrate import solve
from ringsim.refusal import InputError
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("planar-truss", {}),
        ("ring18", {"rods.kind": "ancf", "rods.damping": 0.0, "record.stress": False}),
    ],
    ids=["planar-truss", "ancf"],
)
def test_it_is_refused(name: str, values: dict[str, Any]) -> None:
    with pytest.raises(InputError) as refused:
        solve(load_scene(name).with_values(values))
    text = str(refused.value)
    assert "frame" in text
    assert 'fidelity = "full"' in text
    assert "\n" not in text
