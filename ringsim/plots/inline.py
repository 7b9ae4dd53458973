"""Figures as text and bytes: as a notebook shows them, and as elements of an HTML page, SVG where
they are light, PNG where they are not.
"""

import base64
import html
import io
import re
from functools import cached_property
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from PIL import Image

from ringsim.plots.style import styled

HEAVY = 120_000
"""Bytes of SVG above which a figure goes into a page as PNG."""
_ARTISTS = 800
"""Artists of a figure whose SVG is beyond that: 400 to 600 took 100 to 170 thousand."""
_DPI = 110
_PIXELS = 96.0
"""Of a page in an inch; figures larger than drawn would have words larger than the page's."""


@styled
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
    def _placed(self) -> Figure:
        """The figure with its layout found once, which costs as much as drawing it twice."""
        if (engine := self._figure.get_layout_engine()) is not None:
            engine.execute(self._figure)
            self._figure.set_layout_engine("none")
        return self._figure

    @cached_property
    @styled
    def _lines(self) -> str:
        held, name = io.StringIO(), self._name
        with matplotlib.rc_context({"svg.hashsalt": name}):
            # By the canvas itself: savefig draws a figure twice that had a layout to find.
            self._placed.set_dpi(matplotlib.rcParams["savefig.dpi"])
            canvas: Any = FigureCanvasSVG(self._placed)
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
    @styled
    def _picture(self) -> str:
        self._placed.set_dpi(_DPI)
        canvas: Any = FigureCanvasAgg(self._placed)
        canvas.draw()
        drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
        # 256 colours are a third of the bytes, and nobody sees a difference.
        few, picture = drawn.quantize(dither=Image.Dither.NONE), io.BytesIO()
        few.save(picture, format="png")  # optimised it takes ten times as long for 8 % less
        data = base64.b64encode(picture.getvalue()).decode("ascii")
        words = html.escape(self._words)
        return f'<img alt="{words}" {self._size} src="data:image/png;base64,{data}">'
