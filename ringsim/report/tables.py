"""The tables of a report: plain rows of text, out of a merged campaign."""

import shlex
from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ringsim.analysis.brief import digits_of, worst_of
from ringsim.analysis.design import (
    NUMERICAL,
    called,
    distribution_of,
    endings,
    inputs,
    paths_of,
    scalars,
    values_of,
)
from ringsim.analysis.intervals import CHECKED, share_interval
from ringsim.analysis.tails import short_of, tail, unseen_lines
from ringsim.analysis.worst import losses, marked
from ringsim.refusal import show
from ringsim.tables import Table, interval_text, number_text
from ringsim.variables import GOALS, Cause

# The tables of a report: plain rows of text, out of a merged campaign.


MOST_FAILURES = 100
"""Rows of the table of failures; the page says how many more there are."""
_SHOWN = ("title", "source", "execution", "seed", "solver", "identity", "date_created")
_MOST_NAMED = 20
"""Samples of a row that are named."""
Rows = list[list[str]]


def number(value: float) -> str:
    """As many digits as one reads."""
    return f"{value:.5g}" if np.isfinite(value) else "-"


_MOMENTS = {
    "mean": "Mean", "standard_deviation": "Std. dev.", "quantile_05": "5 %", "median": "Median",
    "quantile_95": "95 %",
}  # fmt: skip


def statistics(campaign: xr.Dataset, analysis: xr.Dataset) -> Table:
    """A row a main number: estimates of the analysis with intervals, extremes, samples.

    Extremes alone where samples stand for no population: their mean would be that of the design.
    """
    rows, known = [], [name for name in scalars(campaign) if name in analysis]
    moments = _MOMENTS if any(np.isfinite(analysis[name]).sum() > 2 for name in known) else {}
    for name in known:
        says, found = campaign[name].attrs, analysis[name]
        ends, counts = analysis[f"{name}_interval"], analysis[f"{name}_samples"]
        least, most = (found.sel(statistic=s).item() for s in ("minimum", "maximum"))
        samples, values = values_of(campaign, name)
        fine, cells = digits_of(least, most), []
        for each in moments:
            low, high = ends.sel(statistic=each).values
            cells.append(number_text(found.sel(statistic=each).item(), fine))
            if np.isfinite(low) or np.isfinite(high):
                cells[-1] += f" ({interval_text(low, high, fine)})"
        for value in (least, most):
            first = samples[values == value][:1]
            more = "".join(f" ({sample}{_error_bar(campaign, name, sample)})" for sample in first)
            cells.append(number_text(value, fine) + more)
        used, lost, absent = (str(counts.sel(counted=c).item()) for c in _COUNTS)
        unit = str(says.get("units", "1"))
        cells.append(worst_of(analysis, name) if least < most else "-")
        rows.append([str(says.get("long_name", name)), unit, *cells, used, lost, absent])
    extremes = ("Least (sample)", "Largest (sample)", "Worst sample", "Used", "Lost", "No value")
    notes = (
        ["In brackets intervals of 95 %"] if any("(" in c for r in rows for c in r[2:-6]) else []
    )
    if any("±" in c for r in rows for c in r[-6:-4]):
        notes.append("± what the named sample states as its numerical error")
    return marked(Table(("Number", "Unit", *moments.values(), *extremes), rows, notes), analysis)


def _error_bar(campaign: xr.Dataset, name: str, sample: int) -> str:
    """The numerical error that a sample states of an output; empty if it states none."""
    if (bars := f"{name}_error") not in campaign:
        return ""
    own = float(campaign[bars].sel(sample=sample))
    return f", ± {own:.2g}" if np.isfinite(own) else ""


_COUNTS = ("used", "lost", "without_value")


def failures(campaign: xr.Dataset, folder: str) -> tuple[Rows, int]:
    """Samples, ending, cause, reason, command that repeats the first; how many rows are left out.

    Runs that lost their numbers, and sound ones in which the antenna fell short of its goal; a row
    for all that ended in the same way.
    """
    words, goals = endings(campaign), [goal.word for goal in GOALS] + ["ok", "not run"]
    causes = {int(cause): cause.word.replace("_", " ") for cause in Cause if cause}
    codes, reasons = campaign["cause"].values.tolist(), campaign["reason"].values.tolist()
    alike: dict[tuple[str, str, str], list[int]] = {}
    for place, sample in enumerate(campaign["sample"].values.tolist()):
        if words[place] not in goals:
            how = str(words[place]), causes.get(int(codes[place]), ""), str(reasons[place])
            alike.setdefault(how, []).append(sample)
    rows = []
    for how, samples in sorted(alike.items(), key=lambda each: not each[0][0].startswith("failed")):
        named = ", ".join(map(str, samples[:_MOST_NAMED]))
        named += f" and {len(samples) - _MOST_NAMED} more" * (len(samples) > _MOST_NAMED)
        rows.append([named, *how, f"ringsim replay {shlex.quote(folder)} {samples[0]}"])
    return rows[:MOST_FAILURES], max(0, len(rows) - MOST_FAILURES)


def drawn(campaign: xr.Dataset) -> Rows:
    """Name, unit, places, distribution, the values that came out, and the scene's paths that take
    them: a row an input.
    """
    rows = []
    for name in inputs(campaign):
        variable = campaign[name]
        says, values = distribution_of(variable), variable.to_numpy()
        says.pop("shared", None)
        says.pop("each_section", None)
        kind = says.pop("kind", says.pop("text", ""))
        law = ", ".join([kind, *(f"{key} {_short(value)}" for key, value in says.items())])
        if values.dtype.kind in "OU":
            counts = Counter(values.ravel().astype(str).tolist()).most_common(6)
            extent = ", ".join(f"{word} ({n})" for word, n in counts)
        else:
            extent = f"{number(float(values.min()))} to {number(float(values.max()))}"
        places = variable.shape[1] if variable.ndim > 1 else 1
        unit = str(variable.attrs.get("units", "-"))
        paths = ", ".join(paths_of(variable))
        rows.append([called(variable), unit, str(places), law, extent, paths])
    return rows


def _short(value: Any) -> str:
    return number(value) if isinstance(value, float) else show(value)


def truth(campaign: xr.Dataset) -> Rows:
    """What, samples, typical and largest size: errors of balance, error bars, second engines."""
    rows: Rows = []
    for name in NUMERICAL:
        if name in campaign:
            samples, values = values_of(campaign, name)
            rows += _row(campaign[name], "", samples, values, np.median)
    for name in scalars(campaign):
        for suffix, words in (("_error", ""), (CHECKED, "difference of the engines: ")):
            if (other := name + suffix) not in campaign:
                continue
            samples, values = values_of(campaign, other)
            if suffix == CHECKED:
                values = np.abs(values - campaign[name].sel(sample=samples).to_numpy())
                samples, values = samples[np.isfinite(values)], values[np.isfinite(values)]
                rows += _row(campaign[name], words, samples, values, _rms)
            else:
                rows += _row(campaign[other], words, samples, values, _rms)
    mark = losses(campaign).mark
    return [[f"{what}{mark}", *others] for what, *others in rows]


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _row(variable: xr.DataArray, words: str, samples: Any, values: Any, typical: Any) -> Rows:
    if not len(values):
        return []
    units, most = str(variable.attrs.get("units", "1")), int(values.argmax())
    what = words + str(variable.attrs.get("long_name", variable.name))
    kind = "median" if typical is np.median else "rms"
    return [[
        what, units, str(len(values)), f"{float(typical(values)):.2g} ({kind})",
        f"{values[most]:.2g} (sample {samples[most]})",
    ]]  # fmt: skip


def provenance(campaign: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Who computed it, when, with what."""
    for name, value in campaign.attrs.items():
        if (
            name in _SHOWN
            or name.endswith("_version")
            or name in ("history", "git_commit", "sources")
        ):
            yield name.replace("_", " "), str(value)


# The rare event of a campaign of subset simulation, for a report.


class RareEvent(NamedTuple):
    """A table of what was found, and what it leaves out."""

    rows: Rows
    notes: list[str]


def rare_event(campaign: xr.Dataset) -> RareEvent | None:
    """Probability with its interval, how sure it is and why; None for any other design."""
    if not (found := xr.Dataset(tail(campaign))):
        return None
    event = str(found["tail_probability"].attrs["event"])
    runs, lost = campaign.sizes["sample"], int(found["tail_lost"])
    replicates, levels = found.sizes["tail_replicate"], int(found["tail_levels"].max())
    rows = [["event", event]]
    if not int(found["tail_ended"]):
        rows += [["runs so far", str(runs)]]
        return RareEvent(rows, ["Not all levels have run: there is no probability yet"])
    low, high = found["tail_probability_interval"].to_numpy()
    each = ", ".join(f"{p:.2g}" for p in found["tail_replicate_probability"].to_numpy())
    by_chains = f"{float(found['tail_variation_of_chains']):.2g} by the chains alone"
    scatter = f"{float(found['tail_variation']):.2g} by the replicates, "
    if why := short_of(found):
        rows += [["probability", why[0]]]
    else:
        rows += [
            ["probability", f"{float(found['tail_probability']):.3g}"],
            ["95 % interval, of the parts that chains found", f"{low:.2g} to {high:.2g}"],
            ["coefficient of variation", f"{scatter if replicates > 1 else ''}{by_chains}"],
            ["by each replicate", each],
        ]
    rows += [
        ["levels", f"{levels} at most, in {replicates} replicates"],
        ["runs", f"{runs}, {lost} lost and taken as no event"],
    ]
    notes = [each[0].upper() + each[1:] for each in why[1:] or unseen_lines(found)]
    if why:
        notes.append("Raise samples or most_levels, so that every replicate reaches the event")
    if checked := int(found["tail_checked"]):
        confirmed = int(found["tail_confirmed"])
        low, high = share_interval(confirmed, checked)
        rows.append([
            "in the event by the full engine, too",
            f"{confirmed} of {checked} repeated runs (95 %: {low:.2g} to {high:.2g} of all)",
        ])  # fmt: skip
    if outside := int(found["tail_checked_outside"]):
        rows.append([
            "in the event by the full engine alone",
            f"{int(found['tail_missed'])} of the {outside} nearest runs outside it",
        ])  # fmt: skip
    if (checked or outside) and not why:
        apart = found["tail_difference"]
        farther, nearer = found["tail_probability_moved"].to_numpy()
        rows.append([
            f"probability with the limit moved by {float(apart):.2g} {apart.attrs['units']}, what "
            "the engines differ by",
            f"{farther:.3g} to {nearer:.3g}",
        ])  # fmt: skip
    return RareEvent(rows, notes)
