"""Random scenes with cables along a net's edge, latches, and parts that are not as drawn.

As those of ``benchmarks/random_load_scenes.py``, from seed ``FIRST`` on: three families in turn,
opened by forces and by cables.
"""

from __future__ import annotations

from typing import Any

from random_load_scenes import motors
from random_scenes import Draw, Values, cable_ring, force_ring

FIRST = 2000
FAMILIES = ("edge-net", "latches", "scatter")
RODS = ("diagonal_rising", "diagonal_falling", "bar_upper_left", "bar_upper_right",
        "bar_lower_left", "bar_lower_right")  # fmt: skip
PINS = ("upper_left", "upper_right", "lower_left", "lower_right")


def random_part_scene(seed: int) -> Values:
    """Name, built-in scene, replaced values and fidelity of a seed from ``FIRST`` on."""
    number = seed - FIRST
    draw, family, turn = Draw(seed), FAMILIES[number % len(FAMILIES)], number // len(FAMILIES)
    if turn % 2:
        base, values = "ring18-cable", cable_ring(draw, "bearing", "ramp", closed=True)
        if draw.maybe(0.5):
            values |= motors(draw)
    else:
        base, values = "ring18", force_ring(draw, closed=draw.maybe(0.7))
    if family == "scatter":
        values |= scatter(draw, values["structure.sections"])
    elif family == "latches":
        values |= latches(draw)
    else:
        own = {key: value for key, value in values.items() if not key.startswith("net")}
        values = own | edge(draw)
    values |= {"solver.error_bars": True, "solver.step_limit": 1500}
    return {"name": f"{seed:04d}-{family}", "scene": base, "values": values, "fidelity": "full"}


def edge(draw: Draw) -> Values:
    """Cables that come taut in the last degrees, and take some of the drive."""
    table = {
        "kind": "boundary",
        "axial_stiffness": draw.log(20.0, 1000.0),
        "strain": draw.within(-0.002, 0.005),
        "planes": str(draw.rng.choice(["upper", "both"])),
    }
    return {"net": table}


def latches(draw: Draw) -> Values:
    table: Values = {"peak_torque": draw.log(1e-4, 5e-3), "reach": draw.within(2.0, 15.0)}
    if draw.maybe(0.3):
        table["min_rate"] = draw.log(1e-3, 0.1)
    return {"latch": table, "stop.latch": True}


def scatter(draw: Draw, sections: int) -> Values:
    """Errors of lengths and pins, sections that are held elsewhere, temperatures."""

    def each(size: float) -> list[float]:
        return [size * float(draw.rng.standard_normal()) for _ in range(sections)]

    size, pins = draw.log(1e-6, 3e-4), draw.log(1e-6, 5e-5)
    values: Values = {"rods.length_error": {name: each(size) for name in RODS}}
    if draw.maybe(0.5):
        values["structure.hinge_error"] = {name: each(pins) for name in PINS}
    if draw.maybe(0.3):
        values["structure.angle_error"] = each(0.02)
    if draw.maybe(0.5):
        warm: dict[str, Any] = {
            "value": [draw.within(200.0, 380.0) for _ in range(sections)],
            "expansion": draw.log(1e-7, 2e-6),
        }
        table = {"temperatures": [150.0, 400.0], "factors": [1.1, 0.9]}
        values["temperature"] = {"diagonal": warm, "bar": warm | {"stiffness": table}}
    return values
