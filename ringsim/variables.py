"""What a result is made of: variables with their meaning, and how and why a run ended."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

PLANES = ("upper", "lower")
OF_CAMPAIGNS = "[outputs] of a campaign file"
"""What outputs by expressions need: no scene holds it, so that runs alone do not have them."""
COUNTS = ("steps", "newton_iterations", "jacobians")
"""What a start of a run takes; "total_" before the name counts all starts."""
TIMINGS = ("wall_time", "cpu_time")
"""The only variables that differ between repetitions of one run."""


NO_CODE = -1
"""What files hold where a code is missing: ``status`` and others of samples that have not run."""


class Code(IntEnum):
    """A number in files that stands for a word."""

    @property
    def word(self) -> str:
        """Lower-case name, as in the attribute ``flag_meanings``."""
        return self.name.lower()

    @property
    def words(self) -> str:
        """The same for people, with blanks."""
        return self.word.replace("_", " ")


def about(long_name: str, units: str = "1") -> dict[str, Any]:
    """The CF attributes that tell what a variable is."""
    return {"long_name": long_name, "units": units}


def texts_about(texts: Iterable[Any], long_name: str) -> tuple[NDArray[Any], dict[str, str]]:
    """Texts as files take them, and the CF attribute that tells what they are."""
    return np.array([*texts], dtype=object), {"long_name": long_name}


def flags_of(codes: Iterable[Code]) -> dict[str, Any]:
    """The CF attributes that tell what codes mean."""
    words = {int(code): code.word for code in codes}
    return {
        "flag_values": np.array(list(words), dtype="i1"),
        "flag_meanings": " ".join(words.values()),
    }


class Status(Code):
    """Whether the numbers of a run hold; what the antenna did says its ``Fate``."""

    OK = 0
    SOLVER_FAILED = 2
    DIVERGED = 3
    ERROR = 4
    CRASHED = 5
    TIMEOUT = 6
    MEMORY = 7

    @property
    def failed(self) -> bool:
        """Whether the run gave no usable result."""
        return self >= Status.SOLVER_FAILED


class Cause(Code):
    """Why the numbers of a run do not hold; ``reason`` tells it with values and the cure."""

    NONE = 0
    BLOW_UP = 2
    ENERGY_GREW = 3
    ENERGY_LOST = 4
    JOINT_GAP = 5
    FEW_STEPS = 7
    TENSION_BENDS = 8
    NEWTON = 9
    STEP_LIMIT = 10
    NOT_FINITE = 11
    REFUSED = 12
    EXCEPTION = 13
    CRASH = 14
    TIME_LIMIT = 15
    MEMORY = 16
    UNFIT = 17
    STRAINED = 18


class Fate(Code):
    """What the antenna did, as far as a run whose numbers hold tells."""

    NONE = 0
    """The numbers do not hold: nothing is said."""
    DEPLOYED = 1
    """Every V-joint has reached 180 deg, and all latches that there are have caught."""
    PARTLY_DEPLOYED = 2
    """At rest, with some V-joints locked; nothing drives the others any more."""
    STALLED = 3
    """At rest, with no V-joint locked."""
    FOLDED = 4
    """Every V-joint has reached the stowed stop."""
    OVERLOADED = 5
    """A limit of the scene was passed; see ``ringsim.parts.solver``."""
    CUT_OFF = 6
    """Still moving or driven at ``solver.end_time``."""
    FINISHED = 7
    """A structure that does not lock, driven until ``solver.end_time``."""
    NOT_LATCHED = 8
    """Every V-joint has reached 180 deg, but latches did not catch up to the run's end."""
    SLACKENED = 9
    """A rope was slack for longer than the scene allows: it may have left its pulleys."""


GOALS = (Fate.DEPLOYED, Fate.FOLDED, Fate.FINISHED)
"""What runs are made for; the others ended before."""
GO_ON = (Fate.OVERLOADED, Fate.SLACKENED)
"""Of rings over a limit, which may open all the same."""
AT_REST = (Fate.PARTLY_DEPLOYED, Fate.STALLED)
"""Of rings that came to rest before they were deployed."""


class Reason(str):
    """A sentence that says why a run ended, with the code of the cause."""

    cause: Cause

    def __new__(cls, cause: Cause = Cause.NONE, text: str = "") -> Self:
        """Attach the code to the text."""
        made = super().__new__(cls, text)
        made.cause = cause
        return made

    def __add__(self, more: str) -> Self:
        """The same cause with more words."""
        return type(self)(self.cause, f"{self}{more}")


class Fidelity(Code):
    """Which model answered."""

    FULL = 0
    FRAME = 2

    @property
    def model(self) -> str:
        """What it is, in words."""
        return {
            Fidelity.FULL: "multibody simulation with exudyn",
            Fidelity.FRAME: "flexible rods in joint coordinates, computed in C",
        }[self]


GONE = {
    "ideal": "rings of rigid rods (without asynchrony and stress) are no longer available: choose "
    'fidelity = "frame"'
}
"""Fidelities that there were, with what to do."""


@dataclass(frozen=True)
class ErrorBar:
    """How a variable's error bar follows from a second run; see ``ringsim.outputs.balance``."""

    words: str
    """What may be wrong, for the bar's ``long_name``."""
    safety: float
    """Bar over the error that the difference of the two runs shows."""
    of: str = ""
    """Variable of many places, or axes, of which it is the largest or least: two runs may agree in
    one number by chance, and hardly in all of these."""


@dataclass(frozen=True)
class Variable:
    """One variable of a result: all that files, summaries, figures and messages say of it."""

    name: str
    dims: tuple[str, ...]
    units: str
    """SI, or degree."""
    long_name: str
    dtype: str = "f8"
    needs: tuple[str, ...] = ()
    """What a scene must hold for it, all of: names of parts ("cables", "net", ...), "stress"
    output, "error bars", a structure's "gauge" or kind."""
    flags: type[Code] | None = None
    """What the values mean where they are codes."""
    error_bar: ErrorBar | None = None
    summary: tuple[str, str] | None = None
    """Label and number format in what ``ringsim run`` prints, if it stands there."""
    until: str = "final_time"
    """Number up to which all output times have a value; the run's end where that is missing."""
    gaps: bool = False
    """Whether sound runs lack values at some times, too."""
    worse: Literal["larger", "smaller", "neither", ""] = ""
    """Which of two values of a number an engineer fears more: what is told as worst follows it.
    Where it is not said, what is required of the number may tell: ``requirements.badness_of``."""
    largest_of: str = ""
    """Variable with dimensions whose largest value, or magnitude, this number is."""
    least_of: str = ""
    """Variable with dimensions whose smallest value this number is."""
    round_off: float = 0.0
    """Difference of two engines' values that is none, whatever their error bars; half of it counts
    as 0 in campaigns."""

    @property
    def badness(self) -> int:
        """What values are multiplied by so that the worst is the largest; 0 if neither is worse."""
        return {"larger": 1, "smaller": -1}.get(self.worse, 0)


@dataclass(frozen=True)
class Outcome:
    """The result of one run, as plain arrays."""

    status: Status
    reason: str
    """One sentence: why it ended, and for a failure what to change."""
    coordinates: dict[str, np.ndarray[Any, Any]] = field(default_factory=dict)
    """Values of the dimensions that occur in ``values``."""
    values: dict[str, np.ndarray[Any, Any]] = field(default_factory=dict)
    """Arrays by name; shapes follow ``ringsim.outputs.VARIABLES`` and ``coordinates``.  A failed
    run has what was recorded until then, NaN elsewhere."""
    cause: Cause = Cause.NONE
    states: dict[str, np.ndarray[Any, Any]] = field(default_factory=dict)
    """States from which a run can go on, as arrays of a file: ``state_time``, ..."""
    began: str = ""
    """The stored state that it went on from and what has changed since; empty of a whole run."""

    @property
    def fate(self) -> Fate:
        """What the antenna did."""
        return Fate(int(self.values.get("outcome", Fate.NONE)))
