"""``ringsim scenes``: what is built in, and its text as a starting point."""

import click

from ringsim.refusal import InputError, known_or_nearest
from ringsim.scene import builtin_scenes, scene_from_toml


@click.command()
@click.argument("name", required=False)
def command(name: str | None) -> None:
    """List the built-in scenes, or print the TOML of one.

    To start a scene of your own: ringsim scenes ring18 > my.toml
    """
    texts = builtin_scenes()
    if name is not None:
        if name not in texts:
            raise InputError(f"{name}: no built-in scene ({known_or_nearest(name, texts)})")
        click.echo(texts[name], nl=False)
        return
    longest = max(map(len, texts))
    for key, text in texts.items():
        scene = scene_from_toml(text, source=f"scene {key}")
        sections = scene.structure.sections
        count = f"{sections} section{'s' if sections > 1 else ''}"
        click.echo(f"{key:<{longest}}  {count:>12}  {scene.title}")
