"""The cables of a scene: one in the upper plane, one in the lower, or either alone."""

from __future__ import annotations

from pydantic import model_validator

from ringsim.cable.records import Cable
from ringsim.units import Metre, Model


def pulleys_of(sections: int, *, winches: int = 1) -> int:
    """Pulleys of a cable along so many sections, with one winch or with one at either end."""
    return 3 * sections - 2 + winches


class Cables(Model):
    """Driving cables along the ring, each with its own winch, friction and faults.

    The path of a cable: winch, then for every section the pulley on its first hinge assembly,
    the pulley on its V-joint's block and the pulley on its second hinge assembly.  With one winch
    the last of these holds the cable's end: N sections have 3 N spans and 3 N - 1 pulleys.  With
    a winch at either end the rope runs over it as well and down to the far winch, as it comes up
    from the first: 3 N + 1 spans and 3 N pulleys, the same path from both ends.
    Source: paper 000, figs 1-3.
    """

    upper: Cable | None = None
    lower: Cable | None = None
    winch_distance: Metre = 0.3
    """From a winch to its nearest pulley, along the boom (paper 000: the first span does not
    change its length)."""

    @model_validator(mode="after")
    def _any(self) -> Cables:
        if self.upper is None and self.lower is None:
            raise ValueError("upper or lower must hold a cable (or leave out the whole table)")
        return self

    def present(self) -> list[tuple[int, Cable]]:
        """The cables that there are, with the number of their plane (0 upper, 1 lower)."""
        both = ((0, self.upper), (1, self.lower))
        return [(plane, cable) for plane, cable in both if cable is not None]
