"""The scene: everything that one simulation needs, strict in and exact out."""

import copy
import difflib
import math
import os
from collections.abc import Iterator, Mapping
from html import escape
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, get_origin

import tomli_w
from pydantic import BaseModel, Field, ValidationError, model_validator

from ringsim import extensions
from ringsim.cable.control import Controller
from ringsim.cable.records import CABLES, Cable, Cables, numbered, path_of, spans_of
from ringsim.choice import OneOf
from ringsim.files import parse_toml, read_text
from ringsim.overrides import at_path, length_at, points_in, set_path
from ringsim.parts.boom import Boom, Spacecraft
from ringsim.parts.faults import Fault
from ringsim.parts.ground import Gravity, Loads, Offload
from ringsim.parts.joints import HingeSpring, Joints, Latch, SpringDamperStop, Stop
from ringsim.parts.margin import MarginStandard
from ringsim.parts.net import Net
from ringsim.parts.rods import AncfRods, GeometricallyExactRods, Rods
from ringsim.parts.solver import Limits, Record, Solver
from ringsim.parts.temperature import Temperature
from ringsim.refusal import InputError, explain, known_or_nearest, models_in, show
from ringsim.scene.checks import check_controller, check_layout, check_parts
from ringsim.structures.family import Structure
from ringsim.structures.pantograph_ring import PantographRing
from ringsim.units import ListIn, Model

MOST_RECORDS = 1_000_000
"""Output times of one run, at most."""


class Scene(Model):
    """A structure with its loads and how to solve it.  Parts left out are not built."""

    gone: ClassVar[dict[str, str]] = {
        "fidelity": "this key is for campaign files; for a run use --fidelity",
        "samples": "this is for campaigns: ringsim campaign FILE --samples N",
        "inputs": "this key is for campaign files",
        "requirements": "this key is for campaign files",
    }

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=80)]
    """Word for the scene in files and messages."""
    title: Annotated[str, Field(max_length=300)] = ""
    """One line for figures and reports."""
    imports: Annotated[tuple[str, ...], ListIn] = ()
    """Modules with kinds of your own: files or packages beside this file, or installed ones."""
    structure: Annotated[Structure, OneOf(default="pantograph-ring")] = PantographRing()
    """What deploys."""
    rods: Annotated[Rods, OneOf(default="geometrically-exact")] = GeometricallyExactRods()
    """Material, cross-sections and beam formulation of all rods."""
    joints: Joints = Joints()
    """Friction in pivots, hinges and V-joints."""
    hinge_spring: Annotated[HingeSpring, OneOf()] | None = None
    """A spring in every V-joint."""
    stop: Annotated[Stop, OneOf(default="spring-damper")] | None = SpringDamperStop()
    """What ends the travel of every V-joint; built unless it is "none"."""
    latch: Latch | None = None
    """What the latches of the stops ask for; left out, they take nothing and always catch."""
    boom: Annotated[Boom, OneOf()] | None = None
    """Tube at the first corner along which the ring slides; left out, there is none."""
    spacecraft: Spacecraft | None = None
    """Rigid body that holds the boom; left out, there is none."""
    net: Annotated[Net, OneOf(default="hub")] | None = None
    """Springs to a hub, or cables along the edge; left out, there is none."""
    loads: Loads | None = None
    """Forces on the V-joints; left out, there are none."""
    temperature: Temperature | None = None
    """Temperatures of parts; left out, everything is as the scene says."""
    gravity: Gravity | None = None
    """Weight of everything; left out, there is none."""
    offload: Offload | None = None
    """Lines that carry corners in a ground test; left out, there are none."""
    cables: Cables | None = None
    """Driving cables with their winches; left out, there are none."""
    controller: Annotated[Controller, OneOf()] | None = None
    """What samples sensors and commands the winches; left out, these follow their own laws."""
    limits: Limits = Limits()
    """What counts as overloaded."""
    margin: Annotated[MarginStandard, OneOf()] | None = None
    """Standard by which runs tell the margin of their drive (``drive_margin``)."""
    faults: Annotated[tuple[Annotated[Fault, OneOf()], ...], ListIn] = ()
    """What breaks, when and where."""
    solver: Solver = Solver()
    """Time integration."""
    record: Record = Record()
    """What a run writes down."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for path, value in _lists(self):
            wanted = length_at(self, path)
            if wanted not in (None, len(value)):
                raise ValueError(
                    f"{path} has {len(value)} values, but the structure needs {wanted}: give "
                    "one value for all, or a list of that length"
                )
        check_parts(self)
        self.structure.check(self)
        check_controller(self)
        check_layout(self)
        for part in (self.spacecraft, self.offload, self.gravity, self.temperature):
            if part is not None:
                part.check(self)
        if self.record.stress and isinstance(self.rods, AncfRods) and self.rods.damping > 0.0:
            raise ValueError(
                'record.stress = true with rods.kind = "ancf" needs rods.damping = 0, not '
                f"{self.rods.damping:g} s: exudyn does not give the damping part of the stress "
                "in these rods"
            )
        if self.record.interval > self.solver.end_time:
            raise ValueError(
                f"record.interval = {self.record.interval} s must not exceed solver.end_time = "
                f"{self.solver.end_time} s: only the start would be recorded"
            )
        if self.record.interval * MOST_RECORDS < self.solver.end_time:
            raise ValueError(
                f"record.interval = {self.record.interval} s must be at least "
                f"{self.solver.end_time / MOST_RECORDS:g} s, a {MOST_RECORDS}th of "
                "solver.end_time: the result would not fit in memory"
            )
        return self

    @model_validator(mode="before")
    @classmethod
    def _without_names(cls, table: Any) -> Any:
        if not isinstance(table, dict):
            return table
        # First of all: what follows may be of a kind that they define.
        extensions.load(extensions.names_in(table))
        return numbered(table, points_in(table))

    def __repr__(self) -> str:
        """Name, title and the kinds of its parts in one line; ``ringsim scenes NAME`` has all."""
        parts = {name: getattr(self, name) for name in type(self).model_fields}
        kinds = {
            n: part.model_dump().get("kind") for n, part in parts.items() if isinstance(part, Model)
        }
        known = ", ".join(f"{name} {kind}" for name, kind in kinds.items() if kind)
        return f"Scene({self.name!r}: {self.title or 'no title'}; {known})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """The same, and all values below it, folded."""
        every = f"<summary>all values</summary><pre>{escape(self.to_toml())}</pre>"
        return f"<p>{escape(repr(self))}</p><details>{every}</details>"

    def path_of(self, cable: Cable) -> tuple[str, ...]:
        """Names of the points of a cable's path: its winch, pulleys, and end or other winch."""
        return path_of(points_in(self), cable.end)

    def pulleys_of(self, cable: Cable) -> int:
        """Pulleys of one of the scene's cables: a second winch takes one more."""
        return len(self.path_of(cable)) - 2

    @property
    def loads_turn_at(self) -> float:
        """Time at which the loads turn round, s; infinite if they do not."""
        time = None if self.loads is None else self.loads.reversal_time
        return math.inf if time is None else time

    @property
    def held(self) -> bool:
        """Whether a support holds the structure's base in space."""
        return self.structure.supported or (self.boom is not None and self.boom.base == "fixed")

    @property
    def span_names(self) -> dict[str, tuple[str, ...]]:
        """Names of the spans of each plane's cable, from its winch on; none of one without."""
        present = dict([] if self.cables is None else self.cables.present())
        return {
            name: spans_of(self.path_of(present[plane])) if plane in present else ()
            for plane, name in enumerate(self.structure.planes)
        }

    @property
    def spans(self) -> int:
        """Spans of the cable that has most of them; 0 without cables."""
        return max(map(len, self.span_names.values()), default=0)

    def with_values(self, values: dict[str, Any]) -> "Scene":
        """A copy with the fields at dotted paths replaced in their order, validated again.

        See :func:`ringsim.overrides.set_path` for ``name[k]`` and ``none``; k may be the name of a
        pulley: ``coefficient["section 6 V"]``.  A table takes the place of the whole part; a new
        ``kind`` keeps the fields that it has, and those given here; what had the default of the old
        kind has that of the new one.  InputError if a path or a value is refused.

        >>> scene = load_scene("ring18").with_values({"loads.force": 0.02, "boom": "none"})
        >>> scene.loads.force, scene.boom
        (0.02, None)
        >>> scene.with_values({"rods.young_modulus[3]": 2e11}).rods.young_modulus[1:4]
        (120000000000.0, 200000000000.0, 120000000000.0)
        """
        table = self.to_table()
        # Where winches are comes first: names of pulleys depend on it, numbers count from there.
        ordered = sorted(values.items(), key=lambda item: not _tells_end(item[0]))
        # Later paths may lead into its tables; a copy each, as two parts may be given the same one.
        for path, value in ((path, copy.deepcopy(value)) for path, value in ordered):
            if _tells_end(path):
                _refuse_renumbering(table, path, value, values)
            before = at_path(table, path)
            set_path(table, path, value)
            if path.endswith(".kind"):
                _take_kind(table, path.removesuffix(".kind"), before, values)
        return scene_from_table(table, source=f"scene {self.name}")

    def to_table(self) -> dict[str, Any]:
        """The scene as nested plain tables, without the parts that it leaves out."""
        return self.model_dump(mode="json")

    def to_toml(self) -> str:
        """The scene as TOML text; reading it back gives an equal scene."""
        return tomli_w.dumps(self.to_table())


def _tells_end(path: str) -> bool:
    """Whether a path says where the winches of a cable are."""
    return path.startswith("cables.") and path.endswith(".end")


def _refuse_renumbering(
    table: dict[str, Any], path: str, value: Any, given: Mapping[str, Any]
) -> None:
    """InputError if pulleys that a scene has by number would be other ones from another end."""
    cable = path.removesuffix(".end")
    law = at_path(table, f"{cable}.friction") or {}
    own = f"{cable}.friction.coefficient"
    listed = isinstance(law.get("coefficient"), list) and not any(
        one == own or own.startswith(f"{one}.") for one in given
    )
    present = [f"cables.{name}" for name in CABLES if at_path(table, f"cables.{name}")]
    placed = "faults" not in given and any(
        ("pulley" in fault or "span" in fault) and present[fault["cable"] - 1] == cable
        for fault in table.get("faults") or []
    )
    if at_path(table, path) != value and (listed or placed):
        what = own if listed else "faults"
        raise InputError(
            f"{path} = {show(value)}: pulleys are numbered from the winch, so the values of "
            f"{what} would move to other pulleys: give {what} again, too"
        )


def _take_kind(table: dict[str, Any], path: str, before: Any, given: Mapping[str, Any]) -> None:
    """Leave out what the part at ``path`` had and its kind has not, and what it had by default of
    the kind ``before``, unless it is given, too.
    """
    inside: list[type[BaseModel]] = [Scene]
    for step in path.split("."):
        fields = [m.model_fields[step] for m in inside if step in m.model_fields]
        inside = [model for field in fields for model in models_in(field.annotation)]
    part = at_path(table, path)
    kinds = [(m.model_fields["kind"].default, m) for m in inside if "kind" in m.model_fields]
    kind, old = (
        next((m for k, m in kinds if k == word), None) for word in (part.get("kind"), before)
    )
    if kind is None:
        return
    for name in part.keys() - {"kind"}:
        known = None if old is None or old is kind else old.model_fields.get(name)
        by_default = known is not None and not known.is_required() and part[name] == known.default
        if (by_default or name not in kind.model_fields) and f"{path}.{name}" not in given:
            del part[name]


def _lists(record: Model, prefix: str = "") -> Iterator[tuple[str, tuple[float, ...]]]:
    for name, value in record:
        if isinstance(value, Model):
            yield from _lists(value, f"{prefix}{name}.")
        elif isinstance(value, tuple) and not _is_vector(record, name):
            yield f"{prefix}{name}", value


def _is_vector(record: Model, name: str) -> bool:
    """Whether a field is a vector of its own, not one value or one for each section."""
    return get_origin(type(record).model_fields[name].annotation) is tuple


def scene_from_table(table: dict[str, Any], *, source: str) -> Scene:
    """Validate nested tables; InputError names ``source``, field, value, bound and cure."""
    try:
        return Scene.model_validate(table)
    except ValidationError as error:
        raise InputError(explain(error, Scene, source)) from None


def scene_from_toml(text: str, *, source: str) -> Scene:
    """Parse and validate TOML text; InputError if it is no TOML, or its content is refused."""
    return scene_from_table(parse_toml(text, source), source=source)


def builtin_scenes() -> dict[str, str]:
    """TOML text of the built-in scenes by name."""
    folder = resources.files("ringsim") / "scenes"
    files = {file.name: file for file in folder.iterdir() if file.name.endswith(".toml")}
    return {name[:-5]: files[name].read_text(encoding="utf-8") for name in sorted(files)}


def _nearest_file(path: Path) -> str:
    """The scene file in the same folder whose name is most like it; empty if none is."""
    try:
        known = [each.name for each in path.parent.iterdir() if each.suffix == ".toml"]
    except OSError:
        return ""
    near = difflib.get_close_matches(path.name, known, n=1, cutoff=0.8)
    return str(path.parent / near[0]) if near else ""


_FILES = {"measured": "a calibration", "variables": "an optimisation", "design": "a campaign",
          "inputs": "a campaign"}  # fmt: skip
"""Keys that scenes have not, and the kind of file that has them."""
_VERBS = {"a calibration": "calibrate", "an optimisation": "optimise", "a campaign": "campaign"}


def load_scene(name_or_path: str | Path, *, beside: Path = Path()) -> Scene:
    """A built-in scene by name, or a scene file; paths are relative to the folder of ``beside``.

    InputError if there is no such scene or file, or if its content is refused.

    >>> scene = load_scene("ring18")
    >>> scene.structure.sections, scene.loads.force
    (18, 0.015)
    """
    builtin, name = builtin_scenes(), str(name_or_path)
    if name in builtin:
        return scene_from_toml(builtin[name], source=f"scene {name}")
    path = beside.parent / name_or_path
    if not os.path.exists(path):  # Path.exists raises for names that are too long
        near = f"{path}.toml"
        if not os.path.exists(near):
            near = _nearest_file(path)
        hint = f"did you mean {near}?" if near else known_or_nearest(name, builtin)
        raise InputError(f"{path}: no such file, and no built-in scene of that name ({hint})")
    table = parse_toml(read_text(path), path.name)
    if "sensors" in table:
        raise InputError(
            f"{path.name}: sensors: this is measured data, not a scene: lay it beside a run by "
            f"ringsim compare RUN {path.name}"
        )
    if key := next((key for key in _FILES if key in table), ""):
        raise InputError(
            f"{path.name}: {key}: this is {_FILES[key]} file, not a scene: run it with ringsim "
            f"{_VERBS[_FILES[key]]} (--dry-run only checks it), or give the scene that it names"
        )
    if named := extensions.names_in(table):
        table["imports"] = extensions.located(named, path.parent)
    return scene_from_table(table, source=path.name)
