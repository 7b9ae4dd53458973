"""Measured data of a test: which column of a table is which sensor, and what its numbers are worth.

A TOML file names a CSV table beside it, its clock, and its sensors::

    name = "stand-3"
    file = "stand-3.csv"

    [clock]
    column = "t"
    unit = "ms"
    offset = 0.12            # s: time of the run = offset + (1 + drift) * reading

    [[sensors]]
    column = "encoder 3"
    variable = "opening_angle"
    place = { plane = "upper", section = 3 }
    unit = "deg"
    standard_deviation = 0.1
"""

import csv
import io
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, model_validator

from ringsim.files import parse_toml, read_text, require_regular
from ringsim.outputs.family import VARIABLES, Array
from ringsim.refusal import InputError, explain, known_or_nearest, show
from ringsim.units import ListIn, Model, Second, Unit
from ringsim.variables import OF_CAMPAIGNS

_UNITS = {
    "s": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "degree": {"deg": 1.0, "degree": 1.0, "rad": math.degrees(1.0)},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": 9.80665},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2},
    "A": {"A": 1.0, "mA": 1e-3},
    "W": {"W": 1.0, "mW": 1e-3},
    "N m": {"N m": 1.0, "mN m": 1e-3},
    "rad/s": {"rad/s": 1.0, "deg/s": math.radians(1.0), "1/min": math.pi / 30.0},
    "Pa": {"Pa": 1.0, "MPa": 1e6},
    "m/s^2": {"m/s^2": 1.0, "g": 9.80665},
}
"""Units in which a test may give what files hold in the unit before the colon, and their size."""
_NOTHING = {"", "nan", "na", "n/a", "null", "-"}
"""Cells of a table without a reading."""
_SEPARATORS = ",;\t"

_Positive = Annotated[float, Field(gt=0.0, le=1e12)]
_Number = Annotated[float, Field(ge=-1e12, le=1e12)]


class Clock(Model):
    """What the time of a reading is in the run: offset + (1 + drift) * reading."""

    column: str = ""
    """Its column in the table."""
    interval: Second | None = None
    """Before the test: distance of its readings, in place of a table."""
    end: Second | None = None
    """Before the test: time of the run of the last of them."""
    unit: str = "s"
    """Of its readings: s, ms or min."""
    offset: Annotated[float, Field(ge=-1e6, le=1e6), Unit("s")] = 0.0
    """Time of the run at which the clock shows zero."""
    drift: Annotated[float, Field(ge=-0.1, le=0.1), Unit("1")] = 0.0
    """By how much the time of the run goes faster than the clock."""

    def shown(self, times: Array) -> Array:
        """Times of the run (s) as the clock shows them, in its unit."""
        return np.asarray((times - self.offset) / (1.0 + self.drift) / _UNITS["s"][self.unit])

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        planned = self.interval is not None and self.end is not None
        if bool(self.column) == planned or (self.interval is None) != (self.end is None):
            raise ValueError(
                "column: give a column of the table, or, before there is one, interval and end"
            )
        if planned and not 0.0 < (self.interval or 0.0) <= (self.end or 0.0):
            raise ValueError(
                f"interval = {self.interval:g} s must be above 0 and at most end = {self.end:g} s"
            )
        return self


class Sensor(Model):
    """One sensor: where it is, and how far its readings may be wrong."""

    column: str = ""
    """Its column in the table; left out where ``value`` is the one reading."""
    value: _Number | None = None
    """The one reading of a number, such as a lock time, in ``unit``."""
    variable: str
    """What it measures, by the variable of a run: opening_angle, cable_tension, lock_time, ..."""
    place: dict[str, str | int] = Field(default_factory=dict)
    """Where: a label for each dimension of the variable but time."""
    unit: str
    """Of its readings."""
    standard_deviation: _Positive
    """Of the scatter of one reading, in ``unit``."""
    bias: _Number = 0.0
    """What it reads too much, in ``unit``: it is taken off."""
    bias_deviation: Annotated[float, Field(ge=0.0, le=1e12)] = 0.0
    """Standard deviation of what is not known of the bias, one value for all of its readings."""

    @model_validator(mode="after")
    def _usable(self) -> Self:
        if self.column and self.value is not None:
            raise ValueError(
                "column and value: both given: a sensor has one of them (a column of the table, "
                "or the one value that was read)"
            )
        variable = VARIABLES.get(self.variable)
        if variable is None or variable.dtype == "str":
            hint = known_or_nearest(self.variable, VARIABLES)
            raise ValueError(f"variable = {show(self.variable)} is no number of a run ({hint})")
        known = _UNITS.get(variable.units, {variable.units: 1.0})
        if self.unit not in known:
            raise ValueError(
                f"unit = {show(self.unit)} is none for {self.variable}: choose "
                f"{' or '.join(map(show, known))}"
            )
        if (self.column or self.value is not None) and ("time" in variable.dims) == (
            self.value is not None
        ):
            want = "column" if "time" in variable.dims else "value"
            raise ValueError(
                f"variable = {show(self.variable)} "
                f"{'has values over time' if want == 'column' else 'is one number'}: give {want}"
            )
        wanted = [dim for dim in variable.dims if dim != "time"]
        if sorted(self.place) != sorted(wanted):
            named = ", ".join(f"{dim} = ..." for dim in wanted)
            raise ValueError(
                f"place = {show(dict(self.place))} must tell where {self.variable} is measured: "
                f"place = {{ {named} }}" if wanted else
                f"place = {show(dict(self.place))}: {self.variable} has no place: leave it out"
            )  # fmt: skip
        return self

    @property
    def scale(self) -> float:
        """How many of the variable's units are one of the sensor's."""
        units = VARIABLES[self.variable].units
        return _UNITS.get(units, {}).get(self.unit, 1.0)

    @property
    def name(self) -> str:
        """What tables call it: "opening_angle upper 3"."""
        return " ".join([self.variable, *map(str, self.place.values())])


class Measured(Model):
    """Content of a file of measured data."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=80)]
    """Word for the test."""
    title: Annotated[str, Field(max_length=300)] = ""
    """One line for figures."""
    file: str = ""
    """The table of readings, beside this file: CSV with a row of heads, or netCDF with a variable a
    column, along one dimension."""
    clock: Clock | None = None
    """Of the table."""
    sensors: Annotated[tuple[Sensor, ...], ListIn, Field(min_length=1, max_length=1000)]
    """All that is to be compared."""
    longest_gap: Second | None = None
    """Gaps between readings that are longer are told; left out, ten times the usual distance."""

    @model_validator(mode="after")
    def _whole(self) -> Self:
        columns = [sensor.column for sensor in self.sensors if sensor.column]
        if self.planned:
            if self.file:
                raise ValueError(
                    "file: readings are planned by clock.interval and clock.end: leave it out, or "
                    "give clock.column in their place"
                )
        elif empty := [s.name for s in self.sensors if not s.column and s.value is None]:
            raise ValueError(
                f"sensors: {empty[0]} has neither column nor value: give one of them (a column of "
                "the table, or the one value that was read)"
            )
        if columns and not self.planned and not (self.file and self.clock):
            raise ValueError(
                f"sensors: column = {show(columns[0])} needs the table and its clock: add file = "
                '"NAME.csv" and [clock] with column = "..."'
            )
        names = [sensor.name for sensor in self.sensors]
        if twice := next((name for name in names if names.count(name) > 1), ""):
            raise ValueError(f"sensors: two of them measure {twice}: leave one out")
        return self

    @property
    def planned(self) -> bool:
        """Whether the test is still to come: there are times of readings, and no readings."""
        return self.clock is not None and not self.clock.column


@dataclass(frozen=True)
class Readings:
    """What one sensor has read, in the units of a run's variable, without its bias."""

    sensor: Sensor
    times: Array
    """Of the run, s, shape (n,); one NaN where it is a number without a time."""
    values: Array
    """Shape (n,)."""
    deviation: float
    """Standard deviation of one reading."""
    missing: int
    """Rows of the table without a reading."""
    gaps: int
    """Times between readings that are longer than usual."""

    @property
    def bias_deviation(self) -> float:
        """Standard deviation of what all readings have in common."""
        return self.sensor.scale * self.sensor.bias_deviation


@dataclass(frozen=True)
class Measurement:
    """A test: what its file says, and what its sensors have read."""

    file: Measured
    readings: tuple[Readings, ...]


class Told(NamedTuple):
    """What one sensor has read, and would have read in each run."""

    sensor: str
    computed: Array
    """Shape (runs, readings)."""
    measured: Array
    """Shape (readings,)."""
    deviation: float
    """Standard deviation of one reading."""
    bias: float = 0.0
    """That of what all readings of the sensor have in common."""
    times: Array | None = None
    """Of the readings, by their own clock; NaN for what has none."""

    def only(self, kept: NDArray[np.bool_]) -> "Told":
        """The readings that are kept, shape (readings,) of true and false."""
        times = None if self.times is None else self.times[kept]
        return self._replace(
            computed=self.computed[:, kept], measured=self.measured[kept], times=times
        )

    def scaled(self, values: Array) -> Array:
        """Values of the readings, shape (..., readings), over their scatter.

        With a common bias their covariance is s^2 (1 + r 11'), r = (bias / s)^2; its inverse root
        is (1 - (1 - 1 / sqrt(1 + n r)) 11' / n) / s.
        """
        count = values.shape[-1]
        share = 1.0 - 1.0 / np.sqrt(1.0 + count * (self.bias / self.deviation) ** 2)
        return np.asarray(
            (values - share * values.mean(axis=-1, keepdims=True) if count else values)
            / self.deviation
        )


def by_clock(measurement: Measurement, offset: float, drift: float) -> Measurement:
    """The same readings by another clock."""
    old = measurement.file.clock
    if old is None:
        return measurement
    scale = (1.0 + drift) / (1.0 + old.drift)

    def moved(each: Readings) -> Readings:
        times, values = offset + scale * (each.times - old.offset), each.values
        if np.isnan(each.times).all() and VARIABLES[each.sensor.variable].units == "s":
            start = is_instant(each.sensor.variable)
            values = offset * start + scale * (values - old.offset * start)
        return replace(each, times=times, values=values)

    clock = old.model_copy(update={"offset": offset, "drift": drift})
    file = measurement.file.model_copy(update={"clock": clock})
    return Measurement(file, tuple(map(moved, measurement.readings)))


def load_measured(path: str | Path, *, planned: bool = False) -> Measurement:
    """The measured data that a TOML file describes; NaN for readings of a test still to come, which
    is refused unless ``planned``.

    Raises
    ------
    InputError
        If a file is missing or refused, a cell is no number, or the clock stands or jumps back.
    """
    path = Path(path)
    table = parse_toml(read_text(path), path.name)
    if other := next((key for key in ("scene", "structure") if key in table), ""):
        raise InputError(
            f"{path.name}: {other}: this is no measured data, but a scene or what runs one: give "
            "the file that describes the readings, with sensors"
        )
    try:
        file = Measured.model_validate(table)
    except ValidationError as error:
        raise InputError(explain(error, Measured, path.name)) from None
    if file.planned and not planned:
        raise InputError(
            f"{path.name}: clock.interval: this test is still to come (ringsim sensors): give its "
            "table as file, and clock.column"
        )
    if file.planned:
        return Measurement(file, tuple(_planned(file, sensor) for sensor in file.sensors))
    asks = any(sensor.column for sensor in file.sensors)
    columns = _table(file, path.parent / file.file) if asks else {}
    return Measurement(file, tuple(_read(file, sensor, columns) for sensor in file.sensors))


def _planned(file: Measured, sensor: Sensor) -> Readings:
    deviation, times = sensor.scale * sensor.standard_deviation, np.full(1, np.nan)
    if "time" in VARIABLES[sensor.variable].dims and file.clock is not None:
        step, end = file.clock.interval or 1.0, file.clock.end or 1.0
        times = step * np.arange(1, int(end / step + 1e-9) + 1)  # 1e-9: a quotient of round numbers
    return Readings(sensor, times, np.full(len(times), np.nan), deviation, 0, 0)


def is_instant(variable: str) -> bool:
    """Whether a variable in s is a time of the run's clock; one of the user's own, whatever it is
    called, is taken for a duration.
    """
    return variable.endswith("_time") and OF_CAMPAIGNS not in VARIABLES[variable].needs


def _read(file: Measured, sensor: Sensor, columns: dict[str, Array]) -> Readings:
    deviation = sensor.scale * sensor.standard_deviation
    if sensor.value is not None or file.clock is None:
        value = sensor.scale * ((sensor.value or 0.0) - sensor.bias)
        if VARIABLES[sensor.variable].units == "s" and file.clock is not None:
            # A duration, as of a slack rope, has no place in time.
            instant = is_instant(sensor.variable)
            value = file.clock.offset * instant + (1.0 + file.clock.drift) * value
        return Readings(sensor, np.full(1, np.nan), np.array([value]), deviation, 0, 0)
    clock = file.clock
    scale = _UNITS["s"][clock.unit]
    times = clock.offset + (1.0 + clock.drift) * scale * columns[clock.column]
    known = np.isfinite(columns[sensor.column])
    values = sensor.scale * (columns[sensor.column][known] - sensor.bias)
    apart = np.diff(times[known])
    longest = file.longest_gap or (10.0 * float(np.median(apart)) if len(apart) else math.inf)
    gaps = int((apart > longest).sum())
    return Readings(sensor, times[known], values, deviation, int((~known).sum()), gaps)


def _table(file: Measured, path: Path) -> dict[str, Array]:
    """The columns that the clock and the sensors name, shape (rows,) each."""
    assert file.clock is not None  # a file without one names no column
    if file.clock.unit not in _UNITS["s"]:
        known = " or ".join(map(show, _UNITS["s"]))
        raise InputError(f"clock.unit = {show(file.clock.unit)} is no unit of time: choose {known}")
    wanted = dict.fromkeys([file.clock.column, *(s.column for s in file.sensors if s.column)])
    found = (_from_netcdf if path.suffix == ".nc" else _from_csv)(path, list(wanted))
    times = found[file.clock.column]
    if not np.isfinite(times).all():
        place = int(np.argmin(np.isfinite(times))) + 1
        raise InputError(f"{path.name}: row {place}: has no time: give it one, or leave it out")
    if (back := np.flatnonzero(np.diff(times) <= 0.0)).size:
        place, unit = int(back[0]) + 2, file.clock.unit
        raise InputError(
            f"{path.name}: row {place}: its time {times[place - 1]:g} {unit} is not after "
            f"{times[place - 2]:g} {unit} of the row before: the clock stands or jumps: correct "
            "the column, or cut the table there"
        )
    return found


def _from_netcdf(path: Path, wanted: list[str]) -> dict[str, Array]:
    """The variables of these names, each along the same one dimension; values that are masked, or
    not numbers, are empty cells.
    """
    import netCDF4

    require_regular(path)
    found = dict[str, Array]()
    try:
        with netCDF4.Dataset(path) as data:
            for name in wanted:
                if name not in data.variables:
                    hint = known_or_nearest(name, data.variables)
                    raise InputError(f"{path.name}: variable {show(name)} is not in it ({hint})")
                variable = data[name]
                if len(variable.dimensions) != 1 or variable.dtype.kind not in "iuf":
                    raise InputError(
                        f"{path.name}: variable {show(name)} must be numbers along one dimension, "
                        f"and is {variable.dtype} along {', '.join(variable.dimensions) or 'none'}"
                    )
                values = np.ma.filled(variable[:].astype(float), np.nan)
                if found and len(values) != len(next(iter(found.values()))):
                    raise InputError(
                        f"{path.name}: variable {show(name)} has {len(values)} values, and "
                        f"{show(wanted[0])} has {len(found[wanted[0]])}: give both one dimension"
                    )
                found[name] = values
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read: {error}") from None
    return found


def _from_csv(path: Path, wanted: list[str]) -> dict[str, Array]:
    """The columns of these heads."""
    text = read_text(path)
    lines = [row for row in text.splitlines() if row.strip() and not row.startswith("#")]
    if len(lines) < 2:
        raise InputError(f"{path.name}: has no readings: give a row of heads, and rows below it")
    separator = max(_SEPARATORS, key=lines[0].count)
    try:
        head, *rows = csv.reader(io.StringIO("\n".join(lines)), delimiter=separator)
    except csv.Error as error:
        raise InputError(f"{path.name}: is no table: {error}: write it as plain CSV") from None
    head = [cell.strip() for cell in head]
    for name in wanted:
        if head.count(name) != 1:
            wrong = f"is not in its heads ({known_or_nearest(name, head)})"
            if name in head:
                wrong = "stands twice in its heads: give each column a head of its own"
            raise InputError(f"{path.name}: column {show(name)} {wrong}")
    found = {name: np.empty(len(rows)) for name in wanted}
    for number, row in enumerate(rows, 1):
        if len(row) != len(head):
            raise InputError(
                f"{path.name}: row {number} of its readings has {len(row)} cells, but there are "
                f"{len(head)} heads: mend or leave out the row"
            )
        for name, column in found.items():
            column[number - 1] = _number(row[head.index(name)], f"{path.name}: row {number}", name)
    return found


def _number(cell: str, where: str, column: str) -> float:
    if cell.strip().lower() in _NOTHING:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(
            f"{where}, column {show(column)}: {show(cell)} is no finite number: give one with a "
            "decimal point, leave the cell empty (not that of the clock), or leave out the row"
        )
    return value
