"""``ringsim check``: validate a scene and say what it builds."""

from __future__ import annotations

import math

import click
import numpy as np

from ringsim.choice import kind_of
from ringsim.layout.mobility import internal_mobility
from ringsim.overrides import parse_assignment
from ringsim.refusal import show
from ringsim.scene import Scene, load_scene
from ringsim.structures.pantograph_ring import PantographRing
from ringsim.structures.planar_truss import PlanarTruss
from ringsim.structures.ring_geometry import RingGeometry
from ringsim.units import Model

MOST_SECTIONS_FOR_MOBILITY = 72
"""Larger rings take seconds, and their answer is the same."""


@click.command("check", short_help="Check a scene file and say what it builds.")
@click.argument("scene", metavar="FILE")
@click.option(
    "--set", "assignments", multiple=True, metavar="PATH=VALUE",
    help="Replace a value, e.g. loads.force=0.02, rods.young_modulus[3]=1e11, net=none.",
)  # fmt: skip
@click.option(
    "--deploys-in", "time", type=float, metavar="SECONDS",
    help="Find the initial opening angle from which the ideal fidelity deploys in this time.",
)  # fmt: skip
def command(scene: str, assignments: tuple[str, ...], time: float | None) -> None:
    """Check FILE (a scene file, or the name of a built-in scene) without running it.

    Bad input ends with exit code 2 and one line that names the field, its value and the cure.
    """
    loaded = load_scene(scene)
    if assignments:
        loaded = loaded.with_values(dict(parse_assignment(text) for text in assignments))
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
    lines += _OF_KIND[type(scene.structure)](scene)
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


def _of_ring(scene: Scene) -> list[tuple[str, str]]:
    structure, rods = scene.structure, scene.rods
    geometry = structure.geometry()
    sections, corners = geometry.sections, len(geometry.plan)
    shape = "closed ring" if geometry.closed else f"open arc of a {structure.polygon}-gon"
    masses = _masses(scene)
    return [
        ("structure", f"{kind_of(structure)}, {shape}, {_count(sections, 'section')}"),
        ("polygon", _polygon(geometry)),
        ("deployed", _size(geometry, 0.0)),
        ("initial", f"{_size(geometry, structure.coordinate)} at {structure.opening_angle} deg"),
        ("rods", f"{6 * sections} {kind_of(rods)} ({_count(rods.elements, 'element')} a rod half)"),
        ("points", f"{2 * corners} hinge assemblies, {2 * sections} V-joints, {sections} pivots"),
        ("joints", f"{11 * sections} revolutes"),
        ("mobility", _mobility(geometry, structure.coordinate)),
        ("mass", f"{sum(masses.values()):.4g} kg: {_listed(masses)}"),
    ]


def _of_planar_truss(scene: Scene) -> list[tuple[str, str]]:
    truss, rods = scene.structure, scene.rods
    assert isinstance(truss, PlanarTruss)
    geometry = truss.geometry()
    ends = [truss.coordinate, truss.stowed_angle]
    cable, strut = geometry.cable(ends), geometry.strut(ends)
    angles = [math.degrees(angle) for angle in ends]
    tubes = rods.diagonal.area + truss.strut_inner.area
    masses = {
        "axis": rods.density * truss.axis.area * truss.axis_length,
        "beams": 2 * rods.density * rods.bar.area * truss.beam_length,
        "synchronising beam": rods.density * truss.bar_width * truss.bar_depth * truss.axis_length,
        "strut": rods.density * tubes * truss.strut_tube_length,
    }
    return [
        ("structure", f"{kind_of(truss)}, two beams of {truss.beam_length} m"),
        ("initial", f"{angles[0]:.4g} deg, {cable[0]:.4g} m of cable, strut {strut[0]:.4g} m"),
        ("at its rest", f"{angles[1]:.4g} deg, {cable[1]:.4g} m of cable, strut {strut[1]:.4g} m"),
        ("rods", f"2 {kind_of(rods)} ({2 * rods.elements} and 2 elements)"),
        ("joints", "6 revolutes, 1 prismatic joint"),
        ("mobility", "1 internal degree of freedom with rigid beams"),
        ("mass", f"{sum(masses.values()):.4g} kg: {_listed(masses)}"),
    ]


_OF_KIND = {PantographRing: _of_ring, PlanarTruss: _of_planar_truss}


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _polygon(geometry: RingGeometry) -> str:
    """Axes of the deployed ellipse: the first corner lies on its major axis."""
    semi_major = float(geometry.plan[0, 0])
    x, y = geometry.plan[1, :2]
    semi_minor = abs(y) / math.sqrt(1.0 - (x / semi_major) ** 2)
    scale = 2.0 * geometry.deployed_chord
    return (
        f"equal chords of {geometry.deployed_chord:.4f} m on an ellipse with axes "
        f"{scale * semi_major:.4f} m and {scale * semi_minor:.4f} m"
    )


def _size(geometry: RingGeometry, phi: float) -> str:
    extent = np.ptp(geometry.fold(phi).corners.reshape(-1, 3), axis=0)
    return " x ".join(f"{length:.3f}" for length in extent) + " m"


def _mobility(geometry: RingGeometry, phi: float) -> str:
    if geometry.sections > MOST_SECTIONS_FOR_MOBILITY:
        return f"not computed above {MOST_SECTIONS_FOR_MOBILITY} sections"
    freedom = internal_mobility(geometry, phi)
    tilts = "" if geometry.closed else ": the fold, and the tilts of the four end hinges"
    noun = "internal degree" if freedom == 1 else "internal degrees"
    return f"{freedom} {noun} of freedom with rigid rods{tilts}"


def _masses(scene: Scene) -> dict[str, float]:
    """Mass of each group of parts, kg."""
    structure, rods = scene.structure, scene.rods
    sections = structure.sections
    corners = sections if structure.closed else sections + 1
    masses = {
        "diagonals": 4 * sections * structure.half_diagonal * rods.density * rods.diagonal.area,
        "bars": 4 * sections * structure.half_bar * rods.density * rods.bar.area,
        "hinges": 2 * corners * structure.corner_mass,
        "V-joints": 2 * sections * structure.vjoint_mass,
    }
    if scene.boom is not None:
        masses["boom"] = scene.boom.mass
    if scene.net is not None:
        masses["hub"] = scene.net.hub_mass
    return masses


def _listed(masses: dict[str, float]) -> str:
    return ", ".join(f"{name} {mass:.4g}" for name, mass in masses.items())


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
