"""What all pages share: templates, figures as light as a page must be, print."""

import functools
import os
import shutil
import subprocess
import tempfile
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np
from markupsafe import Markup

from ringsim.files import whole, writing
from ringsim.plots.figures import HEAVY, Inline
from ringsim.refusal import InputError
from ringsim.tables import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST = 2_000_000
"""Bytes of a page: it is to go by mail."""


Drawn = list[tuple[str, str, "Figure"]]
"""Name, what it shows in words, and figure."""


def written(
    template: str, context: Mapping[str, Any], drawn: Sequence[tuple[str, str, "Figure"]],
    beside: Collection[str] = (),
) -> str:  # fmt: skip
    """The page of a template: ``figures`` in it are name, words and element of each one drawn.

    Those named ``beside`` are not among these, but by their names in ``beside``.  They are lines as
    long as the page stays below ``LARGEST`` with them, then pictures.
    """
    shape, text = _shell().get_template(template), ""
    each = [(name, words, Inline(figure, name, words)) for name, words, figure in drawn]
    for heavy in (HEAVY, HEAVY // 4, 0):
        figures = [(name, words, one.element(heavy)) for name, words, one in each]
        text = shape.render({**context, **_apart(figures, beside)})
        if len(text.encode("utf-8")) <= LARGEST:
            break
    return text


_SHEET, _SCALE, _CAPTION = (7.17, 10.6), 0.58, 0.4
"""Width and height of a printed sheet within its margins, size of figures on it over that as they
are drawn, both as page.css has them, and height of a caption with the gap below it; inch."""


def filling(drawn: Drawn, first: int = 0, more: Collection[str] = ()) -> tuple[Drawn, int]:
    """Figures in an order that leaves little of the sheets of a printed page empty.

    The ``first`` of them stay where they are, with those named in ``more`` for which their last
    sheet has room; each other one moves up to the first sheet that has some.  Returns them, and how
    many stay.
    """
    kept, rest, room = list(drawn[:first]), list(drawn[first:]), 0.0
    for each in kept:
        size = _printed(each)
        room = (room if room >= size else _SHEET[1]) - size
    for each in [each for each in rest if each[0] in more and kept]:
        if (size := _printed(each)) <= room:
            room -= size
            kept.append(each)
            rest.remove(each)
    sheets = list[tuple[float, Drawn]]()
    for each in rest:
        size = _printed(each)
        fits = (k for k, (free, _) in enumerate(sheets) if free >= size)
        if (k := next(fits, None)) is None:
            sheets.append((_SHEET[1] - size, [each]))
        else:
            sheets[k] = sheets[k][0] - size, [*sheets[k][1], each]
    return [*kept, *(each for _, own in sheets for each in own)], len(kept)


def _printed(drawn: tuple[str, str, "Figure"]) -> float:
    """Height of a figure with its caption on paper, inch."""
    wide, high = map(float, drawn[2].get_size_inches())
    return min(_SCALE, _SHEET[0] / wide) * high + _CAPTION


@functools.cache
def _shell() -> jinja2.Environment:
    """What templates are read by, which it compiles once."""
    shell = jinja2.Environment(
        loader=jinja2.PackageLoader("ringsim.report", ""), autoescape=True,
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    shell.filters |= {"sentence": _sentence, "head": _head, "parted": _parted}
    return shell


def _apart(figures: list[tuple[str, str, str]], names: Collection[str]) -> dict[str, Any]:
    own = {each[0]: each for each in figures if each[0] in names}
    return {"figures": [each for each in figures if each[0] not in own], "beside": own}


def _sentence(line: str) -> str:
    """A line of a terminal as a sentence: with a capital, unless a name begins it."""
    first = line.split(maxsplit=1)[0] if line else ""
    named = not first.isalpha() or first != first.lower()
    return f"{line if named else line[0].upper() + line[1:]}."


def _head(text: str) -> Markup:
    """The head of a column, which may be broken at underscores: a table that is wider than the
    paper makes browsers print all pages smaller.
    """
    return Markup("_<wbr>").join(text.split("_"))


_MOST_COLUMNS = 12
"""Of a table on a page, as numbers of all outputs have: so many fit a sheet of paper at the size of
the others, and a window of 1200 px."""


def _parted(table: Table) -> list[Table]:
    """A table in parts of about equally many columns that fit, each with the columns of words."""
    if len(table.head) <= _MOST_COLUMNS:
        return [table]
    named, others = range(table.left), np.arange(table.left, len(table.head))
    count = -(-len(others) // (_MOST_COLUMNS - table.left))
    return [
        table._replace(
            head=[table.head[k] for k in (*named, *own)],
            rows=[[row[k] for k in (*named, *own)] for row in table.rows],
        )
        for own in np.array_split(others, count)
    ]


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
