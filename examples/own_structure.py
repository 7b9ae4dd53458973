"""A structure of one's own: a double ring, two pantograph rings joined at their corners.

Both rings have the same rods.  Their chords 2 (l cos(phi) + a) then differ by 2 (a_1 - a_2) at
every fold angle phi, and so do their corners by constant vectors: a wide hinge assembly joins them.
"""

from dataclasses import replace
from typing import Any, ClassVar, Literal

import numpy as np

import ringsim
from ringsim.layout.bodies import Lump
from ringsim.layout.draft import Draft
from ringsim.layout.layout import Layout, internal_mobility, layout_of
from ringsim.structures.pantograph_ring import PantographRing, add_sections
from ringsim.units import Metre


class DoubleRing(PantographRing):
    """The outer ring has ``hinge_offset`` a_1, the inner one ``inner_offset`` a_2."""

    planes: ClassVar[tuple[str, ...]] = ("upper", "lower", "inner upper", "inner lower")
    kind: Literal["double-ring"] = "double-ring"  # type: ignore[assignment]
    inner_offset: Metre = 0.01

    def layout(self, scene: Any, coordinate: Any) -> Layout:
        """Sections of both rings between the same hinge assemblies."""
        draft, outer = Draft(scene), self.geometry()
        inner = replace(outer, hinge_offset=self.inner_offset)
        fold, cube = outer.fold(coordinate), self.hinge_size**2 / 6.0 * np.eye(3)
        hinge = Lump("hinges", self.corner_mass, np.zeros(3), self.corner_mass * cube)
        draft.corners = [[draft.body(at, [hinge]) for at in plane] for plane in fold.corners]
        add_sections(draft, outer, fold, draft.corners, self.vjoint_mass)
        add_sections(draft, inner, inner.fold(coordinate), draft.corners, self.vjoint_mass,
                     plane=2, prefix="inner_")  # fmt: skip
        return draft.finish()


ring = {"kind": "double-ring", "sections": 6, "hinge_offset": 0.05, "opening_angle": 100.0}
scene = ringsim.load_scene("ring18").with_values({"structure": ring, "record.stress": False})
print(f"mobility with rigid rods {internal_mobility(layout_of(scene))}")
run = ringsim.simulate(scene)
print(f"{run.attrs['reason']}: after {float(run.deployment_time):.3f} s")
print(f"planes out of step by up to {float(run.asynchrony_max):.3f} deg")
print(f"energy balance {float(run.energy_error):.1e} of what was exchanged")
