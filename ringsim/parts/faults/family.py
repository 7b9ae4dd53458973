"""The family of faults: things that break at a given time and place."""

from ringsim.units import Model, SecondOrZero

AT_ONCE = 1e-8
"""Faults strike together that are nearer than this, s: the accelerations of a shorter step are
round-off of places (in steps of 1e-10 s they blew rings up that sound steps open)."""


class Fault(Model):
    """Anything that breaks."""

    time: SecondOrZero
    """When it happens, in s of the simulation."""
