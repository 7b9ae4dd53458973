"""Unknown inputs from the measured data of a test: stages of campaigns, and what they tell."""

import contextlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import scipy
import tomli_w
import xarray as xr
from pydantic import ValidationError

from ringsim import build
from ringsim.analysis.posterior import (
    MEMBERS_AN_UNKNOWN,
    WIDER,
    Learnt,
    contrasts,
    explained,
    learn,
)
from ringsim.analysis.residuals import check_sensors, predictions, rank
from ringsim.campaign.folder import open_folder
from ringsim.campaign.python import campaign_text, open_campaign
from ringsim.campaign.run import Ended, Order, listed_cases, require_no_launcher, start
from ringsim.campaign.specification import Campaign, Stages, campaign_of, refuse_other
from ringsim.files import DESIGN, parse_toml, read_text, whole, writing
from ringsim.measured import Measurement, Told, load_measured
from ringsim.overrides import at_path
from ringsim.refusal import InputError, explain
from ringsim.sampling.columns import Axis, Unknowns, add_inputs, alike, correlate, marks, pairs_of
from ringsim.sampling.designs.independent import sobol_points
from ringsim.sampling.distributions import Array, Calibrated, Ranged, inside
from ringsim.scene import Scene
from ringsim.variables import Status

POSTERIOR = "posterior.nc"
"""The result of a calibration, in its folder."""
SENSORS = "sensors.nc"
"""What each sensor would tell, in the folder of ``ringsim sensors``."""
MEMBERS = 1000
"""Samples of a posterior in its file: their 5 % quantile is off by a hundredth in probability."""
_FINE = 25.0
"""Records between two readings: straight between them, five made 0.1 N of 48 N of a first load."""
_MOST_RECORDS = 2000
"""Of a run: a stage of 64 runs stays below half a gigabyte."""
_LEVELS = (0.05, 0.5, 0.95)
_ALL = 1.0 - 1e-9  # the largest correlation that a campaign takes
_NAME = "ringsim.Calibration"
"""How refusals of arguments begin, as those of files with the file's name."""


@dataclass(frozen=True)
class Given:
    """A calibration file: its campaign of the priors, the measured data, and the budget."""

    campaign: Campaign
    measurement: Measurement
    budget: Stages

    @property
    def members(self) -> int:
        """Runs of each stage."""
        return self.budget.runs // self.budget.stages

    def require_readings(self) -> None:
        """Refuse (InputError) a test that is still to come, or that a prior has learnt from."""
        if self.measurement.file.planned:
            where = f"{self.campaign.file.name}: measured = {self.budget.measured}"
            cure = "ringsim sensors takes it; or give its table as file, and clock.column"
            raise InputError(f"{where}: this test is still to come: {cure}")
        test = self.measurement.file.name
        for name, law in self.campaign.specification.inputs.items():
            learnt = law.data.split(", ") if isinstance(law, Calibrated) else []
            if test in [each.partition(" ")[0] for each in learnt]:
                raise InputError(
                    f"{self.campaign.file.name}: inputs.{name} has learnt from the test {test} "
                    "already, and its readings would count twice: give the prior from before it, "
                    f"or, if these are other readings, another name in {self.budget.measured}"
                )


def calibration_of(
    text: str, path: Path, settings: Mapping[str, Any] | None = None, scene: Scene | None = None
) -> Given:
    """The calibration that a text describes: a campaign file without a design, with ``measured``
    and a budget.  ``path``, ``settings`` (which may also have runs and stages) and ``scene`` are as
    in ``campaign_of``.

    InputError if it, the data or a prior is refused.
    """
    table, settings = parse_toml(text, path.name), dict(settings or {})
    refuse_other(table, path.name, "calibrate")
    # --set reaches the scene's values, and how much is run.
    table |= {name: settings.pop(name) for name in ("runs", "stages") if name in settings}
    own = {name: table.pop(name) for name in Stages.model_fields if name in table}
    try:
        budget = Stages.model_validate(own)
    except ValidationError as error:
        raise InputError(explain(error, Stages, path.name)) from None
    stages = "a calibration runs all its stages: leave it out"
    checks = "leave it out, and run samples of the result by the full engine"
    for key, cure in {
        "design": "a calibration places its own samples: leave it out, and set runs and stages",
        "check_every": checks, "max_difference": checks, "error_bars_every": checks,
        "stop_when": stages, "looks": stages,
        "max_failed": "failed runs are counted and left out, whatever their number: leave it out",
        "output": "stages store what calibrations need: leave it out",
        "requirements": "give them to a campaign that draws from the result: leave it out",
    }.items():  # fmt: skip
        if key in table:
            raise InputError(f"{path.name}: {key}: {cure}")
    table.setdefault("fidelity", "frame")
    table["design"] = {"kind": "random", "samples": max(1, budget.runs // budget.stages)}
    campaign = campaign_of(tomli_w.dumps(table), path, settings, scene=scene)
    if not campaign.specification.inputs:
        raise InputError(f"{path.name}: inputs: there is nothing to find: give priors of unknowns")
    for name, law in campaign.specification.inputs.items():
        if law.follows:
            raise InputError(
                f'{path.name}: inputs.{name}: kind = "function" follows another input, which '
                "calibrations cannot: leave it out, or set it under [set]"
            )
    measurement = load_measured(path.parent / budget.measured, planned=True)
    found = Given(campaign, measurement, budget)
    check_sensors(measurement, campaign.scene)
    unknowns = len(unknowns_of(found).names)
    if found.members < (least := MEMBERS_AN_UNKNOWN * (unknowns + 1)):
        raise InputError(
            f"{path.name}: runs = {budget.runs}: {found.members} in each of {budget.stages} stages "
            f"are too few for {unknowns} unknowns: set runs = {least * budget.stages} at least"
        )
    return found


def unknowns_of(given: Given) -> Unknowns:
    """Those that a calibration asks for; InputError if one is no number of a range."""
    asked, file = given.campaign.specification, given.campaign.file.name
    table, found, numbers = given.campaign.draw(), dict[str, Axis](), dict[str, str]()
    for column in table.columns:
        law = asked.inputs[column.input]
        if not isinstance(law, Ranged | Calibrated):
            raise InputError(
                f"{file}: inputs.{column.input}: only numbers that may lie anywhere in a range "
                "can be found from data: give it a continuous distribution"
            )
        bare = law.model_copy(update={"shared": (), "each_section": False})
        for k, mark in enumerate(marks(column.values, () if law.shared else column.places)):
            numbers[f"{column.input}[{k + 1}]"] = f"{column.input}{mark}"
            shared = tuple(f"{path}{mark}" for path in law.shared)
            # Of a posterior each place is an input of its own: together again here.
            group = column.input.partition("[")[0]
            found[f"{column.input}{mark}"] = Axis(
                f"{column.input}{mark}", bare, column.units, group, column.input, shared
            )
    for name, units in {"offset": "s", "drift": "1"}.items():
        if (law := getattr(given.budget.clock, name)) is not None:
            if given.measurement.file.clock is None:
                raise InputError(f"{file}: clock.{name}: the measured data have no clock")
            if not isinstance(law, Ranged | Calibrated) or law.each_section or law.shared:
                raise InputError(
                    f"{file}: clock.{name}: must be one number of a range: give it a "
                    "continuous distribution, without each_section and shared"
                )
            own = f"clock.{name}"
            found[own] = Axis(own, law, units, own, own)
    found = alike(found)
    matrix = np.eye(len(found))
    pairs = [pair.renamed(numbers) for pair in asked.correlations]
    for pair, one, other in pairs_of(list(found), pairs):
        matrix[one, other] = matrix[other, one] = pair.coefficient
    correlate(np.full((1, len(found)), 0.5), list(found), pairs)  # refuses others
    lower = np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)
    return Unknowns(table, tuple(found.values()), lower)


@dataclass
class _Course:
    """The stages of a calibration, or of a plan of sensors, one order after the other."""

    given: Given
    folder: Path
    ended: Callable[["_Course"], None]
    """What is done with all stages."""
    planning: bool = False
    """Whether what sensors read is what they would read at the medians of all unknowns."""
    stages: list[Learnt] = field(default_factory=list)
    told: list[Told] = field(default_factory=list)
    """Of the last stage."""
    points: list[Array] = field(default_factory=list)
    """Of each stage that was ordered."""
    lost: list[int] = field(default_factory=list)
    """Runs of each stage that failed, and so tell nothing."""
    unused: int = 0
    """Readings that some run of the last stage has no value for."""
    nominal: list[Array] = field(default_factory=list)

    def order(self) -> Order:
        """The next stage, from the results of those before."""
        given, asked = self.given, self.given.campaign.specification
        if not self.planning:
            given.require_readings()
        unknowns, number = unknowns_of(given), len(self.points)
        held = self._held()[number]
        if number:
            self._learn(unknowns)
        stream = np.random.default_rng([asked.seed, number])
        if number:
            points = self.stages[-1].posterior.draw(given.members, stream, WIDER)
        else:
            even = sobol_points(given.members, len(unknowns.names), stream, kind="calibration")
            points = scipy.special.ndtri(inside(even))
            if self.planning:
                points[0] = 0.0
        stages = given.budget.stages
        name, title = f"stage-{number + 1}", f"stage {number + 1} of {stages}"
        scene = given.campaign.scene.with_values({"record.interval": _interval(given)})
        # Cases have one value to a place, and lists of them begin with one value for all.
        scene = scene.with_values({
            column.path: float(asked.inputs[column.input].quantile(np.array([0.5]))[0])
            for column in unknowns.template.columns
            if column.dim and at_path(scene, column.path) is None
        })  # fmt: skip
        try:
            points = self._accepted(points, unknowns, scene)
            self.points.append(points)
            middle = {k: float(np.median(v)) for k, v in unknowns.values(points).items()}
            campaign = listed_cases(
                self.folder, name, scene, unknowns.cases(points),
                title=f"{asked.title or asked.name}: {title}", limits=asked.limits,
                fidelity=asked.fidelity, clocks=_clocks(given, middle if number else {}),
                outputs=asked.outputs,
            )  # fmt: skip
        except InputError as error:
            cure = ": truncate the prior that gives it"
            if str(self.folder) in str(error):
                cure = f": choose another folder with --out, or delete {name} and later stages"
            if isinstance(error.__cause__, OSError | RuntimeError):  # of a full disk it is told
                cure = ""
            raise InputError(f"{given.campaign.file.name}: {title}: {error}{cure}") from None
        if held < given.members:
            # What an earlier call has found is not what this one finds.
            (self.folder / (SENSORS if self.planning else POSTERIOR)).unlink(missing_ok=True)
        last = number + 1 == stages
        return Order(campaign, self.folder / name, more=not last, brief=True)

    def _held(self) -> list[int]:
        """Runs of each stage in the folder, 0 of those that it has not; InputError if stages with
        other numbers have followed from one.
        """
        given, sizes = self.given, list[int]()
        for number in range(given.budget.stages):
            path = self.folder / f"stage-{number + 1}"
            sizes.append(open_folder(path).table.samples if (path / DESIGN).exists() else 0)
        for number, size in enumerate(sizes):
            if size > given.members or (0 < size < given.members and any(sizes[number + 1 :])):
                raise InputError(
                    f"{given.campaign.file.name}: runs = {given.budget.runs}: stages of "
                    f"{given.members} runs, and stage-{number + 1} in {self.folder} has {size}: "
                    f"set runs = {size * given.budget.stages} to go on with it, or choose another "
                    "folder with --out"
                )
        return sizes

    def _accepted(self, points: Array, unknowns: Unknowns, scene: Scene) -> Array:
        """Points of a stage whose values the scene takes: where the map of a wide ensemble has
        overshot, nearer to the middle of the one before.
        """
        if not self.stages:
            return points
        step = self.stages[-1].posterior.mean - self.points[-1].mean(axis=0)
        for nearer in (0.0, 0.5, 0.75, 0.875):
            moved = points - nearer * step
            with contextlib.suppress(InputError):
                for values in unknowns.cases(moved):
                    scene.with_values(values)
                return np.asarray(moved)
        return points  # is refused, in words

    def then(self, folder: Path) -> None:
        """Learn from the last stage, unless runs are missing, and write what all have told."""
        ordered = len(self.points) == self.given.budget.stages
        if ordered and not len(open_folder(folder).survey().missing):
            self._learn(unknowns_of(self.given))
            self.ended(self)

    def _learn(self, unknowns: Unknowns) -> None:
        points, name = self.points[-1], f"stage-{len(self.points)}"
        with open_campaign(self.folder / name) as runs:
            well = np.flatnonzero(runs["status"].to_numpy() == Status.OK)
            least = MEMBERS_AN_UNKNOWN * (points.shape[1] + 1)
            if len(well) < least:
                raise InputError(
                    f"{name}: {len(well)} of {len(points)} runs ended well, and "
                    f"{points.shape[1]} unknowns take {least}: look at the others (ringsim status "
                    f"{self.folder / name}), narrow the priors or raise runs"
                )
            known = unknowns.values(points)
            clocks = [known.get(f"clock.{name}") for name in ("offset", "drift")]
            offset, drift = (None if each is None else each[well] for each in clocks)
            every = predictions(
                runs.isel(sample=well), self.given.measurement, offset=offset, drift=drift
            )
        if self.planning and not self.nominal:
            if well[0] != 0:
                raise InputError(f"{name}: the run at the medians of all unknowns failed")
            self.nominal = [values[0] for values in every]
        self.told, self.unused, clock = [], 0, self.given.measurement.file.clock
        for k, (readings, values) in enumerate(
            zip(self.given.measurement.readings, every, strict=True)
        ):
            measured = self.nominal[k] if self.planning else readings.values
            there = np.isfinite(values).all(axis=0) & np.isfinite(measured)
            self.unused += int((~there).sum())
            times = readings.times[there] if clock is None else clock.shown(readings.times[there])
            self.told.append(Told(readings.sensor.name, values[:, there], measured[there],
                                  readings.deviation, readings.bias_deviation,
                                  times))  # fmt: skip
        if not any(len(each.measured) for each in self.told):
            raise InputError(
                f"{name}: no reading lies within all runs: check clock.offset of the measured data "
                "and solver.end_time of the scene"
            )
        self.stages.append(learn(points[well], self.told))
        self.points[-1] = points[well]
        self.lost.append(len(points) - len(well))


def _interval(given: Given) -> float:
    """Spacing of records (s), fine enough for the readings to lie between close ones."""
    scene = given.campaign.scene
    apart = [np.diff(each.times) for each in given.measurement.readings if len(each.times) > 1]
    spacing = min((float(np.median(each)) for each in apart), default=np.inf)
    wished = max(spacing / _FINE, scene.solver.end_time / _MOST_RECORDS)
    return float(f"{min(scene.record.interval, wished):.3g}")


def run_course(
    given: Callable[[], Given], workers: int | None, out: Path | None, *, planning: bool = False
) -> tuple[Ended, Path]:
    """Run all stages that are missing, on all ranks of an MPI world or with so many workers, and
    write what they tell into the folder ``out`` (runs/NAME): ``POSTERIOR``, or ``SENSORS`` if it is
    for ``planning``.  How it ended, and the file.

    Each stage is a campaign in that folder, which other verbs read; the same call goes on with one
    that was interrupted, to the same result.
    """
    courses, name = list[_Course](), SENSORS if planning else POSTERIOR

    def order() -> Order:
        if not courses:
            require_no_launcher(workers)
            found = given()
            called = found.campaign.specification.name + "-sensors" * planning
            write = _write_sensors if planning else _write_posterior
            courses.append(_Course(found, out or Path("runs") / called, write, planning))
        return courses[0].order()

    ended = start(workers, order, lambda folder: courses[0].then(folder))
    return ended, (courses[0].folder if courses else out or Path()) / name


def _write_posterior(course: _Course) -> None:
    """The file of a posterior: samples of it, and what it says of unknowns and sensors."""
    given, last = course.given, course.stages[-1]
    asked, unknowns = given.campaign.specification, unknowns_of(given)
    names, sensors = unknowns.names, [fit.sensor for fit in last.fits]
    mean, covariance = unknowns.spread(*last.posterior[:2])
    deviation = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(deviation, deviation)
    stream = np.random.default_rng([asked.seed, len(course.stages)])
    table = unknowns.at(last.posterior.draw(MEMBERS, stream))
    levels = np.array(_LEVELS)
    contrast, chance = np.full((2, len(names)), np.nan)
    fault, groups = np.zeros(len(names), dtype=int), dict[str, list[int]]()
    for k, axis in enumerate(unknowns.axes):
        groups.setdefault(axis.group, []).append(k)
    # Of two places nobody can say which one is unlike the other.
    judged = [own for own in groups.values() if len(own) > 2]
    prior = unknowns.lower @ unknowns.lower.T
    for own in judged:
        at = np.ix_(own, own)
        apart = contrasts(mean[own], covariance[at], prior[at], len(judged))
        contrast[own], chance[own], fault[own] = apart
    well = explained([fit.chance for fit in last.fits], [*last.chances.values()])
    test = given.measurement.file.name + " (NOT EXPLAINED: intervals too narrow)" * (not well)
    laws = [
        axis.moved(m, s, test)
        for axis, m, s in zip(unknowns.axes, mean.tolist(), deviation.tolist(), strict=True)
    ]
    strays = [float(told.times[k]) for fit, told in zip(last.fits, course.told, strict=True)
              if told.times is not None for k in fit.strays]  # fmt: skip
    per_unknown, per_sensor, per_stage = ("unknown",), ("sensor",), ("stage",)
    numbers: dict[str, tuple[tuple[str, ...], Any, str]] = {
        "prior_quantile": (("unknown", "level"),
                           np.array([axis.law.quantile(levels) for axis in unknowns.axes]),
                           "quantiles of the prior"),
        "posterior_quantile": (("unknown", "level"), np.array([x.quantile(levels) for x in laws]),
                               "quantiles of the posterior"),
        "shift": (per_unknown, mean, "mean of the posterior in standard normal space: sigmas of "
                  "the prior from its median"),
        "learnt": (per_unknown, deviation, "standard deviation of the posterior over that of the "
                   "prior, both in standard normal space"),
        "correlation": (("unknown", "other"), correlation,
                        "correlation of unknowns in the posterior, in standard normal space"),
        "contrast": (per_unknown, contrast,
                     "distance from the mean of the other places of the input, in sigma"),
        "contrast_chance": (per_unknown, chance, "probability of so large a contrast in any place "
                            "of the input if all are as the prior says"),
        "group": (per_unknown, fault, "number of the fault that the place may have, 0 for none"),
        "rms_in_deviations": (per_sensor, [fit.rms for fit in last.fits],
                              "readings less what the posterior's mean gives, over their scatter"),
        "readings": (per_sensor, [fit.readings for fit in last.fits], "readings that were used"),
        "strays": (per_sensor, [len(fit.strays) for fit in last.fits],
                   "readings that were set aside"),
        "stray_time": (("stray",), strays, "time of a reading that was set aside, as "
                       "its table has it (clock_unit)"),
        "stray_size": (("stray",), [size for fit in last.fits for size in fit.stray_sizes],
                       "that reading less what is expected, over the scatter of a reading"),
        "chance": (per_sensor, [fit.chance for fit in last.fits], "probability of so large an rms "
                   "by the scatter of the readings alone"),
        "pattern": (per_sensor, [fit.pattern for fit in last.fits], "how alike successive misfits "
                    "are, N(0, 1) if nothing but scatter makes them"),
        "off": (per_sensor, [fit.off for fit in last.fits], "how far runs lie off the linear map, "
                "over the scatter of a reading"),
        "chance_of_all": (("test",), [*last.chances.values()], "probability by scatter alone"),
        "stage_learnt": (("stage", "unknown"),
                         [np.sqrt(np.diag(unknowns.spread(*stage.posterior[:2])[1]))
                          for stage in course.stages],
                         "learnt, after each stage"),
        "lost": (per_stage, course.lost, "runs that failed"),
        "unused": ((), course.unused, "readings that some run has no value for"),
    }  # fmt: skip
    words = {"unknown": names, "other": names, "sensor": sensors,
             "input": [axis.group for axis in unknowns.axes],
             "test": [*last.chances],
             "stray_sensor": [fit.sensor for fit in last.fits for _ in fit.strays],
             "unknown_units": [axis.units for axis in unknowns.axes]}  # fmt: skip
    own = [k for k, name in enumerate(names) if not name.startswith("clock.")]
    held = np.clip(correlation, -_ALL, _ALL)
    pairs = [{"between": [names[i], names[j]], "coefficient": float(held[i, j])}
             for i in own for j in own if i < j]  # fmt: skip
    says = {names[k]: laws[k].model_dump(exclude_none=True) for k in own}
    clock = given.measurement.file.clock
    half = np.array([0.5])
    medians = {n: float(law.quantile(half)[0]) for n, law in zip(names, laws, strict=True)}
    attributes = {
        "title": asked.title or asked.name, "question": asked.question, "seed": asked.seed,
        "runs": given.members * len(course.stages), "stages": len(course.stages),
        "scene": given.campaign.scene.to_toml(), "fidelity": asked.fidelity,
        "measured": given.measurement.file.name, "inputs": json.dumps(says),
        "clocks": json.dumps(_clocks(given, medians)),
        "clock_unit": clock.unit if clock else "s",
        "held": json.dumps(last.held),
        "correlations": json.dumps(pairs), **build.provenance(),
    }  # fmt: skip
    path = course.folder / POSTERIOR
    with writing(path), whole(path) as draft, netCDF4.Dataset(draft, "w") as file:
        file.setncatts(attributes)
        sizes = {"sample": MEMBERS, "unknown": len(names), "other": len(names),
                 "level": len(_LEVELS), "sensor": len(sensors),
                 "stage": len(course.stages), "test": len(last.chances),
                 "stray": len(words["stray_sensor"])}  # fmt: skip
        for name, size in sizes.items():
            file.createDimension(name, size)
        add_inputs(file, table, compression=4)
        file.createVariable("level", "f8", ("level",))[:] = _LEVELS
        for name, texts in words.items():
            along = "stray" if name == "stray_sensor" else name if name in sizes else "unknown"
            file.createVariable(name, str, (along,))[:] = np.array(texts, dtype=object)
        for name, (dims, values, meaning) in numbers.items():
            array = np.asarray(values)
            made = file.createVariable(name, "i8" if array.dtype.kind == "i" else "f8", dims)
            made[...] = array
            made.setncatts({"long_name": meaning, "units": "1"})


def _clocks(given: Given, medians: Mapping[str, float]) -> dict[str, dict[str, list[float]]]:
    """By tests' names offset and drift of their clocks, in their files and as found."""
    clock, earlier = given.measurement.file.clock, dict(given.campaign.clocks)
    if clock is None or not any(name.startswith("clock.") for name in medians):
        return earlier
    before = {"offset": clock.offset, "drift": clock.drift}
    found = {n: [was, medians.get(f"clock.{n}", was)] for n, was in before.items()}
    return earlier | {given.measurement.file.name: found}


def _write_sensors(course: _Course) -> None:
    """The file of a plan of sensors, the one that tells most first."""
    unknowns = unknowns_of(course.given)
    told = [each for each in course.told if len(each.measured)]
    silent = [each.sensor for each in course.told if not len(each.measured)]
    found = rank(course.points[-1], told, unknowns.lower)
    rows = xr.Dataset(
        {
            "learnt": (("sensor", "unknown"), found.after, {
                "long_name": "posterior over prior scatter with this sensor and all above",
                "units": "1"}),
            "alone": (("sensor", "unknown"), found.alone[found.order], {
                "long_name": "the same with this sensor alone", "units": "1"}),
        },
        {"sensor": [told[k].sensor for k in found.order], "unknown": unknowns.names},
        {"scene": course.given.campaign.scene.to_toml(), "silent": ", ".join(silent),
         **build.provenance()},
    )  # fmt: skip
    path = course.folder / SENSORS
    with writing(path), whole(path) as draft:
        rows.to_netcdf(draft, engine="netcdf4")


class Calibration:
    """Unknown inputs from measured data; ``run`` runs it, or finishes it.

    Parameters
    ----------
    scene, inputs, seed, name, keys
        As of ``ringsim.Campaign``: ``inputs`` are the priors of what is unknown.
    measured
        File of measured data, see ``ringsim.load_measured``.
    runs, stages
        Runs of all stages together; how often the ensemble is drawn anew.

    Raises
    ------
    InputError
        Naming key, value, bound and cure, if something is refused.

    Examples
    --------
    >>> Calibration("ring18", {}, "stand.toml", runs=5)
    Traceback (most recent call last):
    ringsim.refusal.InputError: ringsim.Calibration: runs = 5 must be at least 16
    """

    def __init__(
        self, scene: Scene | str | Path, inputs: Mapping[str, Any], measured: str | Path,
        runs: int = 256, stages: int = 4, seed: int = 0, *, name: str = "calibration", **keys: Any,
    ) -> None:  # fmt: skip
        given = scene if isinstance(scene, Scene) else None
        text = campaign_text(scene, {
            "name": name, "seed": seed, "inputs": inputs, "measured": measured, "runs": runs,
            "stages": stages,
        } | keys)  # fmt: skip
        self._given = calibration_of(text, Path(_NAME), scene=given)

    @classmethod
    def read(cls, file: str | Path, settings: Mapping[str, Any] | None = None) -> "Calibration":
        """The calibration of a file, as ``ringsim calibrate FILE --set ...`` reads it.

        InputError if it is refused.
        """
        found = cls.__new__(cls)
        found._given = calibration_of(read_text(Path(file)), Path(file), settings)
        return found

    def run(self, workers: int | None = None, *, out: str | Path | None = None) -> xr.Dataset:
        """Run all stages that are missing in the folder ``out`` (runs/NAME): the posterior.

        Workers are as of ``Campaign.run``.  InputError if the folder or too few runs of a stage
        that ended well are refused; KeyboardInterrupt after a signal: call again.
        """
        return self._run(workers, out, planning=False)

    def sensors(self, workers: int | None = None, *, out: str | Path | None = None) -> xr.Dataset:
        """How much each sensor would tell; see ``run``, the folder is runs/NAME-sensors."""
        return self._run(workers, out, planning=True)

    def _run(self, workers: int | None, out: str | Path | None, *, planning: bool) -> xr.Dataset:
        folder = None if out is None else Path(out)
        ended, path = run_course(lambda: self._given, workers, folder, planning=planning)
        ended.require_end()
        return xr.load_dataset(path)
