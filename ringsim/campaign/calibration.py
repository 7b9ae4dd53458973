"""Finding values from measurements: unknown inputs from the data of a test, by a file; the stowed
angle from a deployment time.
"""

import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import netCDF4
import numpy as np
import scipy
import tomli_w
import xarray as xr
from pydantic import Field, ValidationError

from ringsim import build
from ringsim.analysis.posterior import (
    MEMBERS_AN_UNKNOWN,
    WIDER,
    Fit,
    Posterior,
    fits,
    posterior_of,
)
from ringsim.analysis.residuals import predictions
from ringsim.cable.records import BarHalfBracket
from ringsim.campaign.run import run_cases
from ringsim.campaign.specification import Campaign, campaign_of
from ringsim.choice import kind_of
from ringsim.files import parse_toml, read_text, whole, writing
from ringsim.measured import Measurement, load_measured
from ringsim.refusal import InputError, explain
from ringsim.sampling.columns import Column, Table, add_inputs
from ringsim.sampling.designs.independent import sobol_points
from ringsim.sampling.distributions import Array, Distribution, inside
from ringsim.scene import Scene
from ringsim.scene.substituted import substituted
from ringsim.simulation import run_frame
from ringsim.structures.pantograph_ring import LEAST_OPENING
from ringsim.units import Model
from ringsim.variables import Status

# Unknown inputs from measured data.


POSTERIOR = "posterior.nc"
"""The result of a calibration, in its folder."""
MEMBERS = 1000
"""Samples of a posterior in its file: their 5 % quantile is off by a hundredth in probability."""
_FINE = 5.0
"""Records of a run between two readings: between records curves are taken as straight."""
_MOST_RECORDS = 2000
"""Records of a run at most, which keeps a stage of 64 runs below half a gigabyte."""
_LEVELS = (0.05, 0.5, 0.95)


class Budget(Model):
    """What a calibration file has beyond the keys of a campaign file."""

    measured: str
    """File of measured data, beside this file."""
    runs: Annotated[int, Field(ge=16, le=1_000_000)] = 256
    """Of all stages together."""
    stages: Annotated[int, Field(ge=1, le=20)] = 4
    """How often the ensemble is drawn anew, the first time from the priors."""


@dataclass(frozen=True)
class Calibration:
    """A calibration file: its campaign of the priors, the measured data, and the budget."""

    campaign: Campaign
    measurement: Measurement
    budget: Budget

    @property
    def members(self) -> int:
        """Runs of each stage."""
        return self.budget.runs // self.budget.stages


def load_calibration(path: Path, settings: Mapping[str, Any] | None = None) -> Calibration:
    """Read a calibration file: a campaign file without a design, with ``measured`` and a budget.

    InputError if it, the data or a prior is refused.
    """
    table = parse_toml(read_text(path), path.name)
    own = {name: table.pop(name) for name in Budget.model_fields if name in table}
    try:
        budget = Budget.model_validate(own)
    except ValidationError as error:
        raise InputError(explain(error, Budget, path.name)) from None
    for key, cure in {
        "design": "a calibration places its own samples: leave it out, and set runs and stages",
        "correlations": "priors of a calibration do not depend on each other: leave it out",
        "check_every": "leave it out, and run samples of the result by the full engine",
        "stop_when": "a calibration runs all its stages: leave it out",
    }.items():
        if key in table:
            raise InputError(f"{path.name}: {key}: {cure}")
    table.setdefault("fidelity", "frame")
    table["design"] = {"kind": "random", "samples": budget.runs // budget.stages}
    campaign = campaign_of(tomli_w.dumps(table), path, settings)
    if not campaign.specification.inputs:
        raise InputError(f"{path.name}: inputs: there is nothing to find: give priors of unknowns")
    found = Calibration(campaign, load_measured(path.parent / budget.measured), budget)
    unknowns = len(Unknowns.of(campaign).names)
    if found.members < (least := MEMBERS_AN_UNKNOWN * (unknowns + 1)):
        raise InputError(
            f"{path.name}: runs = {budget.runs}: {found.members} in each of {budget.stages} stages "
            f"are too few for {unknowns} unknowns: set runs = {least * budget.stages} at least"
        )
    return found


@dataclass(frozen=True)
class Unknowns:
    """The inputs of a calibration, each an axis of standard normal space."""

    template: Table
    laws: Mapping[str, Distribution]
    names: tuple[str, ...]
    """Of the axes: inputs, with a place where one value is drawn for each section."""

    @classmethod
    def of(cls, campaign: Campaign) -> "Unknowns":
        """Those that a campaign draws; InputError if one is no number of a continuous range."""
        table = campaign.draw()
        names = dict[str, None]()
        for column in table.columns:
            if column.values.dtype.kind != "f":
                raise InputError(
                    f"{campaign.file.name}: inputs.{column.input}: only numbers that may lie "
                    "anywhere in a range can be found from data: give it a continuous distribution"
                )
            names |= dict.fromkeys(_axes(column))
        return cls(table, campaign.specification.inputs, tuple(names))

    def at(self, points: Array) -> Table:
        """The inputs at points of standard normal space, shape (samples, unknowns)."""
        place = {name: k for k, name in enumerate(self.names)}
        shares = inside(scipy.special.ndtr(points))
        columns = []
        for column in self.template.columns:
            law = self.laws[column.input]
            each = [law.quantile(shares[:, place[name]]) for name in _axes(column)]
            values = np.stack(each, axis=1) if column.dim else each[0]
            columns.append(replace(column, values=values))
        return Table(tuple(columns), np.arange(len(points), dtype=np.int64))

    def cases(self, points: Array) -> list[dict[str, float]]:
        """Values by scene path of each point, one value to a path."""
        found = []
        table = self.at(points)
        for sample in range(table.samples):
            row = dict[str, float]()
            for path, value in table.values_of(sample).items():
                every = value if isinstance(value, list) else [value]
                marks = [f"[{k + 1}]" for k in range(len(every))]
                ends = marks if isinstance(value, list) else [""]
                row |= {f"{path}{end}": float(v) for end, v in zip(ends, every, strict=True)}
            found.append(row)
        return found

    def quantiles(self, mean: Array, deviation: Array) -> Array:
        """Of each unknown at ``_LEVELS`` if its axis is normal so, shape (unknowns, levels)."""
        at = mean[:, None] + deviation[:, None] * scipy.special.ndtri(np.array(_LEVELS))
        shares = inside(scipy.special.ndtr(at))
        laws = [self.laws[name] if name in self.laws else self.laws[name.rpartition("[")[0]]
                for name in self.names]  # fmt: skip
        return np.array([law.quantile(row) for law, row in zip(laws, shares, strict=True)])


def _axes(column: Column) -> list[str]:
    if not column.dim:
        return [column.input]
    return [f"{column.input}[{k + 1}]" for k in range(column.values.shape[1])]


@dataclass(frozen=True)
class Stage:
    """What one ensemble told."""

    found: Posterior
    fits: list[Fit]
    lost: int
    """Runs that failed, and so tell nothing."""
    unused: int
    """Readings that some run has no value for."""


def calibrate(given: Calibration, folder: Path, workers: int) -> xr.Dataset:
    """Run all stages that are missing, and write and return the posterior (``POSTERIOR``).

    Each stage is a campaign in ``folder``, which other verbs read; the same call goes on with one
    that was interrupted, to the same posterior.

    Raises
    ------
    InputError
        If something is refused, or too few runs of a stage ended well.
    KeyboardInterrupt
        After a signal: call again.
    """
    campaign, asked = given.campaign, given.campaign.specification
    unknowns = Unknowns.of(campaign)
    scene = campaign.scene.with_values({"record.interval": _interval(given)})
    stages = list[Stage]()
    for number in range(given.budget.stages):
        stream = np.random.default_rng([asked.seed, number])
        if stages:
            points = stages[-1].found.draw(given.members, stream, WIDER)
        else:
            even = sobol_points(given.members, len(unknowns.names), stream, kind="calibration")
            points = scipy.special.ndtri(inside(even))
        file = run_cases(
            folder, f"stage-{number + 1}", scene, unknowns.cases(points), workers=workers,
            title=f"{asked.title or asked.name}: stage {number + 1} of {given.budget.stages}",
            timeout=asked.limits.timeout, fidelity=asked.fidelity,
        )  # fmt: skip
        with xr.open_dataset(file) as runs:
            stages.append(_learn(runs, points, given.measurement, f"stage-{number + 1}"))
    return _write(given, unknowns, stages, folder / POSTERIOR)


def _interval(given: Calibration) -> float:
    """Spacing of records (s), fine enough for the readings to lie between close ones."""
    scene = given.campaign.scene
    apart = [np.diff(each.times) for each in given.measurement.readings if len(each.times) > 1]
    spacing = min((float(np.median(each)) for each in apart), default=np.inf)
    wished = max(spacing / _FINE, scene.solver.end_time / _MOST_RECORDS)
    return float(f"{min(scene.record.interval, wished):.3g}")


def _learn(runs: xr.Dataset, points: Array, measurement: Measurement, name: str) -> Stage:
    well = np.flatnonzero(runs["status"].to_numpy() == Status.OK)
    least = MEMBERS_AN_UNKNOWN * (points.shape[1] + 1)
    if len(well) < least:
        raise InputError(
            f"{name}: {len(well)} of {len(points)} runs ended well, and {points.shape[1]} unknowns "
            f"take {least}: look at the others (ringsim status), narrow the priors or raise runs"
        )
    computed = predictions(runs.isel(sample=well), measurement)
    outputs, data, sensors = list[Array](), list[Array](), list[str]()
    unused = 0
    for readings, values in zip(measurement.readings, computed, strict=True):
        there = np.isfinite(values).all(axis=0)
        unused += int((~there).sum())
        outputs.append(values[:, there] / readings.deviation)
        data.append(readings.values[there] / readings.deviation)
        sensors += [readings.sensor.name] * int(there.sum())
    if not sensors:
        raise InputError(
            f"{name}: no reading lies within all runs: check clock.offset of the measured data "
            "and solver.end_time of the scene"
        )
    every = np.concatenate(data)
    found = posterior_of(points[well], np.concatenate(outputs, axis=1), every)
    return Stage(found, fits(found, every, sensors), len(points) - len(well), unused)


def _write(given: Calibration, unknowns: Unknowns, stages: list[Stage], path: Path) -> xr.Dataset:
    """The file of a posterior: samples of it, and what it says of unknowns and sensors."""
    asked, last = given.campaign.specification, stages[-1]
    mean, covariance = last.found.mean, last.found.covariance
    deviation = np.sqrt(np.diag(covariance))
    stream = np.random.default_rng([asked.seed, len(stages)])
    table = unknowns.at(last.found.draw(MEMBERS, stream))
    zero, one = np.zeros(len(mean)), np.ones(len(mean))
    units = {axis: c.units for c in unknowns.template.columns for axis in _axes(c)}
    names, sensors = list(unknowns.names), [fit.sensor for fit in last.fits]
    numbers: dict[str, tuple[tuple[str, ...], Any, str]] = {
        "prior_quantile": (("unknown", "level"), unknowns.quantiles(zero, one),
                           "quantiles of the prior"),
        "posterior_quantile": (("unknown", "level"), unknowns.quantiles(mean, deviation),
                               "quantiles of the posterior"),
        "learnt": (("unknown",), deviation, "standard deviation of the posterior over that of the "
                   "prior, both in standard normal space"),
        "correlation": (("unknown", "other"), covariance / np.outer(deviation, deviation),
                        "correlation of unknowns in the posterior, in standard normal space"),
        "rms_in_deviations": (("sensor",), [fit.rms for fit in last.fits],
                              "readings less what the posterior's mean gives, over their scatter"),
        "readings": (("sensor",), [fit.readings for fit in last.fits], "readings that were used"),
        "chance": (("sensor",), [fit.chance for fit in last.fits], "probability of so large an rms "
                   "in any sensor by the scatter of the readings alone"),
        "stage_learnt": (("stage", "unknown"),
                         [np.sqrt(np.diag(s.found.covariance)) for s in stages],
                         "learnt, after each stage"),
        "lost": (("stage",), [s.lost for s in stages], "runs that failed"),
        "unused": (("stage",), [s.unused for s in stages],
                   "readings that some run has no value for"),
    }  # fmt: skip
    words = {"unknown": names, "other": names, "sensor": sensors,
             "unknown_units": [units[name] for name in names]}  # fmt: skip
    with writing(path), whole(path) as draft, netCDF4.Dataset(draft, "w") as file:
        file.setncatts({
            "title": asked.title or asked.name, "question": asked.question, "seed": asked.seed,
            "runs": given.members * len(stages), "stages": len(stages),
            "scene": given.campaign.scene.to_toml(), "fidelity": asked.fidelity,
            "measured": given.measurement.file.name, "population": 1,
            "inputs": json.dumps(tomllib.loads(given.campaign.text)["inputs"]),
            **build.provenance(),
        })  # fmt: skip
        sizes = {"sample": MEMBERS, "unknown": len(names), "other": len(names),
                 "level": len(_LEVELS), "sensor": len(sensors), "stage": len(stages)}  # fmt: skip
        for name, size in sizes.items():
            file.createDimension(name, size)
        add_inputs(file, table, compression=4)
        file.createVariable("level", "f8", ("level",))[:] = _LEVELS
        for name, texts in words.items():
            along = "unknown" if name == "unknown_units" else name
            file.createVariable(name, str, (along,))[:] = np.array(texts, dtype=object)
        for name, (dims, values, meaning) in numbers.items():
            array = np.asarray(values)
            made = file.createVariable(name, "i8" if array.dtype.kind == "i" else "f8", dims)
            made[:] = array
            made.setncatts({"long_name": meaning, "units": "1"})
    return xr.load_dataset(path)


# The stowed angle from a deployment time.


_WIDEST = 179.0
"""Opening angles that are tried, deg."""
_PATIENCE, _LONGEST = 2.0, 1e6
"""A run is stopped after this multiple of the wanted time, or after this time (s)."""
_CLOSE = 1e-3
"""Tolerance of the angle, deg: what it changes of the time is less than the error of the steps."""


def opening_angle_for(scene: Scene, time: float) -> float:
    """Initial opening angle in deg from which the scene deploys in ``time`` (s).

    Every angle that is tried is a run of the frame engine with all parts of the scene.

    Raises
    ------
    InputError
        If no angle between 1 and 179 deg gives that time, or the frame engine cannot represent the
        scene.
    """
    if "opening_angle" not in type(scene.structure).model_fields:
        raise InputError(
            f'structure.kind = "{kind_of(scene.structure)}" has no opening_angle to find'
        )
    opened: float = scene.structure.opening_angle  # type: ignore[attr-defined]
    if not (math.isfinite(time) and time > 0.0):
        raise InputError(f"a deployment time of {time:g} s must be finite and above 0 s")
    end = min(max(_PATIENCE * time, scene.solver.step), _LONGEST)
    bare = substituted(scene).with_values(
        {"record.stress": False, "solver.error_bars": False, "solver.end_time": end}
    )
    cables = [] if scene.cables is None else [cable for _, cable in scene.cables.present()]
    # From these angles on every cable's bracket opens the ring, and no stop is in contact.
    held = [c.bracket.angle - 90.0 for c in cables if isinstance(c.bracket, BarHalfBracket)]
    least = max(
        [LEAST_OPENING, *held, 0.0 if scene.stop is None else scene.stop.stowed_angle + _CLOSE]
    )

    @cache  # brentq begins with both ends again
    def excess(angle: float) -> float:
        outcome = run_frame(bare.with_values({"structure.opening_angle": angle}))
        if outcome.status.failed:
            raise InputError(f"from {angle:.4g} deg the run fails: {outcome.reason}")
        found = float(outcome.values["deployment_time"]) - time
        return found if math.isfinite(found) else math.inf

    low = high = min(max(opened, least), _WIDEST)
    slow = fast = excess(low)
    while fast > 0.0:
        if high == _WIDEST:
            raise InputError(
                f"a deployment time of {time:g} s is too short: from {_WIDEST:g} deg the ring "
                "takes longer or never opens: check loads, cables, net and friction"
            )
        low, slow, high = high, fast, min(0.5 * (high + 180.0), _WIDEST)
        fast = excess(high)
    while slow < 0.0:
        if low == least:
            raise InputError(
                f"a deployment time of {time:g} s is too long: even from {least:g} deg the ring "
                "deploys sooner; check loads, cables and masses"
            )
        low, high = max(0.7 * low, least), low
        slow = excess(low)
    while math.isinf(slow):
        middle = 0.5 * (low + high)
        if high - low < _CLOSE:
            raise InputError(
                f"a deployment time of {time:g} s is not possible: near {low:.6g} deg the "
                "deployment time jumps past it"
            )
        found = excess(middle)
        low, high, slow = (middle, high, found) if found >= 0.0 else (low, middle, slow)
    return float(scipy.optimize.brentq(excess, low, high, xtol=_CLOSE))
