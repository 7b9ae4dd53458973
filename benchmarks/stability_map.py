"""Map where the solver is sound: 520 runs over stiffness, masses, friction, fold angle, steps, ...

Run: python benchmarks/stability_map.py [--quick | --every N] [--fidelity full|frame|both]
                                        [--workers N] [--out DIR]

docs/evidence/stability.md is what it wrote, of both engines with ``--every 3``.  Every panel spans
the range from harmless to absurd.  Rings are small where an axis does not need more, and start half
open where the stowed end is not the question, so that a cell takes seconds.  ``ringsim stability
SCENE`` maps around one scene.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ringsim.campaign.studies import Panel, Sweep, by_engines
from ringsim.cli.studies import draw_map
from ringsim.scene import load_scene


def _panel(
    name: str, title: str, scene: str, x: Sweep, y: Sweep, settings: Mapping[str, Any]
) -> Panel:
    return Panel(name, title, load_scene(scene).with_values(dict(settings)), x, y)


def _of_cables(leaf: str) -> tuple[str, ...]:
    return tuple(f"cables.{name}.{leaf}" for name in ("upper", "lower"))


def _for_cables(leaf: str, value: Any) -> dict[str, Any]:
    return dict.fromkeys(_of_cables(leaf), value)


_STEPS = 800
"""Steps of a cell at most: twice what a sound one needs, and the same on any machine,
unlike a limit on time."""
_RECORD = {"record.interval": 0.25}
_WOUND = {
    "structure.opening_angle": 60.0,
    "joints.vjoint.viscous": 0.2,
    "solver.end_time": 12.0,
    "solver.step_limit": _STEPS,
    **_for_cables("slack_width", 0.05),
    **_RECORD,
}
"""Two sections, wound from half open."""
_PUSHED = {
    "structure.sections": 4,
    "structure.opening_angle": 60.0,
    "boom": "none",
    "joints.vjoint.viscous": 0.001,
    "solver.end_time": 15.0,
    "solver.step_limit": _STEPS,
    **_RECORD,
}
"""A closed ring of four sections, pushed open by forces."""

_STIFFNESS = Sweep(
    "axial stiffness EA of the cables", "N", _of_cables("axial_stiffness"),
    (1e1, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9),
)  # fmt: skip
_SPEED = Sweep(
    "winding speed", "m/s", _of_cables("winch.winding.speed"),
    (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0),
)  # fmt: skip
_STOP = Sweep("stop stiffness", "N m/rad", ("stop.stiffness",), (0.1, 1.0, 10.0, 1e2, 1e4, 1e6))
_TOLERANCE = Sweep(
    "tolerance of the step control", "1", ("solver.tolerance",), (1e-5, 1e-4, 1e-3, 1e-2, 0.1)
)
_ROPE = 0.2
"""Rope in metre that the reversing winch winds up before it turns back."""

PANELS = (
    _panel(
        "cable-friction", "cables: stiffness and friction", "truss2",
        _STIFFNESS,
        Sweep("bearing coefficient f of the pulleys (limit: R = 0.01 m)", "m",
             _of_cables("friction.coefficient"),
             (0.0, 4e-4, 1e-3, 3e-3, 6e-3, 9e-3, 9.9e-3)),
        {**_WOUND, **_for_cables("winch.winding.speed", 0.15)},
    ),
    _panel(
        "cable-speed", "cables: stiffness and winding speed", "truss2",
        _STIFFNESS, _SPEED, _WOUND,
    ),
    _panel(
        "fold-speed", "fold angle and winding speed", "truss2",
        Sweep("opening angle at the start", "deg", ("structure.opening_angle",),
             (1.0, 2.0, 5.0, 10.0, 20.0, 45.0, 90.0, 135.0, 170.0, 179.0, 179.9)),
        Sweep("winding speed", "m/s", _of_cables("winch.winding.speed"), (0.1, 0.3, 1.0, 3.0)),
        _WOUND,
    ),
    _panel(
        "rods-stops", "rods and stops", "ring18",
        Sweep("Young's modulus of the rods", "Pa", ("rods.young_modulus",),
             (1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e13, 1e15)),
        _STOP, _PUSHED,
    ),
    _panel(
        "net-mass", "net and mass ratio", "ring18",
        Sweep("stiffness of the net", "N/m", ("net.stiffness",),
             (0.0, 1e-3, 1e-2, 0.1, 1.0, 1e2, 1e4, 1e6)),
        Sweep("mass of each corner and V-joint", "kg",
             ("structure.corner_mass", "structure.vjoint_mass"),
             (1e-6, 1e-4, 0.02, 0.2, 2.0, 50.0)),
        {**_PUSHED, "net.neutral_length": 0.3},
    ),
    _panel(
        "joints", "dry friction of the joints", "ring18",
        Sweep("Coulomb torque of the V-joints", "N m", ("joints.vjoint.coulomb",),
             (1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 0.1)),
        Sweep("rate at which it acts", "rad/s", ("joints.vjoint.rate",),
             (1e-5, 1e-4, 1e-3, 0.1)),
        _PUSHED,
    ),
    _panel(
        "sudden", "sudden loads and stops", "ring18",
        Sweep("force on every V-joint", "N", ("loads.force",),
             (1e-3, 0.01, 0.1, 1.0, 10.0, 1e2, 1e3, 1e4)),
        _STOP, _PUSHED,
    ),
    _panel(
        "step-tolerance", "steps that follow the motion", "truss2",
        Sweep("largest step", "s", ("solver.step",), (0.01, 0.1, 0.3, 1.0, 3.0, 10.0)),
        _TOLERANCE,
        {**_WOUND, **_for_cables("winch.winding.speed", 0.15), "solver.step_limit": 6000},
    ),
    _panel(
        "step-tolerance-pushed", "steps that follow the motion, forces", "ring18",
        Sweep("largest step", "s", ("solver.step",), (0.01, 0.1, 0.3, 1.0, 3.0, 10.0)),
        _TOLERANCE, {**_PUSHED, "solver.step_limit": 6000},
    ),
    _panel(
        "constant-steps", "constant steps", "ring18",
        Sweep("step", "s", ("solver.step",),
             (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 10.0)),
        Sweep("force on every V-joint", "N", ("loads.force",), (0.01, 0.1, 1.0)),
        {**_PUSHED, "solver.step_control": "constant", "solver.step_limit": 20_000},
    ),
    _panel(
        "planar-truss", "planar truss: constant steps and cable", "planar-truss",
        Sweep("step", "s", ("solver.step",), (2e-3, 5e-3, 0.02, 0.05, 0.2, 1.0)),
        Sweep("axial stiffness EA of the cable", "N", ("cables.upper.axial_stiffness",),
             (1e3, 1e4, 1e5, 1e6)),
        {
            "solver.end_time": 3.0, "rods.elements": 3, "record.interval": 0.1,
            "cables.upper.winch.winding": {
                "kind": "table", "times": [0.0, 0.5, 1.5, 2.0, 3.0],
                "lengths": [0.0, 0.03, 0.2, 0.22, 0.1],
            },
        },
    ),
    _panel(
        "sections", "closed rings", "ring18",
        Sweep("sections", "1", ("structure.sections",),
             (3, 4, 5, 6, 8, 10, 12, 15, 18, 24, 30, 36, 48, 60, 72)),
        Sweep("force on every V-joint", "N", ("loads.force",), (0.01, 0.1)),
        {"structure.opening_angle": 60.0, "solver.end_time": 15.0, "solver.step_limit": _STEPS,
         **_RECORD},
    ),
    _panel(
        "arcs", "open arcs with cables", "truss2",
        Sweep("sections", "1", ("structure.sections",), (1, 2, 3, 4, 6, 9)),
        Sweep("winding speed", "m/s", _SPEED.paths, (0.1, 0.3, 1.0)),
        _WOUND,
    ),
    _panel(
        "chatter", "winch that reverses: slack-taut chatter", "truss2",
        _STIFFNESS,
        Sweep("viscous friction of the V-joints", "N m s/rad", ("joints.vjoint.viscous",),
             (0.0, 1e-3, 0.01, 0.1, 1.0)),
        {
            **_WOUND,
            "solver.end_time": 2.5,
            "solver.step_limit": 2000,
            **_for_cables("winch.winding", {
                "kind": "table",
                "times": [0.0, 0.5, 1.0, 1.5, 2.0, 2.5],
                "lengths": [0.0, _ROPE, 0.3 * _ROPE, 1.2 * _ROPE, 0.4 * _ROPE, 2.5 * _ROPE],
            }),
        },
    ),
)  # fmt: skip
"""The map: 520 cells."""

QUICK = (
    _panel(
        "steps", "constant steps", "ring18",
        Sweep("step", "s", ("solver.step",), (3e-3, 0.1, 3.0)),
        Sweep("force on every V-joint", "N", ("loads.force",), (0.1, 10.0)),
        {**_PUSHED, "structure.opening_angle": 120.0, "solver.end_time": 4.0,
         "solver.step_control": "constant"},
    ),
    _panel(
        "arcs", "open arcs with cables", "truss2",
        Sweep("sections", "1", ("structure.sections",), (1, 2)),
        Sweep("winding speed", "m/s", _of_cables("winch.winding.speed"), (0.01, 0.3, 1.0)),
        {**_WOUND, "structure.opening_angle": 140.0, "solver.end_time": 2.0},
    ),
)  # fmt: skip
"""A dozen cells that show what the map is."""


def thinned(panel: Panel, every: int) -> Panel:
    """Every so manyth value of both axes, the most absurd ones among them."""
    x, y = (replace(sweep, values=sweep.values[::-every][::-1]) for sweep in (panel.x, panel.y))
    return replace(panel, x=x, y=y)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true", help="a dozen cells instead of all")
    parser.add_argument("--every", type=int, default=1, help="every so manyth value of each axis")
    parser.add_argument("--fidelity", choices=["full", "frame", "both"], default="full")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/stability"))
    asked = parser.parse_args()
    chosen = QUICK if asked.quick else [thinned(panel, asked.every) for panel in PANELS]
    panels = by_engines(chosen, asked.fidelity)
    sys.exit(draw_map(asked.out, panels, asked.workers, percent=10.0))
