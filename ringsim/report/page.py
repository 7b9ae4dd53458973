"""One page about a campaign, out of its merged file, or about how it differs from another."""

import re
import shlex
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ringsim.analysis import comparison_text
from ringsim.analysis.campaign_notes import override_lines, peak_lines, restart_lines
from ringsim.analysis.design import (
    BARS,
    LOST,
    NOT_RUN,
    REACHED,
    UNKNOWN,
    by_path,
    called,
    campaign_file,
    distribution_of,
    endings,
    inputs,
    paths_of,
)
from ringsim.analysis.intervals import good, lost, ran
from ringsim.analysis.residuals import (
    Residuals,
    by_found_clock,
    clock_line,
    residual_table,
    residuals,
)
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import Section, head_lines, outputs_in, sections
from ringsim.analysis.worst import first_clause, note_on_unusual, worst_tables
from ringsim.files import write_text
from ringsim.measured import Measurement
from ringsim.outputs.base import without_doubts
from ringsim.overrides import flat, pulleys_at
from ringsim.plots import style
from ringsim.plots.comparison import figures_of_both, measured_and_computed
from ringsim.plots.figures import figures_of
from ringsim.refusal import show
from ringsim.report.player import player
from ringsim.report.shell import filling, written
from ringsim.sampling.distributions import law_text
from ringsim.scene import builtin_scenes
from ringsim.tables import Table, number_text, unit_text
from ringsim.variables import Cause

# What a page tells of the campaign beside its analysis: plain rows of text.


MOST_FAILURES = 100
"""Rows of the table of failures; the page says how many more there are."""
_SHOWN = ("title", "source", "execution", "seed", "solver", "identity", "date_created")
_PLACES = re.compile(
    r" and \d+ more|(?:(?:upper|lower) )?-?\d[\d.e+-]*(?:, )?|samples?|latches|latch"
)
"""What differs between antennas that ended alike: V-joints by name, numbers, and plurals."""
_MOST_NAMED = 20
"""Samples of a row that are named."""
_LONGEST = 400
"""Characters of a value of the scene that are shown: those of a list for 36 hinges."""
Rows = list[list[str]]


def failures(campaign: xr.Dataset, folder: str) -> tuple[Rows, int]:
    """Samples, ending with its cause, reason, command that repeats the first; how many rows are
    left out.

    Runs that lost their numbers, and sound ones in which the antenna fell short of its goal; a row
    for all that ended in the same way.  Antennas end in the same way that differ by places and
    numbers: the row has the words of the first.
    """
    words, goals = endings(campaign), (*REACHED, UNKNOWN, NOT_RUN)
    causes = {int(cause): cause.words for cause in Cause if cause}
    codes = campaign["cause"].values.tolist()
    reasons = [without_doubts(str(each)) for each in campaign["reason"].values.tolist()]
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
    for shape, samples in sorted(alike.items(), key=lambda each: not each[0][0].startswith(LOST)):
        mark = "" if len(said[shape]) == 1 else f"sample {samples[0]}: "
        ending, cause, _ = shape
        how_told = ending + f" ({cause})" * bool(cause), mark + first[shape]
        named = "sample " if len(samples) == 1 else "samples "
        named += ", ".join(map(str, samples[:_MOST_NAMED]))
        named += f" and {len(samples) - _MOST_NAMED} more" * (len(samples) > _MOST_NAMED)
        rows.append([named, *how_told, f"ringsim replay {shlex.quote(folder)} {samples[0]}"])
    return rows[:MOST_FAILURES], max(0, len(rows) - MOST_FAILURES)


def _all_told(campaign: xr.Dataset, short: list[int], tables: Sequence[Table]) -> bool:
    """Whether tables of worst samples say of all samples that ended short why they did: a table of
    the rest would look like one of all.
    """
    said = {
        (int(row[0]), row[1].removeprefix("no value: ")) for each in tables for row in each.rows
    }
    reasons = campaign["reason"].sel(sample=short).values.tolist()
    whys = [first_clause(without_doubts(str(each))) for each in reasons]
    return all(each in said for each in zip(short, whys, strict=True))


def drawn_inputs(campaign: xr.Dataset) -> Rows:
    """Name, unit, places, distribution, the values that samples which have run have of it, and the
    scene's paths that take them: a row an input, then one for each path that follows an input.
    """
    rows, held = [], ran(campaign)
    every = by_path(campaign)
    followers = [name for name in every.values() if _leader(campaign, name)]
    for name in [*inputs(campaign), *followers]:
        variable = campaign[name]
        law, values = law_text(distribution_of(variable)), variable.to_numpy()
        values = values[held] if held.any() else values
        if values.dtype.kind in "OU":
            counts = Counter(values.ravel().astype(str).tolist()).most_common(6)
            extent = ", ".join(f"{word} ({n})" for word, n in counts)
        else:
            extent = " to ".join(number_text(end, 5) for end in (values.min(), values.max()))
        places = variable.shape[1] if variable.ndim > 1 else 1
        unit = unit_text(str(variable.attrs.get("units", "-")))
        paths = ", ".join(paths_of(variable))
        called_ = paths if name in followers else called(variable)
        rows.append([called_, unit, str(places), law, extent, paths or "-"])
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


# The model of a campaign: every value of its scene, and where it comes from.


class Value(NamedTuple):
    """One value of the scene."""

    path: str
    value: str
    origin: str
    """drawn, drawn in part, campaign, inferred, scene or default."""
    comment: str


def values_of(campaign: xr.Dataset) -> tuple[list[Value], str]:
    """All values of the scene with their origin, and what the scene's file says at its head.

    Comments are known of built-in scenes only: of a scene of the user's own the dataset holds the
    values, and nothing tells which of them are defaults.
    """
    wanted = campaign_file(campaign)
    settings = flat(wanted.get("set", {}))
    file = str(campaign.attrs.get("campaign", ""))
    settings |= {BARS: True} if wanted.get("error_bars_every") else {}
    settings |= dict.fromkeys(re.findall(r"^# called with --set (\S+) =", file, re.MULTILINE))
    varies = by_path(campaign)
    drawn = [*varies]
    text = builtin_scenes().get(str(wanted.get("scene", "")), "")
    written, comments = flat(tomllib.loads(text)), _comments(text)
    nested = tomllib.loads(str(campaign.attrs["scene"]))
    rows, own = [], flat(nested)
    for path, value in own.items():
        comment, origin = comments.get(path, ""), "scene"
        if _under(path, drawn):
            origin = "drawn"
            if leader := _leader(campaign, varies.get(path, "")):
                comment = f"follows {leader}"
        elif _holds(path, drawn):
            whole = len(value) if isinstance(value, list) else len(pulleys_at(nested, path))
            parts = sum(each.startswith(f"{path}[") for each in drawn)
            every = parts == (whole or own.get("structure.sections"))
            origin = "drawn" if every else "drawn in part"
        elif _under(path, settings):
            origin, comment = "campaign", ""
        elif "inferred" in comment:
            origin = "inferred"
        elif text and path not in written:
            origin = "default"
        told = show(value, _LONGEST)
        if path == BARS and BARS in settings and "solver_error_bars" in campaign:
            barred = campaign["solver_error_bars"]
            told = f"true in {int(barred.sum())} of {barred.size} samples (error_bars_every)"
        rows.append(Value(path, told, origin, comment or _remark(path, own)))
    known = [row.path for row in rows]
    unset = [path for path in drawn if not _under(path, known) and not _holds(path, known)]
    rows += [Value(path, "-", "drawn", "") for path in unset]
    head = re.match(r"(?:#.*\n)+", text)
    return rows, " ".join(re.sub(r"^# ?", "", head[0], flags=re.MULTILINE).split()) if head else ""


def _leader(campaign: xr.Dataset, name: str) -> str:
    """The input whose values decide about those of a variable by a table; empty if none does."""
    law = distribution_of(campaign[name]) if name else {}
    return called(campaign[name]) if law.get("kind") == "function" else ""


def _remark(path: str, scene: Mapping[str, Any]) -> str:
    """What a value is not seen to be from its path alone."""
    if path == "structure.polygon_sections" and scene.get("structure.closed"):
        return "without effect: a closed ring is its own polygon"
    return "per rod half" if path == "rods.elements" else ""


def _title_of_scene(campaign: xr.Dataset) -> str:
    title = tomllib.loads(str(campaign.attrs["scene"])).get("title", "")
    return style.scene_title(campaign.assign_attrs(title=title)) if title else ""


def _under(path: str, others: Any) -> bool:
    return any(path == each or path.startswith((f"{each}.", f"{each}[")) for each in others)


def _holds(path: str, others: Any) -> bool:
    return any(_under(each, [path]) for each in others)


def _comments(text: str) -> dict[str, str]:
    """Comments behind values, by path; of a table on one line for each value in it."""
    found, table = dict[str, str](), ""
    for line in text.splitlines():
        if header := re.match(r"\[([^\]]+)\]", line):
            table = f"{header[1]}."
        elif match := re.match(r"([^#=]+?)\s*=\s*((?:\"[^\"]*\"|[^#\"])*)#\s*(.*)", line):
            inner = flat(tomllib.loads(f"{match[1]} = {match[2]}"))
            found |= {table + path: match[3] for path in inner}
    return found


_ANSWERS = ("one_by_one", "rare_event", "distributions", "margin", "fan", "latch_rate")
"""Figures that answer what campaigns are run for, in the order in which they are told; the first
``_FIRST`` of them stand on the first page, with others for which its last sheet has room; all else
is evidence, but ``_MATTERS``, which stands where it is told what matters, unless nothing does."""
_MATTERS = "tornado"
_FIRST = 3


# The pages.


def write_report(
    campaign: xr.Dataset, out: Path, folder: str, analysis: xr.Dataset | None = None,
    measurement: Measurement | None = None,
) -> int:  # fmt: skip
    """Write the page of a merged campaign, which is in memory; returns its size in bytes.

    ``folder`` is what readers of the page give to ``ringsim replay``.  InputError if the file
    cannot be written, or the campaign has not what was measured.
    """
    text = page(campaign, folder, analysis, measurement)
    write_text(out, text)
    return len(text.encode("utf-8"))


def page(
    campaign: xr.Dataset, folder: str, analysis: xr.Dataset | None = None,
    measurement: Measurement | None = None,
) -> str:  # fmt: skip
    """The page as text: nothing in it refers to another file or address.

    All statistics are those of ``analysis``, what ``analyse`` gives, by default of today.  Figures
    are drawn as lines as long as the page stays below ``LARGEST`` with them, then as pictures.
    A ``measurement`` is laid beside the samples.
    """
    analysis = analyse(campaign) if analysis is None else analysis
    wanted = campaign_file(campaign)
    fell_short, more = failures(campaign, folder)
    ended = endings(campaign).astype(str)
    short = ~np.isin(ended, (*REACHED, UNKNOWN, NOT_RUN))
    sound = campaign["sample"].values[short & ~np.char.startswith(ended, LOST)].tolist()
    if _all_told(campaign, sound, worst_tables(analysis, folder)):
        fell_short = [row for row in fell_short if row[1].startswith(LOST)]
    apart, clock = list[Residuals](), ""
    if measurement is not None:
        apart = residuals(campaign, measurement)  # refuses others' tests
        clock = clock_line(campaign, measurement)
        measurement = by_found_clock(campaign, measurement)
    shown = player(campaign, analysis, measurement)
    places = {} if shown is None else {e["sample"]: k for k, e in enumerate(shown["samples"])}
    values, head = values_of(campaign)
    told = sections(analysis, folder)
    matters = "matters" in told and any(each.rows for each in told["matters"].tables)
    pictures = sorted(figures_of(campaign), key=lambda each: _turn(each[0].name))
    design = dict(wanted.get("design", {}))
    design.pop("samples", None)  # a call with --samples changes it
    context: dict[str, Any] = {
        "title": campaign.attrs.get("title", "Campaign"),
        "name": campaign.attrs.get("campaign_name", ""), "question": wanted.get("question", ""),
        "samples": campaign.sizes["sample"], "used": int(good(campaign).sum()),
        "failed": int(lost(campaign).sum()), "not_run": int((~ran(campaign)).sum()),
        "design": design.pop("kind", "unknown"), "design_more": design,
        "seed": campaign.attrs.get("seed", ""), "scene": wanted.get("scene", ""),
        "scene_title": _title_of_scene(campaign),
        "told": told, "notes_on_all": head_lines(analysis)[1:],
        "names": {name: campaign[name].attrs.get("long_name", "") for name in outputs_in(analysis)
                  if name in campaign},
        "fidelity": campaign.attrs.get("fidelity", ""), "engine": campaign.attrs.get("source", ""),
        "peaks": peak_lines(campaign),
        "player": shown, "failures": fell_short, "more": more, "short": bool(short.any()),
        "worst_note": note_on_unusual(analysis),
        "players": {str(sample): k for sample, k in places.items()},
        "notes": [*restart_lines(campaign), *override_lines(campaign)],
        "inputs": drawn_inputs(campaign),
        "values": values, "head": head, "campaign_text": campaign.attrs.get("campaign", ""),
        "provenance": list(provenance(campaign)),
    }  # fmt: skip
    figures = [(p.name, p.words, f) for p, f in pictures if matters or p.name != _MATTERS]
    if measurement is not None:
        told["measured"] = Section("measured", "Measured data", [residual_table(apart, clock)])
        title = measurement.file.title or measurement.file.name
        figures.append((
            "measured", "Measured data beside the samples: on the left readings, the samples' "
            "median and the band of 90 % of them with the scatter of a reading; on the right both "
            "less the median, in standard deviations of a reading",
            measured_and_computed(apart, title),
        ))  # fmt: skip
    own = (_MATTERS, "measured")
    front, rest = filling([e for e in figures if e[0] not in own], _FIRST, _ANSWERS)
    return written("page.html.j2", context | {"front": front, "rest": rest}, figures)


def _turn(name: str) -> int:
    return _ANSWERS.index(name) if name in _ANSWERS else len(_ANSWERS)


# How a campaign, or a run, differs from another.


def write_comparison(found: xr.Dataset, first: xr.Dataset, second: xr.Dataset, out: Path) -> int:
    """Write the page of what ``compare`` has found of two datasets; returns its size in bytes.

    InputError if the file cannot be written.
    """
    text = comparison_page(found, first, second)
    write_text(out, text)
    return len(text.encode("utf-8"))


def comparison_page(found: xr.Dataset, first: xr.Dataset, second: xr.Dataset) -> str:
    """The page as text: nothing in it refers to another file or address."""
    names, both = comparison_text.names_of(found), (first, second)
    context = {
        "title": f"What differs: {found.attrs['second_name']} against {found.attrs['first_name']}",
        "notes_on_all": comparison_text.head_lines(found), "told": comparison_text.sections(found),
        "names": {name: first[name].attrs.get("long_name", "")
                  for name in comparison_text.differing(found)},
        "sides": [
            (name, str(each.attrs.get("campaign", "")), list(provenance(each)))
            for name, each in zip(names, both, strict=True)
        ],
    }  # fmt: skip
    figures = list(figures_of_both(found, first, second))
    return written("compare.html.j2", context | {"figure_sheets": filling(figures)[1]}, figures)
