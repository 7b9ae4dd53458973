"""``ringsim scenes``, ``check`` and ``explain``: scenes and keys, before a run."""

import json
import math
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from ringsim import extensions
from ringsim.cable.ropes import CableFault
from ringsim.choice import kind_of, kinds_of
from ringsim.cli.options import PATH, SETTINGS
from ringsim.files import require_place, write_text
from ringsim.layout.layout import Layout, internal_mobility, layout_of
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME
from ringsim.overrides import flat, place_of, with_names
from ringsim.parts.faults import AT_ONCE
from ringsim.parts.margin import MarginStandard
from ringsim.reference import WORDS, word
from ringsim.refusal import EXIT_BAD_INPUT, InputError, known_or_nearest, show
from ringsim.rigid.drive import turns_ever
from ringsim.rigid.margin import (
    GEARS,
    MOST,
    PULLEYS,
    DriveMargin,
    Margin,
    PlaneMargin,
    place_of_winch,
)
from ringsim.scene import Scene, builtin_scenes, load_scene, scene_from_toml
from ringsim.scene.checks import doubtful
from ringsim.scene.substituted import strained, substituted
from ringsim.tables import counted, text_table, thousandths, unit_text
from ringsim.variables import Variable

SCHEMA = "scene.schema.json"
"""File beside a scene that editors check it by."""


@click.command()
@click.argument("name", required=False)
@click.option(
    "--out", metavar="FILE", type=PATH,
    help="Write the scene to this file, with a schema for editors beside it.",
)  # fmt: skip
def scenes_command(name: str | None, out: Path | None) -> None:
    """List the built-in scenes, or print the TOML of one.

    To start a scene of your own: ringsim scenes ring18 > my.toml
    """
    texts = builtin_scenes()
    if name is not None:
        if name not in texts:
            raise InputError(f"{name}: no built-in scene ({known_or_nearest(name, texts)})")
        if out is None:
            click.echo(texts[name], nl=False)
        else:
            _write_with_schema(texts[name], out)
        return
    if out is not None:
        raise InputError(f"--out {out}: needs the name of a scene ({', '.join(texts)})")
    longest = max(map(len, texts))
    for key, text in texts.items():
        scene = scene_from_toml(text, source=f"scene {key}")
        count = counted(scene.structure.sections, "section")
        click.echo(f"{key:<{longest}}  {count:>12}  {scene.title}")


def _write_with_schema(text: str, out: Path) -> None:
    """Write a scene whose first line names the schema file written beside it.

    A name without a folder: both files may be moved, and nothing is looked up elsewhere.
    """
    from ringsim.reference.tree import schema_of  # reads every record of the package

    require_place(out)
    text = f"#:schema {SCHEMA}\n{text}"
    if out.exists() and out.read_bytes() != text.encode():
        raise InputError(f"--out {out}: this file is there, with other content: remove it first")
    schema = json.dumps(schema_of("scene"), indent=1) + "\n"
    for path, content in ((out, text), (out.with_name(SCHEMA), schema)):
        write_text(path, content)
        click.echo(f"wrote {path}")


_TIED = "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}"
_ASKED = ("margin", "hinge_spring", "temperature")
"""What few scenes name: not told of as left out."""
MOST_SECTIONS_FOR_MOBILITY = 72
"""Larger rings take seconds, and their answer is the same."""


@click.command()
@click.argument("scene", metavar="FILE")
@SETTINGS
@click.option(
    "--deploys-in", "time", type=click.FloatRange(0.0, min_open=True), metavar="SECONDS",
    help="Find the initial opening angle with which the ring deploys in this time (frame engine).",
)  # fmt: skip
@click.option(
    "--margin", is_flag=True,
    help=
        "Print driving and resisting forces at each opening angle, and the drive margin by "
        "standards.",
)  # fmt: skip
def check_command(scene: str, settings: dict[str, Any], time: float | None, margin: bool) -> None:
    """Check FILE (a scene file, or the name of a built-in scene) without running it.

    Bad input ends with exit code 2 and one line that names the field, its value and the cure.
    """
    if margin and time is not None:
        raise InputError("--margin: not together with --deploys-in: leave out one of the two")
    loaded = load_scene(scene).with_values(settings)
    if time is not None:
        from ringsim.stowed_angle import opening_angle_for

        angle = opening_angle_for(loaded, time)
        click.echo(f"structure.opening_angle = {angle:.6g} deg: the ring deploys in {time:g} s")
        return
    if margin:
        click.echo("\n".join(margin_lines(substituted(loaded))))
        return
    told = {label: text for label, text in _summary(loaded).items() if text}
    wide = max(map(len, told)) + 2
    for label, text in told.items():
        # A value stays on the line of its key.
        lines = textwrap.wrap(
            text.replace(" = ", _TIED), _COLUMNS - wide,
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
        for number, line in enumerate(lines):
            click.echo(f"{'' if number else label:<{wide}}{line.replace(_TIED, ' = ')}")
    for line in doubtful(loaded):
        click.echo(f"doubtful: {line}")
    if loaded.imports:
        from ringsim.frame.model import try_laws

        try_laws(loaded)
    outside = loaded.controller is not None and loaded.controller.outside
    how = "ringsim.steps in Python steps it" if outside else "ringsim run FILE runs it"
    click.echo(f"valid{_lacking(loaded)}: {how}")


def _lacking(scene: Scene) -> str:
    """What a scene that asks for a drive margin falls short of, in words; empty if of nothing."""
    if (standard := scene.margin) is None:
        return ""
    scene = substituted(scene)
    both = DriveMargin(scene, standard)
    told, least = "", both.least()
    if least.margin < 0.0:
        told = _verdict(least)
    else:
        planes = [(PlaneMargin(both, k).least(), plane) for k, plane in _driven_apart(scene, both)]
        worst, plane = min(planes, key=lambda each: each[0].margin, default=(least, ""))
        if worst.margin < 0.0:
            told = f"the {plane} plane's own cable has {_verdict(worst)}"
    return f", but {told} (--margin tells why)" * bool(told)


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
        **{
            label: text for name, part in parts.items() if part is not None
            for label, text in _described(name, part.model_dump()).items()
        },
        "winches": _stalls(scene),
        "faults": "; ".join(map(_listed, with_names(scene.to_table()).get("faults", ()))),
        "friction": ", ".join(friction),
        "left out": ", ".join(name for name, out in absent.items() if out).replace("_", " ")
        or "nothing",
        "solver": _listed(scene.solver.model_dump()),
    }  # fmt: skip


def _stalls(scene: Scene) -> str:
    """The tension at which each winch stalls, after its losses; empty if none ever does."""
    found = dict[str, list[str]]()
    for plane, cable in [] if scene.cables is None else scene.cables.present():
        winches = {"winch": cable.winch, "far_winch": cable.far_winch}
        for name, winch in ((name, each) for name, each in winches.items() if each is not None):
            pull = winch.winding.available_tension()
            if math.isfinite(pull):
                path = f"cables.{scene.structure.planes[plane]}.{name}"
                found.setdefault(f"{pull:.4g} N", []).append(path)
    return "; ".join(
        f"{' and '.join(each)} pull{'s' * (len(each) == 1)} at most {most}"
        for most, each in found.items()
    )


def _layout(scene: Scene) -> dict[str, str]:
    layout = layout_of(scene)
    counts = Counter(joint.kind for joint in layout.joints)
    families = Counter(joint.family for joint in layout.joints)
    masses = layout.masses()
    parts = ", ".join(f"{name} {mass:.4g}" for name, mass in masses.items())
    groups = {rod.group: counted(len(rod.stations) - 1, "element") for rod in layout.rods}
    elements = ", ".join(f"{count} in {group}" for group, count in groups.items())
    points = {
        "hinge assemblies": sum(map(len, layout.corners)),
        "V-joints": families["vjoint"], "pivots": families["pivot"],
    }  # fmt: skip
    return {
        "rods": f"{len(layout.rods)} {kind_of(scene.rods)} ({elements})",
        "points": ", ".join(f"{count} {name}" for name, count in points.items() if count),
        "joints": ", ".join(counted(count, _JOINTS[kind]) for kind, count in counts.items()),
        "mobility": _mobility(layout),
        "mass": f"{sum(masses.values()):.4g} kg: {parts}",
    }


def _assembly(scene: Scene) -> str:
    """What lengths of rods do without a run; empty if these are as drawn."""
    if not strained(scene):
        return ""
    # Here: few scenes need them, and they load scipy.
    from ringsim.rigid.assembling import assembled, deployed

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


def _mobility(layout: Layout) -> str:
    if len(layout.openings[0]) > MOST_SECTIONS_FOR_MOBILITY:
        return f"not computed above {MOST_SECTIONS_FOR_MOBILITY} sections"
    return f"{counted(internal_mobility(layout), 'internal degree')} of freedom with rigid rods"


def _listed(table: dict[str, Any]) -> str:
    """Kind, then keys and values; of tables within it by their paths."""
    return ", ".join(
        str(value) if key == "kind" else f"{key} = {_shortened(value)}"
        for key, value in flat(table).items() if value is not None
    )  # fmt: skip


def _described(name: str, table: dict[str, Any]) -> dict[str, str]:
    """A part by a label: its own values, and one more for each table within it."""
    inner = {key: value for key, value in table.items() if isinstance(value, dict)}
    own = {key: value for key, value in table.items() if key not in inner}
    label = name.replace("_", " ")
    found, seen = {label: _listed(own)}, dict[str, str]()
    for key, value in inner.items():
        text = _listed(value)
        found[f"{label}.{key}"] = seen.get(text, text)
        seen.setdefault(text, f"as {label}.{key}")
    return found


def _shortened(value: Any) -> str:
    """A value; of a long list how many values and from where to where."""
    if isinstance(value, (list, tuple)) and len(value) > _MOST_LISTED:
        if all(isinstance(each, (int, float)) for each in value):
            return f"{len(value)} values from {min(value):g} to {max(value):g}"
        return counted(len(value), "value")
    if isinstance(value, float):  # from degrees and back again: 19.999999999999996
        return show(float(f"{value:.12g}"))
    return show(value)


# The table of ``ringsim check --margin``.


_ANGLES = 13
_COLUMNS = 110
"""Letters of a line of ``ringsim check``."""
_MOST_LISTED = 6


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
        k for now in first for k, force in now.driving.items() if _force(force, now) != "0"
    )
    sources = list(known_sources) if len(known_sources) > 1 else []
    # Of one standard all that its margin is made of has room beside it.
    whole = list(courses.values()) if len(courses) == 1 else []
    yield (
        "Forces on the opening angle in N m, without factors, the drive without the losses of "
        "pulleys; margins with the factors of the standard."
    )
    rows = [
        [
            f"{math.degrees(now.angle):.1f}",
            *(
                _force(force, now)
                for force in (
                    now.available,
                    *(now.driving.get(k, 0.0) for k in sources),
                    *(now.resisting[k] for k in kinds),
                )
            ),
            *(_force(f, now) for c in whole for f in (c[row].counted, c[row].required)),
            *(_told(course[row].margin) for course in courses.values()),
        ]
        for row, now in enumerate(first)
    ]
    of_it = [f"by {source}" for source in sources]
    own = ["counted drive", "required"] if whole else []
    margins = ["margin"] if whole else [*drives]
    yield from text_table(["angle (deg)", "drive", *of_it, *kinds, *own, *margins], rows)
    for name, drive in drives.items():
        yield from _formula(name, drive, kinds)
        yield from _jammed(scene, drive, [now.angle for now in courses[name]])
    yield from _exceptions(scene, next(iter(drives.values())))
    for name, drive in drives.items():
        yield f"{name}: {_verdict(drive.least(), _parted(scene))}"
        if drive.least().margin < 0.0 and math.isfinite(more := drive.pull_needed()):
            by = _by_motors(scene) + "; one plane alone may take more" * (not _alike(scene))
            about = "about " * any(cable.friction.loads for cable in drive.drive.cables)
            yield f"  a margin of 0 takes {about}{more:.3g} times the pull of all winches{by}"
        yield from (f"  {line}" for line in _by_plane(scene, drive.standard))


def _jammed(scene: Scene, drive: DriveMargin, angles: Sequence[float]) -> Iterator[str]:
    """At which of some angles (rad) pulleys pass on no tension with the standard's friction."""
    found: dict[int, list[tuple[float, int]]] = {}
    for angle in angles:
        over = drive.drive.reeved(drive.mechanism.at(0.5 * (math.pi - angle)))
        for plane, count in drive.drive.jammed(over, drive.standard.friction).items():
            found.setdefault(plane, []).append((math.degrees(angle), count))
    for plane, each in found.items():
        first, last = each[0][0], each[-1][0]
        yield (
            f"  cables.{scene.structure.planes[plane]}: with {drive.standard.friction:g} times its "
            f"friction up to {counted(max(count for _, count in each), 'pulley')} pass on no "
            f"tension, at angles between {first:.0f} and {last:.0f} deg: what lies behind them "
            "drives nothing"
        )


def _formula(name: str, drive: DriveMargin, kinds: list[str]) -> Iterator[str]:
    """The standard's factors in words, of what resists anywhere."""
    standard, lossy = drive.standard, (PULLEYS, GEARS)
    resisting = " + ".join(
        f"{factor:g} {kind}" for kind, factor in drive.factors.items()
        if kind in kinds and kind not in lossy
    )  # fmt: skip
    speed = f" + {standard.inertia:g} inertia" if standard.keep_speed else ""
    needed = f"{standard.motorisation:g} x ({resisting or 0}){speed}"
    yield f"{name}: margin = counted drive / required - 1, required = {needed}"
    parts = [f"cables with {standard.friction:g} times the friction of pulleys and gears"]
    parts = parts if any(kind in drive.factors for kind in lossy) else ["all that drives"]
    if any(one in drive.factors for one in ("springs", "net", "lines")):
        parts.append(f"springs that drive times {standard.driving_spring:g}")
    winches = drive.conditions.winches.values()
    gears = {getattr(winch.winding, "efficiency", 1.0) for winch in winches} - {1.0}
    for given in sorted(gears) if GEARS in drive.factors else ():
        counted = 1.0 / (1.0 + standard.friction * (1.0 / given - 1.0))
        parts.append(f"a gear of efficiency {given:g} counts as {counted:.2g}")
    yield f"  counted drive: {', '.join(parts)}"


def _force(force: float, now: Margin) -> str:
    """A force in N m; what is round-off beside the others is none."""
    largest = max(now.available, *map(abs, now.resisting.values()), 0.0)
    return f"{0.0 if abs(force) < 1e-9 * largest else force:.4g}" if math.isfinite(force) else "-"


def _exceptions(scene: Scene, drive: DriveMargin) -> Iterator[str]:
    """What faults do to the margin, and winches that are not on all the time."""
    for number, fault in enumerate(scene.faults, 1):
        words = drive.conditions.told(fault)
        if fault.time > AT_ONCE and words == "counted":
            words = "strikes later, not included here; a run includes it from then on"
        elif words == "counted" and isinstance(fault, CableFault):
            words += (
                ", for a rigid ring, which opens as one: whether the sections behind the fault "
                "open, a run tells"
            )
        yield f"faults[{number}], {kind_of(fault)} at {fault.time:g} s: {words}"
    for where, winch in drive.conditions.winches.items():
        place = place_of_winch(scene, *where)
        if not turns_ever(winch):
            yield f"{place}: never turns, not included"
            continue
        if winch.start_time > drive.conditions.begin:
            yield f"{place}: starts at {winch.start_time:g} s, not included here"
        if winch.stop_time is not None:
            yield f"{place}: stops at {winch.stop_time:g} s; a run includes it until then"


def _driven_apart(scene: Scene, both: DriveMargin) -> Iterator[tuple[int, str]]:
    """Planes with cables that are not alike and turn from the beginning, by number and name."""
    cables = scene.cables
    if cables is None or None in (cables.upper, cables.lower) or _equal(scene):
        return
    for number, plane in enumerate(scene.structure.planes):
        if not _late(both, number):
            yield number, plane


def _equal(scene: Scene) -> bool:
    """Whether both cables are, and are struck by nothing at once."""
    assert scene.cables is not None
    return scene.cables.upper == scene.cables.lower and not _parted(scene)


def _parted(scene: Scene) -> bool:
    """Whether a cable is struck at once."""
    return any(isinstance(one, CableFault) and one.time <= AT_ONCE for one in scene.faults)


def _late(both: DriveMargin, number: int) -> bool:
    """Whether all winches of a plane start later."""
    winches = both.conditions.winches.items()
    own = [w for (cable, _), w in winches if cable == number and turns_ever(w)]
    return bool(own) and all(winch.start_time > both.conditions.begin for winch in own)


def _by_plane(scene: Scene, standard: MarginStandard) -> Iterator[str]:
    """The margin of each plane, if both have cables and these are not alike."""
    cables = scene.cables
    if cables is None or None in (cables.upper, cables.lower):
        return
    if _equal(scene):
        yield "both planes are equal: each gives half of the drive"
        return
    both = DriveMargin(scene, standard)
    for number, plane in enumerate(scene.structure.planes):
        if _late(both, number):
            yield f"{plane} plane alone: its winch starts later, not included here"
            continue
        least = PlaneMargin(both, number).least()
        whole = both.at(least.angle)
        counts = whole.required > 0.0 and whole.margin > -1.0
        share = 50.0 * (1.0 + least.margin) / (1.0 + whole.margin) if counts else 0.0
        yield (
            f"{plane} plane alone: its cable, with half of springs and loads, gives {share:.3g} % "
            f"of what drives with the standard's factors, against half of what resists: "
            f"{_verdict(least, _parted(scene))}"
        )


def _alike(scene: Scene) -> bool:
    """Whether there is one cable, or two that are alike."""
    cables = scene.cables
    return cables is None or None in (cables.upper, cables.lower) or _equal(scene)


def _by_motors(scene: Scene) -> str:
    """What gives winches more pull, if all have motors."""
    winches = [] if scene.cables is None else [
        winch for _, cable in scene.cables.present() for winch in cable.winches
    ]  # fmt: skip
    motors = [winch.winding.motor is not None for winch in winches]
    return ", as so many times their stall_torque give" * bool(motors and all(motors))


def _told(margin: float) -> str:
    """A dash where next to nothing resists."""
    return thousandths(margin) if margin < MOST else "-"


def _verdict(least: Margin, parted: bool = False) -> str:
    if least.margin >= MOST:
        return "nothing resists"
    word = f"enough{' for a rigid ring' * parted}" if least.margin >= 0.0 else "NOT enough"
    return (
        f"least margin {thousandths(least.margin)} at {math.degrees(least.angle):.2f} deg: {word}"
    )


def _names(_context: Any, _argument: Any, begun: str) -> list[CompletionItem]:
    """Variables, and paths of keys as far as the next dot."""
    from ringsim.reference import tree

    every = [*VARIABLES, *tree.ROOTS, *(path for root in tree.ROOTS for path in tree.paths(root))]
    depth = begun.count(".") + 1
    found = {".".join(name.split(".")[:depth]) for name in every if name.startswith(begun)}
    return [CompletionItem(name) for name in sorted(found)]


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1, shell_complete=_names)
@click.option("--schema", metavar="scene|campaign", help="Print the JSON Schema of such files.")
@click.option(
    "--import",
    "imports",
    metavar="MODULE",
    multiple=True,
    help="Know the kinds and outputs of this file or module, too, as under imports of a scene.",
)
def explain_command(names: tuple[str, ...], schema: str | None, imports: tuple[str, ...]) -> None:
    """Explain the variables of a result, the keys of a file, or the words of tables.

    NAME is a variable (asynchrony_max), the path of a key (cables.upper.winch, solver.step,
    design), a word of tables ("samples to go"), or a kind of file for all of its keys: scene,
    campaign, measured, optimisation or calibration.  Without a name all variables are listed.
    """
    extensions.load(extensions.located(imports, Path()))
    if schema is not None:
        _print_schema(schema, names)
        return
    if imports:
        from ringsim.reference.tree import schema_of

        for root in ("scene", "campaign"):  # refuses records that no file could choose
            schema_of(root)
    known = COORDINATES | {SPAN_NAME.name: SPAN_NAME} | VARIABLES
    refused = False
    for name in names or known:
        try:
            own = name.removesuffix("_checked")
            told = explained(known[own]) if own in known else _key(name, known)
            click.echo(f"{name}, of checks: " * (name != own) + told)
        except InputError as error:  # the others are explained all the same
            click.echo(str(error), err=True)
            refused = True
    if refused:
        click.get_current_context().exit(EXIT_BAD_INPUT)


def explained(variable: Variable) -> str:
    """One line: name and dimensions, units, meaning, codes, and which scenes have it."""
    text = f"{variable.name}({', '.join(variable.dims)})"
    text = f"{text:44s} {unit_text(variable.units) or '1':8s} {variable.long_name}"
    if variable.flags is not None:
        text += ": " + ", ".join(f"{int(code)} {code.word}" for code in variable.flags)
    return text + (f" (only with {', '.join(variable.needs)})" if variable.needs else "")


def _key(name: str, variables: dict[str, Variable]) -> str:
    """A key of files, or a word of tables; InputError if there is none of that name."""
    # Here, because variables are explained without reading every record of the package.
    from ringsim.reference import tree

    if name == tree.ANY:  # a word, and in paths any name of the user's
        return word(name)
    parts = [tree.all_of(name)] if name in tree.ROOTS else []
    try:
        found = tree.find(name) if parts else tree.known(name, list(variables))
    except InputError:
        if told := word(name):
            return told
        raise
    parts += [word(name)] * (name in WORDS)
    parts += [tree.told(each) for each in found]
    if any(place_of(each.path, closed=True) == "pulley" for each in found):
        parts.append(tree.names_of_pulleys(found[0].path))
    return "\n".join(parts)


def _print_schema(kind: str, names: tuple[str, ...]) -> None:
    from ringsim.reference.tree import schema_of

    if names:
        raise InputError(
            f"--schema {kind}: cannot be combined with {names[0]}: give one of the two"
        )
    click.echo(json.dumps(schema_of(kind), indent=2))
