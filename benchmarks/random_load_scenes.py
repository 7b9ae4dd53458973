"""Random scenes with motors, springs in the V-joints, weight on lines, and a spacecraft.

As those of ``benchmarks/random_scenes.py``, from seed ``FIRST`` on: five families in turn, and the
kinds of springs and standards within them.
"""

from __future__ import annotations

from typing import Any

from random_scenes import Draw, Values, cable_ring, force_ring

FIRST = 1000
FAMILIES = ("motor-ring", "motor-arc", "springs", "ground", "spacecraft")
SPRINGS = ("linear", "tape", "table")


def random_load_scene(seed: int) -> Values:
    """Name, built-in scene, replaced values and fidelity of a seed from ``FIRST`` on."""
    number = seed - FIRST
    draw, family, turn = Draw(seed), FAMILIES[number % len(FAMILIES)], number // len(FAMILIES)
    base = "truss2" if family == "motor-arc" else "ring18-cable"
    if family == "springs":
        base, values = "ring18", force_ring(draw, closed=turn % 2 == 0)
        values["hinge_spring"] = spring(draw, SPRINGS[turn % 3])
    else:
        closed = family != "motor-arc"
        values = cable_ring(draw, ("bearing", "capstan")[turn % 2], "ramp", closed=closed)
    if family.startswith("motor"):
        values |= motors(draw)
        if draw.maybe(0.5):
            values["hinge_spring"] = spring(draw, SPRINGS[turn % 3])
    if family in ("ground", "spacecraft"):
        values |= {"record.reactions": True, "boom.kind": "rigid", "boom.length": 1.0}
    if family == "ground":
        values |= ground(draw)
    if family == "spacecraft":
        values |= {"boom.base": "free", "spacecraft": spacecraft(draw)}
    values |= {"solver.error_bars": True, "solver.step_limit": 1500}
    return {"name": f"{seed:04d}-{family}", "scene": base, "values": values, "fidelity": "full"}


def motors(draw: Draw) -> Values:
    """Two motors that wind as fast as a ramp would, some of which stall."""
    values: Values = {}
    speed, radius = draw.log(0.08, 0.2), 0.02
    for plane in ("upper", "lower"):
        ratio, stall = draw.log(50.0, 300.0), draw.log(2.0, 40.0)  # N of rope
        efficiency = draw.within(0.4, 0.9)
        fastest = speed / radius * ratio
        winding: dict[str, Any] = {
            "kind": "motor",
            "no_load_speed": 1.25 * fastest,
            "stall_torque": stall * radius / (ratio * efficiency),
            "gear_ratio": ratio,
            "efficiency": efficiency,
            "drum_radius": radius,
            "band": draw.within(0.05, 0.3),
        }
        if draw.maybe(0.5):
            winding["speed"] = fastest
        if draw.maybe(0.4):
            winding["back_efficiency"] = draw.within(0.2, 0.8)
        values[f"cables.{plane}.winch"] = {
            "winding": winding,
            "after_lock": str(draw.rng.choice(["stop", "hold", "pull"])),
        }
        values[f"cables.{plane}.end"] = "first"
    return values


def spring(draw: Draw, kind: str) -> Values:
    if kind == "linear":
        return {"kind": kind, "stiffness": draw.log(1e-4, 1e-2), "preload": draw.log(1e-4, 5e-3)}
    if kind == "tape":
        return {"kind": kind, "force": draw.log(0.02, 0.5), "radius": 0.01}
    torques = [draw.within(-2e-3, 6e-3) for _ in range(3)]
    return {"kind": kind, "angles": [20.0, 90.0, 180.0], "torques": torques}


def ground(draw: Draw) -> Values:
    return {
        "boom.base": "fixed",
        "gravity.vector": [0.0, 0.0, -9.81],
        "offload": {
            "planes": str(draw.rng.choice(["upper", "both"])),
            "stiffness": draw.log(0.1, 10.0),
            "residual": draw.within(-0.02, 0.02),
            "friction": draw.log(1e-3, 1e-2),
            "friction_speed": 1e-3,
            "trolley_mass": draw.log(0.01, 0.1),
        },
    }


def spacecraft(draw: Draw) -> Values:
    mass = draw.log(50.0, 1000.0)
    return {"mass": mass, "inertia": [draw.within(0.15, 0.3) * mass for _ in range(3)]}
