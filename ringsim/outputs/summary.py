"""The main numbers of a run in words."""

import numpy as np

from ringsim.outputs.family import OUTPUTS, SpanNames, Values


def summary(values: Values, span_names: SpanNames) -> dict[str, str]:
    """What is told of each main number that is known, by variable: how much, when and where."""
    found = {}
    for output in OUTPUTS:
        for variable in output.variables:
            if variable.summary is None:
                continue
            number = np.asarray(values.get(variable.name, np.nan)).item()
            if not np.isfinite(number):
                continue
            # Whole numbers of which some are missing come as floats out of files.
            number = int(number) if variable.dtype.startswith("i") else number
            unit = {"degree": " deg", "1": ""}.get(variable.units, f" {variable.units}")
            text = f"{number:{variable.summary[1]}}{unit}"
            if (bar := values.get(f"{variable.name}_error")) is not None:
                text += f" +- {np.asarray(bar).item():.2g}"
            found[variable.name] = f"{text} {output().told(values, span_names)}".rstrip()
    return found
