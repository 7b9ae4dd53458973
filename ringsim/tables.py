"""Tables, in Markdown and for terminals."""

import itertools
import math
import re
import textwrap
from collections.abc import Iterable, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from typing import NamedTuple

from tabulate import DataRow, TableFormat, tabulate

_ROW = DataRow("|", "|", "|")
# tabulate's own Markdown pads every cell to its column's width, and one long cell widens all lines.
_NARROW = TableFormat(
    lineabove=None, linebelowheader=lambda widths, aligns: "|" + "---|" * len(widths),
    linebetweenrows=None, linebelow=None, headerrow=_ROW, datarow=_ROW, padding=1,
    with_header_hide=None,
)  # fmt: skip


def markdown_table(head: Sequence[object], rows: Iterable[Sequence[object]]) -> str:
    """A table as GitHub reads it; cells are written as they are, but ``|`` and line breaks."""
    cells = [[" ".join(str(cell).split()).replace("|", "\\|") for cell in row] for row in rows]
    return str(tabulate(cells, list(map(str, head)), _NARROW, disable_numparse=True, stralign=None))


def text_table(head: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> list[str]:
    """The lines of a table for a terminal, numbers to the right of what they are of: the first
    ``left`` columns.
    """
    sides = ["left" if k < left else "right" for k in range(len(head))]
    text = tabulate(list(rows), head, "simple", disable_numparse=True, colalign=sides)
    return str(text).splitlines()


class Table(NamedTuple):
    """A table, for terminals and pages alike, and what is to be said below it."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()
    left: int = 1
    """How many of its columns are words."""
    title: str = ""

    def lines(self) -> list[str]:
        """The table as text; notes alone if it has no rows."""
        return [*(text_table(*self[:2], self.left) if self.rows else ()), *self.notes]


def slim(table: Table) -> Table:
    """A table without the columns that say nothing.

    >>> slim(Table(("output", "failed"), [("peak", "-"), ("time", "-")])).head
    ('output',)
    """
    kept = [k for k in range(len(table.head)) if any(row[k] not in ("", "-") for row in table.rows)]
    return Table(
        tuple(table.head[k] for k in kept),
        [tuple(row[k] for k in kept) for row in table.rows],
        table.notes,
        table.left,
        table.title,
    )


def counted(number: int, noun: str) -> str:
    """A number of things.

    >>> counted(1, "further sample"), counted(2, "sample")
    ('1 further sample', '2 samples')
    """
    return f"{number} {noun}" + "s" * (number != 1)


def known_to(
    number: str, error: float, form: str = ".2g", exact: float | None = None, least: int = 2
) -> str:  # fmt: skip
    """A number in words without the digits beyond those that its error has in print, two at most;
    rounded once where it is known ``exact``.  The ``least`` digits stay, however large the error.

    >>> known_to("32.4713", 0.02), known_to("32.4713", 0.023), known_to("1234", 170.0)
    ('32.47', '32.471', '1230')
    >>> known_to("3.579", 190.0)
    '3.6'
    >>> known_to("3.2", 0.001), known_to("3.2", math.nan)
    ('3.2', '3.2')
    """
    if not (math.isfinite(error) and error > 0.0) or number == "-":
        return number
    bar, held = Decimal(f"{error:{form}}"), Decimal(number)
    own, last = (each.adjusted() - len(each.as_tuple().digits) + 1 for each in (held, bar))
    last = min(last, held.adjusted() + 1 - least) if least else last
    if own >= last:
        return number
    return f"{Decimal(number if exact is None else exact).quantize(Decimal((0, (1,), last))):f}"


def number_text(value: float, digits: int = 4) -> str:
    """A number with so many digits, or a dash.

    >>> number_text(0.25), number_text(1092.3, 3), number_text(1.2e11), number_text(math.nan)
    ('0.25', '1092', '1.2e+11', '-')
    """
    return without_power(f"{value:.{digits}g}", value) if math.isfinite(value) else "-"


def thousandths(margin: float) -> str:
    """Three decimals of a margin, but never a 0 that is none: its sign is the verdict; or a dash.

    >>> thousandths(-0.8691), thousandths(-0.00002), thousandths(-0.0), thousandths(math.nan)
    ('-0.869', '-2.0e-05', '0.000', '-')
    """
    if not math.isfinite(margin):
        return "-"
    return f"{margin:.1e}" if 0.0 < abs(margin) < 0.0005 else f"{margin + 0.0:.3f}"


def without_power(text: str, value: float) -> str:
    """A number in words as people write it below a million: 1092, not 1.09e+03."""
    return f"{value:.0f}" if re.search(r"e\+0[1-5]$", text) else text


_LONG = 100
"""Characters of a text from which on only what differs from another one is told."""


def where_apart(first: str, second: str) -> tuple[str, str]:
    """Both texts, of long ones what is behind the last comma before they part.

    >>> [each[:9] for each in where_apart("uniform, low 1" + 99 * " ", "uniform, low 2")]
    ['... low 1', '... low 2']
    """
    if max(len(first), len(second)) <= _LONG:
        return first, second
    both = itertools.zip_longest(first, second)
    parts = next((k for k, (a, b) in enumerate(both) if a != b), 0)
    # What differs stands in the first half of what is told.
    begin = max(first.rfind(", ", 0, parts) + 1, parts - _LONG // 2, 0)
    one, other = (
        "..." * bool(begin) + text[begin : begin + _LONG] + "..." * (len(text) > begin + _LONG)
        for text in (first, second)
    )
    return one, other


def bound_text(value: float, digits: int = 4, *, upper: bool) -> str:
    """A bound with so many digits, or a dash: an upper one rounded up and a lower one down, so that
    what is printed holds as surely as what was computed.

    >>> bound_text(0.17464, 3, upper=True), bound_text(0.82538, upper=False)
    ('0.175', '0.8253')
    >>> bound_text(0.9, upper=False), bound_text(1.0 - 0.9, upper=True)
    ('0.9', '0.1')
    """
    if not math.isfinite(value) or value == 0.0:
        return number_text(value, digits)
    # Twelve digits, beyond which there is round-off only.
    exact = Decimal(f"{value:.12g}")
    last = Decimal((0, (1,), exact.adjusted() + 1 - digits))
    return number_text(float(exact.quantize(last, ROUND_CEILING if upper else ROUND_FLOOR)), digits)


def digits_of(least: float, most: float) -> int:
    """Four, or so many that a narrow range has two of its own.

    >>> digits_of(22.19, 33.5), digits_of(4.99623, 4.99725)
    (4, 5)
    """
    larger = max(abs(least), abs(most)) / (most - least) if most > least else 1.0
    return max(4, int(math.log10(larger)) + 2)


def fine_text(value: float, digits: int) -> str:
    """A number with so many digits; of a narrow range with their zeros, so that all have as many.

    >>> fine_text(2.99996, 5), fine_text(3.0, 4)
    ('3.0000', '3')
    """
    if digits > 4 and math.isfinite(value):
        return f"{value:#.{digits}g}"
    return number_text(value, digits)


def interval_text(low: float, high: float, digits: int = 4) -> str:
    """Both ends of an interval without digits beyond its half, equally many, or a dash.

    >>> interval_text(6.4463, 6.7259), interval_text(1.0, math.inf), interval_text(0.6511, 0.8976)
    ('6.45 .. 6.73', '1 .. -', '0.65 .. 0.90')
    >>> interval_text(-0.0028, -0.00004), interval_text(0.90708, 1.03187, 3)
    ('-0.0028 .. 0.0000', '0.907 .. 1.032')
    """
    if not (math.isfinite(low) or math.isfinite(high)):
        return "-"
    half = 0.5 * (high - low)
    ends = [known_to(number_text(end, digits), half, ".1e", end, least=0) for end in (low, high)]
    if all(re.fullmatch(r"-?\d+(\.\d+)?", end) for end in ends):
        # Zeros that .g drops say as much as other digits: 45.63 .. 46.30.
        longest = max(len(end.partition(".")[2]) for end in ends)
        ends = [f"{Decimal(repr(end)):.{longest}f}" for end in (float(low), float(high))]
    ends = [end.removeprefix("-") if re.fullmatch(r"-0\.?0*", end) else end for end in ends]
    return " .. ".join(ends)


def estimate_text(value: float, low: float, high: float, digits: int = 4) -> str:
    """An estimate to two digits of half of its interval."""
    return known_to(number_text(value, digits), 0.5 * (high - low), ".1e", value)


def size_text(size: float) -> str:
    """Bytes with two digits or three.

    >>> size_text(48047.0), size_text(5.2e6), size_text(312e9)
    ('48 kB', '5.2 MB', '312 GB')
    """
    unit = "B"
    for larger in ("kB", "MB", "GB", "TB"):
        if size >= 999.5:
            size, unit = size / 1000.0, larger
    return f"{size:.{2 if size < 99.5 else 3}g} {unit}"


def chance_text(probability: float) -> str:
    """A probability that is of interest if it is small, as "p = 0.03"."""
    return f"p = {probability:.2g}" if round(probability, 4) else "p < 0.0001"


def unit_text(units: str) -> str:
    """A unit as people read it, empty of numbers without one; files name it as CF does.

    >>> unit_text("degree"), unit_text("degree s-1"), unit_text("1")
    ('deg', 'deg s-1', '')
    """
    return "" if units == "1" else units.replace("degree", "deg")


def readable(units: str, largest: float) -> tuple[float, str]:
    """Factor and unit in which people read numbers of an SI unit up to a size; files hold SI.

    >>> readable("Pa", 3e7), readable("Pa", 1.2e11), readable("N", 3e7)
    ((1e-06, 'MPa'), (1e-09, 'GPa'), (1.0, 'N'))
    """
    if units != "Pa":
        return 1.0, units
    return (1e-9, "GPa") if abs(largest) >= _GIGA else (1e-6, "MPa")


_GIGA = 1e10
"""Pascal from which on these are moduli and not stresses."""


def with_unit(number: str, units: str) -> str:
    """A number in words and its unit.

    >>> with_unit("3.2", "N"), with_unit("3.2", "1"), with_unit("+3.018e+07", "Pa")
    ('3.2 N', '3.2', '+30.18 MPa')
    """
    if units == "Pa" and number != "-":
        factor, units = readable(units, float(number))
        number = f"{factor * float(number):{'+' * number.startswith('+')}.6g}"
    return f"{number} {unit_text(units)}".rstrip()


def amount_text(value: float, units: str, form: str = ".3g") -> str:
    """A value of an SI unit in the unit in which people read it.

    >>> amount_text(3.018e7, "Pa"), amount_text(3.018e7, "Pa", "+.4g"), amount_text(0.25, "1")
    ('30.2 MPa', '+30.18 MPa', '0.25')
    """
    factor, unit = readable(units, value)
    return f"{factor * value:{form}} {unit_text(unit)}".rstrip()


def unit_behind(words: str, units: str) -> str:
    """What a number is, and its unit: "tension (N)"."""
    return words if units == "1" else f"{words} ({unit_text(units)})"


# Tables whose cells are sentences: a block a row.


def block_lines(tables: Iterable[Table], head: Iterable[str], width: int = 100) -> list[str]:
    """The lines for a terminal of tables with a name and a state in the first and third column, and
    cells of several lines in the others; ``head`` stands above all.
    """
    told = [line for each in head for line in textwrap.wrap(each, width)]
    for table in tables:
        told += ["", table.title, *(each for n in table.notes for each in textwrap.wrap(n, width))]
        for name, asks, state, *cells in table.rows:
            told += ["", *textwrap.wrap(f"{name}: {state}", width)]
            for column, cell in zip(("asks", *table.head[3:]), (asks, *cells), strict=True):
                for k, line in enumerate(cell.splitlines()):
                    first = f"  {'' if k else column:<10}"
                    told += textwrap.wrap(
                        line, width, initial_indent=first, subsequent_indent=" " * 14,
                        break_long_words=False, break_on_hyphens=False,
                    )  # fmt: skip
    return told
