"""Short runs that show one law each, of the smallest structures that have it."""

from __future__ import annotations

from typing import Any

from ringsim.scene import Scene, load_scene

Values = dict[str, Any]
SHORT: Values = {
    "structure.sections": 3,
    "structure.opening_angle": 60.0,
    "boom": "none",
    "net": "none",
    "solver.step_control": "constant",
    "solver.step": 0.005,
    "solver.end_time": 0.5,
    "solver.newton_tolerance": 1e-6,
    # Steps this long lose energy at stops: that is not what these scenes are about.
    "solver.energy_tolerance": 1e6,
    "record.interval": 0.01,
    "record.stress": True,
}
FORCE: Values = {"loads.force": 0.1}
STOPS: Values = FORCE | {
    "structure.opening_angle": 165.0, "solver.step": 5e-4, "solver.end_time": 0.15,
    "solver.settling_time": 1.0, "record.interval": 1e-3,
}  # fmt: skip
RIGID: Values = {"boom.kind": "rigid", "boom.length": 0.9}
FLEXIBLE: Values = {"boom.kind": "flexible", "boom.length": 0.9, "boom.elements": 3}
ARC: Values = {"structure.closed": False, "structure.polygon_sections": 18,
               "structure.aspect_ratio": 1.0, "joints.hinge.viscous": 2e-3}  # fmt: skip
NET: Values = {"net.stiffness": 0.05, "net.neutral_length": 0.1}
EDGE: Values = STOPS | {
    "net": {"kind": "boundary", "axial_stiffness": 200.0, "strain": [0.02, 0.01, 0.03]}
}
SUDDEN: Values = {"solver.step": 1e-3, "solver.end_time": 0.25, "record.interval": 5e-3}
"""Resolves ropes that winches jerk."""
STALLING = SUDDEN | {"solver.step": 2.5e-4, "solver.end_time": 0.1}
BOTH = ("upper", "lower")


def cables(**values: Any) -> Values:
    """Both cables alike; two underscores stand for a dot."""
    return {
        f"cables.{plane}.{name.replace('__', '.')}": value
        for plane in BOTH
        for name, value in values.items()
    }


def of_forces(values: Values) -> Scene:
    return load_scene("ring18").with_values(SHORT | FORCE | values)


def of_cables(values: Values) -> Scene:
    return load_scene("ring18-cable").with_values(SHORT | values)


def joint(family: str, **law: Any) -> Values:
    return {f"joints.{family}.{name}": value for name, value in law.items()}


FORCES: dict[str, Values] = {
    "all-joints": joint("vjoint", viscous=[1e-3, 2e-3, 5e-3], coulomb=1e-3)
    | joint("pivot", coulomb=1e-3, viscous=1e-3)
    | joint("hinge", coulomb=1e-3)
    | {"rods.damping": 0.01},
    "viscous-vjoint": joint("vjoint", viscous=2e-3),
    "dry-vjoint": joint("vjoint", coulomb=1e-3),
    "dry-pivot": joint("pivot", coulomb=1e-3, viscous=1e-3),
    "dry-hinge": joint("hinge", coulomb=1e-3),
    "viscous-sections": joint("vjoint", viscous=[1e-3, 2e-3, 5e-3]),
    "damped-rods": {"rods.damping": 0.01},
    "two-elements": {"rods.elements": 2, "rods.young_modulus[2]": 60e9},
    "force-sections": {"loads.force": [0.1, 0.12, 0.08]},
    "latched-stop": STOPS | {"stop.latch": True, "stop.damping": 0.5},
    "free-stop": STOPS | {"stop.latch": False, "stop.damping": 0.1},
    "net": NET,
    "two-sided-net": NET
    | {"net.two_sided": True, "net.stiffness": 0.01, "net.neutral_length": 0.3},
    "damped-net": NET | {"net.damping": 0.05},
    "net-sections": NET | {"net.stiffness": [0.05, 0.04, 0.06]} | RIGID,
    "edge-net": RIGID | EDGE,
    "ramps": STOPS | {"stop.latch": True, "latch": {"peak_torque": [0.05, 0.1, 0.08]}},
    "rigid-free": RIGID | {"boom.base": "free"},
    "rigid-fixed": RIGID | {"boom.base": "fixed"},
    "prismatic": RIGID | ARC | {"boom.joint": "prismatic", "boom.base": "free"},
    "flexible-free": FLEXIBLE | {"boom.base": "free"},
    "flexible-fixed": FLEXIBLE | {"boom.base": "fixed"},
    "stuck": RIGID | {
        "faults": [{"kind": "stuck-vjoint", "plane": "lower", "section": 2, "time": 0.2}]
    },
    "arc-1": ARC | RIGID | {"structure.sections": 1, "boom.base": "fixed"},
    "arc-2-free": ARC | {"structure.sections": 2},
    "arc-5": ARC | FLEXIBLE | {"structure.sections": 5, "boom.base": "fixed"},
    "closed-6": {"structure.sections": 6, "structure.aspect_ratio": 0.85},
}  # fmt: skip


def winding(**law: Any) -> Values:
    return cables(winch__winding=law)


CABLES: dict[str, Values] = {
    "exact-damped-table": cables(
        friction={"kind": "bearing-exact", "coefficient": 5e-4},
        damping_time=2e-3,
        winch__winding={
            "kind": "table", "times": [0.0, 0.2, 0.35, 1.0], "lengths": [0.0, 0.01, 0.04, 0.1]
        },
    ),
    "both-bar-half": cables(end="both", bracket={"kind": "bar-half", "angle": 98.0}),
    "faults": {
        "faults": [
            {"kind": "jammed-pulley", "cable": 1, "pulley": 3, "time": 0.2},
            {"kind": "cut-cable", "cable": 2, "span": 4, "time": 0.25},
            {"kind": "stuck-vjoint", "plane": "upper", "section": 1, "time": 0.3},
        ]
    },
    "bearing": {},
    "bearing-exact": cables(friction={"kind": "bearing-exact", "coefficient": 5e-4}),
    "capstan-pulleys": cables(
        friction={"kind": "capstan", "coefficient": [0.01, 0.03, 0.02, 0.05, 0.0, 0.01, 0.02, 0.04]}
    ),
    "frictionless": cables(friction={"kind": "none"}),
    "last": cables(end="last"),
    "both": cables(end="both"),
    "two-winches": cables(
        end="both",
        far_winch={"winding": {"kind": "constant", "speed": 0.06}},
    )
    | SUDDEN,
    "bar-half": cables(bracket={"kind": "bar-half", "angle": 98.0}),
    "constant": winding(kind="constant", speed=0.1) | SUDDEN,
    "table": winding(kind="table", times=[0.0, 0.2, 0.35, 1.0], lengths=[0.0, 0.01, 0.04, 0.1]),
    "stall": winding(kind="stall", speed=0.05, max_tension=3.0, band=0.6) | STALLING,
    "backdrivable": winding(
        kind="stall", speed=0.05, max_tension=3.0, band=0.6, backdrivable=True
    )
    | STALLING,
    "motor": winding(
        kind="motor", no_load_speed=150.0, stall_torque=0.002, gear_ratio=100.0, efficiency=0.6,
        back_efficiency=0.5, drum_radius=0.01,
    )
    | STALLING
    | {"solver.end_time": 0.05},
    "feedback": winding(kind="tension-feedback", target=2.0, max_speed=0.2, max_payout=0.1)
    | SUDDEN,
    "damped-rope": cables(damping_time=2e-3),
    "slack": cables(initial_slack=2e-4) | SUDDEN,
    "taut": cables(initial_slack=-2e-5),
    "late-lower": {"cables.lower.winch.start_time": 0.15},
    "jammed": {"faults": [{"kind": "jammed-pulley", "cable": 1, "pulley": 3, "time": 0.2}]},
    "cut": {"faults": [{"kind": "cut-cable", "cable": 2, "span": 4, "time": 0.2}]},
    "stuck": {"faults": [{"kind": "stuck-vjoint", "plane": "upper", "section": 1, "time": 0.2}]},
    "locked": cables(winch__after_lock="hold")
    | {"structure.opening_angle": 160.0, "solver.step": 2e-3, "solver.end_time": 0.8,
       "stop.latch": False, "joints.vjoint.viscous": 0.1},
    "boom-and-net": RIGID | NET | {"boom.base": "free"},
    "arc-3-free": ARC | FLEXIBLE | {"structure.opening_angle": 40.0, "boom.base": "free"},
    "arc-2-flexible": ARC | FLEXIBLE | {"structure.sections": 2, "boom.base": "fixed"},
}  # fmt: skip
