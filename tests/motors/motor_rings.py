"""Small rings that motors open."""

from __future__ import annotations

from ringsim.parts.margin import EcssMechanisms
from ringsim.scene import Scene, load_scene

MOTOR = {
    "kind": "motor", "no_load_speed": 600.0, "stall_torque": 0.002, "gear_ratio": 100.0,
    "efficiency": 0.6, "drum_radius": 0.01,
}  # fmt: skip
TRAVEL = 0.01 / 100.0
"""Rope for a turn of the shaft, m/rad."""
STALL = 0.002 * 0.6 / TRAVEL
"""Tension at which the motor stalls, N."""
PLAIN = EcssMechanisms(
    inertia=1.0, spring=1.0, friction=1.0, gravity=1.0, latch=1.0, driving_spring=1.0,
    motorisation=1.0,
)  # fmt: skip
"""A margin without factors."""


def ring(**values: object) -> Scene:
    """Six even sections from 60 deg on, without a boom; two underscores stand for a dot."""
    plain = {
        "structure.sections": 6, "structure.aspect_ratio": 1.0, "structure.opening_angle": 60.0,
        "boom": "none", "net": "none", "record.interval": 0.05,
    }  # fmt: skip
    plain |= {f"cables.{plane}.winch.winding": MOTOR for plane in ("upper", "lower")}
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    return load_scene("ring18-cable").with_values(plain | chosen)
