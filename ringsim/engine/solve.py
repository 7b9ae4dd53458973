"""Which integration a structure gets: one line a kind."""

from __future__ import annotations

from collections.abc import Callable

from ringsim.engine.build import build
from ringsim.engine.integrate import Integration
from ringsim.engine.planar_truss import build_truss
from ringsim.engine.planar_truss_run import TrussIntegration
from ringsim.parts.structure.pantograph_ring import PantographRing
from ringsim.parts.structure.planar_truss import PlanarTruss
from ringsim.scene import Scene
from ringsim.variables import Outcome


def solve_ring(scene: Scene) -> Outcome:
    """A pantograph ring, until all V-joints have locked."""
    built = build(scene)
    integration = Integration(built)
    integration.run()
    built.ring.assembly.container.Reset()
    return integration.recorder.outcome()


def solve_planar_truss(scene: Scene) -> Outcome:
    """A planar truss, until the end time."""
    model = build_truss(scene)
    integration = TrussIntegration(model)
    integration.run()
    model.assembly.container.Reset()
    outcome = integration.recorder.outcome()
    del outcome.values["repeated_steps"]  # exudyn does not tell how often it halved a step
    return outcome


SOLVERS: dict[type, Callable[[Scene], Outcome]] = {
    PantographRing: solve_ring,
    PlanarTruss: solve_planar_truss,
}
"""Builds and integrates a scene.  A solve that fails is a status, not an exception."""
