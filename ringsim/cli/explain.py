"""``ringsim explain``: what the variables of a result mean."""

import click

from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME
from ringsim.overrides import place_of
from ringsim.refusal import InputError, known_or_nearest
from ringsim.variables import Variable


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
def command(names: tuple[str, ...]) -> None:
    """List the variables of a result, or those named, with dimensions, units and meaning.

    Of a list of values for pulleys, as cables.upper.friction.coefficient, it tells their names.
    """
    known = COORDINATES | {SPAN_NAME.name: SPAN_NAME} | VARIABLES
    for name in names:
        if name not in known and place_of(name, closed=True) != "pulley":
            raise InputError(f"{name}: no variable of a result ({known_or_nearest(name, known)})")
    for name in names or known:
        click.echo(explained(known[name]) if name in known else _PULLEYS.format(path=name))


_PULLEYS = """\
{path}: one value for all pulleys, or a list with one for each from the winch on.
  A single one has a name: {path}["section 6 V"] = VALUE
  Each section has a "first hinge", a "V" and a "second hinge", seen from section 1.
  The last hinge before a cable's end holds the cable, and is no pulley.
  In a scene file: coefficient = {{ default = VALUE, "section 6 V" = VALUE }}
  Faults: pulley = "section 6 V", span = "section 6 V to second hinge" (all: span_name of a run)"""


def explained(variable: Variable) -> str:
    """One line: name and dimensions, units, meaning, codes, and which scenes have it."""
    text = f"{variable.name}({', '.join(variable.dims)})"
    text = f"{text:44s} {variable.units:8s} {variable.long_name}"
    if variable.flags is not None:
        text += ": " + ", ".join(f"{int(code)} {code.word}" for code in variable.flags)
    return text + (f" (only with {', '.join(variable.needs)})" if variable.needs else "")
