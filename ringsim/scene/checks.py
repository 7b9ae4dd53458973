"""What the parts of a scene ask of each other."""

from typing import TYPE_CHECKING

from ringsim.cable.control import named_winches
from ringsim.cable.winches import why_unlimited
from ringsim.choice import kind_of
from ringsim.layout.layout import Layout, layout_of
from ringsim.parts.rods import LengthError
from ringsim.scene.substituted import strained

if TYPE_CHECKING:
    from ringsim.scene import Scene


def check_parts(scene: "Scene") -> None:
    """Refuse (ValueError) parts that lack what they need of each other."""
    _check_faults(scene)
    _check_rods(scene)
    _check_limits(scene)
    _check_frequency(scene)
    _check_latch(scene)
    _check_margin(scene)


def check_controller(scene: "Scene") -> None:
    """Refuse (ValueError) winches as only runs leave them, and a controller that has none."""
    for name, winch in named_winches(scene).items():
        if winch.winding.told_before:
            raise ValueError(
                f"cables.{name.replace(' far', '.far_winch')}: begun, from_speed and wound_before "
                "are written by runs: leave them out"
            )
    if scene.controller is not None:
        scene.controller.check(scene)


def _check_limits(scene: "Scene") -> None:
    """Refuse (ValueError) limits of what a run does not tell."""
    if scene.limits.rod_stress is not None and not scene.record.stress:
        raise ValueError(
            f"limits.rod_stress = {scene.limits.rod_stress:g} Pa needs the stress of the rods: "
            "set record.stress = true, or leave the limit out"
        )
    for name, unit in (("tension", "N"), ("slack_duration", "s")):
        value = getattr(scene.limits, name)
        if value is not None and scene.cables is None:
            raise ValueError(
                f"limits.{name} = {value:g} {unit} needs a cable: add [cables.upper], or leave the "
                "limit out"
            )


def _check_latch(scene: "Scene") -> None:
    """Refuse (ValueError) a latch of stops that have none."""
    if scene.latch is not None and (scene.stop is None or not scene.stop.latch):
        raise ValueError(
            "latch: the stops of this scene do not hold: set stop.latch = true, or leave latch out"
        )


def _check_margin(scene: "Scene") -> None:
    """Refuse (ValueError) a margin of what has none."""
    if scene.margin is None:
        return
    if scene.cables is None and scene.loads is None and scene.hinge_spring is None:
        raise ValueError(
            "margin: nothing drives the ring (add [cables.upper], or leave margin out)"
        )
    if scene.loads is not None and scene.loads.reversal_time is not None:
        raise ValueError(
            f"margin: loads.reversal_time = {scene.loads.reversal_time:g} s: a margin needs "
            "loads of constant sign: leave one of the two out"
        )
    if reason := why_unlimited(scene.cables, scene.structure.planes):
        raise ValueError(reason)


def _check_frequency(scene: "Scene") -> None:
    if not scene.record.frequency:
        return
    name = "record.frequency = true"
    if scene.stop is None:
        raise ValueError(f'{name}: stop = "none" latches no V-joint: give stop.stiffness')
    if not scene.rods.oriented:
        raise ValueError(f'{name}: rods.kind = "{kind_of(scene.rods)}": frequencies are those of '
                         "geometrically-exact rods: leave rods.kind out")  # fmt: skip
    if "opening_angle" not in type(scene.structure).model_fields:
        raise ValueError(f'{name}: structure.kind = "{kind_of(scene.structure)}" has no '
                         "opening_angle: leave record.frequency out")  # fmt: skip


_NO_SUCH = "no such parts"


def check_layout(scene: "Scene") -> None:
    """Refuse (ValueError) what needs parts that the structure's layout does not have."""
    record, young, what = scene.record, scene.rods.bar_young_modulus, strained(scene)
    if not (record.shape or record.accelerations or young is not None or what or scene.margin):
        return
    layout, start = layout_of(scene), scene.structure.coordinate
    # Each by itself: one that a layout ignores is not made good by another.
    fields = [f"structure.{name}" for name in ("hinge_error", "angle_error")
              if getattr(scene.structure, name, None) is not None]  # fmt: skip
    shifting = [*fields, *([what] if what and what not in fields else [])]
    with_corners, with_bars = bool(layout.corners), any(r.group == "bars" for r in layout.rods)
    for asked, there, name, lacking in (
        (record.shape, with_corners, "record.shape = true", "no corners"),
        (record.accelerations, with_corners, "record.accelerations = true", "no corners"),
        (young is not None, with_bars, "rods.bar_young_modulus", "no folding bars"),
        *((each, _shows(layout, each), each, _NO_SUCH) for each in shifting),
        (
            scene.margin, scene.margin and layout.opens_by_twice(start), "margin",
            "opening angles that are not all 180 deg less twice its coordinate",
        ),
    ):  # fmt: skip
        if asked and not there:
            kind = kind_of(scene.structure)
            raise ValueError(f'{name}: structure.kind = "{kind}" has {lacking} (leave it out)')


def _shows(layout: Layout, what: str) -> bool:
    """Whether a layout has what a field of the scene strains."""
    if what == "structure.hinge_error":
        return any(joint.error is not None for joint in layout.joints)
    if what == "structure.angle_error":
        return layout.held is not None
    return any(rod.name in LengthError.model_fields for rod in layout.rods)


def _check_rods(scene: "Scene") -> None:
    """Refuse (ValueError) strained rods of a kind that cannot be."""
    what = strained(scene)
    if what and not scene.rods.oriented:
        raise ValueError(
            f'{what} needs rods.kind = "geometrically-exact", not "{kind_of(scene.rods)}": '
            f"choose that, or leave {what} out"
        )


def _check_faults(scene: "Scene") -> None:
    """Refuse (ValueError) faults of what is not there."""
    cables = [] if scene.cables is None else scene.cables.present()
    for number, fault in enumerate(scene.faults, 1):
        try:
            fault.check(scene)
        except ValueError as error:
            raise ValueError(f"faults[{number}] {error}") from None
        places = {"section": scene.structure.sections, "cable": len(cables)}
        if (cable := getattr(fault, "cable", None)) is not None:
            pulleys = scene.pulleys_of(cables[min(cable, len(cables)) - 1][1])
            places |= {"pulley": pulleys, "span": pulleys + 1}
        planes = scene.structure.planes
        if (plane := getattr(fault, "plane", planes[0])) not in planes:
            known = " or ".join(f'"{each}"' for each in planes)
            raise ValueError(f'faults[{number}].plane = "{plane}" must be {known}')
        for name, most in places.items():
            if getattr(fault, name, 0) > most:
                raise ValueError(
                    f"faults[{number}].{name} = {getattr(fault, name)} must be at most {most}: "
                    f"there is no such {name}"
                )
