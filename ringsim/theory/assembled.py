"""The structure as it is put together before a run."""

from typing import NamedTuple

from ringsim.layout.layout import Layout
from ringsim.parts.rods.family import Rods


class Assembled(NamedTuple):
    """A layout whose bodies and rods' nodes are where they balance, and their elastic energy, J."""

    layout: Layout
    energy: float


def assembled(layout: Layout, rods: Rods, *, locked: bool = False) -> Assembled:
    """The structure as it is put together; the layout itself if that is as drawn.

    Where it is ``locked`` every opening angle is held, not only their mean.

    Raises
    ------
    ValueError
        If nothing balances near the drawing.
    """
    wrong = any(rod.strain for rod in layout.rods) or any(
        joint.error is not None for joint in layout.joints
    )
    if not wrong and (locked or layout.held is None):
        return Assembled(layout, 0.0)
    from ringsim.theory.assembling import Frames  # here: it loads scipy, and few scenes need it

    frames = Frames(layout, rods, locked=locked)
    return Assembled(frames.relax(), frames.energy)
