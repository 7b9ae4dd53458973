"""The family of cable faults."""

from typing import Annotated

from pydantic import Field

from ringsim.cable.ropes import Array, Ropes
from ringsim.cable.state import ChainState
from ringsim.parts.faults.family import Fault


class CableFault(Fault):
    """Something that breaks at a given time and place."""

    cable: Annotated[int, Field(ge=1)] = 1
    """Which cable of the scene, "upper" or "lower", or its number from 1: the upper one first."""

    def strike(self, ropes: Ropes, state: ChainState) -> Ropes:
        """The ropes after the fault, from those before it and the chain at that instant; ValueError
        as of ``change``.
        """
        return self.change(ropes, state.stored, state.wound)

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """The ropes after the fault, with the natural length in each span, m, shape (spans,), and
        the rope wound at both ends of each cable, m, shape (cables, 2), at that instant.

        ValueError if the cable or the place on it does not exist.
        """
        raise NotImplementedError

    def clear(self, ropes: Ropes) -> Ropes:
        """The ropes after the fault is cleared; ValueError if it cannot be."""
        raise NotImplementedError
