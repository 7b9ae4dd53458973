"""All figures that apply to a run or to a campaign, drawn and written."""

import base64
import html
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from PIL import Image

from ringsim.analysis.courses import any_finite
from ringsim.choice import load_package
from ringsim.dataset import as_in_scene
from ringsim.files import whole, writing
from ringsim.plots import NO_JOINTS, Picture, barred, jointed, known, style

load_package("ringsim.plots")
PICTURES = tuple(sorted(known.values(), key=lambda each: (each.of, each.place)))


def names_for(dataset: xr.Dataset) -> list[str]:
    """The names of the figures that ``figures_of`` draws."""
    dataset = as_in_scene(dataset)
    return [p.name for p in PICTURES if _recorded(dataset, p) and p.applies(dataset)]


def figures_of(dataset: xr.Dataset, name: str | None = None) -> Iterator[tuple[Picture, Figure]]:
    """Every figure for which a run, or the samples of a merged campaign, recorded something; or the
    one of that name.

    InputError if not all planes, sections and others of its scene are there.
    """
    dataset, read = style.legible(as_in_scene(dataset)), dict[object, object]()
    for each in PICTURES:
        if name not in (None, each.name):
            continue
        if not _recorded(dataset, each) or not each.applies(dataset):
            continue
        if each.read is not None and each.read not in read:
            read[each.read] = each.read(dataset)
        shared = [] if each.read is None else [read[each.read]]
        figure = each.draw(dataset, *shared)
        style.in_readable_units(figure)
        yield each, figure


def _recorded(dataset: xr.Dataset, each: Picture) -> bool:
    if each.of != ("campaign" if "sample" in dataset.dims else "run"):
        return False
    if not all(name in dataset for name in each.needs):
        return False
    if each.of == "run":
        return all(bool(np.isfinite(dataset[name]).any()) for name in each.needs)
    # Of a number that no run has reached the file still has the variable.
    return all(any_finite(dataset, name) for name in each.needs[:1])


def left_out(dataset: xr.Dataset) -> str:
    """The figures that are not drawn although their numbers are recorded, and why; or nothing."""
    names = [
        each.name for each in PICTURES
        if each.applies in (jointed, barred) and _recorded(dataset, each)
        and not each.applies(dataset)
    ]  # fmt: skip
    return f"not drawn: {', '.join(names)}: {NO_JOINTS}" if names else ""


def draw_figures(
    dataset: xr.Dataset, folder: str | Path, name: str = "run", formats: Sequence[str] = ("png",)
) -> list[Path]:
    """Write every figure of a run, finished or not, or of a merged campaign, as
    NAME-fig-FIGURE.png.

    ``folder`` is created if it does not exist; ``formats`` are any of png, svg and pdf.  Returns
    the files written, none if nothing was recorded.

    Raises
    ------
    InputError
        If the folder or a file cannot be written.
    """
    folder = Path(folder)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    return [
        path for each, figure in figures_of(dataset)
        for path in write_figure(figure, folder, f"{name}-fig-{each.name}", formats)
    ]  # fmt: skip


def write_figure(
    figure: Figure, folder: Path, stem: str, formats: Sequence[str] = ("png",)
) -> list[Path]:
    """Write a figure as STEM.png, or in other formats, into a folder; the files.

    InputError if the folder or a file cannot be written.
    """
    written = [folder / f"{stem}.{kind}" for kind in formats]
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for path in written:
            write(figure, path)
    return written


@style.styled
def write(figure: Figure, path: Path) -> None:
    """Write a file of the kind that its name tells: png, svg or pdf; whole, or not at all."""
    with whole(path, lasting=False) as draft:
        if path.suffix == ".png":
            # As ``savefig``, which draws a figure twice that has a layout to find.
            with _laid_out(figure, matplotlib.rcParams["savefig.dpi"]):
                figure.savefig(draft, format="png")
        else:
            figure.savefig(draft, format=path.suffix[1:])


@contextmanager
def _laid_out(figure: Figure, dpi: float) -> Iterator[None]:
    """A figure at a resolution with the layout that it needs there, found once, which costs as much
    as drawing it twice: words have other widths in lines, and at each resolution.
    """
    engine, before = figure.get_layout_engine(), figure.dpi
    figure.set_dpi(dpi)
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")
    try:
        yield
    finally:
        if engine is not None:  # None would be that of the style
            figure.set_layout_engine(engine)
        figure.set_dpi(before)


# Figures as text and bytes: as a notebook shows them, and as elements of an HTML page, SVG where
# they are light, PNG where they are not.


HEAVY = 120_000
"""Bytes of SVG above which a figure goes into a page as PNG."""
_ARTISTS = 800
"""Artists of a figure whose SVG is beyond that: 400 to 600 took 100 to 170 thousand."""
_DPI = 110
_SVG_DPI = 72.0
"""Of what matplotlib draws as lines, whatever the figure's."""
_PIXELS = 96.0
"""Of a page in an inch; figures larger than drawn would have words larger than the page's."""


@style.styled
def as_png(figure: Figure) -> bytes:
    """A figure as a notebook shows it."""
    held = io.BytesIO()
    figure.savefig(held, format="png", dpi=_DPI)
    return held.getvalue()


class Inline:
    """A figure as an element of an HTML page that loads nothing and is described by ``words``.

    The same figure gives the same text.  Ids begin with ``name``, since all figures of a page
    share one space of them, and matplotlib numbers them alike in each.
    """

    def __init__(self, figure: Figure, name: str, words: str) -> None:
        self._figure, self._name, self._words = figure, name, words
        self._size = f'style="--wide: {_PIXELS * figure.get_size_inches()[0]:.0f}px"'

    def element(self, heavy: int = HEAVY) -> str:
        """``<svg>``, or ``<img>`` if that has more than ``heavy`` characters."""
        # Of so many artists lines are never light, and drawing them would be in vain.
        if len(self._figure.findobj()) > _ARTISTS or len(self._lines) > heavy:
            return self._picture
        return self._lines

    @cached_property
    @style.styled
    def _lines(self) -> str:
        held, name = io.StringIO(), self._name
        canvas: Any = FigureCanvasSVG(self._figure)
        with matplotlib.rc_context({"svg.hashsalt": name}), _laid_out(self._figure, _SVG_DPI):
            # By the canvas itself: savefig draws a figure twice that had a layout to find.
            self._figure.set_dpi(matplotlib.rcParams["savefig.dpi"])
            canvas.print_svg(held, metadata={"Date": None})
        text = held.getvalue()
        text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
        text = re.sub(r'\bid="', f'id="{name}-', text)
        text = re.sub(r'(xlink:href="|url\()#', rf"\g<1>#{name}-", text)
        # In a page the size is that of the column; the names of its XML dialects are known there.
        end = text.index(">")
        opening = re.sub(r' (xmlns(:xlink)?|width|height|version)="[^"]*"', "", text[:end])
        label = f' role="img" aria-label="{html.escape(self._words)}" {self._size}'
        return opening + label + text[end:]

    @cached_property
    @style.styled
    def _picture(self) -> str:
        canvas: Any = FigureCanvasAgg(self._figure)
        with _laid_out(self._figure, _DPI):
            canvas.draw()
            drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
        # 256 colours are a third of the bytes, and nobody sees a difference.
        few, picture = drawn.quantize(dither=Image.Dither.NONE), io.BytesIO()
        few.save(picture, format="png")  # optimised it takes ten times as long for 8 % less
        data = base64.b64encode(picture.getvalue()).decode("ascii")
        words = html.escape(self._words)
        return f'<img alt="{words}" {self._size} src="data:image/png;base64,{data}">'
