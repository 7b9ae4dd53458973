"""What the parts of a scene ask of each other."""

from typing import TYPE_CHECKING

from ringsim.cable.faults.family import CableFault
from ringsim.cable.limited import why_unlimited
from ringsim.choice import kind_of
from ringsim.parts.faults.failed_latch import FailedLatch
from ringsim.parts.faults.failed_spring import FailedSpring
from ringsim.scene.substituted import strained

if TYPE_CHECKING:
    from ringsim.scene import Scene


def check_parts(scene: "Scene") -> None:
    """Refuse (ValueError) parts that lack what they need of each other."""
    _check_faults(scene)
    _check_corners(scene)
    _check_rods(scene)
    _check_limits(scene)
    _check_latch(scene)
    _check_margin(scene)


def _check_limits(scene: "Scene") -> None:
    """Refuse (ValueError) limits of what a run does not tell."""
    if scene.limits.rod_stress is not None and not scene.record.stress:
        raise ValueError(
            f"limits.rod_stress = {scene.limits.rod_stress:g} Pa needs the stress of the rods: "
            "set record.stress = true, or leave the limit out"
        )
    if scene.limits.tension is not None and scene.cables is None:
        raise ValueError(
            f"limits.tension = {scene.limits.tension:g} N needs a cable: add [cables.upper], or "
            "leave the limit out"
        )


def _check_latch(scene: "Scene") -> None:
    """Refuse (ValueError) a latch of stops that have none."""
    if scene.latch is not None and (scene.stop is None or not scene.stop.latch):
        raise ValueError(
            "latch: the stops of this scene do not hold: set stop.latch = true, or leave latch out"
        )


def _check_margin(scene: "Scene") -> None:
    """Refuse (ValueError) a margin of what has none."""
    if scene.margin is None:
        return
    if (kind := kind_of(scene.structure)) != "pantograph-ring":
        raise ValueError(
            f'margin needs structure.kind = "pantograph-ring", not "{kind}" (leave it out)'
        )
    if scene.cables is None and scene.loads is None and scene.hinge_spring is None:
        raise ValueError("margin: nothing drives the ring (add [cables.upper], or leave it out)")
    if scene.loads is not None and scene.loads.reversal_time is not None:
        raise ValueError(
            f"margin: loads.reversal_time = {scene.loads.reversal_time:g} s: a margin is told of "
            "loads that keep their sign: leave one of them out"
        )
    if reason := why_unlimited(scene.cables, scene.structure.planes):
        raise ValueError(reason)


def _check_corners(scene: "Scene") -> None:
    """Refuse (ValueError) records of corners where there are none."""
    for name in ("shape", "accelerations"):
        if getattr(scene.record, name) and kind_of(scene.structure) != "pantograph-ring":
            raise ValueError(
                f'record.{name} = true needs structure.kind = "pantograph-ring", not '
                f'"{kind_of(scene.structure)}", which has no corners: leave it out'
            )


def _check_rods(scene: "Scene") -> None:
    """Refuse (ValueError) rods of other lengths or moduli in structures that have no such rods."""
    if scene.rods.bar_young_modulus is not None and kind_of(scene.structure) != "pantograph-ring":
        raise ValueError(
            "rods.bar_young_modulus: only the pantograph ring has folding bars (leave it out)"
        )
    what = strained(scene)
    if not what:
        return
    if (kind := kind_of(scene.structure)) != "pantograph-ring":
        raise ValueError(
            f'{what} needs structure.kind = "pantograph-ring", not "{kind}" (leave it out)'
        )
    if kind_of(scene.rods) == "ancf":
        raise ValueError(
            f'{what} needs rods.kind = "geometrically-exact", not "ancf": choose that, or leave '
            f"{what} out"
        )


def _check_faults(scene: "Scene") -> None:
    """Refuse (ValueError) faults of what is not there."""
    cables = [] if scene.cables is None else scene.cables.present()
    for number, fault in enumerate(scene.faults, 1):
        places = {"section": scene.structure.sections, "cable": len(cables)}
        if isinstance(fault, FailedSpring) and scene.hinge_spring is None:
            raise ValueError(
                f"faults[{number}] is a fault of a spring, but the scene has none: add "
                "[hinge_spring], or leave the fault out"
            )
        if isinstance(fault, FailedLatch) and (scene.stop is None or not scene.stop.latch):
            raise ValueError(
                f"faults[{number}] is a fault of a latch, but the stops have none: set stop.latch "
                "= true, or leave the fault out"
            )
        if isinstance(fault, CableFault):
            if not cables:
                raise ValueError(
                    f"faults[{number}] is a fault of a cable, but the scene has none: add "
                    "[cables.upper], or leave the fault out"
                )
            pulleys = scene.pulleys_of(cables[min(fault.cable, len(cables)) - 1][1])
            places |= {"pulley": pulleys, "span": pulleys + 1}
        for name, most in places.items():
            if getattr(fault, name, 0) > most:
                raise ValueError(
                    f"faults[{number}].{name} = {getattr(fault, name)} must be at most {most}: "
                    f"there is no such {name}"
                )
