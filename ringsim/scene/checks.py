"""What the parts of a scene ask of each other."""

import math
import operator
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ringsim.cable.control import named_winches
from ringsim.cable.records import why_unlimited
from ringsim.choice import kind_of
from ringsim.layout.layout import Layout, layout_of
from ringsim.parts.rods import LengthError
from ringsim.scene.substituted import strained
from ringsim.units import unit_at

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
            f"set record.stress = true, or {_without('rod_stress')}"
        )
    for name, unit in (("tension", "N"), ("slack_duration", "s")):
        value = getattr(scene.limits, name)
        if value is not None and scene.cables is None:
            raise ValueError(
                f"limits.{name} = {value:g} {unit} needs a cable: add [cables.upper], or "
                f"{_without(name)}"
            )


def _without(limit: str) -> str:
    """How a scene is rid of a limit: a whole table of them takes no "none"."""
    return f"leave the limit out (--set limits.{limit}=none)"


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


# What is possible, and nobody means.


_USUAL = {
    "joints.vjoint.coulomb": (
        0.0, 1.0, "a pin of 10 mm with a dry friction of 0.3 has that under a load of 670 N"),
    "joints.pivot.coulomb": (
        0.0, 1.0, "a pin of 10 mm with a dry friction of 0.3 has that under a load of 670 N"),
    "latch.min_rate": (
        0.0, 2.0, "joints come to their latches at 0.01 to 1 rad/s; files give it in rad/s"),
    "latch.reach": (0.2, 90.0, "a pawl falls in over some degrees; files give it in deg"),
    "limits.rod_stress": (
        1e6, 1e10, "plastics bear more than 1 MPa, and no fibre 10 GPa; files give it in Pa"),
    "limits.tension": (1.0, 1e6, "a thread of 0.1 mm bears some 10 N; files give it in N"),
    "rods.density": (
        100.0, 2.5e4, "foam has 100 kg/m3 and tungsten 19,300; files give it in kg/m3"),
    "spacecraft.mass": (1.0, 1e6, "a cubesat has 1 kg; files give it in kg"),
    "spacecraft.centre": (-50.0, 50.0, "no spacecraft is so large; files give it in m"),
}  # fmt: skip
"""The least and the largest value, by path, that are not taken for a slip, and why."""
_FASTEST = 2e3
"""Speed of a motor without load, rad/s, above which a figure of it is taken for one in rev/min:
19,100 of them."""
_STRONGEST, _SWIFTEST = 1e4, 10.0
"""Tension (N) and speed (m/s) of a rope that no winch of an antenna gives it."""
_SOFT = 1e3
"""Axial stiffness of a rod, N, below which a figure of it is taken for a slip: the 10 N of a rope
make it longer by a hundredth."""
_TOO_HEAVY = 100.0
"""Mass of all corners over that of all rods above which a figure of it is taken for a slip."""


def doubtful(scene: "Scene") -> Iterator[str]:
    """Values that are possible and that nobody means, each with why: no reason to refuse a scene,
    which may be a study of just that.
    """
    layout, end = layout_of(scene), scene.solver.end_time
    shortest = min(rod.length for rod in layout.rods)
    for plane, cable in () if scene.cables is None else scene.cables.present():
        path = f"cables.{scene.structure.planes[plane]}"
        sizes = {
            f"{path}.pulley_radius": cable.pulley_radius,
            f"{path}.block_offset": cable.block_offset,
        }
        winches = {"winch": cable.winch, "far_winch": cable.far_winch}
        for name, winch in ((n, w) for n, w in winches.items() if w is not None):
            if (motor := winch.winding.motor) is not None:
                speed, limit = motor.no_load_speed, motor.current_limit
                if speed > _FASTEST:
                    yield (
                        f"{path}.{name}.winding.no_load_speed = {speed:g} rad/s is above "
                        f"{_FASTEST:g} rad/s: {speed:g} rev/min are {speed * math.tau / 60.0:.4g} "
                        "rad/s"
                    )
                if (tension := motor.stall_tension) > _STRONGEST:
                    yield (
                        f"{path}.{name}.winding stalls at {tension:.3g} N of rope, above "
                        f"{_STRONGEST:g} N: files give stall_torque in N m, of the motor's own "
                        "shaft, and gear_ratio as its turns for one of the drum"
                    )
                if (rate := motor.travel * motor.fastest) > _SWIFTEST:
                    yield (
                        f"{path}.{name}.winding winds up to {rate:.3g} m/s, above {_SWIFTEST:g} "
                        "m/s: gear_ratio is the motor's turns for one of the drum"
                    )
                constant = motor.torque_constant
                if constant and limit and (most := motor.stall_torque / constant) < limit:
                    yield (
                        f"{path}.{name}.winding.current_limit = {limit:g} A is above {most:.3g} A, "
                        "what the motor takes when it stalls: it never acts"
                    )
                sizes[f"{path}.{name}.winding.drum_radius"] = motor.drum_radius
            for key in ("start_time", "stop_time"):
                if (time := getattr(winch, key)) is not None and time > end:
                    yield (
                        f"{path}.{name}.{key} = {time:g} s is after solver.end_time = {end:g} s: "
                        "it never happens"
                    )
        for where, size in sizes.items():
            if size > shortest:
                yield f"{where} = {size:g} m is larger than the shortest rod, {shortest:.4g} m"
    for number, fault in enumerate(scene.faults, 1):
        if fault.time > end:
            yield (
                f"faults[{number}].time = {fault.time:g} s is after solver.end_time = {end:g} s: "
                "it never happens"
            )
    for path, (least, most, why) in _USUAL.items():
        inner, _, last = path.rpartition(".")
        value = getattr(operator.attrgetter(inner)(scene), last, None)
        if value is not None:
            low, high, unit = np.min(value), np.max(value), unit_at(scene, path)
            if low < least:
                yield f"{path} = {low:g} {unit} is below {least:g} {unit}: {why}"
            if high > most:
                yield f"{path} = {high:g} {unit} is above {most:g} {unit}: {why}"
    softest = min(layout.rods, key=lambda rod: rod.young_modulus * rod.tube.area)
    if (stiffness := softest.young_modulus * softest.tube.area) < _SOFT:
        yield (
            f"rods: the axial stiffness E A of the {softest.group} is {stiffness:.3g} N, below "
            f"{_SOFT:g} N: a pull of 10 N makes it longer by more than 1 %"
        )
    masses, rods = layout.masses(), {rod.group for rod in layout.rods}
    own = sum(mass for name, mass in masses.items() if name in rods)
    if masses.get("hinges", 0.0) > _TOO_HEAVY * own:
        yield (
            f"structure.corner_mass: corners of {masses['hinges']:.4g} kg on rods of {own:.4g} kg"
        )
