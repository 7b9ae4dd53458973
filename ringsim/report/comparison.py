"""One page about how a campaign, or a run, differs from another."""

from pathlib import Path

import xarray as xr

from ringsim.analysis.comparison_text import differing, head_lines, names_of, sections
from ringsim.files import write_text
from ringsim.plots.comparison import figures_of_both
from ringsim.report import tables
from ringsim.report.shell import written


def write_comparison(found: xr.Dataset, first: xr.Dataset, second: xr.Dataset, out: Path) -> int:
    """Write the page of what ``compare`` has found of two datasets; returns its size in bytes.

    InputError if the file cannot be written.
    """
    text = page(found, first, second)
    write_text(out, text)
    return len(text.encode("utf-8"))


def page(found: xr.Dataset, first: xr.Dataset, second: xr.Dataset) -> str:
    """The page as text: nothing in it refers to another file or address."""
    names, both = names_of(found), (first, second)
    context = {
        "title": f"What differs: {found.attrs['second_name']} against {found.attrs['first_name']}",
        "notes_on_all": head_lines(found), "told": sections(found),
        "names": {name: first[name].attrs.get("long_name", "") for name in differing(found)},
        "sides": [
            (name, str(each.attrs.get("campaign", "")), list(tables.provenance(each)))
            for name, each in zip(names, both, strict=True)
        ],
    }  # fmt: skip
    return written("compare.html.j2", context, list(figures_of_both(found, first, second)))
