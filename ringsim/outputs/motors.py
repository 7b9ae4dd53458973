"""What the motors of the winches give."""

import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import Winch
from ringsim.cable.winding.motor import MotorWinding
from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable, holds

_CONSTANTS = ("torque_constant",)


class Motors(Output):
    """Torque, speed, power and energy of every motor's shaft; NaN for winches without one.

    Of motors with a ``torque_constant`` also current, electrical power and what of it is lost.

    A motor that is switched off, or whose winch stops when its plane has locked, gives nothing.
    """

    rank = 45
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
    variables = (
        Variable("motor_torque", ("plane", "winch", "time"), "N m", "torque of a motor's shaft"),
        Variable("motor_speed", ("plane", "winch", "time"), "rad/s", "speed of a motor's shaft"),
        Variable("motor_power", ("plane", "winch", "time"), "W", "power of a motor's shaft"),
        Variable(
            "motor_energy", ("plane", "winch", "time"), "J", "energy that a motor's shaft gave"
        ),
        Variable(
            "peak_motor_torque", (), "N m", "largest torque of any motor's shaft at any step",
            summary=("largest motor torque", "10.3g"),
        ),
        Variable(
            "peak_motor_power", (), "W", "largest power of any motor's shaft at any step",
            summary=("largest motor power", "10.3g"),
        ),
        Variable(
            "total_motor_energy", (), "J", "energy that the shafts of all motors gave by the end",
            summary=("energy of all motors", "10.3g"),
        ),
        *electrical,
        Variable(
            "peak_motor_current", (), "A", "largest current of any motor at any step",
            needs=_CONSTANTS, summary=("largest motor current", "10.3g"),
        ),
        Variable(
            "total_motor_electrical_energy", (), "J",
            "electrical energy that all motors took by the end", needs=_CONSTANTS,
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Tension (N), speed (m/s) and rope wound (m) of every winch, (planes, 2, 3)."""
        if now.chain is None:
            return None
        found = np.full((len(now.angles), 2, 3), np.nan)
        chain = now.chain
        own = np.stack([chain.winch_tensions, chain.wound_rate, chain.wound], axis=-1)
        for planes, value in zip(now.planes, own, strict=True):
            found[list(planes)] = value
        return found

    def reduce(self, run: Run, series: Series) -> Values:
        """Of the tensions and speeds at the steps; energies are sums of mean torque times turn."""
        held = run.held
        times, winches = series.times, len(run.coordinates["winch"])
        found = np.full((4, len(times), len(run.locks), winches), np.nan)
        torque, shaft, power, energy = found
        current, supplied, turned = np.zeros((3, *torque.shape))
        current[:] = supplied[:] = np.nan
        # A run that went on may have had another motor before, or none: each for its own steps.
        for steps, (plane, end), winch, motor in _motors(run):
            tension, speed, wound = series.values[:, plane, end].T
            on = np.array([winch.turns(time) for time in times[steps]], dtype=bool)
            if winch.after_lock == "stop":
                on &= times[steps] <= np.nan_to_num(held[plane].max(), nan=math.inf)
            found[:, :, plane, end] = np.nan_to_num(found[:, :, plane, end])
            place, before = (steps, plane, end), np.maximum(steps - 1, 0)
            torque[place] = np.where(on, motor.torque(tension[steps], speed[steps]), 0.0)
            shaft[place] = speed[steps] / motor.travel
            turned[place] = (wound[steps] - wound[before]) / motor.travel
            if motor.torque_constant is not None:
                now = torque[place], shaft[place]
                current[place] = np.where(on, motor.current(*now), 0.0)
                supplied[place] = np.where(on, motor.electrical_power(*now), 0.0)
        power[:] = torque * shaft
        energy[:] = 0.0 * torque
        energy[1:] += np.cumsum(0.5 * (torque[1:] + torque[:-1]) * turned[1:], axis=0)
        values: Values = {
            variable.name: Series(series.times, own, series.grid).on_grid()
            for variable, own in zip(self.variables[:4], found, strict=True)
        }
        if "torque_constant" in holds(run.scene):
            values |= _electrical(series, current, supplied, supplied - power, energy)
        values["peak_motor_torque"] = np.nanmax(torque)
        values["peak_motor_power"] = np.nanmax(power)
        values["total_motor_energy"] = np.nansum(energy[-1])
        return values


def _electrical(series: Series, *found: Array) -> Values:
    """Outputs of current, electrical power, loss and the shafts' energy, shape (times, planes,
    winches).
    """
    current, supplied, loss, energy = found
    lost = 0.0 * loss
    # The shafts' energy follows what they turned; what is lost follows the time.
    steps = np.diff(series.times)[:, None, None]
    lost[1:] += np.cumsum(0.5 * (loss[1:] + loss[:-1]) * steps, axis=0)
    courses = current, supplied, loss, energy + lost
    values: Values = {
        variable.name: Series(series.times, own, series.grid).on_grid()
        for variable, own in zip(Motors.electrical, courses, strict=True)
    }
    return values | {
        "peak_motor_current": np.nanmax(current),
        "total_motor_electrical_energy": np.nansum(courses[-1][-1]),
    }


def _motors(
    run: Run,
) -> Iterator[tuple[NDArray[np.intp], tuple[int, int], Winch, MotorWinding]]:
    """Steps, plane and end of every motor, with its winch and itself as they were then."""
    for steps, scene in run.stretches():
        for plane, cable in [] if scene.cables is None else scene.cables.present():
            for end, winch in enumerate(cable.winches):
                if isinstance(winch.winding, MotorWinding):
                    yield steps, (plane, end), winch, winch.winding
