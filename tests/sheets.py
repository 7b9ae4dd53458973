"""Which words of a figure its sheet cuts off."""

from matplotlib.figure import Figure
from matplotlib.text import Text


def cut_words(figure: Figure) -> list[str]:
    """Words that leave the sheet: of labels, titles, legends and all else but numbers of axes.

    The layout makes room for the height of a label below axes, not for its width.
    """
    figure.draw_without_rendering()
    sheet, found = figure.bbox.padded(1.0), []
    numbers = {
        text for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
        for text in (tick.label1, tick.label2)
    }  # fmt: skip
    for text in figure.findobj(Text):
        hidden = not text.get_visible() or (text.axes and not text.axes.get_visible())
        if text in numbers or hidden or not text.get_text().strip():
            continue
        box = text.get_window_extent()
        if not (sheet.x0 <= box.x0 and box.x1 <= sheet.x1 and sheet.y0 <= box.y0
                and box.y1 <= sheet.y1):  # fmt: skip
            found.append(text.get_text())
    return found
