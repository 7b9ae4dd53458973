"""What steps, care and guard of a run remember, so that another run can go on from there."""

from typing import Any

from ringsim.refusal import InputError
from ringsim.stepping.constant_steps import ConstantSteps
from ringsim.stepping.instant import Instant
from ringsim.stepping.memory import Memory, instant, kept, restore
from ringsim.stepping.motion_steps import MotionSteps
from ringsim.stepping.repeats import EnergyImbalance, TensionBend
from ringsim.stepping.run_control import RunControl
from ringsim.variables import Cause, Fate, Reason

# Attributes that change over a run; the others follow from the scene that goes on.
_CONTROL = ("now", "_farthest", "_count", "repeats", "_settled_at", "status", "fate", "goes_on")
_MOTION = ("_bend", "_past", "step")
_CONSTANT = ("step", "_last", "_since")
_DEVIATIONS = ("_largest", "_bend", "_limit", "_past")
_ENERGY = ("limit", "_refused", "_work", "_stored", "_exchanged")
_BEND = ("limit", "_largest", "_past")
_REST = ("_since", "_angles", "_largest")
_GUARD = ("_lost", "_driven", "_low", "_high", "_worst")
_LOCKS = ("deployed", "stowed", "_away")


def control_memory(control: RunControl) -> Memory:
    """What a control remembers after an accepted step."""
    guard = control._guard
    return {
        "control": kept(control, _CONTROL),
        "reason": [int(control.reason.cause), str(control.reason)],
        "settling": control._solver.settling_time,
        "indicators": len(control._indicators),
        "guard": kept(guard, _GUARD),
        # Constant steps are judged by all of a run at its end.
        "run": guard._run if guard._constant else guard._run[:1],
        **{name: kept(part, names) for name, (part, names) in _parts(control).items()},
    }


def _parts(control: RunControl) -> dict[str, tuple[Any, tuple[str, ...]]]:
    """Parts of a control by name; of other settings some are missing, or have other names."""
    steps = control._steps
    motion = isinstance(steps, MotionSteps)
    found: dict[str, tuple[Any, tuple[str, ...]]] = {
        "motion" if motion else "constant": (steps, _MOTION if motion else _CONSTANT),
        "rest": (control._rest, _REST),
    }
    for one in control._indicators:
        if isinstance(one, EnergyImbalance):
            found["energy"] = one, _ENERGY
        elif isinstance(one, TensionBend):
            found["bend"] = one, _BEND
    if control._deviations is not None:
        found["deviations"] = control._deviations, _DEVIATIONS
    if control._locks is not None:
        found["locks"] = control._locks, _LOCKS
    return found


def go_on(control: RunControl, memory: Memory, changed: bool, where: str) -> None:
    """Let a control that has just begun go on from what another one remembers.

    ``changed`` is whether the scene is another one, ``where`` what the state is called.

    Raises
    ------
    InputError
        If nothing is left to be run.
    """
    for name, (part, _) in _parts(control).items():
        if name in memory:
            restore(part, memory[name])
    restore(control._guard, memory["guard"])
    control._guard._run = [instant(one) for one in memory["run"]]
    restore(control, memory["control"])
    cause, words = memory["reason"]
    control.reason = Reason(Cause(cause), words)
    # What had been left out by then; see RunControl._note_lock.
    control._indicators = control._indicators[: memory["indicators"]]
    steps, solver = control._steps, control._solver
    steps.step = min(steps.step, solver.step)
    if isinstance(steps, ConstantSteps) and changed:
        steps.step = solver.step
    control._settled_at += solver.settling_time - memory["settling"]
    now, ended = control.now.time, not memory["control"]["goes_on"]
    if now >= solver.end_time:
        raise InputError(
            f"solver.end_time = {solver.end_time:g} s: must be after {now:g} s, the time of {where}"
        )
    if now >= control._settled_at:
        raise InputError(
            f"{where}: all V-joints had locked and settled: take an earlier state (--at), or raise "
            "solver.settling_time"
        )
    if ended and not changed and control.fate not in (Fate.CUT_OFF, Fate.FINISHED, Fate.DEPLOYED):
        raise InputError(
            f"{where}: the run had ended there ({control.reason}) and the scene is the same: take "
            "an earlier state (--at), or change the scene (--set)"
        )
    if ended:
        control.goes_on = True
        if control.fate not in (Fate.DEPLOYED, Fate.FOLDED):
            control.fate, control.reason = Fate.NONE, Reason()


def begin_anew(control: RunControl, now: Instant, lost: float) -> None:
    """Let a control go on from how a changed scene makes the present instant; ``lost`` is the
    energy that the change has taken since the reading that it replaces, J.
    """
    guard = control._guard
    guard._run[-1:] = [now] if len(guard._run) > 1 else guard._run
    guard._lost += lost
    control.now = now
    control._rest._begin(now)
