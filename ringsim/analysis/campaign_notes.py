"""What a merged campaign says about its runs and their numerics, in lines for people."""

import re
import textwrap
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.design import (
    LOST,
    NOT_RUN,
    REACHED,
    UNKNOWN,
    endings_of,
    kinds_of_ends,
    learnt_lines,
)
from ringsim.analysis.intervals import good, used, worst_sample
from ringsim.analysis.worst import losses
from ringsim.outputs import OUTPUTS
from ringsim.outputs.balance import summary
from ringsim.tables import counted, known_to, readable, with_unit
from ringsim.variables import Variable

_NAMED = 6
"""Samples that a line names at most."""
_LONGEST = 200
"""Characters of a reason that a line shows."""


def notes(campaign: xr.Dataset) -> list[str]:
    """What the inputs rest on, what became of the antenna, the largest values, runs that were
    repeated, and remarks.
    """
    parts = (learnt_lines, outcome_lines, peak_lines, override_lines, restart_lines, remark_lines)
    return [line for part in parts for line in part(campaign)]


def outcome_lines(campaign: xr.Dataset) -> list[str]:
    """What became of the antenna, and which runs failed: a line an end, with the first reason."""
    reasons = campaign["reason"].to_numpy() if "reason" in campaign else None
    return ending_lines(
        campaign["outcome"].to_numpy(), campaign["status"].to_numpy(),
        lambda sample: "" if reasons is None else str(reasons[sample]),
    )  # fmt: skip


def ending_lines(
    fates: NDArray[Any], status: NDArray[Any], reason_of: Callable[[int], str]
) -> list[str]:
    """The same from codes of every sample and what finds the reason of one, "" if it is lost.

    Counts are of the samples that have run.
    """
    words, lines = endings_of(status, fates), list[str]()
    run = int(np.sum(words != NOT_RUN))
    for word in kinds_of_ends(words):
        own = np.flatnonzero(words == word)
        why = "" if word in (*REACHED, UNKNOWN) else reason_of(int(own[0]))
        if word.startswith(LOST):
            told = f", first sample {own[0]}"
        else:
            more = ", ..." if len(own) > _NAMED else ""
            told = f" (sample{'s' * (len(own) > 1)} {', '.join(map(str, own[:_NAMED]))}{more})"
        if why and len(own) > 1 and not word.startswith(LOST):
            why = f"sample {own[0]}: {why}"
        told += ": " * bool(why) + textwrap.shorten(why, _LONGEST, placeholder=" ...")
        told = "" if word in REACHED else told
        if word != UNKNOWN:
            lines.append(f"{word.removeprefix(LOST)}: {len(own)} of {run}{told}")
    return lines


_NUMBER = re.compile(r"\d[\d.]*(?:e[+-]?\d+)?")
_PLACES = re.compile(r"\b(upper|lower) \d+(?:, (?:(?:upper|lower) )?\d+)*(?: and \d+ more)?")


def remark_lines(campaign: xr.Dataset) -> list[str]:
    """Remarks that runs make on their own numbers behind their reason, alike but for numbers and
    places: how many samples make each, with the first one's words.
    """
    if "reason" not in campaign:
        return []
    found: dict[str, list[tuple[int, str]]] = {}
    held, reasons = good(campaign), campaign["reason"].to_numpy()
    for sample in np.flatnonzero(held).tolist():
        for remark in str(reasons[sample]).split("; ")[1:]:
            kind = _NUMBER.sub("#", _PLACES.sub("#", remark))
            found.setdefault(kind, []).append((sample, remark))
    every = int(held.sum())
    return [
        f"{_where(len(own), every)}, for example in sample {own[0][0]}: {own[0][1]}"
        for own in sorted(found.values(), key=len, reverse=True)
    ]


def _where(count: int, every: int) -> str:
    return f"in all {every} samples" if count == every > 1 else f"in {count} of {every} samples"


def override_lines(campaign: xr.Dataset) -> list[str]:
    """A line for each other setting with which samples were run that had failed before."""
    if "overrides" not in campaign:
        return []
    texts, status = campaign["overrides"].to_numpy(), campaign["status"].to_numpy()
    return [
        f"{len(own)} of {len(texts)} samples were run again with {text} (overrides): "
        f"{int((own == 0).sum())} ok"
        for text in sorted(set(texts) - {""})
        for own in [status[texts == text]]
    ]


def restart_lines(campaign: xr.Dataset) -> list[str]:
    """One line if samples were restarted with smaller steps (``restarts`` above 0), else none."""
    known = {"restarts", "steps", "total_steps"} <= set(campaign.data_vars)
    if not known or not (anew := int((campaign["restarts"] > 0).sum())):
        return []
    # Missing counts are negative.
    counted, every = (float(campaign[n].clip(min=0).sum()) for n in ("steps", "total_steps"))
    lost = 1.0 - counted / max(every, 1.0)
    return [
        f"{anew} of {campaign.sizes['sample']} samples were restarted with smaller steps "
        f"(restarts, step_used): {lost:.0%} of all {every:.0f} steps went to attempts that failed"
    ]


def peak_lines(campaign: xr.Dataset) -> list[str]:
    """The worst value of all samples that ended well, when and where, for outputs that tell it.

    Which end is the worst the output knows: margins and latch rates the least, loads the largest.

    Places have no names where samples differ in the ends at which the winches are.  Of outputs that
    can have an error bar the line says how large that is in this sample, or else in others.
    """
    spans = {}
    if "span_name" in campaign:
        names = campaign.span_name.transpose("plane", "span").values.tolist()
        spans = dict(zip(campaign.plane.values.tolist(), names, strict=True))
    sound, lines, unknown, mark = used(campaign), [], False, losses(campaign).mark
    for output in OUTPUTS:
        for variable in output.variables:
            if variable.summary is None or (sample := worst_sample(sound, variable)) < 0:
                continue
            worst = sound.sel(sample=sample)
            values = {str(n): each.values for n, each in worst.items() if not each.dims}
            if output().told_of(variable.name, values, spans):
                # Series tell which places are alike.
                values = {str(n): each.values for n, each in worst.variables.items()}
                number, *told = summary(values, spans)[variable.name].split()
                error = ""
                if variable.error_bar and "+-" not in told:
                    bar, error = _of_others(sound, variable)
                    unknown |= not error
                    number = known_to(number, readable(variable.units, bar)[0] * bar)
                said = " ".join([number, *told])
                lines.append(f"{variable.summary[0]} in sample {sample}: {said}{error}{mark}")
    if unknown:
        lines.append(
            "no sample has numerical error bars: set error_bars_every in the campaign file, or "
            "solver.error_bars = true for the scenes of the samples named here"
        )
    return lines


def _of_others(sound: xr.Dataset, variable: Variable) -> tuple[float, str]:
    """How large the numerical error of other samples' values is, and that in words; NaN and nothing
    if no sample tells.
    """
    if (name := f"{variable.name}_error") not in sound or not sound[name].notnull().any():
        return np.nan, ""
    stated = sound[name].dropna("sample")
    largest = float(stated.max())
    most = with_unit(f"{largest:.2g}", variable.units)
    others = counted(stated.size, "other sample")
    return largest, f"; largest error bar of {others}: {most}"
