"""The motors and the margin of the drive."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import Winch
from ringsim.cable.winding import MotorWinding
from ringsim.outputs.family import (
    Array,
    ErrorBar,
    Output,
    Peak,
    Reading,
    Run,
    Series,
    SpanNames,
    Values,
    Variable,
    holds,
)
from ringsim.parts.faults import AT_ONCE
from ringsim.variables import AT_REST, Fate

# What the motors of the winches give.


_CONSTANTS = ("torque_constant",)
SEVERAL = ("second winch",)
_COMMAND = 3
"""Place of the command in what is read of a winch."""
_LAGS = 0.01
"""Share of its command by which a motor is slower before it counts: the passage to a limit of
torque begins with parts in a thousand, which nobody commands."""


class Motors(Output):
    """Torque, speed, power and energy of every motor's shaft; NaN for winches without one.

    Of motors with a ``torque_constant`` also current, electrical power and what of it is lost.

    A motor that is switched off, or whose winch stops when its plane has locked, gives nothing.
    """

    late = True
    rank = 45
    of_opening = True
    needs = ("motors",)
    electrical: ClassVar = tuple(
        Variable(name, ("plane", "winch", "time"), units, words, needs=_CONSTANTS)
        for name, units, words in (
            ("motor_current", "A", "current of a motor"),
            ("motor_electrical_power", "W", "electrical power that a motor takes"),
            ("motor_loss", "W", "electrical power less that of the shaft"),
            ("motor_electrical_energy", "J", "electrical energy that a motor took"),
        )
    )
    peaks = tuple(
        Peak(f"peak_{name}", ("plane", "winch"), f"the largest {words} of a motor", name)
        for name, words in (
            ("motor_torque", "torque"), ("motor_power", "power"), ("motor_current", "current"),
        )
    )  # fmt: skip
    variables = (
        Variable("motor_torque", ("plane", "winch", "time"), "N m", "torque of a motor's shaft"),
        Variable("motor_speed", ("plane", "winch", "time"), "rad/s", "speed of a motor's shaft"),
        Variable("motor_power", ("plane", "winch", "time"), "W", "power of a motor's shaft"),
        Variable(
            "motor_energy", ("plane", "winch", "time"), "J", "energy that a motor's shaft gave"
        ),
        Variable(
            "peak_motor_torque", (), "N m", "largest torque of any motor's shaft at any step",
            error_bar=ErrorBar("largest torque of a motor", safety=1.5, of="motor_torque"),
            summary=("largest motor torque", "10.3g"), worse="larger", largest_of="motor_torque",
        ),
        Variable(
            "peak_motor_power", (), "W", "largest power of any motor's shaft at any step",
            error_bar=ErrorBar("largest power of a motor", safety=1.5, of="motor_power"),
            summary=("largest motor power", "10.3g"), worse="larger", largest_of="motor_power",
        ),
        Variable(
            "motor_lag_duration", ("plane", "winch"), "s",
            "time in all that a motor was slower than commanded by more than 1 %, for want of "
            "torque; NaN of motors without a command",
        ),
        Variable(
            "longest_motor_lag", (), "s",
            "time in all that one motor was slower than commanded, of that with most of it",
            error_bar=ErrorBar("total lag of a motor", safety=2.0, of="motor_lag_duration"),
            summary=("total lag of a motor", "10.3g"), worse="larger",
            largest_of="motor_lag_duration",
        ),
        Variable(
            "total_motor_energy", (), "J", "energy that the shafts of all motors gave by the end",
            error_bar=ErrorBar("energy of all motors", safety=1.5, of="motor_energy"),
            summary=("energy of all motors", "10.3g"), worse="larger",
        ),
        *electrical,
        Variable(
            "peak_motor_current", (), "A", "largest current of any motor at any step",
            error_bar=ErrorBar("largest current of a motor", safety=1.5, of="motor_current"),
            needs=_CONSTANTS, summary=("largest motor current", "10.3g"), worse="larger",
            largest_of="motor_current",
        ),
        Variable(
            "total_motor_electrical_energy", (), "J",
            "electrical energy that all motors took by the end", needs=_CONSTANTS, worse="larger",
            error_bar=ErrorBar(
                "electrical energy of all motors", safety=2.0, of="motor_electrical_energy"
            ),
        ),
        *(variable for peak in peaks[:2] for variable in peak.variables),
        *(replace(variable, needs=_CONSTANTS) for variable in peaks[2].variables),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Tension (N), speed (m/s), rope wound (m) and command (m/s) of every winch, shape
        (planes, 2, 4); see ``_COMMAND``.
        """
        if now.chain is None or now.commands is None:
            return None
        chain = now.chain
        each = chain.winch_tensions, chain.wound_rate, chain.wound, now.commands
        return now.by_plane(np.stack(each, axis=-1), 2)

    def reduce(self, run: Run, series: Series) -> Values:
        """Of the tensions and speeds at the steps; energies are sums of mean torque times turn."""
        held = run.held
        times, winches = series.times, len(run.coordinates["winch"])
        spans = np.diff(times, prepend=-1.0)
        # The first of two readings of one time is before what happens then.
        seen = times + np.where(np.append(spans[1:], 1.0) > 0.0, AT_ONCE, -AT_ONCE)
        found = np.full((4, len(times), len(run.locks), winches), np.nan)
        torque, shaft, power, energy = found
        current, supplied, lost, lagged, climbed, begun = np.full((6, *torque.shape), np.nan)
        # A run that went on may have had another motor before, or none: each for its own steps.
        for steps, (plane, end), winch, motor, controlled in _motors(run, series):
            tension, speed, wound, told = series.values[:, plane, end].T
            if controlled:
                motor = motor.model_copy(update={"speed": told / motor.travel, "ramp": None})
            runs = np.array([winch.turns(time) for time in seen], dtype=bool)
            locked = np.nan_to_num(held[plane].max(), nan=math.inf)
            if winch.after_lock == "stop" or (
                winch.after_lock == "hold" and locked < winch.start_time
            ):
                runs &= times <= locked
            on, since_start = runs[steps], times - winch.start_time
            # What stops at a lock has stopped where its step ends: before that it turned as fast
            # as its rope tells.
            stopped = np.append(False, runs[:-1] & ~runs[1:]) & (spans > 0.0)
            rate = np.diff(wound, prepend=0.0) / np.where(spans > 0.0, spans, math.inf)
            last, most = np.append(0.0, speed[:-1]), motor.travel * motor.fastest
            ended = np.where(stopped, np.clip(2.0 * rate - last, rate, np.fmax(rate, most)), speed)
            given = motor.torque(tension, speed, since_start)
            reached = motor.torque(tension, ended, since_start)
            # A rotor that is switched on stands, and has its largest torque: no step ends there.
            low, high = (np.maximum(each, 0.0) / motor.travel for each in (speed[:-1], ended[1:]))
            up = runs[:-1] & motor.runs_up(speed, since_start)[:-1] & (high > low)
            starts = np.flatnonzero(up & (low == 0.0))
            given[starts] = motor.available(0.0)
            found[:, :, plane, end] = np.nan_to_num(found[:, :, plane, end])
            place, before = (steps, plane, end), np.maximum(steps - 1, 0)
            torque[place] = np.where(on, given[steps], 0.0)
            shaft[place] = speed[steps] / motor.travel
            climbs = np.append(0.0, np.where(up, motor.largest_power(low, high), 0.0))
            climbed[place] = climbs[steps]
            # Also of a step at whose end the winch is switched off: its drum turned until then.
            turned = (wound[steps] - wound[before]) / motor.travel
            energy[place] = 0.5 * (reached[steps] + given[before]) * turned
            # What a rotor takes that runs up is known without the course of its torque, which steps
            # may hardly resolve: the load of the rope, and its kinetic energy.
            load = motor.loads(tension)[1]
            gains = 0.5 * (motor.rotor_inertia or 0.0) * (high**2 - low**2)
            runs_up = np.append(False, up)[steps]
            taken = 0.5 * (load[steps] + load[before]) * turned + np.append(0.0, gains)[steps]
            energy[place] = np.where(runs_up, taken, energy[place])
            during = times[steps] - times[before]
            if motor.speed is not None:
                late, slow = (
                    runs & (has / motor.travel < (1.0 - _LAGS) * motor.commanded(since_start)[0])
                    for has in (speed, ended)
                )
                # Up to the end of a step at which it is switched off it is as at its beginning; a
                # shaft without inertia that starts is in its first step as at the step's end.
                first = motor.rotor_inertia is None and times <= winch.start_time + AT_ONCE
                until = np.where(runs[steps], slow[steps], late[before])
                since = np.where((runs & first)[before] & runs[steps], until, late[before])
                lagged[place] = 0.5 * during * runs[before] * (1.0 * since + until)
            if motor.torque_constant is not None:
                takes = motor.electrical_power(given, speed / motor.travel)
                flows = motor.current(given, speed / motor.travel)
                current[place] = np.where(on, flows[steps], 0.0)
                # Just after the start, with nearly all torque and the losses of what turns.
                first = motor.current(motor.available(low), high)
                begun[place] = np.append(np.where(up, first, 0.0), 0.0)[steps]
                supplied[place] = np.where(on, takes[steps], 0.0)
                loss = takes - given * speed / motor.travel
                spent = motor.electrical_power(reached, ended / motor.travel)
                spent -= reached * ended / motor.travel
                half = np.where(runs, 0.5, 0.0)[before] * during
                lost[place] = half * (spent[steps] + loss[before])
        power[:] = torque * shaft
        energy[:] = np.cumsum(energy, axis=0)
        values: Values = {
            variable.name: Series(series.times, own, series.grid).on_grid()
            for variable, own in zip(self.variables[:4], found, strict=True)
        }
        if "torque_constant" in holds(run.scene):
            taken = energy + np.cumsum(lost, axis=0)
            values |= _electrical(series, current, supplied, supplied - power, taken)
        each = [motor for *_, motor, _ in _motors(run, series)]
        # Between readings nothing is above the line of the motor, as a parabola may be.
        bounds = (
            max((one.available(0.0) for one in each), default=math.inf),
            max((float(one.largest_power(0.0, one.free_speed)) for one in each), default=math.inf),
            max((float(one.current(one.available(0.0), 1.0)) for one in each), default=math.inf),
        )
        largest = torque, np.fmax(power, climbed), np.fmax(current, begun)
        for peak, own, bound in zip(self.peaks, largest, bounds, strict=True):
            if np.isfinite(own).any():  # no current of motors that do not tell their constant
                most, places = peak.of(run, times, own)
                values |= places | {peak.name: np.asarray(min(most, bound))}
        values["total_motor_energy"] = np.nansum(energy[-1])
        if np.isfinite(lagged).any():
            known = np.isfinite(lagged).any(axis=0)
            lag = np.where(known, np.nansum(lagged, axis=0), np.nan)
            values |= {"motor_lag_duration": lag, "longest_motor_lag": np.nanmax(lag)}
        else:  # nothing is commanded
            values["longest_motor_lag"] = 0.0
        return values


class Commands(Output):
    """What a controller tells the winches."""

    late = True
    rank = 44
    needs = ("controller",)
    variables = (
        Variable(
            "winch_command", ("plane", "winch", "time"), "m/s",
            "speed that a controller has commanded; NaN of winches that take no commands",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """For every plane and end."""
        return None if now.commands is None else now.by_plane(now.commands, 1)

    def reduce(self, run: Run, series: Series) -> Values:
        """As it stands at the output times."""
        at = np.searchsorted(series.times, series.grid * (1.0 + 1e-12), side="right") - 1
        told = series.values[at, :, : len(run.coordinates["winch"])]
        told[series.grid > series.times[-1] * (1.0 + 1e-12)] = np.nan
        return {"winch_command": np.moveaxis(told, 0, -1)}


def _electrical(series: Series, *courses: Array) -> Values:
    """Outputs of current, power taken, loss and energy taken, shape (times, planes, winches)."""
    values: Values = {
        variable.name: Series(series.times, own, series.grid).on_grid()
        for variable, own in zip(Motors.electrical, courses, strict=True)
    }
    *_, taken = courses
    return values | {"total_motor_electrical_energy": np.nansum(taken[-1])}


def _motors(
    run: Run, series: Series
) -> Iterator[tuple[NDArray[np.intp], tuple[int, int], Winch, MotorWinding, bool]]:
    """Steps, plane and end of every motor, with its winch and itself as they were then, and whether
    a controller has commanded it.  One that holds its tension after the lock follows no command
    then, and takes no torque for its rotor.
    """
    times = series.times
    for steps, scene in run.stretches(times):
        for plane, cable in [] if scene.cables is None else scene.cables.present():
            for end, winch in enumerate(cable.winches):
                if (motor := winch.winding.motor) is None:
                    continue
                place, held = (plane, end), math.inf
                if winch.after_lock == "hold":
                    held = float(np.nan_to_num(run.held[plane].max(), nan=math.inf))
                later = times[steps] > held + AT_ONCE
                early = steps[~later]
                # Until its first command a motor follows its own law, from then on the last one,
                # whether the scene that it goes on with has a controller or not.
                told = series.values[early, plane, end, _COMMAND]
                own = np.flatnonzero(told != motor.commanded_speed())
                first = int(own[0]) if own.size else len(early)
                for part, commanded in ((early[:first], False), (early[first:], True)):
                    if part.size:
                        yield part, place, winch, motor, commanded
                if later.any():
                    still = {"rotor_inertia": None, "speed": None, "ramp": None}
                    yield steps[later], place, winch, motor.model_copy(update=still), False


# Drive and resistance by kind along a run, and the static margin between them by a standard.


LAST_LOCK = "deployment_time"
"""What is open needs no drive any more."""


def left_by_winches(course: Array) -> bool:
    """Whether nobody drove a ring any more in the end, by its margins over time: then it was left
    by its winches, and not by its own sections.
    """
    return bool((course[np.isfinite(course)][-1:] < 0.0).any())


class DriveMargins(Output):
    """Static generalised forces on the opening angle of the ideal ring at the mean one of the run.

    See ``ringsim.rigid.margin``.
    """

    rank = 46
    of_opening = True
    of_both = True  # the statics of rigid rods, at angles that hardly differ
    needs = ("margin",)
    coordinates = (
        Variable("resistance", ("resistance",), "1", "kind of resistance to opening", "str"),
    )
    variables = (
        Variable(
            "drive_available", ("time",), "N m",
            "driving moment of stalling winches, loads and springs without friction in the pulleys",
            until=LAST_LOCK,
        ),
        Variable(
            "drive_resistance", ("resistance", "time"), "N m",
            "static resistance to opening by its kind, without factors",
            until=LAST_LOCK,
        ),
        Variable(
            "drive_margin", ("time",), "1",
            "static margin of the drive by the standard on the ideal ring at the mean opening "
            "angle, with the faults so far, as check --margin tells it",
            until=LAST_LOCK,
        ),
        Variable(
            "least_drive_margin", (), "1",
            "smallest static margin of the drive at any angle that the run passed",
            summary=("least drive margin", "10.3f"), worse="smaller", least_of="drive_margin",
        ),
        Variable("least_drive_margin_time", (), "s", "time of least_drive_margin"),
        Variable(
            "least_drive_margin_angle", (), "degree", "mean opening angle at the least drive margin"
        ),
        Variable(
            "least_drive_margin_started", (), "1",
            "smallest static margin of the drive at any angle passed from the start of the last "
            "winch on; of runs that ended before, that of the whole run",
            needs=SEVERAL, worse="smaller",
        ),
        Variable(
            "least_drive_margin_started_angle", (), "degree",
            "mean opening angle at the least drive margin from the start of the last winch on",
            needs=SEVERAL,
        ),
        Variable(
            "least_drive_margin_plane", ("plane",), "1",
            "smallest static margin of a plane's own cable against half of all that resists, at "
            "the angles that the plane passed until it had locked",
        ),
        Variable(
            "least_plane_margin", (), "1",
            "smallest static margin of either plane's own cable, against half of all that resists",
            worse="smaller", least_of="least_drive_margin_plane",
        ),
        Variable(
            "least_plane_margin_started", (), "1",
            "smallest static margin of either plane's own cable from the start of the last winch "
            "on; of runs that ended before, that of the whole run",
            needs=SEVERAL, worse="smaller",
        ),
    )  # fmt: skip

    def told(self, values: Values, span_names: SpanNames) -> str:
        """As "at 20.5 deg and 0.1 s: NOT enough"; where that is before the last winch starts,
        "(-0.110 from the start of the last winch on)"; of a plane whose own cable falls short by
        more than the mean of both, ", but one plane has -1.000", or ", and one plane even -0.951".
        """
        names = [f"least_drive_margin{end}" for end in ("", "_angle", "_time")]
        margin, angle, time = (float(values.get(name, math.nan)) for name in names)
        word = "enough" if margin >= 0.0 else "NOT enough"
        short = margin >= 0.0 and values.get("outcome", Fate.NONE) in AT_REST
        rigid = short and not left_by_winches(np.asarray(values.get("drive_margin", ())))
        if short:
            word = (
                "enough for a rigid ring, which opens as one; this one did not" if rigid
                else "enough until the winches were switched off"
            )  # fmt: skip
        # Before the last winch starts one plane has no drive, as everybody knows who delays it.
        whole = float(values.get("least_plane_margin", math.nan))
        plane = float(values.get("least_plane_margin_started", whole))
        also = ", but one plane has" if margin >= 0.0 else ", and one plane even"
        also = ", and one plane has" if rigid else also
        # Planes of a ring that sags by a hundredth of a degree are no news; one without drive is.
        own = f"{also} {plane:.3f}" if plane < min(margin - 5e-3, -5e-4) else ""
        started = float(values.get("least_drive_margin_started", math.nan))
        then = f" ({started:.3f} from the start of the last winch on)" * (started > margin + 5e-4)
        return f"at {angle:.4g} deg and {time:.4g} s: {word}{then}{own}"

    def reduce(self, run: Run, series: Series) -> Values:
        """Nothing: ``ringsim.rigid.margin`` knows them."""
        return {}


# What a run took: steps, iterations, starts, times, and the settings that it ended up with.


def _number(name: str, long_name: str, summary: tuple[str, str] | None = None) -> Variable:
    return Variable(name, (), "1", long_name, "i4", summary=summary)


class Effort(Output):
    """Counts of the last attempt; ``ringsim.stepping.ending`` adds those of all attempts."""

    rank = 70
    of_antenna = False
    variables = (
        _number("steps", "time steps of the last attempt", ("steps", "10d")),
        _number("repeated_steps", "steps that were repeated with a smaller one"),
        _number("newton_iterations", "Newton iterations of the last attempt"),
        _number("jacobians", "Jacobian factorisations of the last attempt"),
        _number("restarts", "restarts with smaller steps after a failed attempt"),
        _number(
            "total_steps", "time steps of all attempts of the run", ("steps of all attempts", "10d")
        ),
        _number("total_newton_iterations", "Newton iterations of all attempts"),
        _number("total_jacobians", "Jacobian factorisations of all attempts"),
        _number("fidelity", "model: 0 full multibody, 2 rods in joint coordinates"),
        Variable("step_used", (), "s", "largest step allowed, solver.step, of the last attempt"),
        Variable("tolerance_used", (), "1", "solver.tolerance of the last attempt"),
        Variable("final_time", (), "s", "time at which the run ended"),
        Variable("wall_time", (), "s", "elapsed time of the run", summary=("wall time", "10.2f")),
        Variable("cpu_time", (), "s", "processor time of the run"),
    )

    def reduce(self, run: Run, series: Series) -> Values:
        """As counted."""
        return {**run.counts, "final_time": series.times[-1]}
