"""Which values make an antenna best under what is uncertain: designs that are run as campaigns."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import netCDF4
import numpy as np
import tomli_w
import xarray as xr
from pydantic import BeforeValidator, Field, ValidationError, model_validator

from ringsim import build
from ringsim.analysis.design import placement
from ringsim.analysis.intervals import good, numbers, quantities, samples_needed
from ringsim.analysis.optimum import (
    CHECK,
    DIGITS,
    SEARCH,
    VERDICT,
    Course,
    Found,
    Objective,
    Problem,
    Values,
    Wanted,
    course,
)
from ringsim.analysis.requirements import OUTCOME, Requirements
from ringsim.analysis.verdicts import judge
from ringsim.campaign.folder import open_folder
from ringsim.campaign.python import campaign_text, open_campaign
from ringsim.campaign.run import Ended, Order, require_no_launcher, start
from ringsim.campaign.specification import Campaign, campaign_of
from ringsim.files import parse_toml, read_text, whole, write_text, writing
from ringsim.outputs.balance import instead_of
from ringsim.outputs.family import VARIABLES, holds
from ringsim.overrides import field_at, flat
from ringsim.refusal import EXIT_INTERRUPTED, InputError, explain, known_or_nearest, show
from ringsim.sampling.table import first_inside, refuse_fixed
from ringsim.scene import Scene
from ringsim.stepping.instant import Array
from ringsim.units import ListIn, Model, unit_at
from ringsim.variables import GOALS, Fate, Status

FRONT = "front.nc"
"""The result of an optimisation, in its folder."""
_NAME = "ringsim.Optimisation"
"""How refusals of arguments begin, as those of files with the file's name."""
_DESIGNS = "designs"
"""Folder of the campaigns of the search."""


class Variable(Model):
    """What may be chosen: a scene value between two bounds."""

    low: float
    high: float
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

    minimise: Literal["mean", "quantile"] | None = None
    maximise: Literal["mean", "quantile"] | None = None
    probability: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Below the quantile."""

    @model_validator(mode="after")
    def _one_of_two(self) -> "Aim":
        if (self.minimise is None) == (self.maximise is None):
            raise ValueError('needs either minimise = "mean" or maximise = "mean", or "quantile"')
        if ("quantile" in (self.minimise, self.maximise)) != (self.probability is not None):
            raise ValueError("probability goes with a quantile: give both, or neither")
        return self

    def objective(self, output: str) -> Objective:
        """The same for the search."""
        statistic = self.minimise or self.maximise or "mean"
        sign = 1.0 if self.minimise is not None else -1.0
        return Objective(output, statistic, self.probability or 0.5, sign)


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


@dataclass(frozen=True)
class Given:
    """An optimisation file: what may vary, what is wanted, and the campaign of any design."""

    path: Path
    table: Mapping[str, Any]
    """The rest of the file."""
    settings: Mapping[str, Any]
    scene: Scene | None
    budget: Budget
    present: Campaign
    """Of the verdict on the present design."""
    start: Array
    """The present design in the unit box."""

    @property
    def problem(self) -> Problem:
        """The same for the search."""
        wanted = self.budget
        aims = [aim.objective(name) for name, aim in wanted.objectives.items()]
        front = wanted.front if len(aims) == 2 else 1
        return Problem(aims, wanted.constraints, self.start, wanted.designs, wanted.verdict, front)

    def values(self, point: Array) -> dict[str, float]:
        """Value by variable of a design in the unit box."""
        same = np.round(point, DIGITS) == np.round(self.start, DIGITS)
        found = {}
        for k, (name, law) in enumerate(self.budget.variables.items()):
            # All that is run and written has the same digits; the present ones stay what they are.
            path = (law.shared or (name,))[0]
            value = field_at(self.present.scene, path) if same[k] else law.value(float(point[k]))
            found[name] = float(value if same[k] else f"{value:.8g}")
        return found

    def settings_of(self, point: Array) -> dict[str, float]:
        """Value by scene path."""
        known = self.values(point)
        return {path: known[name] for name, law in self.budget.variables.items()
                for path in law.shared or (name,)}  # fmt: skip

    def campaign(self, wanted: Wanted, name: str) -> Campaign:
        """The campaign that runs a design."""
        return _campaign(
            self.path, self.table, {**self.settings, **self.settings_of(wanted.point)}, self.scene,
            self.budget, wanted.samples, name,
        )  # fmt: skip


def _campaign(
    path: Path, table: Mapping[str, Any], settings: Mapping[str, Any], scene: Scene | None,
    budget: Budget, samples: str, name: str,
) -> Campaign:  # fmt: skip
    own = dict(table)
    turn = (SEARCH, CHECK, VERDICT).index(samples)
    # The search has the same samples in all designs; what judges it has others.
    own["seed"] = int(own.get("seed", 0)) + turn
    own["name"] = f"{own['name']}-{name}"
    if samples == SEARCH:
        own["design"] = {"kind": "latin-hypercube", "samples": budget.samples}
        own.pop("check_every", None)
    elif samples == CHECK:
        own["design"] = {"kind": "random", "samples": budget.check}
        own.pop("check_every", None)
    else:
        own["design"] = {"kind": "random", "samples": budget.verdict}
        own["requirements"] = {
            key: wanted.model_dump(by_alias=True, exclude_none=True)
            for key, wanted in budget.constraints.items()
        }
        own["title"] = f"{table.get('title') or table['name']}: {name}"
    if "check_every" not in own:
        own.pop("max_difference", None)
    return campaign_of(tomli_w.dumps(own), path, settings, scene=scene)


def optimisation_of(
    text: str, path: Path, settings: Mapping[str, Any] | None = None, scene: Scene | None = None
) -> Given:
    """The optimisation that a text describes: a campaign file without a design, with ``variables``,
    ``objectives`` and a budget.  ``path``, ``settings`` (which may also have the budget's numbers)
    and ``scene`` are as in ``campaign_of``.

    InputError if it is refused.
    """
    table, settings = parse_toml(text, path.name), dict(settings or {})
    sizes = ("designs", "samples", "check", "verdict", "front")
    table |= {name: settings.pop(name) for name in sizes if name in settings}
    own = {name: table.pop(name) for name in Budget.model_fields if name in table}
    try:
        budget = Budget.model_validate(own)
    except ValidationError as error:
        raise InputError(explain(error, Budget, path.name)) from None
    for key, cure in {
        "design": "an optimisation places its own samples: leave it out, and set samples, check "
                  "and verdict",
        "requirements": "an optimisation calls them constraints: rename it",
        "stop_when": "each design runs all its samples: leave it out",
        "looks": "each design runs all its samples: leave it out",
        "max_failed": "designs whose runs fail are passed over: leave it out",
        "error_bars_every": "leave it out, and run a chosen design with error bars",
    }.items():  # fmt: skip
        if key in table:
            raise InputError(f"{path.name}: {key}: {cure}")
    if "front" in own and len(budget.objectives) == 1:
        raise InputError(f"{path.name}: front: one objective has one best design: leave it out")
    table.setdefault("fidelity", "frame")
    if not table.get("inputs"):
        raise InputError(
            f"{path.name}: inputs: nothing is uncertain: give distributions of what is not known"
        )
    present = _campaign(path, table, settings, scene, budget, VERDICT, "present")
    for name in budget.objectives:
        _require_output(path.name, name, present.scene)
    start_ = np.array([
        _begin(path.name, name, law, present) for name, law in budget.variables.items()
    ])  # fmt: skip
    given = Given(path, table, settings, scene, budget, present, start_)
    if budget.designs < (least := given.problem.least):
        levels = f" and {given.problem.front} levels" if given.problem.front > 1 else ""
        raise InputError(
            f"{path.name}: designs = {budget.designs}: too few for {len(start_)} variables{levels}:"
            f" set designs = {least} at least"
        )
    present.draw()
    for side in (0.0, 1.0):
        given.campaign(Wanted(SEARCH, np.full(len(start_), side)), "bounds")
    return given


def _require_output(file: str, name: str, scene: Scene) -> None:
    if name in VARIABLES and VARIABLES[name].dims:
        raise InputError(f"{file}: objectives.{instead_of(name)}")
    if name not in quantities():
        hint = known_or_nearest(name, quantities())
        raise InputError(f"{file}: objectives.{name}: is no output that has a mean ({hint})")
    if absent := sorted(set(VARIABLES[name].needs) - holds(scene)):
        raise InputError(
            f"{file}: objectives.{name}: runs of this scene do not have this output, because the "
            f"scene has no {absent[0]}: choose another, or add that to the scene"
        )


def _begin(file: str, name: str, law: Variable, present: Campaign) -> float:
    """Where a variable of the present design is between its bounds; InputError if it is not."""
    where, inputs = f"{file}: variables.{name}", present.specification.inputs
    drawn = [path for key, each in inputs.items() for path in (each.shared or (key,))]
    values = []
    for path in law.shared or (name,):
        try:
            refuse_fixed(present.scene, path)
            value = field_at(present.scene.with_values({path: law.low}), path)
            before = field_at(present.scene, path)
        except (InputError, AttributeError) as error:
            told = str(error).removeprefix("inputs: ")
            raise InputError(f"{where}: {told}") from None
        if not isinstance(value, float) or not isinstance(before, float):
            raise InputError(
                f"{where}: {path} is {show(before)} in the scene, and must be one number there: "
                "name its places one by one, or set a number under [set]"
            )
        if (
            path in drawn
            or first_inside(path, drawn)
            or any(first_inside(d, [path]) for d in drawn)
        ):
            raise InputError(f"{where}: {path} is also drawn as an input: leave out one of the two")
        values.append(before)
    if len(set(values)) > 1:
        raise InputError(
            f"{where}.shared: the scene has {', '.join(f'{v:g}' for v in values)} there, and they "
            "take one value: set them equal under [set]"
        )
    if not law.low <= values[0] <= law.high:
        raise InputError(
            f"{where}: the scene has {values[0]:g}, where the search begins, and {law.low:g} .. "
            f"{law.high:g} do not hold it: widen them, or set a value within them under [set]"
        )
    return law.share(values[0])


@dataclass
class _Course:
    """The campaigns of an optimisation, one order after the other."""

    given: Given
    folder: Path
    course: Course = field(init=False)
    ordered: list[Order] = field(default_factory=list)
    wanted: Wanted | None = None
    found: Found | None = None
    verdicts: list[tuple[str, Array]] = field(default_factory=list)
    """Designs that are judged, by the names of their folders."""

    def order(self) -> Order:
        """The next campaign, from the results of those before."""
        if not self.ordered:
            (self.folder / FRONT).unlink(missing_ok=True)
            self.course = course(self.given.problem)
            self.wanted = next(self.course)
        elif self.found is None:
            assert self.wanted is not None
            try:
                self.wanted = self.course.send(self._values(self.ordered[-1].folder))
            except StopIteration as end:
                self.found = end.value
        number = len(self.ordered) + 1
        if self.found is None:
            assert self.wanted is not None
            name = f"{number:03d}-{self.wanted.samples}"
            folder, more = self.folder / _DESIGNS / name, True
        else:
            if not self.verdicts:
                chosen = [each.point for each in self.found.chosen]
                names = [f"design-{k + 1}" for k in range(len(chosen))]
                self.verdicts = [("present", self.given.start), *zip(names, chosen, strict=True)]
            done = sum(each.folder.parent == self.folder for each in self.ordered)
            name, point = self.verdicts[done]
            self.wanted = Wanted(VERDICT, point)
            folder, more = self.folder / name, done + 1 < len(self.verdicts)
        made = Order(self.given.campaign(self.wanted, name), folder, more=more, brief=True)
        self.ordered.append(made)
        return made

    def _values(self, folder: Path) -> Values:
        """What a design's samples gave of all that is wanted; NaN of those that do not count."""
        campaign = open_folder(folder)
        count = campaign.table.samples
        names = list(dict.fromkeys([*self.given.budget.objectives, *self.given.budget.constraints]))
        kept = {name: np.full(count, np.nan) for name in names}
        survey = campaign.survey()
        for result in survey.results(np.arange(count)):
            wanted = self.given.budget.constraints.get(OUTCOME)
            goals = GOALS if wanted is None else (Fate[str(wanted.is_).upper()],)
            if result.status != Status.OK or result.fate not in (*goals, Fate.NONE):
                continue
            arrays = result.arrays()
            for name in names:
                kept[name][result.sample] = 0.0 if name == OUTCOME else arrays.get(name, np.nan)
        return kept

    def then(self, folder: Path) -> None:
        """Write what was found, unless runs are missing."""
        if self.found is not None and not len(open_folder(folder).survey().missing):
            _write(self)


def run_optimisation(
    given: Callable[[], Given], workers: int | None, out: Path | None
) -> tuple[Ended, Path]:
    """Run all campaigns that are missing, on all ranks of an MPI world or with so many workers, and
    write what was found into the folder ``out`` (runs/NAME).  How it ended, and the file.

    ``given`` is called on rank 0.  The same call goes on with one that was interrupted, to the same
    result.
    """
    courses = list[_Course]()

    def order() -> Order:
        if not courses:
            require_no_launcher(workers)
            asked = given()
            folder = out or Path("runs") / asked.table["name"]
            courses.append(_Course(asked, folder))
        return courses[0].order()

    ended = start(workers, order, lambda folder: courses[0].then(folder))
    return ended, (courses[0].folder if courses else out or Path()) / FRONT


def _write(course_: _Course) -> None:
    """The file of the front, and the scenes of the designs on it."""
    given, found = course_.given, course_.found
    assert found is not None
    problem, names = given.problem, [name for name, _ in course_.verdicts]
    points = [point for _, point in course_.verdicts]
    parts = [_verdict(given, course_.folder / name) for name in names]
    requirements = [*given.budget.constraints]
    variables, aims = [*given.budget.variables], [each.told for each in problem.objectives]
    signs = np.array([each.sign for each in problem.objectives])
    bounds = [f"{name} {'<=' if s > 0 else '>='} {b:g}" for name, s, b, _ in problem.bounds]
    units = [unit_at(given.present.scene, (law.shared or (name,))[0])
             for name, law in given.budget.variables.items()]  # fmt: skip
    width = len(found.points), len(variables)
    every = np.array([[*given.values(p).values()] for p in found.points]).reshape(width)
    objectives = np.array([signs * one.objectives for one in found.judged])
    without = np.full((len(names), len(variables), len(aims)), np.nan)
    beyond_without = np.full((len(names), len(variables), len(bounds)), np.nan)
    few = np.full((len(names), len(aims)), np.nan)
    few_beyond = np.full((len(names), len(bounds)), np.nan)
    first = found.judged[0]
    few[0], few_beyond[0] = signs * first.objectives, first.beyond
    for k, chosen in enumerate(found.chosen, start=1):
        few[k], few_beyond[k] = signs * chosen.search.objectives, chosen.search.beyond
        without[k] = [signs * one.objectives for one in chosen.without]
        beyond_without[k] = np.array([one.beyond for one in chosen.without]).reshape(
            len(variables), len(bounds)
        )
    tried, own = ("tried", "variable"), ("design", "variable")
    says: dict[str, tuple[tuple[str, ...], Any, str]] = {
        "tried_value": (tried, every, "values of all designs that the search has run"),
        "tried_objective": (("tried", "objective"), objectives,
                            "statistic by the few samples of the search"),
        "tried_beyond": (("tried", "bound"), np.array([j.beyond for j in found.judged]).reshape(
            len(found.judged), len(bounds)), "quantile aimed at less the bound, by these samples"),
        "tried_lost": (("tried",), np.array([j.lost for j in found.judged]),
                       "share of samples without a value"),
        "value": (own, np.array([[*given.values(p).values()] for p in points]),
                  "values of the present design, and of the chosen ones"),
        "objective_value": (("design", "objective"), np.array([p["objective"] for p in parts]),
                            "statistic by the fresh samples of the verdict"),
        "objective_lower": (("design", "objective"), np.array([p["lower"] for p in parts]),
                            "end of its interval of 95 %"),
        "objective_upper": (("design", "objective"), np.array([p["upper"] for p in parts]),
                            "end of its interval of 95 %"),
        "probability": (("design", "requirement"), np.array([p["probability"] for p in parts]),
                        "share of the fresh samples that keep to the requirement"),
        "probability_lower": (("design", "requirement"),
                              np.array([p["probability_lower"] for p in parts]),
                              "one-sided lower bound of the probability"),
        "verdict": (("design", "requirement"), np.array([p["verdict"] for p in parts]),
                    "verdict: 0 not met, 1 not yet shown, 2 met"),
        "short": (("design",), np.array([p["short"] for p in parts]),
                  "fresh samples that failed or ended before their goal"),
        "searched": (("design", "objective"), few, "statistic by the few samples of the search"),
        "searched_beyond": (("design", "bound"), few_beyond,
                            "quantile aimed at less the bound, by these samples"),
        "without": (("design", "variable", "objective"), without,
                    "statistic, by the few samples, with the variable as it is at present"),
        "without_beyond": (("design", "variable", "bound"), beyond_without,
                           "the same of the quantile aimed at less the bound"),
        "low": (("variable",), [v.low for v in given.budget.variables.values()], "least value"),
        "high": (("variable",), [v.high for v in given.budget.variables.values()],
                 "largest value"),
    }  # fmt: skip
    texts = [wanted.told(name) for name, wanted in given.budget.constraints.items()]
    words = {"design": names, "variable": variables, "objective": aims, "bound": bounds,
             "requirement": requirements, "variable_units": units,
             "objective_units": [quantities()[o.output].units for o in problem.objectives],
             "requirement_text": texts}  # fmt: skip
    asked = given.present.specification
    attributes = {
        "title": str(given.table.get("title", "")), "question": asked.question,
        "name": given.table["name"], "scene": given.present.scene.to_toml(),
        "fidelity": asked.fidelity,
        "signs": json.dumps(signs.tolist()), "samples": given.budget.samples,
        "verdict_samples": given.budget.verdict, "designs": len(found.points),
        **build.provenance(),
    }  # fmt: skip
    path = course_.folder / FRONT
    with writing(path), whole(path) as draft, netCDF4.Dataset(draft, "w") as file:
        file.setncatts(attributes)
        sizes = {name: len(words[name]) for name in
                 ("design", "variable", "objective", "bound", "requirement")}  # fmt: skip
        for name, size in (sizes | {"tried": len(found.points)}).items():
            file.createDimension(name, size)
        for name, known in words.items():
            along = name if name in sizes else name.partition("_")[0]
            file.createVariable(name, str, (along,))[:] = np.array(known, dtype=object)
        for name, (dims, values, meaning) in says.items():
            array = np.asarray(values)
            made = file.createVariable(name, "i8" if array.dtype.kind == "i" else "f8", dims)
            if array.size:
                made[...] = array
            made.setncatts({"long_name": meaning})
    for name, point in course_.verdicts[1:]:
        text = given.present.scene.with_values(given.settings_of(point)).to_toml()
        write_text(course_.folder / f"{name}.toml", text)


def _verdict(given: Given, folder: Path) -> dict[str, Any]:
    """What the fresh samples of a design say."""
    with open_campaign(folder) as campaign:
        ended = np.isin(campaign["outcome"].to_numpy(), [*map(int, GOALS)])
        placed, used = placement(campaign), good(campaign) & ended
        sample, rows = campaign["sample"].to_numpy(), []
        for each in given.problem.objectives:
            values = numbers(campaign, each.output)
            known = used & np.isfinite(values)
            of = np.mean if each.statistic == "mean" else each.probability
            middle = (np.mean(values[known]) if each.statistic == "mean"
                      else np.quantile(values[known], each.probability, method="hazen")
                      ) if known.any() else np.nan  # fmt: skip
            rows.append((float(middle), *placed.interval(values[known], sample[known], of)))
        told = judge(campaign, given.budget.constraints, placed)
        objective, lower, upper = (np.array(rows)[:, k] for k in range(3))
        return {
            "objective": objective, "lower": lower, "upper": upper,
            "short": int((~used).sum()),
            **{name: told[name].to_numpy().astype(int if name == "verdict" else float)
               for name in ("probability", "probability_lower", "verdict")},
        }  # fmt: skip


class Optimisation:
    """Which values make an antenna best under what is uncertain; ``run`` runs it, or finishes it.

    Parameters
    ----------
    scene, inputs, seed, name, keys
        As of ``ringsim.Campaign``: ``inputs`` are what is uncertain in each design.
    variables
        What may be chosen, by scene path: ``{"cables.upper.winch.winding.speed": {"low": 0.05,
        "high": 0.2}}``.
    objectives
        One or two outputs: ``{"asynchrony_max": {"minimise": "mean"}}``.
    constraints
        Requirements, as of ``ringsim.Campaign``.

    Raises
    ------
    InputError
        Naming key, value, bound and cure, if something is refused.

    Examples
    --------
    >>> force = {"f": {"low": 2, "high": 1, "shared": ["loads.force"]}}
    >>> Optimisation("ring18", force, {"deployment_time": {"minimise": "mean"}}, {})
    Traceback (most recent call last):
    ringsim.refusal.InputError: ringsim.Optimisation: variables.f.low = 2 must be below high = 1
    """

    def __init__(
        self, scene: Scene | str | Path, variables: Mapping[str, Any],
        objectives: Mapping[str, Any], inputs: Mapping[str, Any],
        constraints: Mapping[str, Any] | None = None, seed: int = 0, *,
        name: str = "optimisation", **keys: Any,
    ) -> None:  # fmt: skip
        given = scene if isinstance(scene, Scene) else None
        text = campaign_text(scene, {
            "name": name, "seed": seed, "inputs": inputs, "variables": variables,
            "objectives": objectives, "constraints": constraints,
        } | keys)  # fmt: skip
        self._given = optimisation_of(text, Path(_NAME), scene=given)

    @classmethod
    def read(cls, file: str | Path, settings: Mapping[str, Any] | None = None) -> "Optimisation":
        """The optimisation of a file, as ``ringsim optimise FILE --set ...`` reads it.

        InputError if it is refused.
        """
        found = cls.__new__(cls)
        found._given = optimisation_of(read_text(Path(file)), Path(file), settings)
        return found

    def run(self, workers: int | None = None, *, out: str | Path | None = None) -> xr.Dataset:
        """Run what is missing in the folder ``out`` (runs/NAME): the front.

        Workers are as of ``Campaign.run``.  InputError if the folder is refused; KeyboardInterrupt
        after a signal: call again.
        """
        folder = None if out is None else Path(out)
        ended, path = run_optimisation(lambda: self._given, workers, folder)
        if ended.refused is not None:
            raise ended.refused
        if ended.code == EXIT_INTERRUPTED:
            raise KeyboardInterrupt
        return xr.load_dataset(path)
