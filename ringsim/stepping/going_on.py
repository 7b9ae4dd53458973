"""Runs that go on from what another one remembers."""

from ringsim.parts.solver import Solver
from ringsim.refusal import InputError
from ringsim.stepping.memory import Memory
from ringsim.stepping.run_control import RunControl
from ringsim.variables import Fate, Reason

_UNFINISHED = (Fate.CUT_OFF, Fate.FINISHED, Fate.DEPLOYED, Fate.NOT_LATCHED)
"""What runs may go on from without a change: the end time, or the settling time, is later now, or
joints lean on latches that have not caught."""


def go_on(control: RunControl, solver: Solver, memory: Memory, changed: bool, where: str) -> None:
    """Let a control that has just begun go on from the memory of another one.

    ``changed`` is whether the scene is another one, ``where`` what the state is called.

    Raises
    ------
    InputError
        If nothing is left to be run.
    """
    control.recall(memory)
    if control.now.time >= solver.end_time:
        raise InputError(
            f"solver.end_time = {solver.end_time:g} s: must be after {control.now.time:g} s, the "
            f"time of {where}"
        )
    if changed and control.fate is Fate.FOLDED:
        control.unsettle()
    if control.settled:
        folded = control.fate is Fate.FOLDED
        words = "come to the stowed stop" if folded else "locked"
        cure = "change the loads (--set), " if folded else ""
        raise InputError(
            f"{where}: all V-joints had {words} and settled: {cure}take an earlier state (--at), "
            "or raise solver.settling_time"
        )
    if control.goes_on:
        return
    if not changed and control.fate not in _UNFINISHED:
        raise InputError(
            f"{where}: the run had ended there ({control.reason}) and the scene is the same: take "
            "an earlier state (--at), or change the scene (--set)"
        )
    control.goes_on = True
    if control.fate not in (Fate.DEPLOYED, Fate.FOLDED):
        control.fate, control.reason = Fate.NONE, Reason()
