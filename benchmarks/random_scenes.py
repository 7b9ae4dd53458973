"""Cheap random scenes of every kind, for comparisons of two checkouts (benchmarks/before_after.py).

A scene is a name, a built-in scene, replaced values and a fidelity, so that it can be kept as JSON
and means the same to any version.  Seeds go round eight families in turn, and the laws of
friction and winding within them, so that forty in a row hold each kind; all else is drawn.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Values = dict[str, Any]

FAMILIES = (
    "forces-ring",
    "forces-arc",
    "cables-ring",
    "cables-arc",
    "cable-faults",
    "frames",
    "planar-truss",
    "ancf-or-constant",
)
FRICTIONS = ("none", "bearing", "bearing-exact", "capstan")
WINDINGS = ("ramp", "constant", "table", "stall", "tension-feedback")


class Draw:
    """Random numbers of one scene."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng([2031, seed])

    def within(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def log(self, low: float, high: float) -> float:
        return float(math.exp(self.rng.uniform(math.log(low), math.log(high))))

    def maybe(self, probability: float) -> bool:
        return bool(self.rng.random() < probability)

    def count(self, low: int, high: int) -> int:
        """Whole number from low to high, both possible."""
        return int(self.rng.integers(low, high + 1))


def random_scene(seed: int) -> Values:
    """Name, built-in scene, replaced values and fidelity of a seed."""
    draw, family, turn = Draw(seed), FAMILIES[seed % len(FAMILIES)], seed // len(FAMILIES)
    fidelity, name = "full", family
    if family == "planar-truss":
        base, values = "planar-truss", planar_truss(draw)
    elif family in ("cables-ring", "cables-arc", "cable-faults"):
        shift = ("cables-ring", "cables-arc", "cable-faults").index(family)
        closed = family == "cables-ring"
        base = "ring18-cable" if closed else "truss2"
        values = cable_ring(draw, FRICTIONS[(turn + shift) % 4], WINDINGS[(turn + shift) % 5],
                            closed=closed)  # fmt: skip
        if family == "cable-faults":
            values["faults"] = faults(draw, values["structure.sections"])
    elif family == "frames":
        fidelity, closed = "frame", draw.maybe(0.5)
        if turn % 2:
            base, values = "ring18", force_ring(draw, closed=closed)
        else:
            law = WINDINGS[(turn // 2 + 1) % 5]
            base, values = "truss2", cable_ring(draw, FRICTIONS[turn % 4], law, closed=closed)
        values |= {"record.stress": False}
    elif family == "ancf-or-constant":
        base, name = "ring18", "ancf" if turn % 2 else "constant-steps"
        values = force_ring(draw, closed=draw.maybe(0.5), largest=4)
        if turn % 2:
            values |= {"rods.kind": "ancf", "rods.damping": 0.0, "record.stress": False}
        else:
            values |= {"solver.step_control": "constant", "solver.step": draw.log(2e-3, 1e-2)}
            values |= {"solver.end_time": draw.within(1.0, 3.0)}
    else:
        base, values = "ring18", force_ring(draw, closed=family == "forces-ring")
    if fidelity == "full":
        values |= {"solver.error_bars": True, "solver.step_limit": 1500}
    return {"name": f"{seed:03d}-{name}", "scene": base, "values": values, "fidelity": fidelity}


def ring(draw: Draw, *, closed: bool, largest: int) -> Values:
    """What rings with forces and with cables have in common."""
    least, most = (3, largest) if closed else (1, min(largest, 5))
    sections = min(draw.count(least, most), draw.count(least, most))  # small ones are cheap
    values: Values = {
        "structure.sections": sections,
        "structure.closed": closed,
        "structure.aspect_ratio": draw.within(0.75, 1.0) if closed else 1.0,
        "structure.opening_angle": draw.within(30.0, 140.0),
        "structure.hinge_offset": draw.log(1e-3, 2e-2),
        "structure.corner_mass": draw.log(0.01, 0.1),
        "structure.vjoint_mass": draw.log(0.005, 0.08),
        "rods.young_modulus": draw.log(30e9, 400e9),
        "rods.damping": float(draw.rng.choice([0.0, 1e-4, 1e-3])),
        "rods.elements": 2 if draw.maybe(0.1) else 1,
        "record.stress": draw.maybe(0.3),
        "record.interval": 0.05,
        "solver.tolerance": draw.log(2e-3, 1e-2),
    }
    if not closed:
        values |= {"structure.polygon_sections": draw.count(6, 18), "joints.hinge.viscous": 2e-3}
    if draw.maybe(0.25):
        values[f"rods.young_modulus[{draw.count(1, sections)}]"] = draw.log(30e9, 400e9)
    if draw.maybe(0.3):
        values["joints.pivot.viscous"] = draw.log(1e-4, 1e-3)
    values |= boom(draw, closed=closed) | net(draw, sections, closed=closed) | stop(draw)
    return values


def boom(draw: Draw, *, closed: bool) -> Values:
    kind = str(draw.rng.choice(["none", "rigid", "rigid", "flexible"]))
    if kind == "none":
        return {"boom": "none"}
    values: Values = {"boom.kind": kind, "boom.length": draw.within(0.9, 1.2)}
    values["boom.base"] = "free" if closed and draw.maybe(0.6) else "fixed"
    if kind == "flexible":
        values["boom.elements"] = draw.count(2, 4)
    return values


def net(draw: Draw, sections: int, *, closed: bool) -> Values:
    if draw.maybe(0.5):
        return {"net": "none"}
    stiffness: Any = draw.log(1e-4, 2e-3)
    if draw.maybe(0.3):
        stiffness = [stiffness * draw.within(0.8, 1.2) for _ in range(sections + (not closed))]
    return {
        "net.stiffness": stiffness,
        "net.neutral_length": draw.within(0.1, 0.7),
        "net.damping": draw.log(1e-4, 1e-2) if draw.maybe(0.3) else 0.0,
        "net.two_sided": draw.maybe(0.2),
    }


def stop(draw: Draw) -> Values:
    return {
        "stop.stiffness": draw.log(15.0, 700.0),
        "stop.damping": draw.log(0.05, 1.0),
        "stop.latch": draw.maybe(0.7),
    }


def force_ring(draw: Draw, *, closed: bool, largest: int = 8) -> Values:
    """A ring opened by forces; now and then some joint rubs dry, or one is stuck from a time on."""
    values = ring(draw, closed=closed, largest=largest)
    sections, force = values["structure.sections"], draw.log(0.03, 0.2)
    values["loads.force"] = (
        [force * draw.within(0.9, 1.1) for _ in range(sections)] if draw.maybe(0.3) else force
    )
    values["solver.end_time"] = 10.0
    if draw.maybe(0.5):
        values["joints.vjoint.viscous"] = draw.log(1e-4, 3e-3)
    if draw.maybe(0.3):
        values["joints.vjoint.coulomb"] = draw.log(1e-5, 2e-4)
    return values


def cable_ring(draw: Draw, friction: str, law: str, *, closed: bool) -> Values:
    """A ring opened by one cable or two."""
    values = ring(draw, closed=closed, largest=5 if closed else 3)
    sections, speed = values["structure.sections"], draw.log(0.06, 0.3)
    end = str(draw.rng.choice(["first", "first", "last", "both"]))
    duration = sections * 0.3 / speed / (2.0 if end == "both" else 1.0) + 3.0
    values |= {
        "joints.vjoint.viscous": draw.log(0.05, 0.6),
        "solver.end_time": min(duration, 20.0),
    }
    shared = cable(draw, friction, sections, end)
    shared["winch.winding"] = winding(draw, law, speed, duration)
    if end == "both" and draw.maybe(0.5):
        shared["far_winch"] = {"winding": winding(draw, "ramp", 0.8 * speed, duration)}
    for plane in ("upper", "lower"):
        values |= {f"cables.{plane}.{name}": value for name, value in shared.items()}
    if draw.maybe(0.2):
        values["cables.lower.winch.start_time"] = draw.within(0.1, 0.5)
    return values


def cable(draw: Draw, friction: str, sections: int, end: str) -> Values:
    pulleys = 3 * sections - (0 if end == "both" else 1)
    values: Values = {
        "end": end,
        "axial_stiffness": draw.log(4e3, 3e5),
        "slack_width": draw.log(5e-3, 5e-2),
        "block_offset": draw.within(0.07, 0.14),
        "damping_time": draw.log(1e-4, 1e-2) if draw.maybe(0.3) else 0.0,
        "initial_slack": draw.within(-1e-5, 2e-3) if draw.maybe(0.4) else 0.0,
    }
    if friction == "none":
        values["friction"] = {"kind": "none"}
    else:
        most = 0.08 if friction == "capstan" else 8e-4
        coefficient: Any = draw.within(0.1 * most, most)
        if draw.maybe(0.3):
            coefficient = [coefficient * draw.within(0.7, 1.3) for _ in range(pulleys)]
        values["friction"] = {"kind": friction, "coefficient": coefficient}
    if draw.maybe(0.2):
        values["bracket"] = {"kind": "bar-half", "angle": draw.within(92.0, 104.0)}
    return values


def winding(draw: Draw, law: str, speed: float, duration: float) -> Values:
    match law:
        case "constant":
            return {"kind": law, "speed": 0.5 * speed}
        case "table":
            times = [0.0, 0.5, 0.4 * duration, 0.7 * duration, duration]
            lengths = [0.0, 0.2 * speed, 0.4 * duration * speed, 0.65 * duration * speed]
            return {"kind": law, "times": times, "lengths": [*lengths, duration * speed]}
        case "stall":
            tension = draw.log(0.5, 5.0)
            return {"kind": law, "speed": speed, "max_tension": tension, "band": 0.2,
                    "backdrivable": draw.maybe(0.5)}  # fmt: skip
        case "tension-feedback":
            return {"kind": law, "target": draw.log(0.3, 2.0), "max_speed": 2.0 * speed,
                    "max_payout": 0.5 * speed * draw.maybe(0.5)}  # fmt: skip
    shape = str(draw.rng.choice(["cubic", "quintic"]))
    return {"kind": "ramp", "speed": speed, "duration": draw.within(0.3, 1.5), "shape": shape}


def faults(draw: Draw, sections: int) -> list[Values]:
    """One fault of each kind in turn, or two."""
    choices: list[Values] = [
        {"kind": "cut-cable", "cable": draw.count(1, 2), "span": draw.count(1, 3 * sections)},
        {"kind": "jammed-pulley", "cable": 1, "pulley": draw.count(1, 3 * sections - 1)},
        {"kind": "stuck-vjoint", "plane": "upper", "section": draw.count(1, sections)},
    ]
    chosen = draw.rng.choice(3, size=2 if draw.maybe(0.3) else 1, replace=False)
    return [choices[each] | {"time": draw.within(0.3, 2.5)} for each in chosen]


def planar_truss(draw: Draw) -> Values:
    """Paper 001's truss, reeled in part of the way and faster, and let out again."""
    end, reach = draw.within(2.5, 4.0), draw.within(0.05, 0.3)
    return {
        "rods.elements": draw.count(2, 6),
        "rods.young_modulus": draw.log(50e9, 90e9),
        "rods.damping": draw.log(3e-4, 3e-3),
        "structure.spring.stiffness": draw.log(1500.0, 2500.0),
        "structure.spring.damping": draw.log(2.0, 10.0),
        "cables.upper.axial_stiffness": draw.log(5e3, 3e4),
        "cables.upper.winch.winding": {
            "kind": "table",
            "times": [0.0, 0.3, 0.5 * end, 0.9 * end],
            "lengths": [0.0, 0.0, reach, 0.0],
        },
        "solver.end_time": end,
        "solver.step": draw.log(0.005, 0.02),
        "record.interval": 0.05,
    }
