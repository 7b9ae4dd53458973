"""What all pages share: templates, figures as light as a page must be, print."""

import functools
import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

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
    template: str, context: Mapping[str, Any], drawn: Sequence[tuple[str, str, "Figure"]]
) -> str:
    """The page of a template: ``figures`` in it are name, words and element of each one by name.

    They are lines as long as the page stays below ``LARGEST`` with them, then pictures.
    """
    shape, text = templates().get_template(template), ""
    each = [(name, words, Inline(figure, name, words)) for name, words, figure in drawn]
    for heavy in (HEAVY, HEAVY // 4, 0):
        figures = {name: (name, words, one.element(heavy)) for name, words, one in each}
        text = shape.render({**context, "figures": figures})
        if len(text.encode("utf-8")) <= LARGEST:
            break
    return text


class Sheet(NamedTuple):
    """Figures that share a printed sheet, by their names, and how far they are reduced for that."""

    names: list[str]
    fit: float


_SHEET, _SCALE, _HEADING = (7.17, 10.59), 0.66, 0.42
"""Width and height of a printed sheet within its margins, size of figures on it over that as they
are drawn, both as page.css has them, and height of the heading above the first figures; inch."""
_LEAST_FIT = 0.92
"""Letters of figures that are reduced so far have 5.5 pt instead of 6: hardly another size."""
_LINE, _LETTERS, _GAP = 0.135, 125, 0.15
"""Height of a line of a caption (inch), letters on it, and its distance from figures (inch)."""


def filling(
    drawn: Drawn, first: int = 0, more: Collection[str] = ()
) -> tuple[list[Sheet], list[Sheet]]:
    """Figures by sheets of a printed page: the ``first`` of them, with those named in ``more`` for
    which their sheets have room, and all others.

    A figure moves up to the first sheet that has room for it.  Of the others' sheets the emptiest
    comes first, since it may find room below text.
    """
    front = _Sheets()
    for each in drawn[:first]:
        front.put(each)
    late = [each for each in drawn[first:] if each[0] in more and front.sheets]
    moved = [each[0] for each in late if front.put(each, anew=False)]
    rest = _Sheets()
    for each in drawn[first:]:
        if each[0] not in moved:
            rest.put(each)
    return front.told(), sorted(rest.told(), key=lambda sheet: rest.height_of(sheet.names))


class _Sheets:
    """Sheets with figures, on each of which a heading has room, too."""

    def __init__(self) -> None:
        self.sheets: list[list[str]] = []
        self._sizes = dict[str, tuple[float, float]]()

    def put(self, drawn: tuple[str, str, "Figure"], *, anew: bool = True) -> bool:
        """Put a figure on the first sheet that has room, or ``anew`` on another; whether it was."""
        name, words, figure = drawn
        wide, high = map(float, figure.get_size_inches())
        caption = _GAP + _LINE * math.ceil(len(words) / _LETTERS)
        self._sizes[name] = min(_SCALE, _SHEET[0] / wide) * high, caption
        for names in self.sheets:
            if self._fit([*names, name]) >= _LEAST_FIT:
                names.append(name)
                return True
        self.sheets += [[name]] * anew
        return anew

    def told(self) -> list[Sheet]:
        """All sheets."""
        return [Sheet(own, min(1.0, self._fit(own))) for own in self.sheets]

    def height_of(self, names: Sequence[str]) -> float:
        """Of figures with their captions, inch."""
        return sum(map(sum, (self._sizes[name] for name in names)))

    def _fit(self, names: Sequence[str]) -> float:
        """How far figures must be reduced to fit; captions are not."""
        figures, captions = map(sum, zip(*(self._sizes[name] for name in names), strict=True))
        return (_SHEET[1] - _HEADING - captions) / figures


@functools.cache
def templates() -> jinja2.Environment:
    """What templates are read by, which it compiles once."""
    found = jinja2.Environment(
        loader=jinja2.PackageLoader("ringsim.report", ""), autoescape=True,
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    found.filters |= {"sentence": _sentence, "head": _head, "parted": _parted}
    return found


def _sentence(line: str) -> str:
    """A line of a terminal as a sentence: with a capital, unless a name begins it."""
    first = line.split(maxsplit=1)[0] if line else ""
    named = not first.isalpha() or first != first.lower() or first == "ringsim"  # as it is typed
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
