"""How far the answers of the frame engine and of the full one are apart, output by output."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ringsim.analysis.design import placement, population_of
from ringsim.analysis.intervals import (
    CHECKED,
    NOTHING,
    ROUND_OFF,
    Mask,
    good,
    is_moment,
    numbers,
    of_both_engines,
    quantities,
)
from ringsim.analysis.ladder import Rung, references
from ringsim.outputs.family import VARIABLES, Array
from ringsim.tables import counted, readable, text_table, unit_text, with_unit
from ringsim.variables import GOALS, Fate, Outcome, Status

if TYPE_CHECKING:
    import xarray as xr

_NOT_CHECKED = -1
_NAMED = 6


def main_outputs() -> list[str]:
    """Those of the numbers that summaries tell."""
    return [name for name, variable in quantities().items() if variable.summary is not None]


@dataclass(frozen=True)
class Difference:
    """One output in the samples that both engines answered, shapes (checked samples,)."""

    name: str
    units: str
    samples: Array
    apart: Array
    """Magnitude of the difference; infinite where one engine has a number and the other none."""
    share: Array
    """The same over the magnitude of the full engine's value."""
    bars: Array
    """Sum of the error bars that both state, or for one that states none the largest that its
    engine states in other samples, or that of the other engine; NaN without any."""
    size: float
    """Largest magnitude of its values, which decides in which unit it is told."""
    standard_error: float
    """Of the mean of all samples that ended well, as the design tells it; NaN if it does not."""

    @property
    def worst(self) -> int:
        """Place of the sample with the largest difference."""
        return int(np.argmax(self.apart))

    @property
    def listed(self) -> bool:
        """Whether tables tell of it: sizes that differ by more than rounding."""
        apart = (self.share > ROUND_OFF) & (self.apart > NOTHING)
        return not is_moment(self.name) and bool(apart.any())


def differences(campaign: xr.Dataset) -> list[Difference]:
    """All outputs of a merged campaign that was checked; none if no check ended well."""
    ok = good(campaign)
    both = np.flatnonzero(ok & (campaign[f"status{CHECKED}"].to_numpy() == Status.OK))
    stand, placed, found = population_of(campaign), placement(campaign), []
    same = of_both_engines()
    for name, variable in quantities().items():
        if (
            name in same
            or name not in campaign
            or f"{name}{CHECKED}" not in campaign
            or not len(both)
        ):
            continue
        frame, full = (numbers(campaign, f"{name}{end}") for end in ("", CHECKED))
        apart, share = _apart(frame[both], full[both])
        if not np.isfinite([frame[both], full[both]]).any():
            continue
        own, theirs = (numbers(campaign, f"{name}_error{end}") for end in ("", CHECKED))
        own, theirs = (np.where(np.isnan(x), np.fmax.reduce(x), x) for x in (own, theirs))
        bars = np.where(np.isnan(own), theirs, own) + np.where(np.isnan(theirs), own, theirs)
        every = numbers(stand, name)
        known = good(stand) & np.isfinite(every)
        error = placed.error_of_mean(every[known], stand["sample"].to_numpy()[known])
        samples = campaign["sample"].to_numpy()[both]
        size = float(np.nanmax(np.abs([frame[both], full[both]])))
        found.append(
            Difference(name, variable.units, samples, apart, share, bars[both], size, error)
        )
    return found


def _apart(frame: Array, full: Array) -> tuple[Array, Array]:
    """Differences and their shares of the full engine's values."""
    apart = np.where(np.isnan(frame) & np.isnan(full), 0.0, np.abs(frame - full))
    apart = np.where(np.isnan(apart), np.inf, apart)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(apart == 0.0, 0.0, apart / np.abs(full))
    return apart, np.where(np.isnan(share), np.inf, share)


def check_lines(campaign: xr.Dataset) -> list[str]:
    """What the checks of a merged campaign gave, its last line the verdict; none without checks."""
    if f"status{CHECKED}" not in campaign:
        return []
    status = campaign[f"status{CHECKED}"].to_numpy()
    done = np.flatnonzero(status != _NOT_CHECKED)
    lines = [f"{len(done)} of {len(status)} samples were checked with the full engine"]
    if len(failed := np.flatnonzero(status >= Status.SOLVER_FAILED)):
        why = str(campaign[f"reason{CHECKED}"].to_numpy()[failed[0]])[:200]
        lines.append(f"{counted(len(failed), 'check')} failed, first sample {failed[0]}: {why}")
    found = differences(campaign)
    if found:
        both = counted(len(found[0].samples), "sample")
        lines.append(f"median and worst are over the {both} that both engines completed")
    rows = []
    for each in (each for each in found if each.listed):
        factor, unit = readable(each.units, each.size)
        rows.append((
            each.name, unit_text(unit),
            f"{factor * np.median(each.apart):.2g}", f"{factor * each.apart[each.worst]:.2g}",
            str(each.samples[each.worst]), f"{each.share[each.worst]:.2g}",
            _or_dash(factor * each.bars[each.worst]), _or_dash(factor * each.standard_error),
        ))  # fmt: skip
    if rows:
        head = (
            "difference of", "unit", "median", "worst", "sample", "share", "both error bars there",
            "standard error",
        )  # fmt: skip
        lines += text_table(head, rows)
        lines.append(
            "both error bars there: of the frame and of the full engine together, in the sample of "
            "the worst difference, the largest of all samples where that one has none; share: of "
            "the full engine's value"
        )
    return [*lines, *_other_ends(campaign), *verdict(campaign, found)]


def _or_dash(value: float) -> str:
    return f"{value:.2g}" if np.isfinite(value) else "-"


def _other_ends(campaign: xr.Dataset) -> list[str]:
    """A line if the engines do not agree on what the antenna did."""
    if not {"outcome", f"outcome{CHECKED}"} <= set(campaign):  # the file leaves it out
        return []
    frame, full = (campaign[f"outcome{end}"].to_numpy() for end in ("", CHECKED))
    ok = (campaign["status"] == Status.OK) & (campaign[f"status{CHECKED}"] == Status.OK)
    other = np.flatnonzero(ok.to_numpy() & (frame != full))
    if not len(other):
        return []
    words = [
        f"sample {k}: {Fate(frame[k]).word}, full engine: {Fate(full[k]).word}"
        for k in other[:_NAMED]
    ]
    return [f"the outcome differs in {len(other)} of {int(ok.sum())}: {'; '.join(words)}"]


def differ(name: str, apart: Array, bars: Array) -> Mask:
    """Whether two engines' values of a variable are farther apart than both error bars together."""
    return np.asarray(apart > bars + VARIABLES[name].round_off)


def verdict(campaign: xr.Dataset, found: list[Difference]) -> list[str]:
    """Whether the engines differ by more than they state, and by more than the campaign allows."""
    beyond, stated = [], False
    for each in found:
        stated = stated or bool(np.isfinite(each.bars).any())
        over = np.flatnonzero(differ(each.name, each.apart, each.bars))
        if len(over):
            k = over[np.argmax(each.apart[over] / each.bars[over])]
            factor, unit = readable(each.units, each.size)
            beyond.append(
                f"{each.name} (sample {each.samples[k]}: "
                f"{with_unit(f'{factor * each.apart[k]:.2g}', unit)}, both error bars "
                f"{factor * each.bars[k]:.2g})"
            )
    lines = []
    if beyond:
        lines = [f"the engines differ by more than their error bars in {', '.join(beyond)}"]
    elif stated:
        barred = {each.name for each in found if np.isfinite(each.bars).any()}
        every = all(each.name in barred for each in found if each.listed)
        which = "" if every else f" in the {counted(len(barred), 'output')} with such bars"
        lines = [f"the engines differ by no more than their error bars{which}"]
    return lines + too_far(campaign, found)


def too_far(campaign: xr.Dataset, found: list[Difference] | None = None) -> list[str]:
    """One line if ``max_difference`` of the campaign is exceeded, or nothing tells; else none."""
    limits = limits_of(json.loads(campaign.attrs.get("max_difference", "null")))
    if not limits or f"status{CHECKED}" not in campaign:
        return []
    known = {each.name: each for each in (differences(campaign) if found is None else found)}
    if not known:
        return ["max_difference cannot be checked: no sample was completed by both engines"]
    over = [
        f"{name} ({share:.2g} of the value in sample {known[name].samples[k]}, max_difference = "
        f"{limits[name]:g})"
        for name in limits.keys() & known.keys()
        for k in [int(np.argmax(known[name].share))]
        if (share := known[name].share[k]) > limits[name]
    ]
    words = f"the engines differ by more than the campaign allows in {', '.join(sorted(over))}"
    return [words] if over else []


def limits_of(given: float | Mapping[str, float] | None) -> dict[str, float]:
    """Largest differences by output, as shares of the value; one number is for the main outputs."""
    if given is None:
        return {}
    return dict(given) if isinstance(given, Mapping) else dict.fromkeys(main_outputs(), given)


def run_lines(frame: Outcome, full: Outcome) -> list[str]:
    """The same table for one run of a scene with both engines."""
    rows: list[tuple[str, ...]] = []
    for name, variable in quantities().items():
        if name not in frame.values or name not in full.values:
            continue
        one, other = (float(each.values[name]) for each in (frame, full))
        apart, share = (float(x) for x in _apart(np.array(one), np.array(other)))
        stated = [each.values.get(f"{name}_error", np.array(np.nan)) for each in (frame, full)]
        if share <= ROUND_OFF or apart <= NOTHING:
            apart = share = 0.0
        numbers = f"{one:.6g}", f"{other:.6g}", f"{apart:.2g}", f"{share:.2g}"
        rows.append((name, unit_text(variable.units), *numbers, _or_dash(float(sum(stated)))))
    head = ("output", "unit", "frame", "full", "difference", "share", "error bars")
    lines = text_table(head, rows) if rows else []
    if frame.fate != full.fate:
        lines.append(f"the outcome differs: {frame.fate.word}, full engine: {full.fate.word}")
    return lines


def with_frame(full: xr.Dataset, frame: xr.Dataset) -> xr.Dataset:
    """The dataset of the full engine, with the frame engine's variables as ``NAME_frame``."""
    own: dict[str, Any] = {f"{name}_frame": values for name, values in frame.data_vars.items()}
    for values in own.values():
        values.attrs["long_name"] = f"{values.attrs['long_name']}, of the frame engine"
    told = {"fidelity": "both", "reason_frame": frame.attrs["reason"]}
    return full.assign(own).assign_attrs(told)


# Errors of all rungs of a ladder against the limit of its finest runs, and their orders.
#
# Three levels tell whether refining pays as it should.  Changes that shrink by r from one level to
# the next (4 at second order) leave d / (r - 1) of the last change d to go, Richardson (1911);
# changes that do not shrink, or alternate in sign, are not extrapolated.


OUTPUTS = {
    "deployment_time": "deployment time",
    "opening_angle": "opening angle",
    "asynchrony": "asynchrony",
    "peak_tension": "peak tension",
    "peak_rod_stress": "peak stress",
    "peak_bending_strain": "peak strain",
    "least_latch_rate": "least latch rate",
    "peak_latch_rate": "peak latch rate",
    "peak_lock_impulse": "lock impulse",
}
"""What people use of a result, as far as a scene has it, and its name in tables."""
LEAST_ASYNCHRONY = 1e-3
"""deg: below this the asynchrony of a symmetric ring is round-off, and its error not relative."""
GROUPS = {
    "motion": ("deployment_time", "opening_angle"),
    "loads": ("peak_tension", "peak_rod_stress", "peak_bending_strain"),
}
"""Outputs that are asked for together: the error is the largest of theirs.  The motion contains
the asynchrony as a difference of opening angles; relative to itself it is an output of its own."""
_SECOND_ORDER = 4.0
"""Ratio of successive changes where steps halve and the order is two; no more is believed."""
_SHRINKING = 1.5
"""Ratio from which on changes count as shrinking."""
_CLEAR = 1.5
"""An error over the limit's uncertainty from which on it counts for a slope."""
_ABOUT = 0.2
"""Share by which an error may rise towards finer steps and still count as falling."""
_MATTERS = 2.0
"""Ratio of the errors along a ladder from which on it shows an order."""


class Limit(NamedTuple):
    """A value (of any shape), and its largest uncertainty anywhere, in its own unit."""

    value: xr.DataArray
    uncertainty: float


def limit(values: xr.DataArray) -> Limit:
    """Limit of three levels along ``rung``, each with steps (or elements) half as long.

    The uncertainty is all that was extrapolated, and at least what second order would leave of
    the first change: two fine runs may agree by chance.  Of two levels nothing is extrapolated.
    """
    if values.sizes["rung"] == 2:
        finer = values.isel(rung=1, drop=True)
        return Limit(finer, float(abs(values.diff("rung")).max()))
    coarse, middle, fine = (values.isel(rung=k, drop=True) for k in range(3))
    first, last = middle - coarse, fine - middle
    before, now = float(abs(first).max()), float(abs(last).max())
    if now * _SHRINKING > before or before == 0.0:
        return Limit(fine, max(before, now))
    least = before / _SECOND_ORDER / (_SECOND_ORDER - 1.0)
    if float((first * last).sum()) < 0.0:  # alternating: the limit lies between the last two
        return Limit(fine, max(now, least))
    ratio = min(before / max(now, 1e-300), _SECOND_ORDER)
    return Limit(fine + last / (ratio - 1.0), max(now / (ratio - 1.0), least))


def reference(in_time: xr.DataArray, in_space: xr.DataArray) -> Limit:
    """Limit of three levels of steps, and what levels of elements change, along ``rung``.

    Of the elements the last three levels are extrapolated; the first has those of ``in_time``.
    """
    steps, elements = limit(in_time), limit(in_space.isel(rung=slice(-3, None)))
    more = elements.value - in_space.isel(rung=0, drop=True)
    return Limit(steps.value + more, steps.uncertainty + elements.uncertainty)


def largest(values: xr.DataArray) -> Array:
    """The largest size of each rung's values, shape (rung,)."""
    return np.asarray(abs(values).max([dim for dim in values.dims if dim != "rung"]))


def order(values: xr.DataArray, noise: float) -> float:
    """Observed order of three levels along ``rung``; NaN unless changes shrink above the noise,
    and of fewer levels.

    Each level has half the length of elements of the one before; ``noise`` is the largest effect
    of anything else, in the unit of the values.
    """
    if values.sizes["rung"] < 3:
        return np.nan
    first, last = largest(values.diff("rung")).tolist()
    return float(np.log2(first / last)) if first > last > noise else np.nan


def slope(sizes: Array, error: Array, uncertainty: float) -> float:
    """Slope of log error over log size among all errors above the uncertainty of their limit.

    All of them, because two may agree by chance.  NaN if errors rise somewhere towards finer
    steps, or hardly change.
    """
    clear = np.isfinite(error) & (error > max(_CLEAR * uncertainty, 1e-300))
    finer = error[clear][np.argsort(-sizes[clear])]
    falls = len(finer) >= 3 and (np.diff(finer) <= _ABOUT * finer[:-1]).all()
    if not falls or finer[0] < _MATTERS * finer[-1]:
        return np.nan
    return float(np.polyfit(np.log(sizes[clear]), np.log(error[clear]), 1)[0])


class Errors:
    """Errors, uncertainties and reference values by output.

    ``of`` has relative errors, shape (rung,) each, by output and group of outputs, NaN where a run
    failed or has none; ``uncertainty`` that of the reference, relative; ``best`` the reference
    where it is one number, in the output's unit; ``good``, shape (rung,): which rungs ended well.
    """

    def __init__(self, results: xr.Dataset, rungs: Sequence[Rung], fidelity: str = "full") -> None:
        """Compare results over ``rung`` with the limit of a fidelity's.

        Raises
        ------
        ValueError
            If too few of its references ended well.
        """
        self.results, self._rungs, self._fidelity = results, rungs, fidelity
        self.good = ((results.status == 0) & results.outcome.isin(GOALS)).to_numpy()
        self._in_time, self._in_space = references(rungs, self.good, fidelity)
        places = self._in_time + self._in_space
        ends = results[["deployment_time", "final_time"]].isel(rung=places).min(skipna=False)
        deployed = float(ends.deployment_time)
        self._end = float(ends.final_time) if np.isnan(deployed) else deployed
        self.of: dict[str, Array] = {}
        self.uncertainty: dict[str, float] = {}
        self.best: dict[str, float] = {}
        for name in (name for name in OUTPUTS if name in results):
            if np.isfinite(largest(self.until_the_end(name).isel(rung=places))).all():
                self._judge(name)
        self.of["energy"] = np.where(self.good, results.energy_error, np.nan)
        self.uncertainty["energy"] = 0.0
        for group, members in GROUPS.items():
            if present := [m for m in members if m in self.of]:
                self.of[group] = np.max([self.of[m] for m in present], axis=0)
                self.uncertainty[group] = max(self.uncertainty[m] for m in present)

    def until_the_end(self, name: str) -> xr.DataArray:
        """A variable, series only up to the earliest deployment time of the references."""
        values = self.results[name]
        return held(values.sel(time=values.time <= self._end)) if "time" in values.dims else values

    def best_of(self, name: str) -> Limit:
        """The reference of a variable, in its unit."""
        values = self.until_the_end(name)
        return reference(values.isel(rung=self._in_time), values.isel(rung=self._in_space))

    def scale(self, name: str, best: xr.DataArray) -> float:
        """What an error is relative to: the value itself, or the extent of a series."""
        if name.startswith("asynchrony"):
            return max(float(self.results.asynchrony_max[self._in_time[-1]]), LEAST_ASYNCHRONY)
        return float(best.max() - best.min() if name == "opening_angle" else abs(best).max())

    def _judge(self, name: str) -> None:
        error, own = np.full(len(self.good), np.nan), 0.0
        # Of the asynchrony the largest value counts, too: the grid of output times may miss it.
        for each in (name, "asynchrony_max") if name == "asynchrony" else (name,):
            values, best = self.until_the_end(each), self.best_of(each)
            scale = self.scale(each, best.value)
            error = np.fmax(error, largest(values - best.value) / scale)
            own = max(own, best.uncertainty / scale)
        self.of[name] = np.where(self.good, error, np.nan)
        self.uncertainty[name] = own
        if best.value.ndim == 0:
            self.best[name] = float(best.value)

    def orders(self) -> tuple[list[str], Array]:
        """Names of the fidelity's ladders that may have an order, and those orders, shape (ladder,
        output).

        Steps show the slope of their errors against the limit of the steps, whatever the elements
        are; elements and formulations that of the changes from level to level, which all share the
        error of their steps.
        """
        ladders: dict[str, list[int]] = {}
        for k, rung in enumerate(self._rungs):
            # Longer steps than the scene's own are too long to show an order.
            too_long = rung.ladder == "steps" and rung.size > 1.0
            if rung.size > 0.0 and not too_long and rung.fidelity == self._fidelity:
                ladders.setdefault(rung.ladder, []).append(k)
        found = np.full((len(ladders), len(self.of)), np.nan)
        for row, (name, own) in enumerate(ladders.items()):
            sizes = np.array([self._rungs[k].size for k in own])
            for column, output in enumerate(self.of):
                if output == "energy":
                    found[row, column] = slope(sizes, self.of[output][own], 0.0)
                elif output in OUTPUTS:
                    values = self.until_the_end(output)
                    steps = limit(values.isel(rung=self._in_time))
                    if name not in ("elements", "formulation"):
                        error = np.where(self.good, largest(values - steps.value), np.nan)
                        found[row, column] = slope(sizes, error[own], steps.uncertainty)
                    elif self.good[own[-3:]].all():
                        found[row, column] = order(values.isel(rung=own[-3:]), steps.uncertainty)
        return list(ladders), found


def held(values: xr.DataArray) -> xr.DataArray:
    """Series with their last value kept from the end of a run on: a locked V-joint stays locked."""
    # What DataArray.ffill does, which needs bottleneck or numbagg.
    values = values.transpose(..., "time")
    series = values.to_numpy()
    last = np.where(np.isfinite(series), np.arange(series.shape[-1]), 0)
    kept = np.take_along_axis(series, np.maximum.accumulate(last, axis=-1), axis=-1)
    return values.copy(data=kept)
