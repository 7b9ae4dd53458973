"""Stress and strain of the rods."""

import numpy as np

from ringsim.outputs.family import (
    Array,
    ErrorBar,
    Output,
    Peak,
    Reading,
    Run,
    Series,
    Values,
    Variable,
)

# Stress of the rods.


PEAK = Peak("peak_stress", ("rod", "section"), "the largest stress of a rod", "rod_stress")


class RodStress(Output):
    """Axial + bending stress at the ends of every rod half, and the largest at any step."""

    rank = 30
    needs = ("stress",)
    peak = PEAK
    limit = "rod_stress"
    coordinates = (Variable("rod", ("rod",), "1", "rod half of a section", "str"),)
    variables = (
        Variable(
            "rod_stress", ("rod", "section", "time"), "Pa",
            "axial + bending stress of a rod, elastic + viscous",
        ),
        Variable(
            "peak_rod_stress", (), "Pa", "largest axial + bending stress of any rod",
            error_bar=ErrorBar("largest stress", safety=4.0),
            summary=("largest rod stress", "10.4g"), worse="larger", largest_of="rod_stress",
        ),
        *PEAK.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """Shape (rod halves, sections), Pa."""
        return now.meters.stress()

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated, and the largest reading."""
        values, peak = super().reduce(run, series), PEAK.of(run, series.times, series.values)
        return values | peak | {"peak_rod_stress": np.nanmax(series.values)}

    def shocks(self, run: Run, series: Series) -> dict[str, float]:
        """When the largest stress was."""
        largest = np.nanmax(series.values.reshape(len(series.times), -1), axis=1)
        return {"peak_rod_stress": float(series.times[largest.argmax()])}


# Bending strain of the rod that carries a structure's gauge.


class BendingStrain(Output):
    """Strain of the outer fibre at the nodes, where a beam loaded at its nodes is bent most."""

    rank = 44
    needs = ("gauge",)
    coordinates = (
        Variable("station", ("station",), "m", "distance along the upper beam from the fixed axis"),
    )
    variables = (
        Variable(
            "bending_strain", ("station", "time"), "1", "bending strain of the upper beam's fibre"
        ),
        Variable(
            "peak_bending_strain", (), "1", "largest bending strain of the upper beam at any step",
            summary=("largest strain", "10.2e"), worse="larger", largest_of="bending_strain",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """Shape (stations,)."""
        return now.meters.strain()
