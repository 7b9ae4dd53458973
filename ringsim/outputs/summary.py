"""The main numbers of a run in words."""

import numpy as np

from ringsim.outputs.family import OUTPUTS, Output, Values, Variable
from ringsim.scene import Scene


def summed_up(values: Values) -> list[tuple[type[Output], Variable]]:
    """Outputs with their variables that have a place in the summary, and a finite value."""
    return [
        (output, variable)
        for output in OUTPUTS
        for variable in output.variables
        if variable.summary is not None and np.isfinite(float(values.get(variable.name, np.nan)))
    ]


def in_unit(values: Values, variable: Variable) -> str:
    """A value as the summary gives it, with its unit and error bar."""
    assert variable.summary is not None
    unit = {"degree": " deg", "1": ""}.get(variable.units, f" {variable.units}")
    bar = values.get(f"{variable.name}_error")
    number = np.asarray(values[variable.name]).item()
    text = f"{number:{variable.summary[1]}}{unit}"
    return text if bar is None else f"{text} +- {np.asarray(bar).item():.2g}"


def summary(values: Values, scene: Scene) -> list[str]:
    """One line for each main number of a run: what, how much, when and where."""
    lines = []
    for output, variable in summed_up(values):
        if variable.name == "total_steps" and not values.get("restarts", 0):
            continue
        assert variable.summary is not None
        line = f"{variable.summary[0]:20s}{in_unit(values, variable)}"
        lines.append(f"{line} {output().told(values, scene)}".rstrip())
    return lines
