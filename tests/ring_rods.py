"""Names of a pantograph ring's rod halves, in the order of the results."""

from ringsim.layout.halves import halves
from ringsim.layout.of_scene import layout_of
from ringsim.scene import load_scene

RODS = tuple(halves(layout_of(load_scene("truss2"))))
