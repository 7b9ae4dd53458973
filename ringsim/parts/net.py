"""The net, reduced to springs."""

from __future__ import annotations

from ringsim.parts.persection import PerSection
from ringsim.units import DampingRate, Kilogram, Metre, Model, SpringRate


class Net(Model):
    """A spring from every upper corner to one free hub point in the middle.

    Force = stiffness * (distance - neutral_length) + damping * rate, only while longer than
    neutral unless two_sided.  Source: paper 002, eqs 9-11 and table 1; where the springs go is
    inferred from the published deployment times.
    """

    stiffness: PerSection[SpringRate] = 0.001
    """One value, or one per corner."""
    damping: DampingRate = 0.0
    neutral_length: Metre = 0.7116
    two_sided: bool = False
    hub_mass: Kilogram = 1e-5
