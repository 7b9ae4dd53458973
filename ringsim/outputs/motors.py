"""What the motors of the winches give."""

import math

import numpy as np

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
        assert run.scene.cables is not None
        winches = len(run.coordinates["winch"])
        found = np.full((4, len(series.times), len(run.locks), winches), np.nan)
        for plane, cable in run.scene.cables.present():
            locked = float(np.nan_to_num(run.locks[plane].max(), nan=math.inf))
            for end, winch in enumerate(cable.winches):
                if not isinstance(motor := winch.winding, MotorWinding):
                    continue
                tension, speed, wound = series.values[:, plane, end].T
                on = np.array([winch.turns(time) for time in series.times])
                if winch.after_lock == "stop":
                    on &= series.times <= locked
                torque = np.where(on, motor.torque(tension, speed), 0.0)
                shaft, turned = speed / motor.travel, np.diff(wound) / motor.travel
                energy = np.cumsum(np.append(0.0, 0.5 * (torque[1:] + torque[:-1]) * turned))
                found[:, :, plane, end] = torque, shaft, torque * shaft, energy
        return {
            variable.name: Series(series.times, values, series.grid).on_grid()
            for variable, values in zip(self.variables, found, strict=True)
        }
