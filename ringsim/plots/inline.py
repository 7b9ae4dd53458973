"""A figure as text for an HTML page: SVG where it is light, PNG where it is not."""

import base64
import html
import io
import re

import matplotlib
from matplotlib.figure import Figure
from PIL import Image

from ringsim.plots import style

HEAVY = 120_000
"""Bytes of SVG above which a figure goes into a page as PNG."""
_DPI = 110
_PIXELS = 96.0
"""Of a page in an inch; figures larger than drawn would have words larger than the page's."""


@style.styled
def inline(figure: Figure, name: str, words: str) -> str:
    """An ``<svg>`` or ``<img>`` element that loads nothing and is described by ``words``.

    The same figure gives the same text.  Ids begin with ``name``, since all figures of a page
    share one space of them, and matplotlib numbers them alike in each.
    """
    size = f'style="max-width: {_PIXELS * figure.get_size_inches()[0]:.0f}px"'
    held = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name}):
        figure.savefig(held, format="svg", metadata={"Date": None})
    text = held.getvalue()
    if len(text) > HEAVY:
        picture = io.BytesIO()
        figure.savefig(picture, format="png", dpi=_DPI, metadata={"Software": None})
        with Image.open(picture) as drawn:
            # 256 colours are a third of the bytes, and nobody sees a difference.
            few = drawn.convert("RGB").quantize(dither=Image.Dither.NONE)
        picture = io.BytesIO()
        few.save(picture, format="png", optimize=True)
        data = base64.b64encode(picture.getvalue()).decode("ascii")
        return f'<img alt="{html.escape(words)}" {size} src="data:image/png;base64,{data}">'
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'(xlink:href="|url\()#', rf"\g<1>#{name}-", text)
    # In a page the size is that of the column; the names of its XML dialects are known there.
    opening = re.sub(r' (xmlns(:xlink)?|width|height|version)="[^"]*"', "", text[: text.index(">")])
    label = f' role="img" aria-label="{html.escape(words)}" {size}'
    return opening + label + text[text.index(">") :]
