"""Names of a pantograph ring's rod halves, in the order of the results."""

from ringsim.layout.layout import layout_of
from ringsim.scene import load_scene

RODS = tuple(layout_of(load_scene("truss2")).halves())
