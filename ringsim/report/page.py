"""One page about a campaign, out of its merged file."""

from pathlib import Path
from typing import Any

import jinja2
import xarray as xr

from ringsim.analysis.brief import what_matters, what_separates
from ringsim.analysis.campaign_notes import budget_lines, override_lines, peak_lines, restart_lines
from ringsim.analysis.campaign_samples import campaign_file, endings, scalars
from ringsim.analysis.design import placement
from ringsim.analysis.influence_text import influence_tables
from ringsim.analysis.losses import losses
from ringsim.analysis.quantities import good
from ringsim.analysis.sensitivity_text import sensitivity_tables
from ringsim.analysis.stopping import stopping_lines
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import error_table, outcome_table, verdict_table
from ringsim.analysis.unusual import NOTE
from ringsim.analysis.worst import worst_tables
from ringsim.files import write_text
from ringsim.plots.campaign.figures import figures_of
from ringsim.plots.inline import inline
from ringsim.report import model, tables
from ringsim.report.player import player
from ringsim.report.tail import rare_event
from ringsim.tables import slim

LARGEST = 2_000_000
"""Bytes of a page: it is to go by mail."""


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


def page(campaign: xr.Dataset, folder: str, analysis: xr.Dataset | None = None) -> str:
    """The page as text: nothing in it refers to another file or address.

    All statistics are those of ``analysis``, what ``analyse`` gives, by default of today.
    """
    analysis = analyse(campaign) if analysis is None else analysis
    wanted = campaign_file(campaign)
    failures, more = tables.failures(campaign, folder)
    shown = player(campaign, analysis)
    places = {} if shown is None else {e["sample"]: k for k, e in enumerate(shown["samples"])}
    values, head = model.values(campaign)
    figures = [(p.name, p.words, inline(f, p.name, p.words)) for p, f in figures_of(campaign)]
    notes = [*restart_lines(campaign), *override_lines(campaign), *budget_lines(campaign)]
    shell = jinja2.Environment(
        loader=jinja2.PackageLoader("ringsim.report", ""), autoescape=True,
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    shell.filters["sentence"] = _sentence
    placed = placement(campaign)
    lost = losses(campaign)
    stopping = [line + lost.mark for line in stopping_lines(campaign, placed)]
    names = scalars(campaign)
    design = dict(wanted.get("design", {}))
    design.pop("samples", None)  # a call with --samples changes it
    context: dict[str, Any] = {
        "title": campaign.attrs.get("title", "Campaign"),
        "name": campaign.attrs.get("campaign_name", ""), "question": wanted.get("question", ""),
        "samples": campaign.sizes["sample"], "used": int(good(campaign).sum()),
        "not_run": int((endings(campaign) == "not run").sum()),
        "design": design.pop("kind", "unknown"), "design_more": design,
        "seed": campaign.attrs.get("seed", ""), "scene": wanted.get("scene", ""),
        "outcomes": outcome_table(analysis), "tail": rare_event(campaign),
        "statistics": tables.statistics(campaign, analysis),
        "errors": slim(error_table(analysis, names)),
        "no_population": "" if placed.population or not placed.kind else placed.told,
        "verdicts": slim(verdict_table(analysis)),
        "brief": [slim(what_matters(analysis)), slim(what_separates(analysis))],
        "matters": [*influence_tables(analysis, names), *sensitivity_tables(analysis, names)],
        "fidelity": campaign.attrs.get("fidelity", ""), "engine": campaign.attrs.get("source", ""),
        "peaks": peak_lines(campaign), "stopping": stopping, "lost": lost.note,
        "figures": figures, "player": shown, "failures": failures, "more": more,
        "worst": worst_tables(analysis, folder), "worst_note": NOTE,
        "players": {str(sample): k for sample, k in places.items()},
        "truth": tables.truth(campaign), "notes": notes, "inputs": tables.drawn(campaign),
        "values": values, "head": head, "campaign_text": campaign.attrs.get("campaign", ""),
        "provenance": list(tables.provenance(campaign)),
    }  # fmt: skip
    return shell.get_template("page.html.j2").render(context)


def _sentence(line: str) -> str:
    """A line of a terminal as a sentence: with a capital, unless a name begins it."""
    first = line.split(maxsplit=1)[0] if line else ""
    named = not first.isalpha() or first != first.lower()
    return f"{line if named else line[0].upper() + line[1:]}."
