"""What a merged campaign says about its runs and their numerics, in lines for people."""

from __future__ import annotations

import json
import re
import textwrap
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis import derived
from ringsim.analysis.design import (
    LOST,
    NOT_RUN,
    REACHED,
    UNKNOWN,
    blocks_of,
    by_path,
    drawn,
    endings_of,
    kinds_of_ends,
    learnt_lines,
)
from ringsim.analysis.indices import UNLIKELY, dependence
from ringsim.analysis.intervals import (
    CHECKED,
    Mask,
    good,
    lost,
    numbers,
    quantities,
    ran,
    used,
    worst_sample,
)
from ringsim.analysis.requirements import MARGINS, OUTCOME
from ringsim.analysis.tails import subset_simulation
from ringsim.outputs import OUTPUTS
from ringsim.outputs.balance import summary
from ringsim.outputs.base import DOUBT, UNCERTAIN, finest, may_be_off, without_doubts
from ringsim.outputs.family import Array
from ringsim.outputs.motors import left_by_winches
from ringsim.overrides import flat
from ringsim.tables import (
    Table,
    chance_text,
    counted,
    known_to,
    number_text,
    readable,
    thousandths,
    with_unit,
)
from ringsim.variables import AT_REST, GO_ON, Fate, Variable

if TYPE_CHECKING:
    import xarray as xr

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
    if OUTCOME not in campaign:  # the file leaves it out
        return []
    reasons = campaign["reason"].to_numpy() if "reason" in campaign else None
    fates, status, samples = (campaign[name].to_numpy() for name in (OUTCOME, "status", "sample"))
    return ending_lines(
        fates, status, samples, lambda place: "" if reasons is None else str(reasons[place]),
        opened(campaign) if "deployment_time" in campaign else None,
    )  # fmt: skip


def opened(campaign: xr.Dataset) -> Mask:
    """Which antennas have opened, however they ended: all V-joints at 180 deg, no latch missed."""
    caught, come = (numbers(campaign, f"{name}_joints") for name in ("latched", "locked"))
    return np.asarray(np.isfinite(numbers(campaign, "deployment_time")) & ~(caught < come))


def ending_lines(
    fates: NDArray[Any], status: NDArray[Any], samples: NDArray[Any],
    reason_of: Callable[[int], str], opened: NDArray[Any] | None = None,
) -> list[str]:  # fmt: skip
    """The same from codes and numbers of all samples and what finds the reason at a place, "" if it
    is lost; and from which have ``opened``, where that is known, since an overloaded ring may have.

    Counts are of the samples that have run.
    """
    words, lines = endings_of(status, fates), list[str]()
    run = int(np.sum(words != NOT_RUN))
    for word in kinds_of_ends(words):
        own = np.flatnonzero(words == word)
        called = samples[own].tolist()
        why = "" if word in (*REACHED, UNKNOWN) else without_doubts(reason_of(int(own[0])))
        if word.startswith(LOST):
            told = f", first sample {called[0]}"
        else:
            more = ", ..." if len(own) > _NAMED else ""
            told = f" (sample{'s' * (len(own) > 1)} {', '.join(map(str, called[:_NAMED]))}{more})"
        if why and len(own) > 1 and not word.startswith(LOST):
            why = f"sample {called[0]}: {why}"
        told += ": " * bool(why) + textwrap.shorten(why, _LONGEST, placeholder=" ...")
        told = "" if word in REACHED else told
        if opened is not None and word in [each.words for each in GO_ON] and opened[own].any():
            told = f", {int(opened[own].sum())} of them opened all the same{told}"
        if word != UNKNOWN:
            lines.append(f"{word.removeprefix(LOST)}: {len(own)} of {run}{told}")
    return lines


_NUMBER = re.compile(r"-?\d[\d.]*(?:e[+-]?\d+)?")
_PLACES = re.compile(r"\b(upper|lower) \d+(?:, (?:(?:upper|lower) )?\d+)*(?: and \d+ more)?")


def remark_lines(campaign: xr.Dataset) -> list[str]:
    """Remarks that runs make on their own numbers behind their reason, alike but for numbers and
    places: how many samples make each, be it as their reason, with the first one's words.  What may
    be off ``off_note`` tells, and ``late_line`` drive margins of winches that start late.
    """
    if "reason" not in campaign:
        return []
    found, first = dict[str, dict[int, str]](), dict[str, dict[int, str]]()
    held, both = good(campaign), (campaign[name].to_numpy() for name in ("sample", "reason"))
    for sample, told_of in zip(*(each[held].tolist() for each in both), strict=True):
        reason, *remarks = str(told_of).split("; ")
        first.setdefault(_kind(reason), {})[sample] = reason
        for remark in remarks:
            if may_be_off(f"; {remark}")[0] or remark.startswith(_LATE):
                continue
            remark = remark.replace("start 1: ", "first attempt, not used: ", 1)
            if remark.count(")") > remark.count("("):  # which the words before it have opened
                remark = remark.removesuffix(")")
            found.setdefault(_kind(remark), {}).setdefault(sample, remark)
    whole = [sorted((own | first.get(kind, {})).items()) for kind, own in found.items()]
    return [
        f"in {_of(len(own), int(held.sum()))}, {'for example in ' * (len(own) > 1)}sample "
        f"{own[0][0]}: {own[0][1]}"
        for own in sorted(whole, key=len, reverse=True)
    ]


def _kind(remark: str) -> str:
    """What is alike of remarks that differ in numbers and places."""
    alike = _NUMBER.sub("#", _PLACES.sub("#", remark))
    return alike.replace(" the # latches that were met", " # latches")


_LATE = "the least drive margin is that of "


def late_line(campaign: xr.Dataset) -> str:
    """In how many samples the least drive margin is that of a time before the last winch starts,
    and the least of all samples from that start on; empty if in none.
    """
    least, later = (numbers(campaign, f"least_drive_margin{end}") for end in ("", "_started"))
    held = good(campaign) & np.isfinite(least)
    if not (late := held & (later > least)).any():
        return ""
    which = _of(int(late.sum()), int(held.sum()))
    line = f"in {which} the least drive margin is that of a time before the last winch starts"
    k = int(np.argmin(np.where(held, later, np.inf)))
    angle = numbers(campaign, "least_drive_margin_started_angle")[k]
    where = f"sample {int(campaign['sample'][k])}, at {angle:.4g} deg"
    return f"{line}; counted from then on the least of all samples is {later[k]:.4g} ({where})"


_STARTED = "_started"


def plane_margin(campaign: xr.Dataset) -> str:
    """The output with the margin of one plane's own cable, where its least is less than that of
    both together, or more samples have less than none; else empty.  From the start of the last
    winch on where one starts late: before it one plane has no drive.
    """
    before, later = (numbers(campaign, f"least_plane_margin{end}") for end in ("", _STARTED))
    late = _STARTED * bool((later > before)[good(campaign)].any())
    both, own = (numbers(campaign, f"least_{of}_margin{late}") for of in ("drive", "plane"))
    held = good(campaign) & np.isfinite(both) & np.isfinite(own)
    # Planes of a ring that sags a little are no news.
    if not held.any():
        return ""
    own, both = own[held], both[held]
    if not own.min() < both.min() - 5e-3 and not (own < -5e-3).sum() > (both < 0.0).sum():
        return ""
    return f"least_plane_margin{late}"


def plane_line(campaign: xr.Dataset) -> str:
    """The least ``plane_margin`` in words; empty if there is none to tell."""
    if not (name := plane_margin(campaign)):
        return ""
    own = np.where(good(campaign), numbers(campaign, name), np.nan)
    k, short = int(np.nanargmin(own)), int((own < 0.0).sum())
    word = f"NOT enough in {_of(short, int(np.isfinite(own).sum()))}" if short else "enough"
    word += " for a rigid ring" * (not short and bool(rigid_line(campaign)))
    when = " from the start of the last winch on" * name.endswith(_STARTED)
    return (
        f"the least drive margin of one plane's own cable{when} is {thousandths(own[k])} "
        f"(sample {int(campaign['sample'][k])}): {word}"
    )


def rigid_line(campaign: xr.Dataset) -> str:
    """In how many samples a driven ring came to rest with a margin that is enough; or empty."""
    margin = numbers(campaign, "least_drive_margin")
    known = good(campaign) & np.isfinite(margin)
    if OUTCOME not in campaign or not known.any():
        return ""
    places = np.flatnonzero(known & (margin >= 0.0) & np.isin(campaign[OUTCOME], AT_REST))
    if "drive_margin" in campaign:
        courses = campaign["drive_margin"].isel(sample=places).transpose("sample", "time")
        places = places[[not left_by_winches(course) for course in courses.to_numpy()]]
    if not len(places):
        return ""
    return (
        f"in {_of(len(places), int(known.sum()))} the least drive margin is enough and the ring "
        "came to rest before it was deployed: margins are those of a rigid ring, which opens as "
        "one; what sections behind a fault do, runs alone tell"
    )


def records_line(campaign: xr.Dataset, names: Collection[str] = ()) -> str:
    """Which of a campaign's own outputs, by default of all, are of records alone, and how far these
    are apart; empty if none is.
    """
    found = derived.of_records(derived.known_from(campaign.attrs))
    found = [name for name in found if not names or name in names]
    if not found:
        return ""
    scene = flat(tomllib.loads(str(campaign.attrs.get("scene", ""))))
    every = f" every {scene['record.interval']:g} s" * ("record.interval" in scene)
    verb = "is" if len(found) == 1 else "are"
    named = " and ".join(filter(None, [", ".join(found[:-1]), found[-1]]))
    return f"{named} {verb} of records{every}: what happens between two is missed"


def _of(count: int, every: int) -> str:
    return f"all {every} samples" if count == every > 1 else f"{count} of {every} samples"


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
    lost, run = 1.0 - counted / max(every, 1.0), int((campaign["restarts"] >= 0).sum())
    return [
        f"{anew} of {run} samples were restarted with smaller steps "
        f"(restarts, step_used): {lost:.0%} of all {every:.0f} steps went to attempts that failed"
    ]


def peak_lines(campaign: xr.Dataset) -> list[str]:
    """The worst value of all samples that ended well, when and where, for outputs that tell it.

    Which end is the worst the output knows: margins and latch rates the least, loads the largest.

    Places have no names where samples differ in the ends at which the winches are.  Of outputs that
    can have an error bar the line says how large that is in this sample, or else in others.  Behind
    them stands what may be off.
    """
    spans = {}
    if "span_name" in campaign:
        names = campaign.span_name.transpose("plane", "span").values.tolist()
        spans = dict(zip(campaign.plane.values.tolist(), names, strict=True))
    says = attributes(campaign)
    sound, lines, unknown, mark = used(campaign), [], False, MARK * bool(says[NOTE])
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
                error, raw = "", float(values[variable.name])
                raw *= readable(variable.units, raw)[0]
                if variable.error_bar and "+-" not in told:
                    bar, error = _of_others(sound, variable)
                    unknown |= not error
                    if not error:  # more digits would say that they are known
                        number = number_text(raw, 4)
                    number = known_to(number, readable(variable.units, bar)[0] * bar, exact=raw)
                said = " ".join([number, *told])
                error += _checked(worst, variable)
                name = variable.summary[0] + DOUBT * (f'"{variable.name}"' in says.get(OFF, ""))
                lines.append(f"{name} in sample {sample}: {said}{error}{mark}")
    lines += filter(None, [plane_line(sound), rigid_line(sound)])
    if unknown:
        lines.append(
            "no sample has numerical error bars: set error_bars_every in the campaign file, or run "
            "a sample named here again: ringsim replay DIR SAMPLE --scene > one.toml, then ringsim "
            "run one.toml --set solver.error_bars=true"
        )
    return [*lines, *filter(None, [off_note(says)])]


def _checked(worst: xr.Dataset, variable: Variable) -> str:
    """What the full engine has in a sample instead, where that is another number."""
    own, other = (float(worst.get(f"{variable.name}{end}", np.nan)) for end in ("", CHECKED))
    if not abs(other - own) > _ANOTHER * abs(own):
        return ""
    return f"; {with_unit(number_text(other, 3), variable.units)} by the full engine"


_ANOTHER = 0.05
"""Share of a worst value by which the full engine's is beside it: more than any rounding."""


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


# Lost runs that bend what the others tell: which lines they bend, and the mark on these.
#
# Runs that are lost where inputs have certain values leave another population behind: its mean,
# quantiles and shares are not those of the antenna, and their intervals tell nothing of that.


MARK = " *"
"""Stands behind what lost runs bend."""
_OF_LOSSES = "failed"
"""How names of groups and outcomes begin that are those of lost runs: all that ran tell them."""
NOTE = "lost_runs"
"""Attribute that says why, of an analysis and of each of its variables that is bent."""


@dataclass(frozen=True)
class Losses:
    """The lost runs of a campaign, and whether they go with inputs."""

    count: int
    ran: int
    chance: float
    """Probability that runs lost at random go with inputs as much; NaN if none is lost."""

    @property
    def note(self) -> str:
        """Why statistics are bent, in words; empty if they are not, as far as one can tell."""
        if not self.chance < UNLIKELY:
            return ""
        return (
            f"{self.count} of {self.ran} runs failed, and whether one fails depends on the "
            f"inputs ({chance_text(self.chance)}): numbers marked{MARK} are from the other "
            f"{self.ran - self.count} alone, which are not representative, and may be far off "
            "(run the failed ones again: ringsim campaign --retry-failed, or narrow the inputs)"
        )

    @property
    def mark(self) -> str:
        """What stands behind a line that they bend; empty if they do not."""
        return MARK if self.note else ""


def losses(campaign: xr.Dataset) -> Losses:
    """The lost runs of a merged campaign; subset simulation takes them as no event, and says so."""
    run, gone = ran(campaign), lost(campaign)
    count, chance = int(gone.sum()), np.nan
    if count and subset_simulation(campaign.attrs) is None:
        blocks, block = blocks_of(campaign), None
        if blocks is not None:
            block = np.unique(np.arange(len(run))[run] // blocks.size, return_inverse=True)[1]
        chance = dependence(gone[run], drawn(campaign).values[run], block)
    return Losses(count, int(run.sum()), chance)


def marked(table: Table, analysis: xr.Dataset, column: int = 0, safe: Sequence[str] = ()) -> Table:
    """A table with the mark in one column of each row, if an analysis says that its statistics are
    bent; not in rows about lost runs and those that begin with what is ``safe``.
    """
    if not analysis.attrs.get(NOTE):
        return table
    rows, own = [], False
    for row in table.rows:
        # A blank repeats the one above.
        if row[0]:  # an output of the user's own may begin so, too
            own = row[0].startswith((_OF_LOSSES, *safe)) and row[0].split()[0] not in quantities()
        mark = "" if own else MARK
        rows.append((*row[:column], f"{row[column]}{mark}", *row[column + 1 :]))
    return table._replace(rows=rows)


# Outputs that runs call uncertain themselves, and the mark on them.


OFF = "may_be_off"
"""Attribute of an analysis with what ``off_note`` tells, as JSON."""
LATE, PLANE, RIGID = "late_winches", "plane_margin", "rigid_margin"
"""Attributes with ``late_line``, ``plane_line`` and ``rigid_line``."""
RECORDED = "of_records"
"""Attribute of an analysis with ``records_line``."""


def doubtful(campaign: xr.Dataset) -> tuple[dict[str, Mask], dict[str, str]]:
    """By output the samples in which it may be off, by what their runs say; and by what makes them
    so what cures all of them.
    """
    held, found, cures = good(campaign), dict[str, Mask](), dict[str, str]()
    reasons = campaign["reason"].to_numpy() if "reason" in campaign else np.full(len(held), "")
    for place in np.flatnonzero(held).tolist():
        names, told = may_be_off(str(reasons[place]))
        for name in names:
            found.setdefault(name, np.zeros(len(held), dtype=bool))[place] = True
        cures |= {since: finest(cure, cures.get(since, cure)) for since, cure in told.items()}
    return found, cures


def _said(campaign: xr.Dataset) -> Iterator[tuple[int, re.Match[str]]]:
    """What samples say of latches of which it is uncertain whether they catch, by their places."""
    reasons = campaign["reason"].to_numpy() if "reason" in campaign else ()
    for place in np.flatnonzero(good(campaign)).tolist() if len(reasons) else ():
        if said := _LATCHES.search(str(reasons[place])):
            yield place, said


_ENOUGH = 3
"""Error bars of samples that ended alike from which on the others of them take these alone."""


def bars_of(campaign: xr.Dataset, name: str) -> tuple[Array, float]:
    """The error bar of an output in each sample; those without one take the root mean square of
    those that ended alike (of all, if that is larger, where fewer than three have one); and what
    they take in the median.  NaN if there is none.
    """
    bars = np.where(good(campaign), numbers(campaign, f"{name}_error"), np.nan)
    known = np.isfinite(bars)
    if not known.any():
        return bars, np.nan
    every = np.sqrt(np.mean(bars[known] ** 2))
    found = np.where(known, bars, every)
    ends = campaign[OUTCOME].to_numpy() if OUTCOME in campaign else np.zeros(len(bars))
    for end in np.unique(ends[known]):  # a ring that stalls has other errors than one that opens
        alike = ends == end
        own = bars[alike & known]
        size = np.sqrt(np.mean(own**2))
        found[alike & ~known] = size if len(own) >= _ENOUGH else max(size, every)
    rest = good(campaign) & ~known
    return found, float(np.median(found[rest] if rest.any() else found[known]))


def latches_in_doubt(campaign: xr.Dataset) -> tuple[Array, Array]:
    """How many latches of each sample may have missed of those that caught, and the reverse: their
    rate is closer to the least at which they catch than its numerical error, or the run says so.
    """
    slow = _slow(campaign)
    if "latched" not in campaign:
        either = np.asarray(slow.sum(axis=(1, 2)), dtype=float)
        for sample, said in _said(campaign):
            either[sample] = max(either[sample], said[1].count(",") + 1 + int(said[2] or 0))
        return either, either
    gone = campaign["latched"].to_numpy() == 0
    unsure, more = np.zeros(gone.shape, dtype=bool), np.zeros(len(gone))
    planes = campaign["plane"].values.tolist()
    for sample, said in _said(campaign):
        more[sample], plane = int(said[2] or 0), ""  # those without a name may be any
        for each in said[1].split(", "):  # "upper 3, 4, lower 5"
            *named, section = each.split()
            plane = named[0] if named else plane
            if plane in planes and 0 < int(section) <= unsure.shape[2]:
                unsure[sample, planes.index(plane), int(section) - 1] = True
    unsure |= slow
    return more + np.sum(unsure & ~gone, axis=(1, 2)), more + np.sum(unsure & gone, axis=(1, 2))


def open_outcomes(campaign: xr.Dataset) -> Mask:
    """Which samples would have another outcome if the latches of which it is uncertain whether they
    catch did otherwise: none that stalled before its stops, and none another latch of which has
    missed for certain.  A ring past its stops is overloaded by the latches that did not catch.
    """
    fate, (lost, won) = numbers(campaign, OUTCOME), latches_in_doubt(campaign)
    missed = 0.0 * won
    if "latched" in campaign:
        missed = (campaign["latched"].to_numpy() == 0).sum(axis=(1, 2))
    of_latches = np.isin(fate, [Fate.DEPLOYED, Fate.NOT_LATCHED]) | (missed > 0.0)
    return np.asarray((lost + won > 0.0) & (missed <= won) & of_latches)


def _slow(campaign: xr.Dataset) -> NDArray[np.bool_]:
    """Those latches, shape (samples, planes, sections), or (samples, 1, 1) of none."""
    path, none = "latch.min_rate", np.zeros((campaign.sizes["sample"], 1, 1), dtype=bool)
    varied = by_path(campaign)
    parts = any(each == "latch" or each.startswith(("latch[", f"{path}[")) for each in varied)
    if not {"latch_rate", "least_latch_rate_error"} <= {*campaign} or parts:
        return none
    scene = flat(tomllib.loads(str(campaign.attrs.get("scene", ""))))
    drawn = path in varied
    least = campaign[varied[path]] if drawn else np.atleast_1d(scene.get(path, 0.0))[None]
    least, rates = np.asarray(least, dtype=float), campaign["latch_rate"].to_numpy()
    least = least.reshape(len(least), 1, -1)  # of all sections, or of each
    if not least.any() or least.shape[-1] not in (1, rates.shape[-1]):
        return none
    bars, _ = bars_of(campaign, "least_latch_rate")
    return np.asarray((np.abs(rates - least) < bars[:, None, None]) & (least > 0.0))


_LATCHES = re.compile(rf"whether the latch of ([^;]*?)(?: and (\d+) more)? {UNCERTAIN}")


def attributes(campaign: xr.Dataset) -> dict[str, str]:
    """What tables about a merged campaign must tell: lost runs, outputs that may be off, and drive
    margins before a winch starts.
    """
    found, cures = doubtful(campaign)
    counts = {name: int(own.sum()) for name, own in found.items()}
    counts = dict(sorted(counts.items(), key=lambda each: -each[1]))
    told = {"samples": counts, "of": int(good(campaign).sum()), "cures": cures}
    marks = {NOTE: losses(campaign).note, LATE: late_line(campaign), PLANE: plane_line(campaign)}
    marks |= {RIGID: rigid_line(campaign)}
    return marks | ({OFF: json.dumps(told)} if counts else {})


def drive_notes(says: Mapping[Any, Any], name: str = MARGINS[0]) -> list[str]:
    """What is told beside a margin, by default the least of the drive, out of ``attributes``."""
    beside = dict.fromkeys(MARGINS, (RIGID,)) | {MARGINS[0]: (LATE, PLANE, RIGID)}
    return [told for each in beside.get(name, ()) if (told := says.get(each))]


def off_counts(says: Mapping[Any, Any]) -> dict[str, str]:
    """By output in how many samples it may be off, in words, out of ``attributes``."""
    told = json.loads(says.get(OFF, "{}"))
    return {name: _of(count, told["of"]) for name, count in told.get("samples", {}).items()}


def off_note(says: Mapping[Any, Any]) -> str:
    """The same in a line with the cure; empty if none may be off."""
    if OFF not in says:
        return ""
    told = json.loads(says[OFF])
    (first, count), *others = told["samples"].items()
    more = "".join(f", {name} in {number}" for name, number in others)
    of = counted(told["of"], "sample")
    each = [f"where {cause}, {cure}" for cause, cure in told["cures"].items()]
    cure = "; ".join(each if len(each) > 1 else told["cures"].values())
    return f"{_doubted(told['cures'])}: {first} in {count} of {of}{more}; {cure}"


def _doubted(causes: Iterable[str]) -> str:
    return f"{DOUBT.strip()} may be off, since {' or '.join(causes)}"


def doubted(table: Table, says: Mapping[Any, Any], said: str = "") -> Table:
    """A table with the mark behind the names of outputs that may be off, wherever it has them, and
    below it what is ``said`` of the mark, or why they may be, out of ``attributes``.
    """
    if not (names := off_counts(says)):
        return table
    named = re.compile(rf"\b({'|'.join(names)})\b")

    def mark(words: Sequence[str]) -> list[str]:
        return [named.sub(rf"\1{DOUBT}", each) for each in words]

    found = table._replace(
        head=mark(table.head), rows=[mark(row) for row in table.rows],
        notes=mark(table.notes), title=mark([table.title])[0],
    )  # fmt: skip
    every = [found.title, *found.head, *found.notes, *(cell for row in found.rows for cell in row)]
    said = said or _doubted(json.loads(says[OFF])["cures"])
    return found._replace(notes=[*found.notes, *[said] * any(DOUBT in each for each in every)])
