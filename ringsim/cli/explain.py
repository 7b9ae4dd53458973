"""``ringsim explain``: what the variables of a result mean."""

import click

from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.refusal import InputError, known_or_nearest
from ringsim.variables import Variable


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
def command(names: tuple[str, ...]) -> None:
    """List the variables of a result, or those named, with dimensions, units and meaning."""
    known = COORDINATES | VARIABLES
    for name in names:
        if name not in known:
            raise InputError(f"{name}: no variable of a result ({known_or_nearest(name, known)})")
    for name in names or known:
        click.echo(explained(known[name]))


def explained(variable: Variable) -> str:
    """One line: name and dimensions, units, meaning, codes, and which scenes have it."""
    text = f"{variable.name}({', '.join(variable.dims)})"
    text = f"{text:44s} {variable.units:8s} {variable.long_name}"
    if variable.flags is not None:
        text += ": " + ", ".join(f"{int(code)} {code.word}" for code in variable.flags)
    return text + (f" (only with {', '.join(variable.needs)})" if variable.needs else "")
