"""What a report tells of the campaign beside its analysis: plain rows of text."""

import re
import shlex
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import xarray as xr

from ringsim.analysis.design import (
    LOST,
    NOT_RUN,
    REACHED,
    UNKNOWN,
    called,
    distribution_of,
    endings,
    inputs,
    paths_of,
)
from ringsim.analysis.worst import first_clause
from ringsim.sampling.distributions import law_text
from ringsim.tables import number_text, unit_text
from ringsim.variables import Cause

MOST_FAILURES = 100
"""Rows of the table of failures; the page says how many more there are."""
_SHOWN = ("title", "source", "execution", "seed", "solver", "identity", "date_created")
_PLACES = re.compile(
    r" and \d+ more|(?:(?:upper|lower) )?\d[\d.e+-]*(?:, )?|samples?|latches|latch"
)
"""What differs between antennas that ended alike: V-joints by name, numbers, and plurals."""
_MOST_NAMED = 20
"""Samples of a row that are named."""
Rows = list[list[str]]


def failures(
    campaign: xr.Dataset, folder: str, told: Mapping[int, Sequence[str]] | None = None
) -> tuple[Rows, int]:  # fmt: skip
    """Samples, ending with its cause, reason, command that repeats the first; how many rows are
    left out.

    Runs that lost their numbers, and sound ones in which the antenna fell short of its goal; a row
    for all that ended in the same way.  Antennas end in the same way that differ by places and
    numbers: the row has the words of the first.  No row of samples without a cause of which all it
    is ``told`` by sample why they ended.
    """
    told = {} if told is None else told
    words, goals = endings(campaign), (*REACHED, UNKNOWN, NOT_RUN)
    causes = {int(cause): cause.words for cause in Cause if cause}
    codes, reasons = campaign["cause"].values.tolist(), campaign["reason"].values.tolist()
    alike: dict[tuple[str, str, str], list[int]] = {}
    first: dict[tuple[str, str, str], str] = {}
    said: dict[tuple[str, str, str], set[str]] = {}
    for place, sample in enumerate(campaign["sample"].values.tolist()):
        if words[place] not in goals:
            how = str(words[place]), causes.get(int(codes[place]), ""), str(reasons[place])
            shape = how if how[0].startswith(LOST) else (*how[:2], _PLACES.sub("", how[2]))
            first.setdefault(shape, how[2])
            said.setdefault(shape, set()).add(how[2])
            alike.setdefault(shape, []).append(sample)
    rows = []
    why = dict(zip(campaign["sample"].values.tolist(), map(first_clause, reasons), strict=True))
    for shape, samples in sorted(alike.items(), key=lambda each: not each[0][0].startswith(LOST)):
        mark = "" if len(said[shape]) == 1 else f"sample {samples[0]}: "
        ending, cause, _ = shape
        if not cause and all(why[k] in told.get(k, ()) for k in samples):
            continue
        how_told = ending + f" ({cause})" * bool(cause), mark + first[shape]
        named = "sample " if len(samples) == 1 else "samples "
        named += ", ".join(map(str, samples[:_MOST_NAMED]))
        named += f" and {len(samples) - _MOST_NAMED} more" * (len(samples) > _MOST_NAMED)
        rows.append([named, *how_told, f"ringsim replay {shlex.quote(folder)} {samples[0]}"])
    return rows[:MOST_FAILURES], max(0, len(rows) - MOST_FAILURES)


def drawn(campaign: xr.Dataset) -> Rows:
    """Name, unit, places, distribution, the values that came out, and the scene's paths that take
    them: a row an input.
    """
    rows = []
    for name in inputs(campaign):
        variable = campaign[name]
        if variable.attrs.get("path") == "solver.error_bars":  # drawn by nobody
            continue
        law, values = law_text(distribution_of(variable)), variable.to_numpy()
        if values.dtype.kind in "OU":
            counts = Counter(values.ravel().astype(str).tolist()).most_common(6)
            extent = ", ".join(f"{word} ({n})" for word, n in counts)
        else:
            extent = " to ".join(number_text(end, 5) for end in (values.min(), values.max()))
        places = variable.shape[1] if variable.ndim > 1 else 1
        unit = unit_text(str(variable.attrs.get("units", "-")))
        paths = ", ".join(paths_of(variable))
        rows.append([called(variable), unit, str(places), law, extent, paths])
    return rows


def provenance(campaign: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Who computed it, when, with what."""
    for name, value in campaign.attrs.items():
        if (
            name in _SHOWN
            or name.endswith("_version")
            or name in ("history", "git_commit", "sources")
        ):
            yield name.replace("_", " "), str(value)
