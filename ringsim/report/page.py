"""One page about a campaign, out of its merged file."""

import os
import re
import shutil
import subprocess
import tempfile
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import xarray as xr

from ringsim.analysis.campaign_notes import override_lines, peak_lines, restart_lines
from ringsim.analysis.design import campaign_file, endings, inputs, paths_of
from ringsim.analysis.intervals import good
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import head_lines, outputs_in, sections
from ringsim.analysis.worst import NOTE_ON_UNUSUAL
from ringsim.campaign.specification import flat
from ringsim.files import whole, write_text, writing
from ringsim.plots.figures import figures_of
from ringsim.plots.style import HEAVY, inline
from ringsim.refusal import InputError, show
from ringsim.report import tables
from ringsim.report.player import player
from ringsim.scene import builtin_scenes

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
    called = str(campaign.attrs.get("campaign", ""))
    settings |= dict.fromkeys(re.findall(r"^# called with --set (\S+) =", called, re.MULTILINE))
    drawn = [path for name in inputs(campaign) for path in paths_of(campaign[name])]
    text = builtin_scenes().get(str(wanted.get("scene", "")), "")
    written, comments = flat(tomllib.loads(text)), _comments(text)
    rows = []
    for path, value in flat(tomllib.loads(str(campaign.attrs["scene"]))).items():
        comment, origin = comments.get(path, ""), "scene"
        if _under(path, drawn):
            origin = "drawn"
        elif _holds(path, drawn):
            origin = "drawn in part"
        elif _under(path, settings):
            origin, comment = "campaign", ""
        elif "inferred" in comment:
            origin = "inferred"
        elif text and path not in written:
            origin = "default"
        rows.append(Value(path, show(value), origin, comment))
    known = [row.path for row in rows]
    unset = [path for path in drawn if not _under(path, known) and not _holds(path, known)]
    rows += [Value(path, "-", "drawn", "") for path in unset]
    head = re.match(r"(?:#.*\n)+", text)
    return rows, " ".join(re.sub(r"^# ?", "", head[0], flags=re.MULTILINE).split()) if head else ""


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


LARGEST = 2_000_000
"""Bytes of a page: it is to go by mail."""
_ANSWERS = ("one_by_one", "rare_event", "distributions", "margin", "fan", "tornado")
"""Figures that answer what campaigns are run for, in the order in which they are told; the first
``_FIRST`` of them stand on the first page, all others are evidence."""
_FIRST = 3


def write_report(
    campaign: xr.Dataset, out: Path, folder: str, analysis: xr.Dataset | None = None
) -> int:
    """Write the page of a merged campaign, which is in memory; returns its size in bytes.

    ``folder`` is what readers of the page give to ``ringsim replay``.  InputError if the file
    cannot be written.
    """
    text = page(campaign, folder, analysis)
    write_text(out, text)
    return len(text.encode("utf-8"))


_BROWSERS = "chromium", "chromium-browser", "google-chrome"
_PRINT_SECONDS = 120.0


def require_browser() -> str:
    """The browser that prints pages; InputError without one."""
    found = next(filter(None, map(shutil.which, _BROWSERS)), None)
    if found is None:
        raise InputError(
            f"--pdf: needs a browser, and none of {', '.join(_BROWSERS)} is installed: install "
            "chromium, or print the page from your own browser"
        )
    return found


def write_pdf(file: Path, out: Path) -> None:
    """Print a page, its folded parts open; InputError if the browser does not."""
    # Root has no sandbox to give; the page loads nothing.
    alone = ["--no-sandbox"] * (os.geteuid() == 0)
    with tempfile.TemporaryDirectory() as own, writing(out):
        draft = Path(own, "page.pdf")
        words = [
            require_browser(), "--headless", "--disable-gpu", *alone, f"--user-data-dir={own}/user",
            "--no-pdf-header-footer", f"--print-to-pdf={draft}", file.resolve().as_uri(),
        ]  # fmt: skip
        try:
            done = subprocess.run(
                words, capture_output=True, text=True, timeout=_PRINT_SECONDS, check=False
            )
            why = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        except subprocess.TimeoutExpired:
            why = [f"no answer within {_PRINT_SECONDS:g} s"]
        if not draft.exists():
            raise InputError(f"{out}: the browser has not printed the page: {why[0]}")
        with whole(out) as place:
            shutil.copyfile(draft, place)


def page(campaign: xr.Dataset, folder: str, analysis: xr.Dataset | None = None) -> str:
    """The page as text: nothing in it refers to another file or address.

    All statistics are those of ``analysis``, what ``analyse`` gives, by default of today.  Figures
    are drawn as lines as long as the page stays below ``LARGEST`` with them, then as pictures.
    """
    analysis = analyse(campaign) if analysis is None else analysis
    wanted = campaign_file(campaign)
    failures, more = tables.failures(campaign, folder)
    shown = player(campaign, analysis)
    places = {} if shown is None else {e["sample"]: k for k, e in enumerate(shown["samples"])}
    values, head = values_of(campaign)
    drawn = sorted(figures_of(campaign), key=lambda each: _turn(each[0].name))
    shell = jinja2.Environment(
        loader=jinja2.PackageLoader("ringsim.report", ""), autoescape=True,
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    shell.filters["sentence"] = _sentence
    design = dict(wanted.get("design", {}))
    design.pop("samples", None)  # a call with --samples changes it
    context: dict[str, Any] = {
        "title": campaign.attrs.get("title", "Campaign"),
        "name": campaign.attrs.get("campaign_name", ""), "question": wanted.get("question", ""),
        "samples": campaign.sizes["sample"], "used": int(good(campaign).sum()),
        "not_run": int((endings(campaign) == "not run").sum()),
        "design": design.pop("kind", "unknown"), "design_more": design,
        "seed": campaign.attrs.get("seed", ""), "scene": wanted.get("scene", ""),
        "told": sections(analysis, folder), "notes_on_all": head_lines(analysis)[1:],
        "names": {name: campaign[name].attrs.get("long_name", "") for name in outputs_in(analysis)
                  if name in campaign},
        "fidelity": campaign.attrs.get("fidelity", ""), "engine": campaign.attrs.get("source", ""),
        "peaks": peak_lines(campaign),
        "first": _FIRST, "player": shown, "failures": failures, "more": more,
        "worst_note": NOTE_ON_UNUSUAL,
        "players": {str(sample): k for sample, k in places.items()},
        "notes": [*restart_lines(campaign), *override_lines(campaign)],
        "inputs": tables.drawn(campaign),
        "values": values, "head": head, "campaign_text": campaign.attrs.get("campaign", ""),
        "provenance": list(tables.provenance(campaign)),
    }  # fmt: skip
    shape, text = shell.get_template("page.html.j2"), ""
    for heavy in (HEAVY, HEAVY // 4, 0):
        figures = [(p.name, p.words, inline(f, p.name, p.words, heavy)) for p, f in drawn]
        text = shape.render(context | {"figures": figures})
        if len(text.encode("utf-8")) <= LARGEST:
            break
    return text


def _turn(name: str) -> int:
    return _ANSWERS.index(name) if name in _ANSWERS else len(_ANSWERS)


def _sentence(line: str) -> str:
    """A line of a terminal as a sentence: with a capital, unless a name begins it."""
    first = line.split(maxsplit=1)[0] if line else ""
    named = not first.isalpha() or first != first.lower()
    return f"{line if named else line[0].upper() + line[1:]}."
