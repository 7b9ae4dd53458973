"""Arguments and options that several verbs have."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from ringsim.overrides import in_turn, parse_assignment
from ringsim.refusal import InputError, known_or_nearest
from ringsim.scene import builtin_scenes

if TYPE_CHECKING:
    import xarray as xr

Formats = tuple[str, ...] | None
"""Those of figures that were asked for, if any were."""
PATH = click.Path(path_type=Path)
WORKERS = click.IntRange(1, 4096)


def _assigned(_context: Any, _option: Any, texts: tuple[str, ...]) -> dict[str, Any]:
    return in_turn(*(dict([parse_assignment(text)]) for text in texts))


def _formats(_context: Any, _option: Any, text: str | None) -> Formats:
    if text is None:
        return None
    return listed("--plot-format", text, PLOT_FORMATS, "is not a figure format")


def listed(option: str, text: str, known: Sequence[str], wrong: str) -> tuple[str, ...]:
    """The words of a list with commas, each once; InputError if one is not known."""
    asked = tuple(dict.fromkeys(word.strip().lower() for word in text.split(",")))
    for word in asked:
        if word not in known:
            hint = known_or_nearest(word, known)
            raise InputError(f"{option} {text}: {word!r} {wrong} ({hint})")
    return asked


def _scenes(_context: Any, _argument: Any, begun: str) -> list[CompletionItem]:
    """Built-in scenes, or files where none begins so."""
    found = [CompletionItem(name) for name in builtin_scenes() if name.startswith(begun)]
    return found or [CompletionItem(begun, type="file")]


def _paths(_context: Any, _option: Any, begun: str) -> list[CompletionItem]:
    """Paths of scenes as far as the next dot; a key that takes a value ends with "="."""
    from ringsim.reference import tree  # reads every record of the package

    every, depth = tree.paths("scene"), begun.count(".") + 1
    found = dict.fromkeys(".".join(p.split(".")[:depth]) for p in every if p.startswith(begun))
    inner = {path.rpartition(".")[0] for path in every}
    return [CompletionItem(name if name in inner else f"{name}=") for name in found]


PLOT_FORMATS = ("png", "svg", "pdf")
PLOT_FORMAT = click.option(
    "--plot-format", "formats", metavar="png,svg,pdf", callback=_formats,
    help="File formats of the figures, one or more (default png).",
)  # fmt: skip
ANIMATE = click.option(
    "--animate", is_flag=True, help="Also write an animated GIF of the structure."
)
COLOUR = click.option(
    "--colour", metavar="lag|stress", default=None,
    type=click.Choice(["lag", "stress"]),
    help="Colours of --animate: deviation from the mean opening angle (default), or stress.",
)  # fmt: skip
SCENE = click.argument("scene", metavar="SCENE", shell_complete=_scenes)
FOLDER = click.argument("folder", type=PATH)
SETTINGS = click.option(
    "--set", "settings", metavar="PATH=VALUE", multiple=True, callback=_assigned,
    shell_complete=_paths,
    help="Replace a value, e.g. loads.force=0.02, rods.young_modulus[3]=1e11, net=none.",
)  # fmt: skip
"""Gives values by scene path."""


def require_with(option: str, value: object, other: str, given: object) -> None:
    """Refuse (InputError) an option that says nothing without another one."""
    if value is not None and not given:
        told = ",".join(value) if isinstance(value, tuple) else value
        told = "" if value is True else f" {told}"  # a flag has no value
        raise InputError(f"{option}{told}: has no effect without {other}; give both")


def draw_figures(dataset: "xr.Dataset", folder: Path, name: str, formats: Formats) -> list[Path]:
    """Draw all figures of a run or a campaign, and tell their files."""
    from ringsim.plots import figures

    drawn = figures.draw_figures(dataset, folder, name, formats or ("png",))
    for picture in drawn:
        click.echo(f"wrote {picture}")
    return drawn


def write_animation(run: "xr.Dataset", file: Path, colour: str | None) -> None:
    """Write a run as a GIF, and tell its file."""
    from ringsim.plots.animation import animate

    click.echo(f"wrote {animate(run, file, colour or 'lag')}")


def draw_result(dataset: "xr.Dataset", folder: Path, stem: str, formats: Formats = None) -> None:
    """Write the figure of a posterior, of a front or of modes, as their verbs and plot do."""
    from ringsim.plots import figures
    from ringsim.plots.comparison import learnt
    from ringsim.plots.ring import modes
    from ringsim.plots.studies import front

    name, draw = ("learnt", learnt) if "learnt" in dataset else ("front", front)
    if "mechanism_modes" in dataset:
        name, draw = "modes", modes
    for written in figures.write_figure(
        draw(dataset), folder, f"{stem}-fig-{name}", formats or ("png",)
    ):
        click.echo(f"wrote {written}")
