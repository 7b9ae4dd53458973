"""What the motors of the winches give."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import Winch
from ringsim.cable.winding.motor import MotorWinding
from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable


class Motors(Output):
    """Torque, speed, power and energy of every motor's shaft; NaN for winches without one.

    A motor that is switched off, or whose winch stops when its plane has locked, gives nothing.
    """

    rank = 45
    needs = ("motors",)
    variables = (
        Variable("motor_torque", ("plane", "winch", "time"), "N m", "torque of a motor's shaft"),
        Variable("motor_speed", ("plane", "winch", "time"), "rad/s", "speed of a motor's shaft"),
        Variable("motor_power", ("plane", "winch", "time"), "W", "power of a motor's shaft"),
        Variable(
            "motor_energy", ("plane", "winch", "time"), "J", "energy that a motor's shaft gave"
        ),
    )

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
        times, winches = series.times, len(run.coordinates["winch"])
        found = np.full((4, len(times), len(run.locks), winches), np.nan)
        torque, shaft, power, energy = found
        turned = np.zeros_like(torque)
        # A run that went on may have had another motor before, or none: each for its own steps.
        for steps, (plane, end), winch, motor in _motors(run):
            tension, speed, wound = series.values[:, plane, end].T
            on = np.array([winch.turns(time) for time in times[steps]], dtype=bool)
            if winch.after_lock == "stop":
                on &= times[steps] <= np.nan_to_num(run.locks[plane].max(), nan=math.inf)
            found[:, :, plane, end] = np.nan_to_num(found[:, :, plane, end])
            place, before = (steps, plane, end), np.maximum(steps - 1, 0)
            torque[place] = np.where(on, motor.torque(tension[steps], speed[steps]), 0.0)
            shaft[place] = speed[steps] / motor.travel
            turned[place] = (wound[steps] - wound[before]) / motor.travel
        power[:] = torque * shaft
        energy[:] = 0.0 * torque
        energy[1:] += np.cumsum(0.5 * (torque[1:] + torque[:-1]) * turned[1:], axis=0)
        return {
            variable.name: Series(series.times, values, series.grid).on_grid()
            for variable, values in zip(self.variables, found, strict=True)
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
