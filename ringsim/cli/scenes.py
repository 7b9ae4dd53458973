"""``ringsim scenes``: what is built in, and its text as a starting point."""

import json
from pathlib import Path

import click

from ringsim.cli.options import PATH
from ringsim.files import require_place, write_text
from ringsim.refusal import InputError, known_or_nearest
from ringsim.scene import builtin_scenes, scene_from_toml

SCHEMA = "scene.schema.json"
"""File beside a scene that editors check it by."""


@click.command()
@click.argument("name", required=False)
@click.option(
    "--out",
    metavar="FILE",
    type=PATH,
    help="Write it to this file, and a schema for editors beside it.",
)
def command(name: str | None, out: Path | None) -> None:
    """List the built-in scenes, or print the TOML of one.

    To start a scene of your own: ringsim scenes ring18 > my.toml
    """
    texts = builtin_scenes()
    if name is not None:
        if name not in texts:
            raise InputError(f"{name}: no built-in scene ({known_or_nearest(name, texts)})")
        if out is None:
            click.echo(texts[name], nl=False)
        else:
            _write_with_schema(texts[name], out)
        return
    if out is not None:
        raise InputError(f"--out {out}: needs the name of a scene ({', '.join(texts)})")
    longest = max(map(len, texts))
    for key, text in texts.items():
        scene = scene_from_toml(text, source=f"scene {key}")
        sections = scene.structure.sections
        count = f"{sections} section{'s' if sections > 1 else ''}"
        click.echo(f"{key:<{longest}}  {count:>12}  {scene.title}")


def _write_with_schema(text: str, out: Path) -> None:
    """Write a scene whose first line names the schema file written beside it.

    A name without a folder: both files may be moved, and nothing is looked up elsewhere.
    """
    from ringsim.reference.schema import schema_of  # reads every record of the package

    require_place(out)
    schema = out.with_name(SCHEMA)
    for path, content in (
        (out, f"#:schema {SCHEMA}\n{text}"),
        (schema, json.dumps(schema_of("scene"), indent=1) + "\n"),
    ):
        write_text(path, content)
        click.echo(f"wrote {path}")
