"""The family of faults: things that break at a given time and place."""

from ringsim.units import Model, SecondOrZero


class Fault(Model):
    """Anything that breaks."""

    time: SecondOrZero
    """When it happens, in s of the simulation."""
