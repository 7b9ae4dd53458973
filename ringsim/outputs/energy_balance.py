"""Energies over time, and what their balance lacks."""

import numpy as np

from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable
from ringsim.stepping.instant import exchanged


class EnergyBalance(Output):
    """Kinetic and elastic energy, work of loads and winches, what was lost, and the imbalance."""

    rank = 60
    of_antenna = False
    variables = (
        Variable("kinetic_energy", ("time",), "J", "kinetic energy"),
        Variable(
            "elastic_energy", ("time",), "J",
            "elastic energy of rods, springs, net, stops and cables",
        ),
        Variable("work", ("time",), "J", "work done on the structure by forces and winches"),
        Variable("dissipation", ("time",), "J", "energy lost in joints, dampers and stops"),
        Variable(
            "energy_error", (), "1", "largest energy imbalance over the largest energy exchanged",
            summary=("energy error", "10.1e"), worse="larger",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """In the order of the variables, and what winches have put in, J, shape (5,)."""
        return np.array(now.energies)

    def reduce(self, run: Run, series: Series) -> Values:
        """Each interpolated by itself: the losses may be unknown (NaN) where the others are not."""
        kinetic, elastic, work, lost, wound = series.values.T
        # What a fault takes at the start is not in the first energies any more.
        balance = kinetic - kinetic[0] + elastic - elastic[0] + lost - lost[0] - work
        scale = max(exchanged(np.array([kinetic, elastic, work - wound, wound]).T), 1e-300)
        names = [variable.name for variable in self.variables]
        shown = [*series.on_grid()[:4], np.abs(balance).max() / scale]
        return dict(zip(names, shown, strict=True))
