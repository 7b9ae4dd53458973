"""Energies over a run, how it ended, and its error bars."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ringsim.outputs.family import (
    OUTPUTS,
    VARIABLES,
    Array,
    ErrorBar,
    Output,
    Reading,
    Run,
    Series,
    SpanNames,
    Values,
    Variable,
)
from ringsim.scene import Scene
from ringsim.stepping.instant import exchanged
from ringsim.tables import known_to, readable, unit_text, without_power
from ringsim.variables import TIMINGS, Cause, Fate, Outcome, Status

# Energies over time, and what their balance lacks.


class EnergyBalance(Output):
    """Kinetic and elastic energy, work of loads and winches, what was lost, and the imbalance."""

    late = True
    rank = 60
    of_antenna = False
    variables = (
        Variable("kinetic_energy", ("time",), "J", "kinetic energy"),
        Variable(
            "elastic_energy", ("time",), "J",
            "elastic energy of rods, springs, net, stops and cables",
        ),
        Variable("work", ("time",), "J", "work done on the structure by forces and winches"),
        Variable("dissipation", ("time",), "J", "energy lost in joints, dampers and stops"),
        Variable(
            "energy_error", (), "1", "largest energy imbalance over the largest energy exchanged",
            summary=("energy error", "10.1e"), worse="larger",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """In the order of the variables, and what winches have put in, J, shape (5,)."""
        return np.stack(now.energies, axis=-1)

    def reduce(self, run: Run, series: Series) -> Values:
        """Each interpolated by itself: the losses may be unknown (NaN) where the others are not."""
        kinetic, elastic, work, lost, wound = series.values.T
        # What a fault takes at the start is not in the first energies any more.
        balance = kinetic - kinetic[0] + elastic - elastic[0] + lost - lost[0] - work
        # Where nothing moves, both are round-off: the guard takes no less for what was exchanged.
        found = exchanged(np.array([kinetic, elastic, work - wound, wound]).T)
        scale = max(found, run.slight, 1e-300)
        names = [variable.name for variable in self.variables]
        shown = [*series.on_grid()[:4], np.abs(balance).max() / scale]
        return dict(zip(names, shown, strict=True))


# How a run ended and why, as codes.


class Ending(Output):
    """Status and cause, which stand in every ``Outcome``, and what the antenna did."""

    rank = 80
    variables = (
        Variable("status", (), "1", "whether the results of the run are valid", "i1", flags=Status),
        Variable("cause", (), "1", "why the results are not valid", "i1", flags=Cause),
        Variable("outcome", (), "1", "what the antenna did", "i1", flags=Fate),
    )

    def reduce(self, run: Run, series: Series) -> Values:
        """Nothing: the engine knows them."""
        return {}


# Which number of a run tells the largest or the least of a variable that has many values.


SENSES = {"largest": "largest_of", "least": "least_of"}


def instead_of(name: str, *senses: str) -> str:
    """What to name in place of a variable with a value for each place or time, in words: the number
    that tells its largest or its least, whichever of ``SENSES`` decides, by default both.

    A limit from above is kept to by all values where the largest keeps to it, one from below where
    the least does; the other number would be far from every limit.
    """
    told, lacking = list[str](), list[str]()
    for sense in senses or SENSES:
        found = [n for n, v in VARIABLES.items() if getattr(v, SENSES[sense]) == name]
        if found:
            told.append(f"its {sense}, {found[0]}")
        else:
            lacking.append(sense)
    words = f"{name} has a value for each {' and '.join(VARIABLES[name].dims)}: use "
    if told:
        return words + " or ".join(told)
    near = [n for n in (f"{name}_joints", f"total_{name}") if n in VARIABLES]
    other = f"; {near[0]} is another number of it" if near else ""
    return f"{words}a number; no output tells its {' or its '.join(lacking)}{other}"


# The main numbers of a run in words.


_IF_ANY = ("longest_slack",)
"""Numbers that are told if they are above zero only."""


def summary(values: Values, span_names: SpanNames) -> dict[str, str]:
    """What is told of each main number that is known, by variable: how much, when and where."""
    found = {}
    for output in OUTPUTS:
        for variable in output.variables:
            if variable.summary is None:
                continue
            number = np.asarray(values.get(variable.name, np.nan)).item()
            if not np.isfinite(number) or (not number and variable.name in _IF_ANY):
                continue
            # Whole numbers of which some are missing come as floats out of files.
            number = int(number) if variable.dtype.startswith("i") else number
            factor, unit = readable(variable.units, number)
            number = number if factor == 1.0 else factor * number
            bar = factor * np.asarray(values.get(f"{variable.name}_error", np.nan)).item()
            text = f"{number:{variable.summary[1]}}"
            if not number and variable.largest_of:  # at no place and no time
                found[variable.name] = f"{'0':>{len(text)}} {unit_text(unit)}".rstrip()
                continue
            text = without_power(text, number).strip().rjust(len(text))
            if 0.0 < bar < math.inf:  # all digits that its error leaves it, and none behind them
                whole = math.floor(math.log10(abs(number))) + 1 if number else 1
                known = f"{number:#.{max(_MOST_DIGITS, whole)}g}".removesuffix(".")
                text = known_to(known, bar, exact=number).rjust(len(text))
            text = f"{text} {unit_text(unit)}".rstrip()
            if np.isfinite(bar):  # samples of a campaign need not have one
                text += f" +- {bar:.2g}"
            text = f"{text} {output().told_of(variable.name, values, span_names)}".rstrip()
            series = values.get(variable.largest_of, ()) if output.limit else ()
            # A limit holds for the whole run, a peak may count up to the last lock. By how much it
            # is larger the series does not say: what ends a run counts all steps.
            if np.size(series) and exceeded(number, factor * float(np.nanmax(series))):
                text += "; more than that after the last lock"
            found[variable.name] = text
    return found


_MOST_DIGITS = 6
"""At most, before the point or behind it, of a number with an error bar."""


def exceeded(peak: float, later: float) -> bool:
    """Whether a series is larger than its peak: not by the digits alone that files leave it."""
    return later > peak * (1.0 + 1e-6)


# Numerical error of a run, estimated from a second run with half the steps and twice the elements.
#
# Integrator and elements are of second order: such a run has a quarter of the error, so that the
# two are apart by three quarters of it (Richardson).  A finer run shows the error itself, a coarser
# one only how errors grow: it says little of a vibration that it does not resolve.  Each output
# states the factors of its bar (``ErrorBar``); docs/evidence/accuracy.md tells what they cover.


OF_DIFFERENCE = 4.0 / 3.0
"""Error over the difference of two runs, of which the second has a quarter of it."""
_MOST_ELEMENTS = 64
"""Upper bound of ``rods.elements``."""


def with_bars(outcome: Outcome, scene: Scene, solve: Callable[[Scene], Outcome]) -> Outcome:
    """The outcome of a scene, run with its own settings, with error bars, or why it has none."""
    finer = solve(refined(scene))
    # Times count from the beginning: those of the last run hold for both.
    outcome.values.update({n: finer.values[n] for n in TIMINGS if n in finer.values})
    if bars := error_bars(outcome, finer):
        outcome.values.update(bars)
        return outcome
    ended = f"ended as {finer.status.word}" if finer.status.failed else "locked other V-joints"
    why = f"no error bars, since the run with half the steps {ended}: {finer.reason}"
    return replace(outcome, reason=f"{outcome.reason}; {why}")


def refined(scene: Scene) -> Scene:
    """A scene with half the steps, twice the elements and a quarter of Newton's tolerance."""
    solver = scene.solver.scaled(0.5)
    solver = solver.model_copy(update={"newton_tolerance": solver.newton_tolerance / 4.0})
    elements = min(2 * scene.rods.elements, _MOST_ELEMENTS)
    rods = scene.rods.model_copy(update={"elements": elements})
    return scene.model_copy(update={"solver": solver, "rods": rods})


def error_bars(run: Outcome, finer: Outcome) -> dict[str, Array]:
    """Error bars of the main results of a run, whatever the antenna did in it.

    Parameters
    ----------
    run, finer
        The run that counts, and that of the ``refined`` scene.

    Returns
    -------
    dict
        ``NAME_error`` in the unit of NAME, of a function of time alone at every output time;
        NaN where the result itself is.  Empty if one of the runs failed, or if other V-joints
        locked in the other: then the steps decide what the antenna does, and no bar holds.
    """
    if run.status.failed or finer.status.failed or not _alike(run, finer):
        return {}
    return {f"{name}_error": bar(name, apart) for name, apart in differences(run, finer).items()}


def rules() -> dict[str, ErrorBar]:
    """How the error bars of all variables that have one are made."""
    return {name: v.error_bar for name, v in VARIABLES.items() if v.error_bar is not None}


def differences(one: Outcome, other: Outcome) -> dict[str, Array]:
    """Differences of two runs of a scene in what has an error bar, as far as both have it.

    The largest difference of all joints and output times; of a function of time alone the largest
    up to each output time, shape (time,); of the largest of many places at least the root mean
    square of theirs, those of a series by its largest size at each place.
    """
    apart: dict[str, Array] = {}
    for name, rule in rules().items():
        if name in one.values:
            first, second = one.values[name], other.values[name]
            found = largest(name, np.abs(first - second))
            if np.isfinite(found).all() and rule.of in one.values.keys() & other.values.keys():
                places = _at_places(rule.of, one) - _at_places(rule.of, other)
                places = places[np.isfinite(places)]
                found = np.sqrt(np.fmax(found**2, np.mean(places**2))) if places.size else found
            apart[name] = np.where(np.isfinite(first), found, np.nan) if found.ndim else found
    return apart


def _at_places(name: str, run: Outcome) -> Array:
    """Values of a result, of a series at many places the largest size at each."""
    values, dims = np.asarray(run.values[name]), VARIABLES[name].dims
    if "time" not in dims or len(dims) == 1:
        return values
    return np.asarray(np.fmax.reduce(np.abs(values), dims.index("time")))


def largest(name: str, values: Array) -> Array:
    """Value of a result, or the largest of its series; of one over time up to each time."""
    over_time = VARIABLES[name].dims == ("time",)
    return np.asarray(np.fmax.accumulate(values) if over_time else np.fmax.reduce(values, None))


def bar(name: str, apart: Array | float) -> Array:
    """Error bar of a result from the difference of two runs, in its unit."""
    return np.asarray(rules()[name].safety * OF_DIFFERENCE * apart)


def _alike(one: Outcome, other: Outcome) -> bool:
    """Whether the same V-joints have locked in both runs."""
    first, second = (np.isfinite(run.values.get("lock_time", 0.0)) for run in (one, other))
    return bool(np.array_equal(first, second))
