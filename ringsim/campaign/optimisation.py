"""Which values make an antenna best under what is uncertain: designs that are run as campaigns."""

import contextlib
import sys
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from pydantic import ValidationError

from ringsim import build, extensions
from ringsim.analysis import derived
from ringsim.analysis.design import endings_of
from ringsim.analysis.front import Axis, fresh_of, gains, write_front
from ringsim.analysis.intervals import quantities
from ringsim.analysis.optimum import (
    CHECK,
    DIGITS,
    SEARCH,
    VERDICT,
    Course,
    Found,
    Problem,
    Values,
    Wanted,
    course,
)
from ringsim.analysis.requirements import OUTCOME
from ringsim.campaign.folder import open_folder
from ringsim.campaign.python import campaign_text, open_campaign
from ringsim.campaign.run import Ended, Order, require_no_launcher, start
from ringsim.campaign.specification import (
    Budget,
    Campaign,
    Specification,
    Variable,
    campaign_of,
    refuse_other,
)
from ringsim.files import parse_toml, read_text, write_text, writing
from ringsim.outputs.balance import instead_of
from ringsim.outputs.family import VARIABLES, holds, supply
from ringsim.overrides import field_at, flat, in_turn, with_number
from ringsim.refusal import EXIT_FAILED, InputError, explain, known_or_nearest, show
from ringsim.sampling.table import first_inside, refuse_fixed
from ringsim.scene import Scene
from ringsim.stepping.instant import Array
from ringsim.tables import amount_text, counted
from ringsim.units import unit_at
from ringsim.variables import GOALS, OF_CAMPAIGNS, Fate, Status

FRONT = "front.nc"
"""The result of an optimisation, in its folder."""
_ASKED = "optimisation.toml"
"""What the folder is run with, all values."""
_NAME = "ringsim.Optimisation"
"""How refusals of arguments begin, as those of files with the file's name."""
_DESIGNS = "designs"
"""Folder of the campaigns of the search."""


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

    @property
    def asked(self) -> str:
        """All that decides about what is run, as a text."""
        wanted, keys = self.present.specification, dict[str, Any](exclude_none=True, mode="json")
        left = {"name", "title", "question", "seed", "set", "scene", "design", "requirements"}
        table: dict[str, Any] = {"seed": self.table.get("seed", 0)}
        table |= self.budget.model_dump(by_alias=True, exclude={"objectives"}, **keys)
        table |= wanted.model_dump(exclude=left, **keys)
        table["objectives"] = {
            name: aim.model_dump(exclude_unset=True) for name, aim in self.budget.objectives.items()
        }
        table["scene"] = self.present.scene.to_table()
        return tomli_w.dumps(table)

    def settings_of(self, point: Array) -> dict[str, float]:
        """Value by scene path."""
        known = self.values(point)
        return {path: known[name] for name, law in self.budget.variables.items()
                for path in law.shared or (name,)}  # fmt: skip

    def campaign(self, wanted: Wanted, name: str) -> Campaign:
        """The campaign that runs a design."""
        settings = in_turn(self.settings, self.settings_of(wanted.point))
        return _campaign(
            self.path, self.table, settings, self.scene, self.budget, wanted.samples, name
        )


def _campaign(
    path: Path, table: Mapping[str, Any], settings: Mapping[str, Any], scene: Scene | None,
    budget: Budget, samples: str, name: str,
) -> Campaign:  # fmt: skip
    own = dict(table)
    turn = (SEARCH, CHECK, VERDICT).index(samples)
    # The search has the same samples in all designs; what judges it has others.
    own["seed"] = (own.get("seed", 0) + turn) % 2**63
    own["name"] = f"{own['name'][:60]}-{name}"
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
    refuse_other(table, path.name, "optimise")
    sizes = ("designs", "samples", "check", "verdict", "front")
    table |= {name: settings.pop(name) for name in sizes if name in settings}
    for key, cure in _NOT_HERE.items():
        if key in table:
            raise InputError(f"{path.name}: {key}: {cure}: leave it out")
    known = {*Budget.model_fields, *Specification.model_fields} - {*_NOT_HERE}
    if strange := [key for key in table if key not in known and key not in Specification.gone]:
        hint = known_or_nearest(strange[0], sorted(known))
        raise InputError(f"{path.name}: {strange[0]} is not a known key ({hint})")
    extensions.load(extensions.located(extensions.names_in(table), path.parent))
    own = {name: table.pop(name) for name in Budget.model_fields if name in table}
    table.setdefault("fidelity", "frame")
    for model, part in (
        (Specification, table | {"design": {"kind": "random", "samples": 16}}), (Budget, own)
    ):  # fmt: skip
        try:  # as it stands in the file: names and seeds of its campaigns are others
            model.model_validate(part)
        except ValidationError as error:
            raise InputError(explain(error, model, path.name)) from None
    budget = Budget.model_validate(own)
    if "front" in own and len(budget.objectives) == 1:
        raise InputError(f"{path.name}: front: one objective has one best design: leave it out")
    if not table.get("inputs"):
        raise InputError(
            f"{path.name}: inputs: nothing is uncertain: give distributions of what is not known"
        )
    try:
        present = _campaign(path, table, settings, scene, budget, VERDICT, "present")
    except InputError as error:  # its campaigns call them requirements
        raise InputError(str(error).replace(" requirements.", " constraints.", 1)) from None
    for name in budget.objectives:
        _require_output(path.name, name, present.scene)
    taken = dict[str, str]()
    start_ = np.array([
        _begin(path.name, name, law, present, taken) for name, law in budget.variables.items()
    ])  # fmt: skip
    given = Given(path, table, settings, scene, budget, present, start_)
    if budget.designs < (least := given.problem.least):
        levels = f" and {given.problem.front} levels" if given.problem.front > 1 else ""
        raise InputError(
            f"{path.name}: designs = {budget.designs}: too few for "
            f"{counted(len(start_), 'variable')}{levels}: set designs = {least} at least"
        )
    present.draw()
    for side in ("low", "high"):
        corner = {path: getattr(law, side) for name, law in budget.variables.items()
                  for path in law.shared or (name,)}  # fmt: skip
        try:
            present.scene.with_values(corner)
        except InputError as error:
            raise InputError(
                f"{path.name}: variables: with all at their {side}: {error}; narrow their bounds"
            ) from None
    return given


_NOT_HERE = {
    "design": "an optimisation places its own samples, by samples, check and verdict",
    "requirements": "an optimisation calls them constraints",
    **dict.fromkeys(("stop_when", "looks"), "each design runs all its samples"),
    "max_failed": "designs whose runs fail are passed over",
    "error_bars_every": "a chosen design may be run with error bars",
}
"""Keys of campaign files that an optimisation has no use for, and why."""


def _require_output(file: str, name: str, scene: Scene) -> None:
    if name in VARIABLES and VARIABLES[name].dims:
        raise InputError(f"{file}: objectives.{instead_of(name)}")
    if name not in quantities():
        hint = known_or_nearest(name, quantities())
        raise InputError(f"{file}: objectives.{name}: is no output that has a mean ({hint})")
    if absent := sorted(set(VARIABLES[name].needs) - holds(scene) - {OF_CAMPAIGNS}):
        raise InputError(
            f"{file}: objectives.{name}: runs of this scene do not have this output, because the "
            f"scene has no {absent[0]}: choose another, or {supply(absent[0])}"
        )


def _begin(file: str, name: str, law: Variable, present: Campaign, used: dict[str, str]) -> float:
    """Where a variable of the present design is between its bounds; InputError if it is not.

    Its paths join those that are ``used``, with its name.
    """
    where, inputs = f"{file}: variables.{name}", present.specification.inputs
    scene, paths = present.scene, law.shared or (name,)
    if not law.shared and "." not in name:
        raise InputError(
            f"{where}: {name} is no scene path: give those that take its value, as shared = "
            '["cables.upper.winch.winding.speed", ...], or a path in its place'
        )
    drawn = {with_number(scene, path): key for key, each in inputs.items()
             for path in each.shared or (key,)}  # fmt: skip
    values = []
    for path in paths:
        before: Any = None
        try:
            refuse_fixed(scene, path)
            own = with_number(scene, path)
            with contextlib.suppress(AttributeError):
                before = field_at(scene, path)
            if isinstance(before, int) and not isinstance(before, bool):
                raise InputError(
                    f"{path} = {before} is a whole number, and variables have decimals: leave it "
                    "out, and run one optimisation for each value, under [set]"
                )
            value = field_at(scene.with_values({path: law.low}), path)
        except (InputError, AttributeError) as error:
            told = str(error).removeprefix("inputs: ")
            side = ".low" if f"{path} = {law.low}" in told else ""
            raise InputError(f"{where}{side}: {told}") from None
        if not isinstance(value, float) or not isinstance(before, float):
            raise InputError(
                f"{where}: {path} is {show(before)} in the scene, and must be one number there: "
                "name its places one by one, or set a number under [set]"
            )
        for others, what in ((drawn, "drawn as input"), (used, "set by variable")):
            outer = next((o for o in others if first_inside(o, [own])), "")
            if other := own if own in others else first_inside(own, others) or outer:
                by = f"{what} {others[other]}" if others[other] != name else "named before"
                raise InputError(f"{where}: {path} is also {by}: leave out one of the two")
        used[own] = name
        values.append(before)
    if len(set(values)) > 1:
        raise InputError(
            f"{where}.shared: the scene has {', '.join(f'{v:g}' for v in values)} there, and they "
            "take one value: set them equal under [set]"
        )
    for side in ("low", "high"):
        try:
            scene.with_values(dict.fromkeys(paths, getattr(law, side)))
        except InputError as error:
            raise InputError(f"{where}.{side}: {error}") from None
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
    tried: int = 0  # designs that have been ordered so far
    apart: list[str] = field(default_factory=list)
    """Where engines differ by more than ``max_difference``, a line a design that is judged."""

    def order(self) -> Order:
        """The next campaign, from the results of those before."""
        if not self.ordered:
            self._keep_asked()
            self.course = course(self.given.problem)
            self.wanted = next(self.course)
        elif self.found is None:
            assert self.wanted is not None
            try:
                self.wanted = self.course.send(self._values(self.ordered[-1].folder))
            except StopIteration as end:
                self.found = end.value
                if not self.found.checks:
                    raise InputError(self._hopeless()) from None
        if self.found is None:
            assert self.wanted is not None
            name = f"{len(self.ordered) + 1:03d}-{self.wanted.samples}"
            folder, more = self.folder / _DESIGNS / name, True
            self.tried += self.wanted.samples == SEARCH
            told = "check of the best design"
            if self.wanted.samples == SEARCH:
                told = f"design {self.tried} of at most {self.given.budget.designs}"
                if self.wanted.without is not None:
                    which, k = self.wanted.without
                    name_of = [*self.given.budget.variables]
                    told = f"design-{which + 1} with {name_of[k]} as at present"
            told += self._best(self.wanted.best)
        else:
            if not self.verdicts:
                chosen = [self.found.points[each.place] for each in self.found.chosen]
                names = [f"design-{k + 1}" for k in range(len(chosen))]
                self.verdicts = [("present", self.given.start), *zip(names, chosen, strict=True)]
            done = sum(each.folder.parent == self.folder for each in self.ordered)
            name, point = self.verdicts[done]
            self.wanted = Wanted(VERDICT, point)
            folder, more = self.folder / name, done + 1 < len(self.verdicts)
            told = f"verdict on {name}, {done + 1} of {len(self.verdicts)}"
        made = Order(
            self.given.campaign(self.wanted, name), folder, more=more, brief=True,
            label=f"{self.given.table['name']}: {told}",
        )  # fmt: skip
        self.ordered.append(made)
        return made

    def _keep_asked(self) -> None:
        """Keep what is asked for in the folder; InputError if it has another optimisation."""
        path, asked = self.folder / _ASKED, self.given.asked
        if not path.exists():
            with writing(path):
                self.folder.mkdir(parents=True, exist_ok=True)
            write_text(path, asked)
        held, mine = (flat(parse_toml(text, _ASKED)) for text in (read_text(path), asked))
        for key in {**mine, **held}:
            if mine.get(key) != held.get(key):
                values = (show(each[key]) if key in each else "nothing" for each in (mine, held))
                raise InputError(
                    f"{self.folder}: this folder has another optimisation: {key} = "
                    f"{' instead of '.join(values)}: choose another folder with --out"
                )

    def _best(self, best: Array | None) -> str:
        """The objectives of the best design so far, in words."""
        if best is None:
            return ""
        words = []
        for aim, steered in zip(self.given.problem.objectives, best, strict=True):
            value = float(aim.shown(steered))
            words.append(f"{aim.told} {amount_text(value, aim.units, '.4g')}")
        return f", best so far: {', '.join(words)}"

    def _hopeless(self) -> str:
        survey = open_folder(self.ordered[0].folder).survey()
        ends = Counter(endings_of(survey.status, survey.fate).tolist())
        told = ", ".join(f"{count} {word}" for word, count in ends.most_common(3))
        return (
            f"{self.given.path.name}: none of {counted(len(survey.status), 'sample')} of the "
            f"present design reaches its goal with all outputs that are asked for ({told}), so "
            "that the search has nowhere to begin: set another present design under [set], or a "
            "longer solver.end_time"
        )

    def _values(self, folder: Path) -> Values:
        """What a design's samples gave of all that is wanted; NaN of those that do not count."""
        campaign = open_folder(folder)
        count = campaign.table.samples
        names = list(dict.fromkeys([*self.given.budget.objectives, *self.given.budget.constraints]))
        kept = {name: np.full(count, np.nan) for name in names}
        survey, own = campaign.survey(), derived.known_from(campaign.attributes)
        for result in survey.results(np.arange(count)):
            wanted = self.given.budget.constraints.get(OUTCOME)
            goals = GOALS if wanted is None else (Fate[str(wanted.is_).upper()],)
            if result.status != Status.OK or result.fate not in (*goals, Fate.NONE):
                continue
            arrays = derived.of_run(own, result.arrays())
            for name in names:
                kept[name][result.sample] = 0.0 if name == OUTCOME else arrays.get(name, np.nan)
        return kept

    def then(self, folder: Path) -> None:
        """Write what was found, unless runs are missing."""
        held = open_folder(folder)
        if self.found is not None and not len(held.survey().missing) + len(held.unchecked()):
            _write(self)


def first_order(given: Given) -> tuple[Order, int, int, str]:
    """The verdict on the present design, for all; about how many runs there are (rounds of checks
    nobody knows), and how many by the other engine; the runs in words.
    """
    budget, chosen = given.budget, given.problem.front
    every = given.present.specification.check_every
    checks = -(-budget.verdict // every) if every else 0
    parts = (
        (budget.designs, budget.samples, "designs searched"),
        (chosen * len(budget.variables), budget.samples, "with one value as at present"),
        (1 + 2 * chosen, budget.check, "checks"), (1 + chosen, budget.verdict, "verdicts"),
    )  # fmt: skip
    told = " + ".join(f"{count} {what} x {samples}" for count, samples, what in parts)
    runs = sum(count * samples for count, samples, _ in parts)
    return Order(given.present, Path()), runs, (1 + chosen) * checks, told


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
    if courses and courses[0].apart:  # on the first rank: a launcher's exit code is the largest
        print(*courses[0].apart, sep="\n", file=sys.stderr, flush=True)
        ended = ended._replace(code=EXIT_FAILED)
    return ended, (courses[0].folder if courses else out or Path()) / FRONT


def _write(course_: _Course) -> None:
    """The file of the front, and the scenes of the designs on it."""
    given, found, folder = course_.given, course_.found, course_.folder
    assert found is not None
    axes = [
        Axis(name, unit_at(given.present.scene, (law.shared or (name,))[0]), law.low, law.high)
        for name, law in given.budget.variables.items()
    ]
    asked, budget = given.present.specification, given.budget
    attributes = {
        "title": str(given.table.get("title", "")), "question": asked.question,
        "name": given.table["name"], "scene": given.present.scene.to_toml(),
        "fidelity": asked.fidelity, "samples": budget.samples, "check_samples": budget.check,
        "verdict_samples": budget.verdict, "most_designs": budget.designs,
        **build.provenance(),
    }  # fmt: skip
    fresh = {name: fresh_verdict(given, folder / name) for name, _ in course_.verdicts}
    for name, told in fresh.items():  # the samples of all verdicts are the same
        pairs = zip(
            given.problem.objectives, fresh["present"]["values"], told["values"], strict=True
        )
        every = np.array([gains(aim, first, second) for aim, first, second in pairs])
        course_.apart += [f"{name}: {line}" for line in told["too_far"]]
        told |= {"gain": every[:, 0], "gain_lower": every[:, 1], "gain_upper": every[:, 2]}
    write_front(
        folder / FRONT, given.problem, found, axes, lambda p: [*given.values(p).values()], fresh,
        attributes,
    )  # fmt: skip
    for name, point in course_.verdicts[1:]:
        text = given.present.scene.with_values(given.settings_of(point)).to_toml()
        write_text(folder / f"{name}.toml", text)


def fresh_verdict(given: Given, folder: Path) -> dict[str, Any]:
    """What the fresh samples of a design say; see ``fresh_of``."""
    with open_campaign(folder) as campaign:
        return fresh_of(campaign, given.problem)


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
        ended.require_end()
        return xr.load_dataset(path)
