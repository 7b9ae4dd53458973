"""What the stability map varies: pairs of axes, each on a small ring with a short motion.

Every group spans the range from harmless to absurd.  Rings are small where the axis does not
need more, and start half open where the stowed end is not the question, so that a cell takes
seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

_CABLES = ("cables.upper", "cables.lower")


@dataclass(frozen=True)
class Axis:
    """One axis of a group.

    Attributes
    ----------
    label, units
        On the map; the values are in these units.
    paths
        Scene paths that all get the value.
    values
        In rising order.
    apart
        Whether each value needs a campaign of its own, because it shapes the result.
    """

    label: str
    units: str
    paths: tuple[str, ...]
    values: tuple[float, ...]
    apart: bool = False


@dataclass(frozen=True)
class Group:
    """All pairs of two axes' values, on one scene.

    Attributes
    ----------
    name, title
        Of its folder, and on the map.
    scene
        Built-in scene that it starts from.
    x, y
        The axes; only ``x`` may be ``apart``.
    settings
        Values by scene path that all cells share.
    """

    name: str
    title: str
    scene: str
    x: Axis
    y: Axis
    settings: Mapping[str, Any] = field(default_factory=dict)


def _of_cables(leaf: str) -> tuple[str, ...]:
    return tuple(f"{cable}.{leaf}" for cable in _CABLES)


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

_STIFFNESS = Axis(
    "axial stiffness EA of the cables", "N", _of_cables("axial_stiffness"),
    (1e1, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9),
)  # fmt: skip
_SPEED = Axis(
    "winding speed", "m/s", _of_cables("winch.winding.speed"),
    (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0),
)  # fmt: skip
_STOP = Axis("stop stiffness", "N m/rad", ("stop.stiffness",), (0.1, 1.0, 10.0, 1e2, 1e4, 1e6))
_TOLERANCE = Axis(
    "tolerance of the step control", "1", ("solver.tolerance",), (1e-5, 1e-4, 1e-3, 1e-2, 0.1)
)
_ROPE = 0.2
"""Rope in metre that the reversing winch winds up before it turns back."""

GROUPS = (
    Group(
        "cable-friction", "cables: stiffness and friction", "truss2",
        _STIFFNESS,
        Axis("bearing coefficient f of the pulleys (limit: R = 0.01 m)", "m",
             _of_cables("friction.coefficient"),
             (0.0, 4e-4, 1e-3, 3e-3, 6e-3, 9e-3, 9.9e-3)),
        {**_WOUND, **_for_cables("winch.winding.speed", 0.15)},
    ),
    Group(
        "cable-speed", "cables: stiffness and winding speed", "truss2",
        _STIFFNESS, _SPEED, _WOUND,
    ),
    Group(
        "fold-speed", "fold angle and winding speed", "truss2",
        Axis("opening angle at the start", "deg", ("structure.opening_angle",),
             (1.0, 2.0, 5.0, 10.0, 20.0, 45.0, 90.0, 135.0, 170.0, 179.0, 179.9)),
        Axis("winding speed", "m/s", _of_cables("winch.winding.speed"), (0.1, 0.3, 1.0, 3.0)),
        _WOUND,
    ),
    Group(
        "rods-stops", "rods and stops", "ring18",
        Axis("Young's modulus of the rods", "Pa", ("rods.young_modulus",),
             (1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e13, 1e15)),
        _STOP, _PUSHED,
    ),
    Group(
        "net-mass", "net and mass ratio", "ring18",
        Axis("stiffness of the net", "N/m", ("net.stiffness",),
             (0.0, 1e-3, 1e-2, 0.1, 1.0, 1e2, 1e4, 1e6)),
        Axis("mass of each corner and V-joint", "kg",
             ("structure.corner_mass", "structure.vjoint_mass"),
             (1e-6, 1e-4, 0.02, 0.2, 2.0, 50.0)),
        {**_PUSHED, "net.neutral_length": 0.3},
    ),
    Group(
        "joints", "dry friction of the joints", "ring18",
        Axis("Coulomb torque of the V-joints", "N m", ("joints.vjoint.coulomb",),
             (1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 0.1)),
        Axis("rate at which it acts", "rad/s", ("joints.vjoint.rate",),
             (1e-5, 1e-4, 1e-3, 0.1)),
        _PUSHED,
    ),
    Group(
        "sudden", "sudden loads and stops", "ring18",
        Axis("force on every V-joint", "N", ("loads.force",),
             (1e-3, 0.01, 0.1, 1.0, 10.0, 1e2, 1e3, 1e4)),
        _STOP, _PUSHED,
    ),
    Group(
        "step-tolerance", "steps that follow the motion", "truss2",
        Axis("largest step", "s", ("solver.step",), (0.01, 0.1, 0.3, 1.0, 3.0, 10.0)),
        _TOLERANCE,
        {**_WOUND, **_for_cables("winch.winding.speed", 0.15), "solver.step_limit": 6000},
    ),
    Group(
        "step-tolerance-pushed", "steps that follow the motion, forces", "ring18",
        Axis("largest step", "s", ("solver.step",), (0.01, 0.1, 0.3, 1.0, 3.0, 10.0)),
        _TOLERANCE, {**_PUSHED, "solver.step_limit": 6000},
    ),
    Group(
        "constant-steps", "constant steps", "ring18",
        Axis("step", "s", ("solver.step",),
             (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 10.0)),
        Axis("force on every V-joint", "N", ("loads.force",), (0.01, 0.1, 1.0)),
        {**_PUSHED, "solver.step_control": "constant", "solver.step_limit": 20_000},
    ),
    Group(
        "planar-truss", "planar truss: constant steps and cable", "planar-truss",
        Axis("step", "s", ("solver.step",), (2e-3, 5e-3, 0.02, 0.05, 0.2, 1.0)),
        Axis("axial stiffness EA of the cable", "N", ("cables.upper.axial_stiffness",),
             (1e3, 1e4, 1e5, 1e6)),
        {
            "solver.end_time": 3.0, "rods.elements": 3, "record.interval": 0.1,
            "cables.upper.winch.winding": {
                "kind": "table", "times": [0.0, 0.5, 1.5, 2.0, 3.0],
                "lengths": [0.0, 0.03, 0.2, 0.22, 0.1],
            },
        },
    ),
    Group(
        "sections", "closed rings", "ring18",
        Axis("sections", "1", ("structure.sections",),
             (3, 4, 5, 6, 8, 10, 12, 15, 18, 24, 30, 36, 48, 60, 72), apart=True),
        Axis("force on every V-joint", "N", ("loads.force",), (0.01, 0.1)),
        {"structure.opening_angle": 60.0, "solver.end_time": 15.0, "solver.step_limit": _STEPS,
         **_RECORD},
    ),
    Group(
        "arcs", "open arcs with cables", "truss2",
        Axis("sections", "1", ("structure.sections",), (1, 2, 3, 4, 6, 9), apart=True),
        Axis("winding speed", "m/s", _SPEED.paths, (0.1, 0.3, 1.0)),
        _WOUND,
    ),
    Group(
        "chatter", "winch that reverses: slack-taut chatter", "truss2",
        _STIFFNESS,
        Axis("viscous friction of the V-joints", "N m s/rad", ("joints.vjoint.viscous",),
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
"""The map."""

QUICK = (
    Group(
        "steps", "constant steps", "ring18",
        Axis("step", "s", ("solver.step",), (3e-3, 0.1, 3.0)),
        Axis("force on every V-joint", "N", ("loads.force",), (0.1, 10.0)),
        {**_PUSHED, "structure.opening_angle": 120.0, "solver.end_time": 4.0,
         "solver.step_control": "constant"},
    ),
    Group(
        "arcs", "open arcs with cables", "truss2",
        Axis("sections", "1", ("structure.sections",), (1, 2), apart=True),
        Axis("winding speed", "m/s", _of_cables("winch.winding.speed"), (0.01, 0.3, 1.0)),
        {**_WOUND, "structure.opening_angle": 140.0, "solver.end_time": 2.0},
    ),
)  # fmt: skip
"""A dozen cells that show what the map is."""
