"""``ringsim explain``: what results, scenes and campaigns hold."""

import json
from typing import Any

import click
from click.shell_completion import CompletionItem

from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME
from ringsim.overrides import place_of
from ringsim.refusal import InputError
from ringsim.variables import Variable


def _names(_context: Any, _argument: Any, begun: str) -> list[CompletionItem]:
    """Variables, and paths of keys as far as the next dot."""
    from ringsim.reference import tree

    every = [*VARIABLES, *tree.ROOTS, *(path for root in tree.ROOTS for path in tree.paths(root))]
    depth = begun.count(".") + 1
    found = {".".join(name.split(".")[:depth]) for name in every if name.startswith(begun)}
    return [CompletionItem(name) for name in sorted(found)]


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1, shell_complete=_names)
@click.option("--schema", metavar="scene|campaign", help="Print the JSON Schema of such files.")
def command(names: tuple[str, ...], schema: str | None) -> None:
    """Say what the variables of a result, or the keys of a scene or campaign file, mean.

    NAME is a variable (asynchrony_max), the path of a key (cables.upper.winch, solver.step,
    design), or one of the words scene and campaign for all keys of such files.  Without a name all
    variables are listed.
    """
    if schema is not None:
        _print_schema(schema, names)
        return
    known = COORDINATES | {SPAN_NAME.name: SPAN_NAME} | VARIABLES
    # Paths are looked up before anything is printed, so that one that is refused stands alone.
    told = [explained(known[name]) if name in known else _key(name, known) for name in names]
    for text in told or map(explained, known.values()):
        click.echo(text)


def explained(variable: Variable) -> str:
    """One line: name and dimensions, units, meaning, codes, and which scenes have it."""
    text = f"{variable.name}({', '.join(variable.dims)})"
    text = f"{text:44s} {variable.units:8s} {variable.long_name}"
    if variable.flags is not None:
        text += ": " + ", ".join(f"{int(code)} {code.word}" for code in variable.flags)
    return text + (f" (only with {', '.join(variable.needs)})" if variable.needs else "")


def _key(name: str, variables: dict[str, Variable]) -> str:
    """A key of scenes or campaigns in words; InputError if there is none of that name."""
    # Here, because variables are explained without reading every record of the package.
    from ringsim.reference import tree, words

    parts = [words.all_of(name)] if name in tree.ROOTS else []
    found = tree.find(name) if parts else tree.known(name, list(variables))
    parts += [words.told(each) for each in found]
    if any(place_of(each.path, closed=True) == "pulley" for each in found):
        parts.append(words.names_of_pulleys(found[0].path))
    return "\n".join(parts)


def _print_schema(kind: str, names: tuple[str, ...]) -> None:
    from ringsim.reference.schema import schema_of

    if names:
        raise InputError(f"--schema {kind}: says nothing of {names[0]}: give one of both")
    click.echo(json.dumps(schema_of(kind), indent=2))
