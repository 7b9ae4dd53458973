"""The variables of a result: dimensions, units and meaning, in one place."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np


class Status(IntEnum):
    """How a run ended; negative codes never occur, 0 is the only success."""

    OK = 0
    UNFINISHED = 1
    SOLVER_FAILED = 2
    DIVERGED = 3
    ERROR = 4
    CRASHED = 5
    TIMEOUT = 6
    MEMORY = 7

    @property
    def word(self) -> str:
        """Lower-case name, as in the dataset's flag_meanings."""
        return self.name.lower()

    @property
    def failed(self) -> bool:
        """Whether the run gave no usable result."""
        return self >= Status.SOLVER_FAILED


class Fidelity(IntEnum):
    """Which model answered: the full multibody model, or the ideal ring with rigid rods."""

    FULL = 0
    IDEAL = 1


@dataclass(frozen=True)
class Variable:
    """Name, dimensions, SI unit (or degree where said) and meaning of one variable."""

    name: str
    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: str = "f8"
    needs: str = ""
    """What a scene must hold for it: "stress" output, "cables", "error bars" (of one of these), a
    kind of structure, or nothing."""


PLANES = ("upper", "lower")
RODS = (
    "diagonal_rising_left", "diagonal_rising_right",
    "diagonal_falling_left", "diagonal_falling_right",
    "bar_upper_left", "bar_upper_right", "bar_lower_left", "bar_lower_right",
)  # fmt: skip

COORDINATES = (
    Variable("plane", ("plane",), "1", "plane of the ring", "str"),
    Variable("section", ("section",), "1", "section number, counted from the boom", "i4"),
    Variable("time", ("time",), "s", "time since the start of the run"),
    Variable("span", ("span",), "1", "span of a cable, counted from its winch", "i4"),
    Variable("rod", ("rod",), "1", "rod half of a section", "str"),
    Variable("station", ("station",), "m", "distance along the upper beam from the fixed axis"),
)

_ALL = (
    Variable("deployment_time", (), "s", "time at which the last V-joint reached 180 deg"),
    Variable(
        "opening_angle", ("plane", "section", "time"), "degree", "angle between the bar halves"
    ),
    Variable("lock_time", ("plane", "section"), "s", "time at which the V-joint reached 180 deg"),
    Variable(
        "asynchrony", ("time",), "degree", "largest difference of opening angles between V-joints"
    ),
    Variable("asynchrony_max", (), "degree", "largest asynchrony up to the deployment time"),
    Variable(
        "rod_stress",
        ("rod", "section", "time"),
        "Pa",
        "axial + bending stress of a rod, elastic + viscous",
    ),
    Variable(
        "peak_rod_stress", (), "Pa", "largest axial + bending stress of any rod", needs="stress"
    ),
    Variable("cable_tension", ("plane", "span", "time"), "N", "tension of a cable's span"),
    Variable(
        "peak_tension",
        (),
        "N",
        "largest tension of any span of any cable up to the deployment time",
        needs="cables",
    ),
    Variable("peak_tension_time", (), "s", "time of the largest tension", needs="cables"),
    Variable(
        "slack_duration",
        ("plane",),
        "s",
        "time for which the cable is slack at its winch",
        needs="cables",
    ),
    Variable("wound_length", ("plane", "time"), "m", "rope wound up by the cable's winches"),
    Variable("cable_length", ("plane", "time"), "m", "length of the driving cable"),
    Variable(
        "bending_strain", ("station", "time"), "1", "bending strain of the upper beam's fibre"
    ),
    Variable(
        "peak_bending_strain",
        (),
        "1",
        "largest bending strain of the upper beam at any step",
        needs="planar-truss",
    ),
    Variable("kinetic_energy", ("time",), "J", "kinetic energy"),
    Variable("elastic_energy", ("time",), "J", "energy stored in rods, net and stops"),
    Variable("work", ("time",), "J", "work done on the structure by forces and winches"),
    Variable("dissipation", ("time",), "J", "energy lost in joints, dampers and stops"),
    Variable("energy_error", (), "1", "largest energy imbalance over the largest energy exchanged"),
    *(
        Variable(f"{name}_error", (), units, f"what the {words} may be wrong by", needs=needs)
        for name, units, words, needs in (
            ("deployment_time", "s", "deployment time", "error bars"),
            ("opening_angle", "degree", "opening angles", "error bars"),
            ("asynchrony_max", "degree", "largest asynchrony", "error bars"),
            ("peak_tension", "N", "largest tension", "error bars of cables"),
            ("peak_rod_stress", "Pa", "largest stress", "error bars of stress"),
        )
    ),
    Variable(
        "asynchrony_error",
        ("time",),
        "degree",
        "what the asynchrony may be wrong by at any time up to then",
    ),
    Variable("constraint_violation", ("time",), "m", "largest gap in any joint"),
    Variable("constraint_error", (), "m", "largest gap in any joint at any step"),
    Variable("steps", (), "1", "time steps of the start that counts", "i4"),
    Variable("repeated_steps", (), "1", "steps that were repeated with a smaller one", "i4"),
    Variable("newton_iterations", (), "1", "Newton iterations of the start that counts", "i4"),
    Variable("jacobians", (), "1", "Jacobian factorisations of the start that counts", "i4"),
    Variable("restarts", (), "1", "new starts with a smaller step after a run that failed", "i4"),
    Variable("total_steps", (), "1", "time steps of all starts of the run", "i4"),
    Variable("total_newton_iterations", (), "1", "Newton iterations of all starts", "i4"),
    Variable("total_jacobians", (), "1", "Jacobian factorisations of all starts", "i4"),
    Variable("step_used", (), "s", "largest step allowed, solver.step, of the start that counts"),
    Variable("tolerance_used", (), "1", "solver.tolerance of the start that counts"),
    Variable("final_time", (), "s", "time at which the run ended"),
    Variable("fidelity", (), "1", "model: 0 full multibody, 1 ideal ring of rigid rods", "i4"),
    Variable("status", (), "1", "how the run ended", "i1"),
    Variable("wall_time", (), "s", "elapsed time of the run"),
    Variable("cpu_time", (), "s", "processor time of the run"),
)
VARIABLES = {variable.name: variable for variable in _ALL}

COUNTS = ("steps", "newton_iterations", "jacobians")
"""What a start of a run takes; "total_" before the name counts all starts."""

TIMINGS = ("wall_time", "cpu_time")
"""The only variables that differ between repetitions of one run."""


@dataclass(frozen=True)
class Outcome:
    """The result of one run, as plain arrays.

    Attributes
    ----------
    status
        How the run ended.
    reason
        One sentence: why it ended, and for a failure what to change.
    coordinates
        Values of the dimensions that occur in ``values``.
    values
        Arrays by variable name; shapes follow ``VARIABLES`` and ``coordinates``.  A failed run
        has what was recorded until then, NaN elsewhere.
    """

    status: Status
    reason: str
    coordinates: dict[str, np.ndarray[Any, Any]] = field(default_factory=dict)
    values: dict[str, np.ndarray[Any, Any]] = field(default_factory=dict)
