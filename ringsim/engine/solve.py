"""Which integration a structure gets: one line a kind."""

from __future__ import annotations

from typing import Protocol

from ringsim.engine import planar_truss_outcome
from ringsim.engine.build import build
from ringsim.engine.integrate import Integration
from ringsim.engine.outcome import to_outcome
from ringsim.engine.planar_truss import build_truss
from ringsim.engine.planar_truss_run import TrussIntegration
from ringsim.parts.structure.pantograph_ring import PantographRing
from ringsim.parts.structure.planar_truss import PlanarTruss
from ringsim.scene import Scene
from ringsim.variables import Outcome


class Solved(Protocol):
    """A run that has ended, ready to be put on the scene's output grid."""

    def __call__(self, *, wall_time: float, cpu_time: float) -> Outcome:
        """Its outcome, with the time (s) that it took."""


class Solver(Protocol):
    """Builds and integrates a scene.  A solve that fails is a status, not an exception."""

    def __call__(self, scene: Scene) -> Solved:
        """Run a scene."""


def solve_ring(scene: Scene) -> Solved:
    """A pantograph ring, until all V-joints have locked."""
    built = build(scene)
    history = Integration(built).run()
    built.ring.assembly.container.Reset()

    def finish(*, wall_time: float, cpu_time: float) -> Outcome:
        return to_outcome(history, scene, wall_time=wall_time, cpu_time=cpu_time)

    return finish


def solve_planar_truss(scene: Scene) -> Solved:
    """A planar truss, until the end time."""
    model = build_truss(scene)
    history = TrussIntegration(model).run()
    model.assembly.container.Reset()

    def finish(*, wall_time: float, cpu_time: float) -> Outcome:
        return planar_truss_outcome.to_outcome(
            history, model, wall_time=wall_time, cpu_time=cpu_time
        )

    return finish


SOLVERS: dict[type, Solver] = {
    PantographRing: solve_ring,
    PlanarTruss: solve_planar_truss,
}
