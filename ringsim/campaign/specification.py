"""The campaign file: which scene, inputs, design and limits; and what an optimisation adds."""

import contextlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, ValidationError, model_validator

from ringsim import extensions
from ringsim.analysis import derived
from ringsim.analysis.intervals import quantities, samples_needed
from ringsim.analysis.optimum import Objective
from ringsim.analysis.requirements import (
    Condition,
    Looks,
    Requirements,
    Rule,
    as_list,
    beyond_joints,
)
from ringsim.choice import kind_of, kinds_of, load_package
from ringsim.execution.work import Allowance
from ringsim.files import parse_toml, read_text
from ringsim.outputs.balance import instead_of
from ringsim.outputs.family import VARIABLES, axes, holds, supply
from ringsim.overrides import flat, in_turn, with_number
from ringsim.refusal import InputError, explain, known_or_nearest, show
from ringsim.sampling.columns import Correlation, Table
from ringsim.sampling.designs import Design
from ringsim.sampling.distributions import Distribution, plain
from ringsim.sampling.table import (
    AnyDesign,
    AnyDistribution,
    Learnt,
    draw,
    first_inside,
    learnt_from,
    with_own_places,
)
from ringsim.scene import Scene, load_scene
from ringsim.storage.netcdf import PER_SAMPLE, OutputTable
from ringsim.units import ListIn, Model
from ringsim.variables import GONE, OF_CAMPAIGNS

load_package("ringsim.sampling.designs")  # all kinds that a file may choose

SOLVERS = {
    "full": "ringsim.simulation:run",
    "frame": "ringsim.simulation:run_frame",
}
"""What maps a scene to its outcome, by fidelity."""


def _not_gone(fidelity: Any) -> Any:
    if isinstance(fidelity, str) and fidelity in GONE:
        raise ValueError(f"fidelity = {show(fidelity)}: {GONE[fidelity]}")
    return fidelity


_Share = Annotated[float, Field(gt=0.0, le=1e3)]


class Specification(Model):
    """Content of a campaign file."""

    gone: ClassVar[dict[str, str]] = {
        "workers": "give it on the command line (ringsim campaign FILE --workers N): leave it out",
        "retry": "failed runs are restarted automatically, see solver.restarts: leave it out",
    }

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=80)]
    """Word for the campaign, and for the folder of its results below ``runs``."""
    title: Annotated[str, Field(max_length=300)] = ""
    """One line for figures and reports."""
    question: Annotated[str, Field(max_length=1000)] = ""
    """What the campaign is to answer, and for which decision; its report begins with it."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """With its number, all that the inputs of a sample depend on."""
    scene: str
    """Built-in scene, or scene file looked up beside the campaign file."""
    imports: list[str] = Field(default_factory=list)
    """Modules with kinds of your own: files or packages beside this file, or installed ones; also
    for the scene and what is set in it."""
    set: Annotated[dict[str, Any], BeforeValidator(flat)] = Field(default_factory=dict)
    """Values by scene path that all samples share; tables are joined into those of the scene."""
    inputs: Annotated[
        dict[str, AnyDistribution], BeforeValidator(lambda table: flat(table, "kind"))
    ] = Field(default_factory=dict)
    """Distribution by scene path; ``from = "posterior.nc"`` adds what a calibration has found.
    Beside one with ``each_section``, a single place of it may have its own."""
    correlations: list[Correlation] = Field(default_factory=list)
    """Pairs of inputs that depend on each other."""
    design: AnyDesign
    """How the samples are placed."""
    limits: Allowance = Allowance()
    """What one run may use before it is ended."""
    fidelity: Annotated[Literal["full", "frame"], BeforeValidator(_not_gone)] = "full"
    """full: the flexible multibody model; frame: the same in joint coordinates, some thirty times
    as fast."""
    check_every: Annotated[int, Field(ge=0)] = 0
    """One sample in so many runs with the full model, too, as a check of the frame engine: samples
    0, check_every, 2 check_every, ...; 0 for none."""
    max_difference: _Share | dict[str, _Share] | None = None
    """Largest difference of the checked samples, as a share of the full model's value: by output,
    or one for the main outputs; beyond it the campaign ends with exit code 3."""
    error_bars_every: Annotated[int, Field(ge=0)] = 0
    """One sample in so many has numerical error bars (``solver.error_bars``); 0 for none."""
    max_failed: Annotated[int, Field(ge=0)] | None = None
    """The campaign stops when more samples than this have failed."""
    outputs: derived.Outputs = Field(default_factory=dict)
    """Further outputs, each one number by an expression over what runs store:
    peak = "max(cable_tension(plane='upper'))"."""
    requirements: Requirements = Field(default_factory=dict)
    """Bounds on outputs, with probability and confidence; ``ringsim analyse`` checks them."""
    stop_when: Annotated[list[Condition], BeforeValidator(as_list)] = Field(default_factory=list)
    """The campaign ends before its last sample once all of these hold; one or a list of them."""
    looks: Looks = Looks()
    """Numbers of samples after which ``stop_when`` is checked."""
    output: OutputTable = OutputTable()
    """How ``campaign.nc`` stores the results."""

    @model_validator(mode="after")
    def _can_be_checked(self) -> "Specification":
        if self.check_every and self.fidelity != "frame":
            raise ValueError(
                f'check_every = {self.check_every} repeats samples of fidelity = "frame" with the '
                f'full model, but fidelity = "{self.fidelity}": leave check_every out, or set '
                'fidelity = "frame"'
            )
        if getattr(self.design, "check", 0) and self.fidelity != "frame":
            raise ValueError(
                "design.check repeats runs of the frame engine with the full model, but "
                f'fidelity = "{self.fidelity}": leave design.check out, or set fidelity = "frame"'
            )
        if self.max_difference is not None and not self.check_every:
            raise ValueError(
                f"max_difference = {show(self.max_difference)} has no effect without "
                "check_every: give both"
            )
        for name in self.max_difference if isinstance(self.max_difference, dict) else ():
            if name in VARIABLES and VARIABLES[name].dims:
                raise ValueError(f"max_difference.{instead_of(name)}")
            if name not in quantities():
                raise ValueError(
                    f"max_difference.{name}: this is not an output that can be compared between "
                    f"engines ({known_or_nearest(name, quantities())})"
                )
        return self

    @model_validator(mode="after")
    def _can_be_left_out(self) -> "Specification":
        for name in self.output.leave_out:
            if name in PER_SAMPLE:
                raise ValueError(
                    f"output.leave_out: {name} says how each sample ended, without which the file "
                    "cannot be read: take it out of the list"
                )
        return self

    @model_validator(mode="after")
    def _can_stop(self) -> "Specification":
        if not self.stop_when:
            if "looks" in self.model_fields_set:
                raise ValueError("looks has no effect without stop_when: give both, or neither")
            return self
        kind = str(kind_of(self.design))
        if not self.design.extendable:
            raise ValueError(
                f"stop_when: a {kind} design needs all its samples, so it cannot be stopped "
                'early: leave stop_when out, or set design.kind = "random", or "sobol" with '
                "design.replicates = 8"
            )
        if not self.design.independent and self.rule_replicates < 2:
            raise ValueError(
                f"stop_when: one {kind} design gives no intervals: set design.replicates = 8, or "
                'design.kind = "random"'
            )
        for each in self.stop_when:
            name = each.requirement
            if name is not None and name not in self.requirements:
                raise ValueError(
                    f"stop_when.requirement = {name} is not among the requirements of this file "
                    f"({known_or_nearest(name, self.requirements)}): give it under [requirements]"
                )
        return self

    @property
    def rule_replicates(self) -> int:
        """Independent replicates of the design."""
        return int(getattr(self.design, "replicates", 1))

    @property
    def rule(self) -> Rule | None:
        """When the campaign may end before its last sample; None if only there."""
        return Rule(conditions=self.stop_when, looks=self.looks) if self.stop_when else None


# What an optimisation file has beyond these keys.


class Variable(Model):
    """What may be chosen: a scene value between two bounds."""

    low: float
    """Least value, in the unit of the path."""
    high: float
    """Largest value."""
    scale: Literal["linear", "log"] = "linear"
    """Whether steps or ratios of the value matter."""
    shared: Annotated[tuple[str, ...], ListIn] = ()
    """Scene paths that all take the value, if the name is none, or not the only one."""

    @model_validator(mode="after")
    def _in_order(self) -> "Variable":
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} must be below high = {self.high:g}")
        if self.scale == "log" and self.low <= 0.0:
            raise ValueError(f'low = {self.low:g} must be above 0 for scale = "log"')
        return self

    def value(self, share: float) -> float:
        """The value at a place between low (0) and high (1)."""
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** share)
        return float(self.low + (self.high - self.low) * share)

    def share(self, value: float) -> float:
        """The place of a value."""
        if self.scale == "log":
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)


class Aim(Model):
    """A statistic of an output, to be made small or large."""

    minimise: Literal["mean", "quantile", "probability"] | None = None
    """What of the output is to be small."""
    maximise: Literal["mean", "quantile"] | None = None
    """What of the output is to be large; one of the two must be given."""
    probability: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.5
    """Below the quantile."""
    max: float = 0.0
    """Of minimise = "probability": values above count."""
    min: float = 0.0
    """Likewise: values below count."""

    @model_validator(mode="after")
    def _one_of_two(self) -> "Aim":
        given, what = self.model_fields_set, self.minimise or self.maximise
        if (self.minimise is None) == (self.maximise is None):
            raise ValueError(
                'minimise or maximise: give one of both, = "mean" or "quantile", or minimise = '
                '"probability"'
            )
        if (what == "quantile") != ("probability" in given):
            raise ValueError("probability goes with a quantile: give both, or neither")
        if (len(given & {"max", "min"}) == 1) != (what == "probability"):
            raise ValueError(
                'max or min goes with minimise = "probability", which is that of a value beyond: '
                'give both, for example minimise = "probability", max = 10.0'
            )
        return self

    def objective(self, output: str) -> Objective:
        """The same for the search."""
        sign = 1.0 if self.minimise is not None else -1.0
        above = "min" not in self.model_fields_set
        return Objective(
            output, self.minimise or self.maximise or "mean", self.probability, sign,
            self.max if above else self.min, 1.0 if above else -1.0,
        )  # fmt: skip


class Budget(Model):
    """What an optimisation file has beyond the keys of a campaign file."""

    variables: Annotated[
        dict[str, Variable], BeforeValidator(lambda table: flat(table, "low")), Field(min_length=1)
    ]
    """What may be chosen, by scene path."""
    objectives: Annotated[dict[str, Aim], Field(min_length=1, max_length=2)]
    """What is made small or large, by output; two give a front."""
    constraints: Requirements = Field(default_factory=dict)
    """Requirements, as of a campaign file."""
    designs: Annotated[int, Field(ge=4, le=100_000)] = 60
    """Designs that the search runs, at most."""
    samples: Annotated[int, Field(ge=4, le=100_000)] = 16
    """Of each design in the search."""
    check: Annotated[int, Field(ge=16, le=1_000_000)] = 100
    """Fresh samples of a design that the search has found, which correct it."""
    verdict: Annotated[int, Field(ge=16, le=10_000_000)] = 300
    """Fresh samples of the present and of each chosen design, which judge it."""
    front: Annotated[int, Field(ge=2, le=100)] = 5
    """Designs along the front of two objectives."""

    @model_validator(mode="after")
    def _can_be_shown(self) -> "Budget":
        for name, wanted in self.constraints.items():
            if (least := samples_needed(0, wanted.probability, wanted.confidence)) > self.verdict:
                raise ValueError(
                    f"verdict = {self.verdict}: so few samples never show constraints.{name} with "
                    f"probability {wanted.probability:g} and confidence {wanted.confidence:g}: set "
                    f"verdict = {least} at least, better twice that"
                )
        return self


# What a calibration file has beyond these keys.


class ClockPrior(Model):
    """What is not known of the measured clock, in place of the measured file's values."""

    offset: AnyDistribution | None = None
    """Of clock.offset, s."""
    drift: AnyDistribution | None = None
    """Of clock.drift."""


class Stages(Model):
    """What a calibration file has beyond the keys of a campaign file."""

    measured: str
    """File of measured data, beside this file."""
    runs: Annotated[int, Field(ge=16, le=1_000_000)] = 256
    """Of all stages together."""
    stages: Annotated[int, Field(ge=1, le=20)] = 4
    """How often the ensemble is drawn anew, the first time from the priors."""
    clock: ClockPrior = ClockPrior()
    """Unknowns of the measured clock."""


_NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
"""Bounds that are values of other fields are told by their names: no end of a distribution."""


def _cure(error: str, inputs: Mapping[str, Distribution]) -> str:
    """What helps against a drawn value that is refused for a bound; empty if that is said, or if
    its distribution has ends of its own.
    """
    bound = re.search(rf"must be (at least|above|at most|below) ({_NUMBER})", error)
    path = max((path for path in inputs if f"{path} = " in error), key=len, default="")
    if bound is None or not path or "truncate" in error:
        return ""
    law = inputs[path]
    if law.follows:
        return ""
    ends = np.array(law.quantile(np.array([0.0, 1.0])))
    if ends.dtype.kind != "f" or np.isfinite(ends).all():
        return ""
    side, kind = "low" if bound[1] in ("at least", "above") else "high", show(kind_of(law))
    middle, end = float(np.median(law.quantile(np.array([0.5])))), float(bound[2])
    if middle < end if side == "low" else middle > end:
        return "; most of its distribution is beyond that: check its numbers"
    return f': draw it with kind = "truncated", {side} = {bound[2]}, of = {{ kind = {kind}, ... }}'


@dataclass(frozen=True)
class Campaign:
    """A campaign file, its text and content, and the scene that its samples vary."""

    file: Path
    text: str
    specification: Specification
    scene: Scene
    suspects: tuple[int, ...] = ()
    """Samples that run with the full model, too, because of their results."""
    clocks: Mapping[str, Any] = field(default_factory=dict)
    """Of tests that inputs were learnt from, see ``learnt_from``."""

    def draw(self) -> Table:
        """All inputs of all samples; InputError if the scene refuses one."""
        wanted = self.specification
        try:
            table = draw(
                self.scene, wanted.inputs, wanted.correlations, wanted.design, seed=wanted.seed,
                folder=self.file.parent, error_bars_every=wanted.error_bars_every,
            )  # fmt: skip
        except InputError as error:
            cure = _cure(str(error), wanted.inputs)
            raise InputError(f"{self.file.name}: {error}{cure}") from None
        for path in [column.path for column in table.columns if column.path]:
            if given := path if path in wanted.set else first_inside(path, wanted.set):
                raise InputError(
                    f"{self.file.name}: {given} is set by [set] or --set and also drawn as an "
                    "input: leave out one of the two"
                )
        return table


def _add_learnt(table: dict[str, Any], path: Path) -> tuple[str, list[str], dict[str, Any]]:
    """Put what ``inputs.from`` names into the tables of a campaign file, in its place; the name of
    that file, those of its inputs, and the clock of its test.
    """
    inputs = table.get("inputs")
    if not isinstance(inputs, dict) or "from" not in inputs:
        return "", [], {}
    given = inputs["from"]
    given = {"file": given} if isinstance(given, str) else given
    if not isinstance(given, dict):
        raise InputError(
            f"{path.name}: inputs.from = {show(given)} must be the name of a file, or a table "
            'with file and without: write from = "posterior.nc"'
        )
    try:
        source = Learnt.model_validate(given)
    except ValidationError as error:
        raise InputError(explain(error, Learnt, f"{path.name}: inputs.from")) from None
    try:
        found, pairs, clocks = learnt_from(path.parent / source.file, source.without)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    own = flat({name: law for name, law in inputs.items() if name != "from"}, "kind")
    for key, names in (("inputs", own), ("set", flat(table.get("set") or {}))):
        every = {name: law.get("shared") or [name] for name, law in found.items()}
        twice = ""
        for name, paths in every.items():
            if name in names or any(
                p in names or first_inside(p, names) or any(first_inside(n, [p]) for n in names)
                for p in paths
            ):
                twice = name
                break
        if twice:
            raise InputError(
                f"{path.name}: {twice} is given by {key} and by inputs.from, too: leave it out "
                f"there, or here by without = [{show(twice)}]"
            )
    table["inputs"] = {**own, **found}
    table["correlations"] = [*(table.get("correlations") or []), *pairs]
    return source.file, list(found), clocks


def _as_drawn(pair: Correlation, inputs: Mapping[str, Any], scene: Scene) -> Correlation:
    """A correlation whose places are called as they are drawn: by their names, or their numbers."""
    called = {with_number(scene, name): name for name in inputs if "." in name}

    def own(name: str) -> str:
        number = name
        with contextlib.suppress(InputError):
            number = with_number(scene, name)
        return name if name in inputs else called.get(number, number)

    first, second = pair.between
    return pair.model_copy(update={"between": (own(first), own(second))})


def load_campaign(
    path: Path, settings: Mapping[str, Any] | None = None, samples: int | None = None
) -> Campaign:
    """Read a campaign file; see :func:`campaign_of`."""
    return campaign_of(read_text(path), path, settings, samples)


_MARKS = {"measured": "calibrate", "variables": "optimise", "design": "campaign"}
"""Keys that only one kind of file has, and its verb; a campaign may do without."""


def refuse_other(table: Mapping[str, Any], name: str, verb: str) -> None:
    """Refuse (InputError) the content of a file that another verb takes."""
    noun = {"campaign": "campaign", "calibrate": "calibration", "optimise": "optimisation"}[verb]
    an = "an" if noun[0] in "aeiou" else "a"
    if "structure" in table and not {"scene", *_MARKS} & set(table):
        raise InputError(
            f"{name}: structure: this is a scene, not {an} {noun} file: run it with ringsim run, "
            f'or name it in {an} {noun} file, as scene = "{name}"'
        )
    if "sensors" in table:
        raise InputError(
            f"{name}: sensors: this is measured data, no {noun} file: name it in a calibration "
            f'file, as measured = "{name}"'
        )
    if any(key in table for key, other in _MARKS.items() if other == verb != "campaign"):
        return
    for key, other in _MARKS.items():
        if key in table and other != verb:
            raise InputError(f"{name}: {key}: this is no {noun} file: run it with ringsim {other}")


def campaign_of(
    text: str, path: Path, settings: Mapping[str, Any] | None = None, samples: int | None = None,
    scene: Scene | None = None,
) -> Campaign:  # fmt: skip
    """The campaign that a text describes; InputError if it, its content or its scene is refused.

    ``path`` is where the text is from: files that it names are looked up beside it.  ``settings``
    are values by scene path beyond those under [set], ``samples`` another size of the design; both
    become comments at the end of the campaign's text.  A ``scene`` takes the place of the one that
    the text names.
    """
    table = parse_toml(text, path.name)
    refuse_other(table, path.name, "campaign")
    if samples is not None and isinstance(design := table.get("design"), dict):
        kind = kinds_of(Design).get(str(design.get("kind")))
        if kind is not None and "samples" not in kind.model_fields:
            raise InputError(
                f"--samples {samples}: a design of kind {show(design.get('kind'))} has a fixed "
                "number of samples, given by its levels or its file: leave it out"
            )
        design["samples"] = samples
        text += f"\n# called with --samples {samples}"
    own = extensions.located(extensions.names_in(table), path.parent)
    extensions.load(own)
    derived.forget(derived.declared())  # of other campaigns
    if scene is None and isinstance(table.get("scene"), str):
        with contextlib.suppress(InputError):  # told below; kinds of its modules come first
            scene = load_scene(table["scene"], beside=path)
    source, learnt, clocks = _add_learnt(table, path)
    try:
        specification = Specification.model_validate(table)
    except ValidationError as error:
        raise InputError(explain(error, Specification, path.name)) from None
    together = in_turn(specification.set, settings or {})
    specification = specification.model_copy(update={"set": together})
    for name, value in (settings or {}).items():
        own_key = re.split(r"[.\[]", name)[0].strip("\"'")
        if own_key in Specification.model_fields.keys() - Scene.model_fields.keys():
            cure = " (or say --samples)" * (own_key == "design")
            raise InputError(
                f"{path.name}: --set {name}: {own_key} is a key of the campaign file: change it "
                f"there{cure}; --set changes values of the scene"
            )
        text += f"\n# called with --set {name} = {json.dumps(value, default=str)}"
    key = "scene"
    try:
        base = load_scene(specification.scene, beside=path) if scene is None else scene
        if own:
            base = base.with_values({"imports": list(dict.fromkeys((*base.imports, *own)))})
        key = "set"
        varied = base.with_values(specification.set)
    except InputError as error:
        raise InputError(f"{path.name}: {key}: {error}") from None
    for name in learnt:
        law = specification.inputs[name]
        median = plain(law.quantile(np.array([0.5]))[0])
        try:
            varied.with_values(dict.fromkeys(law.shared or (name,), median))
        except InputError as error:
            raise InputError(
                f"{path.name}: inputs.from = {show(source)}: {name} of it is nothing that this "
                f"scene can have ({error}): leave it out by without = [{show(name)}]"
            ) from None
    if (interval := varied.record.state_interval) is not None:
        raise InputError(
            f"{path.name}: record.state_interval = {interval:g} s: campaigns store no states: "
            "leave it out, and run the sample of interest alone (ringsim replay --scene prints "
            "its scene)"
        )
    try:
        inputs = with_own_places(varied, specification.inputs)
        pairs = [_as_drawn(pair, inputs, varied) for pair in specification.correlations]
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    specification = specification.model_copy(update={"inputs": inputs, "correlations": pairs})
    own_outputs, has = specification.outputs, holds(varied)
    derived.require_places(own_outputs, axes(varied), path.name)
    wanted = {f"outputs.{n}": one for n, each in own_outputs.items() for one in each.names}
    wanted |= {f"requirements.{name}": name for name in specification.requirements}
    wanted |= {f"stop_when.of = {each.of}": each.of for each in specification.stop_when if each.of}
    for where, name in wanted.items():
        if absent := sorted(set(VARIABLES[name].needs) - has - {OF_CAMPAIGNS}):
            raise InputError(
                f"{path.name}: {where}: runs of this scene do not have this output, because the "
                f"scene has no {absent[0]}: leave it out, or {supply(absent[0])}"
            )
    joints = len(varied.structure.planes) * varied.structure.sections
    for name, each in specification.requirements.items():
        if wrong := beyond_joints(name, each, joints):
            raise InputError(f"{path.name}: requirements.{wrong}")
    return Campaign(path, text, specification, varied, clocks=clocks)
