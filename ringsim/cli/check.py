"""``ringsim check``: validate a scene and say what it builds."""

from collections import Counter
from typing import Any

import click

from ringsim.choice import kind_of
from ringsim.cli.options import SETTINGS
from ringsim.layout.layout import Layout, layout_of
from ringsim.layout.mobility import internal_mobility
from ringsim.refusal import InputError, show
from ringsim.scene import Scene, load_scene
from ringsim.scene.substituted import strained, substituted
from ringsim.units import Model

_ASKED = ("margin", "hinge_spring", "temperature")
"""What few scenes name: not told of as left out."""
MOST_SECTIONS_FOR_MOBILITY = 72
"""Larger rings take seconds, and their answer is the same."""


@click.command()
@click.argument("scene", metavar="FILE")
@SETTINGS
@click.option(
    "--deploys-in", "time", type=click.FloatRange(0.0, min_open=True), metavar="SECONDS",
    help="Find the initial opening angle from which the scene deploys in this time (frame engine).",
)  # fmt: skip
@click.option(
    "--margin", is_flag=True,
    help="Tell what drives and what resists at every opening angle, and the margin by standards.",
)  # fmt: skip
def command(scene: str, settings: dict[str, Any], time: float | None, margin: bool) -> None:
    """Check FILE (a scene file, or the name of a built-in scene) without running it.

    Bad input ends with exit code 2 and one line that names the field, its value and the cure.
    """
    loaded = load_scene(scene).with_values(settings)
    if time is not None:
        from ringsim.calibration import opening_angle_for

        angle = opening_angle_for(loaded, time)
        click.echo(f"structure.opening_angle = {angle:.6g} deg: the ring deploys in {time:g} s")
        return
    if margin:
        from ringsim.cli.margin_table import margin_lines

        for text in margin_lines(substituted(loaded)):
            click.echo(text)
        return
    for label, text in _summary(loaded).items():
        if text:
            click.echo(f"{label:<12}{text}")


def _summary(scene: Scene) -> dict[str, str]:
    """What a scene builds; an empty text has no line."""
    friction = scene.joints.model_dump()
    parts = {name: getattr(scene, name) for name in sorted(type(scene).parts())}
    absent = {name: part is None for name, part in parts.items() if name not in _ASKED}
    absent |= {"joint friction": not friction, "stress output": not scene.record.stress}
    return {
        "scene": f"{scene.name}: {scene.title}" if scene.title else scene.name,
        **scene.structure.describe(),
        **_layout(scene),
        "assembly": _assembly(scene),
        **{name: _fields(part) for name, part in parts.items() if part is not None},
        "faults": "; ".join(map(_fields, scene.faults)),
        "friction": ", ".join(friction),
        "left out": ", ".join(name for name, out in absent.items() if out) or "nothing",
        "solver": _fields(scene.solver),
    }


def _layout(scene: Scene) -> dict[str, str]:
    layout = layout_of(scene)
    counts = Counter(joint.kind for joint in layout.joints)
    families = Counter(joint.family for joint in layout.joints)
    masses = layout.masses()
    parts = ", ".join(f"{name} {mass:.4g}" for name, mass in masses.items())
    groups = {rod.group: _count(len(rod.stations) - 1, "element") for rod in layout.rods}
    elements = ", ".join(f"{count} in {group}" for group, count in groups.items())
    points = {
        "hinge assemblies": sum(map(len, layout.corners)),
        "V-joints": families["vjoint"], "pivots": families["pivot"],
    }  # fmt: skip
    return {
        "rods": f"{len(layout.rods)} {kind_of(scene.rods)} ({elements})",
        "points": ", ".join(f"{count} {name}" for name, count in points.items() if count),
        "joints": ", ".join(_count(count, _JOINTS[kind]) for kind, count in counts.items()),
        "mobility": _mobility(layout),
        "mass": f"{sum(masses.values()):.4g} kg: {parts}",
    }


def _assembly(scene: Scene) -> str:
    """What lengths of rods do without a run; empty if these are as drawn."""
    if not strained(scene):
        return ""
    # Here: few scenes need them, and they load scipy.
    from ringsim.theory.assembled import assembled
    from ringsim.theory.deployed import deployed

    made = substituted(scene)
    try:
        start, end = assembled(layout_of(made), made.rods), deployed(made)
    except ValueError as error:
        raise InputError(str(error)) from None
    return (
        f"prestress {start.energy:.3g} J at the start, {end.energy:.3g} J deployed at rest, "
        f"corners {end.rms:.3g} m (rms) from the design"
    )


_JOINTS = {
    "revolute": "revolute", "prismatic": "prismatic joint",
    "sleeve": "sliding joint", "weld": "clamp",
}  # fmt: skip


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _mobility(layout: Layout) -> str:
    if len(layout.openings[0]) > MOST_SECTIONS_FOR_MOBILITY:
        return f"not computed above {MOST_SECTIONS_FOR_MOBILITY} sections"
    return f"{_count(internal_mobility(layout), 'internal degree')} of freedom with rigid rods"


def _fields(part: Model) -> str:
    table = part.model_dump()
    return ", ".join(
        str(value) if key == "kind" else f"{key} = {show(value)}" for key, value in table.items()
    )
