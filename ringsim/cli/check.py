"""``ringsim check``: validate a scene and say what it builds."""

from collections import Counter
from typing import Any

import click

from ringsim.choice import kind_of
from ringsim.cli.options import SETTINGS
from ringsim.layout.layout import Layout
from ringsim.layout.mobility import internal_mobility
from ringsim.layout.of_scene import layout_of
from ringsim.refusal import show
from ringsim.scene import Scene, load_scene
from ringsim.units import Model

MOST_SECTIONS_FOR_MOBILITY = 72
"""Larger rings take seconds, and their answer is the same."""


@click.command("check", short_help="Check a scene file and say what it builds.")
@click.argument("scene", metavar="FILE")
@SETTINGS
@click.option(
    "--deploys-in", "time", type=float, metavar="SECONDS",
    help="Find the initial opening angle from which the ideal fidelity deploys in this time.",
)  # fmt: skip
def command(scene: str, settings: dict[str, Any], time: float | None) -> None:
    """Check FILE (a scene file, or the name of a built-in scene) without running it.

    Bad input ends with exit code 2 and one line that names the field, its value and the cure.
    """
    loaded = load_scene(scene)
    if settings:
        loaded = loaded.with_values(settings)
    if time is not None:
        from ringsim.theory.calibration import opening_angle_for

        angle = opening_angle_for(loaded, time)
        click.echo(
            f"structure.opening_angle = {angle:.6g} deg: the ideal ring deploys in {time:g} s"
        )
        return
    for label, text in summary(loaded):
        click.echo(f"{label:<12}{text}")


def summary(scene: Scene) -> list[tuple[str, str]]:
    """What a scene builds, as pairs of a label and a text."""
    lines = [("scene", f"{scene.name}: {scene.title}" if scene.title else scene.name)]
    lines += [*scene.structure.describe().items(), *_parts(scene)]
    for name in sorted(type(scene).parts()):
        part = getattr(scene, name)
        if part is not None:
            lines.append((name, _fields(part)))
    friction = scene.joints.model_dump()
    if friction:
        lines.append(("friction", ", ".join(friction)))
    lines.append(("left out", ", ".join(_left_out(scene)) or "nothing"))
    lines.append(("solver", _fields(scene.solver)))
    return lines


def _parts(scene: Scene) -> list[tuple[str, str]]:
    """What the layout of a scene holds."""
    layout, rods = layout_of(scene), scene.rods
    counts = Counter(joint.kind for joint in layout.joints)
    families = Counter(joint.family for joint in layout.joints)
    masses = layout.masses()
    parts = ", ".join(f"{name} {mass:.4g}" for name, mass in masses.items())
    elements = ", ".join(
        f"{_count(count, 'element')} in {group}"
        for group, count in {rod.group: len(rod.stations) - 1 for rod in layout.rods}.items()
    )
    points = {
        "hinge assemblies": sum(map(len, layout.corners)),
        "V-joints": families["vjoint"], "pivots": families["pivot"],
    }  # fmt: skip
    lines = [
        ("rods", f"{len(layout.rods)} {kind_of(rods)} ({elements})"),
        ("points", ", ".join(f"{count} {name}" for name, count in points.items() if count)),
        ("joints", ", ".join(_count(count, _JOINTS[kind]) for kind, count in counts.items())),
        ("mobility", _mobility(layout)),
        ("mass", f"{sum(masses.values()):.4g} kg: {parts}"),
    ]
    return [(label, text) for label, text in lines if text]


_JOINTS = {
    "revolute": "revolute", "prismatic": "prismatic joint",
    "sleeve": "sliding joint", "weld": "clamp",
}  # fmt: skip


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _mobility(layout: Layout) -> str:
    sections = len(layout.openings[0])
    if sections > MOST_SECTIONS_FOR_MOBILITY:
        return f"not computed above {MOST_SECTIONS_FOR_MOBILITY} sections"
    freedom = internal_mobility(layout)
    return f"{_count(freedom, 'internal degree')} of freedom with rigid rods"


def _fields(part: Model) -> str:
    table = part.model_dump()
    kind = [str(table.pop("kind"))] if "kind" in table else []
    return ", ".join(kind + [f"{key} = {show(value)}" for key, value in table.items()])


def _left_out(scene: Scene) -> list[str]:
    missing = [name for name in sorted(type(scene).parts()) if getattr(scene, name) is None]
    if not scene.joints.model_dump():
        missing.append("joint friction")
    if not scene.record.stress:
        missing.append("stress output")
    return missing
