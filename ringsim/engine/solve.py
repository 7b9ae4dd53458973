"""Building a scene, integrating it, and letting go of what it held."""

from __future__ import annotations

from ringsim.engine.build import build
from ringsim.engine.integrate import Integration
from ringsim.scene import Scene
from ringsim.variables import Outcome


def solve(scene: Scene) -> Outcome:
    """Run a scene.  A solve that fails is a status, not an exception."""
    built = build(scene)
    history = Integration(built).run()
    built.model.assembly.container.Reset()
    return history.outcome()
