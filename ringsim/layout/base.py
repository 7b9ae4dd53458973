"""What holds a structure: its boom and, at the boom's upper end, the ground or a spacecraft."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ringsim.layout.bodies import SPACE, InSpace, Lump, OnBody
from ringsim.layout.joints import Joint
from ringsim.layout.layout import SPACECRAFT, BoomBeam
from ringsim.parts.boom.rigid import RigidBoom

if TYPE_CHECKING:
    from ringsim.layout.draft import Draft

_UPWARDS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Axes with x along the boom."""


def add_boom(draft: "Draft") -> BoomBeam | None:
    """A flexible boom; a rigid one becomes a lump of the body at its top."""
    boom = draft.scene.boom
    if boom is None:
        return None
    draft.require_corners("boom", 2)
    top, low = (OnBody(plane[0].number) for plane in draft.corners[:2])
    body, tube = draft.bodies[top.body], boom.tube
    if boom.base == "fixed":
        draft.joints.append(Joint("weld", "", 0, InSpace(body.pose.place, SPACE), top))
    across = 0.125 * boom.mass * (tube.outer_diameter**2 + tube.inner_diameter**2)
    along = boom.mass * boom.length**2 / 3.0
    centre = np.array([0.0, 0.0, -0.5 * boom.length])
    line = Lump("boom", boom.mass, centre, np.diag([along, along, 0.0]))
    sections = across * np.diag([0.5, 0.5, 1.0])
    _add_spacecraft(draft, top.body)
    if not isinstance(boom, RigidBoom):
        # Elements are lines: what the tube's sections have of inertia turns with its top.
        _add_lump(draft, top.body, Lump("boom", 0.0, np.zeros(3), sections))
        return BoomBeam(top, low, boom, line)
    _add_lump(draft, top.body, line._replace(inertia=line.inertia + sections))
    # A sleeve slides along z, a prismatic joint along x.
    axes = SPACE if boom.joint == "sleeve" else _UPWARDS
    first, second = (end._replace(axes=axes) for end in (top, low))
    draft.joints.append(Joint(boom.joint, "", 0, first, second))
    return None


def base_of(draft: "Draft") -> int | None:
    """Number of the body that is held, or that a boom's upper end is fixed to; None without."""
    for joint in draft.joints:
        if isinstance(joint.first, InSpace) and isinstance(joint.second, OnBody):
            return joint.second.body
    return None if draft.scene.boom is None else draft.corners[0][0].number


def _add_spacecraft(draft: "Draft", top: int) -> None:
    craft = draft.scene.spacecraft
    if craft is not None:
        lump = Lump(SPACECRAFT, craft.mass, np.array(craft.centre), craft.inertia_at_mount)
        _add_lump(draft, top, lump)


def _add_lump(draft: "Draft", number: int, lump: Lump) -> None:
    body = draft.bodies[number]
    draft.bodies[number] = replace(body, lumps=(*body.lumps, lump))
