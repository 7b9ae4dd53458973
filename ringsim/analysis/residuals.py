"""What runs say beside measured data: differences by sensor, in units and in scatter."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.posterior import HARDLY, LISTED, posterior_of
from ringsim.measured import Measurement, Readings, Told, by_clock, is_instant
from ringsim.outputs.family import VARIABLES, axes, holds, supply
from ringsim.refusal import InputError, known_or_nearest, show
from ringsim.scene import Scene
from ringsim.stepping.instant import Array
from ringsim.tables import Table, counted, number_text, readable, unit_text
from ringsim.variables import OF_CAMPAIGNS, Fate, Status

_HELD = (Fate.DEPLOYED, Fate.FOLDED)
"""Where the angles of joints stay after a run; one that is driven to its end might go on."""


@dataclass(frozen=True)
class Residuals:
    """Of one sensor: readings that the run has a value for, and that value."""

    readings: Readings
    times: Array
    """s, shape (n,)."""
    measured: Array
    """In the variable's units, shape (n,)."""
    computed: Array
    """The same of the run."""
    outside: int
    """Readings before the first or after the last value of the run, or of what it never came to; of
    half of a campaign's samples or more."""
    band: Array | None = None
    """Of a campaign: ends of what holds 90 % of the samples' readings, scatter included, shape
    (2, n); ``computed`` is the samples' median then."""
    beyond: int = 0
    """Readings that lie farther off than scatter may put them from every sample of a campaign."""

    @property
    def apart(self) -> Array:
        """Measured less computed, in the variable's units."""
        return self.measured - self.computed

    @property
    def in_deviations(self) -> Array:
        """The same over the standard deviation of a reading."""
        return self.apart / self.readings.deviation

    @property
    def within(self) -> Array:
        """1 for readings within the band, 0 for others; NaN without a band."""
        if self.band is None:
            return np.full(len(self.measured), np.nan)
        low, high = self.band
        return np.asarray((self.measured >= low) & (self.measured <= high), dtype=np.float64)


def residuals(run: xr.Dataset, measurement: Measurement) -> list[Residuals]:
    """Of every sensor of a test beside a run or a campaign; values between records are linear.

    InputError if a run has not the variable or the place of a sensor.
    """
    measurement = by_found_clock(run, measurement)
    if "sample" not in run.dims:
        return [_of(run, readings) for readings in measurement.readings]
    good = run.isel(sample=np.flatnonzero(run["status"].to_numpy() == Status.OK))
    if not good.sizes["sample"]:
        raise InputError("no sample of the campaign has ended well: nothing to compare with")
    every = predictions(good, measurement)
    return [
        _of_samples(readings, values)
        for readings, values in zip(measurement.readings, every, strict=True)
    ]


def by_found_clock(run: xr.Dataset, measurement: Measurement) -> Measurement:
    """A test by the clock that a calibration has found, if the campaign draws from its posterior,
    and the test's file has not been given another one since.
    """
    found = json.loads(run.attrs.get("clocks", "{}")).get(measurement.file.name)
    clock = measurement.file.clock
    if not found or clock is None:
        return measurement
    (was, offset), (rate, drift) = found["offset"], found["drift"]
    same = np.allclose([was, rate], [clock.offset, clock.drift], rtol=1e-9, atol=1e-12)
    return by_clock(measurement, offset, drift) if same else measurement


def clock_line(run: xr.Dataset, measurement: Measurement) -> str:
    """What is told of a clock that is not the file's; empty if it is."""
    clock, own = by_found_clock(run, measurement).file.clock, measurement.file.clock
    if clock is None or own is None or clock == own:
        return ""
    drift = f" and a drift of {clock.drift:.3g}" * (clock.drift != own.drift)
    return (
        f"times of {measurement.file.name} by the clock that the calibration has found: an offset "
        f"of {clock.offset:.4g} s{drift}"
    )


_TAIL = 0.05
"""Share of samples on each side of a band."""
BAND = 1.6449
"""Sigmas on each side of the middle that hold 90 % of a normal variable: ``_TAIL`` lies beyond."""
_FAR = 3.5
"""Sigmas of a reading beyond every sample from which on scatter is not to blame: once in 4,000
readings even at the last sample."""


def _of_samples(readings: Readings, values: Array) -> Residuals:
    """Of values of each sample, shape (samples, readings)."""
    there = np.isfinite(values).mean(axis=0) > 0.5
    known, measured = values[:, there], readings.values[there]
    if not there.any():
        nothing = np.zeros(0)
        return Residuals(readings, nothing, nothing, nothing, len(there), np.zeros((2, 0)))
    low, middle, high = np.nanquantile(known, [_TAIL, 0.5, 1.0 - _TAIL], axis=0)
    # A sensor's own bias moves all its readings, and so each of them.
    sigma = math.hypot(readings.deviation, readings.bias_deviation)
    band = np.array([
        middle - np.hypot(middle - low, BAND * sigma),
        middle + np.hypot(high - middle, BAND * sigma),
    ])  # fmt: skip
    past = np.maximum(np.nanmin(known, axis=0) - measured, measured - np.nanmax(known, axis=0))
    return Residuals(
        readings, readings.times[there], measured, middle, int((~there).sum()), band,
        int((past > _FAR * sigma).sum()),
    )  # fmt: skip


def _at_place(run: xr.Dataset, readings: Readings) -> xr.DataArray:
    """What a run or a campaign has of a sensor's variable at its place."""
    sensor = readings.sensor
    if sensor.variable not in run:
        raise InputError(
            f"sensor {sensor.name}: the run has no {sensor.variable}: simulate it with what "
            f"records it (ringsim explain {sensor.variable})"
        )
    found = run[sensor.variable]
    for dim, label in sensor.place.items():
        labels = found[dim].values.tolist()
        if label not in labels:
            hint = known_or_nearest(str(label), list(map(str, labels)))
            raise InputError(f"sensor {sensor.name}: the run has no {dim} {show(label)} ({hint})")
        found = found.sel({dim: label})
    return found


def _of(run: xr.Dataset, readings: Readings) -> Residuals:
    found = _at_place(run, readings)
    if "time" not in found.dims:
        value = np.full(1, float(found))
        there = np.isfinite(value)  # a ring that stalls has no deployment time
        return Residuals(
            readings, readings.times[there], readings.values[there], value[there], int(~there[0])
        )
    known = np.isfinite(found.values)
    times, values = found["time"].values[known], found.values[known]
    at = readings.times
    stays = bool(readings.sensor.variable == "opening_angle" and int(run["outcome"]) in _HELD)
    lock = np.nan
    if stays and "lock_time" in run and int(run["outcome"]) == Fate.DEPLOYED:
        lock = float(run["lock_time"].sel(readings.sensor.place))
    computed = _at(at, times, values, holds=stays, lock=lock)
    inside = np.isfinite(computed)
    computed = computed[inside]
    return Residuals(readings, at[inside], readings.values[inside], computed, int((~inside).sum()))


def check_sensors(measurement: Measurement, scene: Scene) -> None:
    """Refuse (InputError) sensors that no run of the scene has values for, and data without any."""
    known, has, file = axes(scene), holds(scene), measurement.file
    for sensor in file.sensors:
        if absent := sorted(set(VARIABLES[sensor.variable].needs) - has - {OF_CAMPAIGNS}):
            raise InputError(
                f"sensor {sensor.name}: runs of this scene do not have {sensor.variable}, because "
                f"the scene has no {absent[0]}: leave the sensor out, or {supply(absent[0])}"
            )
        for dim, label in sensor.place.items():
            labels = known[dim].tolist() if dim in known else [label]
            if label not in labels:
                hint = known_or_nearest(str(label), list(map(str, labels)))
                raise InputError(
                    f"sensor {sensor.name}: the scene has no {dim} {show(label)} ({hint})"
                )
    if not file.planned and not any(len(each.times) for each in measurement.readings):
        raise InputError(f"{file.name}: no sensor has a reading: all cells are empty")


def predictions(
    campaign: xr.Dataset, measurement: Measurement, offset: Array | None = None,
    drift: Array | None = None,
) -> list[Array]:  # fmt: skip
    """What each sensor would read in each run of a campaign, shape (samples, readings) each, in the
    variable's units; NaN where a run has no value.

    ``offset`` (s) and ``drift`` of the clock in each run, shape (samples,), take the place of the
    measured file's.  Runs end once an antenna is deployed: its joints stay at 180 deg.  What is
    folded stays as it was.
    """
    clock, samples = measurement.file.clock, campaign.sizes["sample"]
    known = (0.0, 0.0) if clock is None else (clock.offset, clock.drift)
    starts, rates = (np.full(samples, was) if now is None else now
                     for was, now in zip(known, (offset, drift), strict=True))  # fmt: skip
    # From the time of the run by the file's clock to that by each run's own, t' = shift + scale t.
    scale = (1.0 + rates) / (1.0 + known[1])
    shift = starts - known[0] * scale
    outcome = campaign["outcome"].to_numpy()
    stays = np.isin(outcome, [int(goal) for goal in _HELD])
    found = []
    for readings in measurement.readings:
        values = _at_place(campaign, readings)
        if "time" not in values.dims:
            each, name = values.to_numpy().astype(float), readings.sensor.variable
            if VARIABLES[name].units == "s" and clock is not None:
                # Back to what the file's clock would have shown of an instant, or of a duration.
                each = (each - shift * is_instant(name)) / scale
            found.append(each[:, None])
            continue
        times, rows = values["time"].to_numpy(), values.transpose("sample", "time").to_numpy()
        angle, locks = readings.sensor.variable == "opening_angle", np.full(samples, np.nan)
        if angle and "lock_time" in campaign:
            locks = campaign["lock_time"].sel(readings.sensor.place).to_numpy()
            locks = np.where(outcome == int(Fate.DEPLOYED), locks, np.nan)
        found.append(np.array([
            _at(shift[k] + scale[k] * readings.times, times, row,
                holds=bool(angle and stays[k]), lock=float(locks[k]))
            for k, row in enumerate(rows)
        ]))  # fmt: skip
    return found


def _at(wanted: Array, times: Array, values: Array, *, holds: bool, lock: float) -> Array:
    """Values at other times, by lines; NaN before the first and after the last, unless it holds.

    A joint that locks (s; NaN without) is at 180 deg after the last record, which may be before its
    lock or, on a springy stop, tenths of a degree off.
    """
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(wanted), np.nan)
    times, values = times[known], values[known]
    # A clock's sum of offset and time may be off in its last digits.
    wanted = np.where(np.isclose(wanted, times[-1], rtol=1e-12, atol=0.0), times[-1], wanted)
    last = values[-1] if holds else np.nan
    if np.isfinite(lock):
        last = 180.0
        if lock > times[-1]:
            times, values = np.append(times, lock), np.append(values, last)
    return np.interp(wanted, times, values, left=np.nan, right=last)


def residual_statistics(found: list[Residuals]) -> xr.Dataset:
    """Statistics by ``sensor``: readings that are compared, and that lie outside of the run; mean,
    root mean square and largest of measured less computed, in the variable's units, and when the
    largest is; the root mean square over the standard deviation of a reading.  Beside a campaign
    the median of its samples is what is computed, and there are two more: the share of readings
    within the band of 90 %, and how many lie beyond every sample.
    """
    names = [each.readings.sensor.name for each in found]
    rows = {
        "compared": [len(each.times) for each in found],
        "outside": [each.outside for each in found],
        "mean_difference": [_mean(each.apart) for each in found],
        "rms_difference": [_rms(each.apart) for each in found],
        "largest_difference": [_farthest(each)[0] for each in found],
        "largest_difference_time": [_farthest(each)[1] for each in found],
        "rms_in_deviations": [_rms(each.in_deviations) for each in found],
        "variable_units": [VARIABLES[each.readings.sensor.variable].units for each in found],
    }
    if any(each.band is not None for each in found):
        rows["within_band"] = [_mean(each.within) for each in found]
        rows["beyond_samples"] = [each.beyond for each in found]
    every = np.concatenate([np.zeros(0), *(each.in_deviations for each in found)])
    return xr.Dataset(
        {name: ("sensor", np.array(row)) for name, row in rows.items()},
        {"sensor": names}, {"rms_in_deviations": _rms(every), "compared": len(every)},
    )  # fmt: skip


def _mean(values: Array) -> float:
    return float(values.mean()) if len(values) else np.nan


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.nan


def _farthest(each: Residuals) -> tuple[float, float]:
    if not len(each.apart):
        return np.nan, np.nan
    k = int(np.argmax(np.abs(each.apart)))
    return float(each.apart[k]), float(each.times[k])


def residual_table(found: list[Residuals], clock: str = "") -> Table:
    """The statistics as a table, the worst sensor first, with what ``clock_line`` says."""
    told, rows = residual_statistics(found), []
    sampled = "within_band" in told
    sizes = np.nan_to_num(told["rms_in_deviations"].values, nan=-1.0)
    for k in np.argsort(-sizes, kind="stable").tolist():
        one = told.isel(sensor=k)
        units = str(one["variable_units"].values)
        largest = float(one["largest_difference"])
        factor, units = readable(units, np.nan_to_num(largest))
        readings = found[k].readings
        rows.append((
            str(one["sensor"].values), unit_text(units), str(int(one["compared"])),
            str(int(one["outside"])) if one["outside"] else "-",
            str(readings.missing) if readings.missing else "-",
            str(readings.gaps) if readings.gaps else "-",
            *(number_text(factor * float(one[n]), 3)
              for n in ("mean_difference", "rms_difference", "largest_difference")),
            number_text(float(one["largest_difference_time"]), 4),
            number_text(factor * readings.deviation, 2),
            *((_share(one), str(int(one["beyond_samples"]) or "-"))
              if sampled else (number_text(float(one["rms_in_deviations"]), 3),)),
        ))  # fmt: skip
    head = (
        "sensor", "unit", "readings", "outside the run", "empty cells", "gaps",
        "mean difference", "rms difference", "largest difference", "at (s)", "sigma",
        *(("within 90 %", "beyond all samples") if sampled else ("rms / sigma",)),
    )  # fmt: skip
    if sampled:
        return Table(head, rows, [*filter(None, [clock]), *_of_campaign(told)])
    notes = [
        "difference: measured less computed; rms / sigma is 1 where nothing but the scatter of "
        "the readings sets them apart, and more where the model or its values do",
        f"all sensors: rms / sigma {number_text(told.attrs['rms_in_deviations'], 3)} in "
        f"{counted(told.attrs['compared'], 'reading')}",
    ]
    return Table(head, rows, notes)


def _share(one: xr.Dataset) -> str:
    """How many readings of a sensor lie in the band, and their share."""
    share, count = float(one["within_band"]), int(one["compared"])
    return f"{round(share * count)} ({number_text(share, 2)})" if np.isfinite(share) else "-"


def _of_campaign(told: xr.Dataset) -> list[str]:
    compared = told["compared"].values
    weights = compared if compared.any() else np.ones(len(compared))
    share = float(np.average(told["within_band"].fillna(0.0), weights=weights))
    notes = [
        "difference: measured less the median of the samples; within 90 %: share of the readings "
        "in the band that holds 90 % of the samples, with the scatter of a reading",
        f"all sensors: {round(share * compared.sum())} of "
        f"{counted(int(compared.sum()), 'reading')} ({number_text(share, 2)}) lie in it; far less "
        "than 0.9 says that the inputs scatter too little, or about wrong values, or that the "
        "clock is off",
    ]
    if beyond := int(told["beyond_samples"].sum()):
        notes.append(
            f"beyond all samples by more than {_FAR:g} sigma: {counted(beyond, 'reading')}, which "
            "none of the drawn values of the inputs gives"
        )
    return notes


# What sensors would tell of unknowns, before a test.


class Ranking(NamedTuple):
    """How much sensors would tell."""

    order: list[int]
    """Of the sensors: each next one is that which adds most to those before."""
    after: Array
    """Posterior over prior scatter of each unknown with the first k + 1 of them, shape (sensors,
    unknowns)."""
    alone: Array
    """The same with each sensor alone, in their own order."""


def rank(points: Array, told: Sequence[Told], lower: Array) -> Ranking:
    """Sensors in the order in which they leave least of the scatter of unknowns (geometric mean).

    Unknowns u = L w are correlated by the root L = ``lower``, of which ``points`` are the w.
    What has been read does not matter: of a linear map the covariance is the same for any data.
    """
    reduced = []
    for each in told:
        values = each.scaled(each.computed)
        # Turned into at most as many directions as runs: what it tells is unchanged.
        sides, sizes, _ = np.linalg.svd(values - values.mean(axis=0), full_matrices=False)
        reduced.append(sides * sizes)

    def scatter(chosen: Sequence[int]) -> Array:
        outputs = np.concatenate([reduced[k] for k in chosen], axis=1)
        covariance = posterior_of(points, outputs, np.zeros(outputs.shape[1])).covariance
        return np.asarray(np.sqrt(np.diag(lower @ covariance @ lower.T)))

    every, order, after = range(len(told)), list[int](), list[Array]()
    alone = np.array([scatter([k]) for k in every])
    while len(order) < len(told):
        left = [k for k in every if k not in order]
        best = min(left, key=lambda k: float(np.log(scatter([*order, k])).sum()))
        order.append(best)
        after.append(scatter(order))
    return Ranking(order, np.array(after), alone)


def sensors_table(found: xr.Dataset) -> Table:
    """Sensors in the order in which they tell most (the dataset of ``ringsim sensors``)."""
    names = [str(name) for name in found["unknown"].values]
    listed = names if len(names) <= LISTED else []
    silent = str(found.attrs.get("silent", ""))
    after, alone = (np.exp(np.log(found[k].values).mean(axis=1)) for k in ("learnt", "alone"))
    rows = [
        (str(k + 1), str(sensor), number_text(alone[k], 2), number_text(after[k], 2),
         *(number_text(float(found["learnt"].values[k, names.index(name)]), 2) for name in listed))
        for k, sensor in enumerate(found["sensor"].values)
    ]  # fmt: skip
    notes = [
        "remaining scatter over that of the prior: of all unknowns (geometric mean) with the "
        "sensor alone, and with all above it; of each unknown with all above it",
        "each next sensor is the one that leaves least; about the medians of the priors",
        *_seeming(found["sensor"].values, after),
        *(f"hardly learnt even from all of them: {name}"
          for name, v in zip(names, found["learnt"].values[-1], strict=True) if v > HARDLY),
        *filter(None, [silent and f"tell nothing, since some run has no value at any of their "
                       f"readings: {silent}"]),
    ]  # fmt: skip
    return Table(("", "sensor", "alone", "together", *listed), rows, notes)


def _seeming(sensors: NDArray[np.str_], after: Array) -> list[str]:
    """A line on sensors with which more seems to be left than without."""
    worse = [str(each) for each in sensors[1:][after[1:] > _SEEMS * after[:-1]]]
    return [
        f"too few runs to tell how much these add, which seem to take knowledge away, as no sensor "
        f"can: {', '.join(worse)}: raise runs"
    ] * bool(worse)  # fmt: skip


_SEEMS = 1.01
"""Of what is left: less than anybody prints."""
