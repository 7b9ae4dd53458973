"""Arguments and options that several verbs have."""

from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from ringsim.overrides import parse_assignment
from ringsim.refusal import InputError, known_or_nearest
from ringsim.scene import builtin_scenes

PATH = click.Path(path_type=Path)
WORKERS = click.IntRange(1, 4096)


def _assigned(_context: Any, _option: Any, texts: tuple[str, ...]) -> dict[str, Any]:
    return dict(parse_assignment(text) for text in texts)


def _formats(_context: Any, _option: Any, text: str | None) -> tuple[str, ...] | None:
    if text is None:
        return None
    asked = tuple(dict.fromkeys(word.strip().lower() for word in text.split(",")))
    for word in asked:
        if word not in PLOT_FORMATS:
            known = known_or_nearest(word, PLOT_FORMATS)
            raise InputError(f"--plot-format {text}: {word!r} is no format of a figure ({known})")
    return asked


def _scenes(_context: Any, _argument: Any, begun: str) -> list[CompletionItem]:
    """Built-in scenes, or files where none begins so."""
    found = [CompletionItem(name) for name in builtin_scenes() if name.startswith(begun)]
    return found or [CompletionItem(begun, type="file")]


PLOT_FORMATS = ("png", "svg", "pdf")
PLOT_FORMAT = click.option(
    "--plot-format", "formats", metavar="png,svg,pdf", callback=_formats,
    help="Formats of the figures, one or more (default png).",
)  # fmt: skip
SCENE = click.argument("scene", metavar="SCENE", shell_complete=_scenes)
FOLDER = click.argument("folder", type=PATH)
SETTINGS = click.option(
    "--set", "settings", metavar="PATH=VALUE", multiple=True, callback=_assigned,
    help="Replace a value, e.g. loads.force=0.02, rods.young_modulus[3]=1e11, net=none.",
)  # fmt: skip
"""Gives values by scene path."""


def require_plot(formats: tuple[str, ...] | None, *, plot: bool) -> None:
    """Refuse (InputError) formats of figures that nobody draws."""
    if formats is not None and not plot:
        raise InputError(
            f"--plot-format {','.join(formats)}: says nothing without --plot; give both"
        )
