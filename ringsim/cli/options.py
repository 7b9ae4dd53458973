"""Arguments and options that several verbs have."""

from pathlib import Path
from typing import Any

import click

from ringsim.overrides import parse_assignment

PATH = click.Path(path_type=Path)
WORKERS = click.IntRange(1, 4096)


def _assigned(_context: Any, _option: Any, texts: tuple[str, ...]) -> dict[str, Any]:
    return dict(parse_assignment(text) for text in texts)


SCENE = click.argument("scene", metavar="SCENE")
FOLDER = click.argument("folder", type=PATH)
SETTINGS = click.option(
    "--set", "settings", metavar="PATH=VALUE", multiple=True, callback=_assigned,
    help="Replace a value, e.g. loads.force=0.02, rods.young_modulus[3]=1e11, net=none.",
)  # fmt: skip
"""Gives values by scene path."""
