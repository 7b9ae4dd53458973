"""Whatever a layout lists acts in both engines, or is refused: nothing is left out in silence."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

import ringsim.frame.model as frame_model
from ringsim.layout.layout import Contact, Layout, layout_of
from ringsim.parts.joints import SpringDamperStop
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.simulation import why_not_frame

pytestmark = pytest.mark.quick

ROOT = Path(frame_model.__file__).parents[1]


@pytest.mark.parametrize("engine", ["frame", "exudyn"])
def test_an_engine_reads_every_field_of_a_layout(engine: str) -> None:
    """By itself, or by what both share: outputs, cables and the rigid mechanism."""
    folders = (engine, "outputs", "rigid", "layout", "cable")
    text = "\n".join(
        file.read_text() for folder in folders for file in sorted((ROOT / folder).glob("*.py"))
    )
    own = "\n".join(file.read_text() for file in sorted((ROOT / engine).glob("*.py")))
    laws = {"contacts", "hub", "boom", "forces", "hung", "angle_laws", "pair_laws", "rubs"}
    for field in dataclasses.fields(Layout):
        where = own if field.name in laws else text
        assert f".{field.name}" in where, field.name


def test_contacts_of_bodies_are_refused_by_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene("ring18").with_values({"structure.sections": 3})
    assert why_not_frame(scene) == ""
    law = SpringDamperStop(stiffness=10.0)
    touching = dataclasses.replace(layout_of(scene), contacts=(Contact(0, 0, 0.1, law),))
    monkeypatch.setattr(frame_model, "layout_of", lambda _: touching)
    with pytest.raises(InputError, match=r'does not represent contacts of bodies.*"full"'):
        frame_model.FrameModel(scene)
    assert "contacts" in why_not_frame(scene)
