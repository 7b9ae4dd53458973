"""The table of ``ringsim check --margin``."""

import math
from collections.abc import Iterator

from ringsim.cable.faults.family import CableFault
from ringsim.choice import kind_of, kinds_of
from ringsim.parts.faults.family import AT_ONCE
from ringsim.parts.margin.family import MarginStandard
from ringsim.scene import Scene
from ringsim.tables import text_table
from ringsim.theory.condition import changes_drive, told, turns_ever
from ringsim.theory.drive_margin import MOST, DriveMargin, Margin
from ringsim.theory.plane_margin import PlaneMargin

_ANGLES = 13


def margin_lines(scene: Scene) -> Iterator[str]:
    """Drive, resistances and margins of the ideal ring over the opening angle.

    By the scene's standard, or else by all there are with their own factors.
    """
    known = (kind.model_validate({}) for kind in kinds_of(MarginStandard).values())
    standards = known if scene.margin is None else [scene.margin]
    drives = {
        kind_of(each): DriveMargin(scene, each)
        for each in standards
        if isinstance(each, MarginStandard)
    }
    courses = {name: drive.course(_ANGLES) for name, drive in drives.items()}
    first = next(iter(courses.values()))
    # At rest nothing is accelerated, and a net may be slack at every angle; springs may be gone.
    kinds = [k for k in first[0].resisting if any(now.resisting[k] for now in first)]
    known_sources = dict.fromkeys(
        k for now in first for k, force in now.driving.items() if force > 0.0
    )
    sources = list(known_sources) if len(known_sources) > 1 else []
    yield "Forces on the opening angle in N m, without factors; margins with those of the standard."
    rows = [
        [
            f"{math.degrees(now.angle):.1f}",
            *(
                f"{force:.4g}"
                for force in (
                    now.available,
                    *(now.driving.get(k, 0.0) for k in sources),
                    *(now.resisting[k] for k in kinds),
                )
            ),
            *(_told(course[row].margin) for course in courses.values()),
        ]
        for row, now in enumerate(first)
    ]
    of_it = [f"of it {source}" for source in sources]
    yield from text_table(["angle (deg)", "drive", *of_it, *kinds, *drives], rows)
    for name, drive in drives.items():
        yield f"{name}: margin = {_formula(drive)}"
    yield from _exceptions(scene, next(iter(drives.values())))
    for name, drive in drives.items():
        yield f"{name}: {_verdict(drive.least())}"
        yield from (f"  {line}" for line in _by_plane(scene, drive.standard))


def _formula(drive: DriveMargin) -> str:
    """The standard's factors in words."""
    standard = drive.standard
    resisting = " + ".join(f"{factor:g} {kind}" for kind, factor in drive.factors.items())
    springs = any(one in drive.factors for one in ("springs", "net", "lines"))
    driving = f", springs times {standard.driving_spring:g}" if springs else ""
    speed = f" + {standard.inertia:g} inertia" if standard.keep_speed else ""
    return f"drive{driving} / ({standard.motorisation:g} x ({resisting}){speed}) - 1"


def _exceptions(scene: Scene, drive: DriveMargin) -> Iterator[str]:
    """What faults do to the margin, and winches that are not on all the time."""
    for number, fault in enumerate(scene.faults, 1):
        later = "strikes later, not counted here; a run counts it from then on"
        words = later if fault.time > AT_ONCE and changes_drive(fault) else told(fault)
        yield f"faults[{number}], {kind_of(fault)} at {fault.time:g} s: {words}"
    names = [] if scene.cables is None else [number for number, _ in scene.cables.present()]
    for (cable, end), winch in drive.conditions.winches.items():
        place = f"cables.{scene.structure.planes[names[cable]]}.{('winch', 'far_winch')[end]}"
        if not turns_ever(winch):
            yield f"{place}: never turns, not counted"
            continue
        if winch.start_time > drive.conditions.begin:
            yield f"{place}: starts at {winch.start_time:g} s, not counted here"
        if winch.stop_time is not None:
            yield f"{place}: stops at {winch.stop_time:g} s; a run counts it until then"


def _by_plane(scene: Scene, standard: MarginStandard) -> Iterator[str]:
    """The margin of each plane, if both have cables and these are not alike."""
    cables = scene.cables
    if cables is None or None in (cables.upper, cables.lower):
        return
    struck = any(isinstance(one, CableFault) and one.time <= AT_ONCE for one in scene.faults)
    if cables.upper == cables.lower and not struck:
        yield "each plane has half of the drive"
        return
    for number, plane in enumerate(scene.structure.planes):
        drive = PlaneMargin(scene, standard, number)
        least = drive.least()
        whole = drive.whole(least.angle).available
        share = f"{100.0 * least.available / whole:.3g}" if whole > 0.0 else "0"
        yield f"{plane}: {share} % of the drive against half of all that resists: {_verdict(least)}"


def _told(margin: float) -> str:
    """A dash where next to nothing resists."""
    return f"{margin:.3f}" if margin < MOST else "-"


def _verdict(least: Margin) -> str:
    if least.margin >= MOST:
        return "nothing resists"
    word = "enough" if least.margin >= 0.0 else "NOT enough"
    return f"least margin {least.margin:.3f} at {math.degrees(least.angle):.2f} deg: {word}"
