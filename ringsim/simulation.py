"""One simulation: scene in, outcome or dataset out.  Failures are values, not exceptions.

Engines are imported by whoever runs them: each costs a second, and its own libraries.
"""

import contextlib
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

import numpy as np

from ringsim import extensions
from ringsim.cable import friction
from ringsim.cable.control import OUTSIDE, Outside, Readings, checked, places_of
from ringsim.choice import kind_of
from ringsim.outputs.balance import with_bars
from ringsim.outputs.base import SMOOTHED
from ringsim.outputs.recorder import StoredState
from ringsim.parts.solver import Solver
from ringsim.refusal import InputError, NotBuiltError, known_or_nearest, show
from ringsim.rigid.margin import with_margin
from ringsim.scene import Scene, load_scene
from ringsim.scene.substituted import substituted
from ringsim.stepping.ending import run_with_restarts
from ringsim.stepping.instant import Instant, Watch
from ringsim.stored_state import require_fit
from ringsim.threads import one_thread
from ringsim.variables import AT_REST, GONE, Cause, Fate, Fidelity, Outcome, Status

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIDELITIES", "Steps", "run", "run_frame", "simulate", "steps", "why_not_frame"]

Solve = Callable[[Scene, Watch | None], Outcome]
"""An engine."""


def run(
    scene: Scene, watch: Watch | None = None, start: StoredState | None = None
) -> Outcome:  # fmt: skip
    """Build and integrate a scene; one that fails or diverges starts anew with smaller steps.

    The outcome has arrays on the scene's output grid, of the last start, and what
    :func:`ringsim.stepping.ending.run_with_restarts` adds on the starts; times are those of all
    of them and of the second run for error bars.  A solve that fails or does not reach its goal
    has a status other than OK and the reason; it never raises.  ``watch`` is called with every
    accepted state.

    Raises
    ------
    InputError
        If the structure cannot be put together, or the scene asks for stored states, or is to go on
        from one, as only the frame engine can.
    """
    require_fit(start, scene, "full")
    prepare_run(scene)
    from ringsim.exudyn.integrate import solve

    return _run(solve, Fidelity.FULL, scene, watch)


def prepare_run(scene: Scene) -> None:
    """Load what ``run`` needs, so that the time of the first run is that of a run."""
    import ringsim.exudyn.integrate  # noqa: F401


_CRAWLS = 0.3
"""Excess of a tension from which on friction is not merely rounded: the rope runs slower than the
slip speed, and the ring opens where its friction would hold it."""


def run_frame(
    scene: Scene, watch: Watch | None = None, start: StoredState | None = None
) -> Outcome:  # fmt: skip
    """As :func:`run`, by the frame engine, which can go on from a stored state.

    Raises
    ------
    InputError
        If it cannot represent the scene, or the state is none of such a scene.
    """
    require_fit(start, scene, "frame")
    prepare_run_frame(scene)
    from ringsim.frame.integrate import solve

    if start is None and scene.record.state_interval is None:
        return _run(solve, Fidelity.FRAME, scene, watch)
    from ringsim.frame.integrate import solve_and_store as solve_storing

    storing = partial(solve_storing, start=start)
    before = [] if start is None else start.scenes
    outcome = _run(storing, Fidelity.FRAME, scene, watch, before)
    return outcome if start is None else replace(outcome, began=start.told(scene))


def prepare_run_frame(scene: Scene) -> None:
    """Load what ``run_frame`` needs.

    Raises
    ------
    InputError
        If it cannot represent the scene's rods.
    """
    _refuse_other_rods(scene)
    import ringsim.frame.integrate  # noqa: F401


def why_not_frame(scene: Scene) -> str:
    """Why the frame engine cannot represent a scene, or what it records; empty if it can."""
    try:
        _refuse_other_rods(scene)
        from ringsim.frame.model import FrameModel
        from ringsim.frame.readings import FrameMeters

        FrameMeters(FrameModel(scene))
    except InputError as error:
        return str(error)
    return ""


def _refuse_other_rods(scene: Scene) -> None:
    """The frame engine's elements are geometrically exact, whatever a scene asks for."""
    if not scene.rods.oriented:
        raise InputError(
            f'rods.kind = "{kind_of(scene.rods)}": fidelity = "frame" has geometrically-exact rods '
            'only: leave rods.kind out, or choose fidelity = "full"'
        )


@one_thread()
def _run(
    solve: Solve, fidelity: Fidelity, scene: Scene, watch: Watch | None,
    before: Sequence[tuple[float, Scene]] = (),
) -> Outcome:  # fmt: skip
    """Run a scene with an engine, which may refuse it; it had other scenes ``before``, each until a
    time (s).
    """
    begin = (time.perf_counter(), time.process_time())
    scene = substituted(scene)
    if isinstance(scene.controller, Outside) and not hasattr(OUTSIDE, "ask"):
        raise InputError(
            'controller.kind = "outside": only ringsim.steps in Python commands it: step the scene '
            "there, or choose another kind"
        )

    def start(variant: Scene) -> Outcome:
        """One start; times count from the first."""
        try:
            outcome = solve(variant, watch)
            outcome.values["wall_time"] = np.array(time.perf_counter() - begin[0])
            outcome.values["cpu_time"] = np.array(time.process_time() - begin[1])
            return outcome
        except (InputError, NotBuiltError):
            raise
        except Exception as error:  # whatever broke, a campaign goes on and the user learns of it
            traceback.print_exc()  # a campaign keeps it in the sample's log
            place = ""
            with contextlib.suppress(Exception):  # a module may be gone meanwhile
                place = extensions.line_in(extensions.files_of(scene.imports), error)
            why = f"{type(error).__name__}: {error}{place}"
            return Outcome(Status.ERROR, why, cause=Cause.EXCEPTION)

    def so_solved(solver: Solver) -> Scene:
        return scene.model_copy(update={"solver": solver})

    outcome = run_with_restarts(
        lambda solver: start(so_solved(solver)),
        scene.solver,
        lambda outcome, used: with_bars(outcome, so_solved(used), start),
    )
    outcome.values["fidelity"] = np.array(int(fidelity))
    if scene.record.frequency and outcome.fate is Fate.DEPLOYED:
        from ringsim.frame.modes import first_frequency  # few scenes ask for it

        try:
            outcome.values["first_frequency"] = np.array(first_frequency(scene))
        except InputError as error:  # the run itself is as good as without
            outcome.values["first_frequency"] = np.array(np.nan)
            outcome = replace(outcome, reason=f"{outcome.reason}; first_frequency unknown: {error}")
    return _with_remark(with_margin(_after_faults(outcome, scene), scene, before), scene)


def _after_faults(outcome: Outcome, scene: Scene) -> Outcome:
    """The outcome; of a ring that came to rest short of its goal its reason names the faults that
    had struck by then.
    """
    if outcome.status.failed or outcome.fate not in AT_REST:
        return outcome
    end = float(outcome.values["final_time"])
    struck = [f"{kind_of(one)} at {one.time:.4g} s" for one in scene.faults if one.time <= end]
    why, mark, rest = outcome.reason.partition("; ")
    after = f", after {' and '.join(struck)}" * bool(struck)
    return replace(outcome, reason=f"{why}{after}{mark}{rest}")


def _with_remark(outcome: Outcome, scene: Scene) -> Outcome:
    """The outcome; its reason ends with the cables whose pulley friction is reduced, if any.

    A law with feedback finds its speed in the run, and a scene may set the slip speed, so this is
    judged afterwards, by the length wound until deployed; see ``ringsim.cable.friction``.
    """
    values = outcome.values
    if scene.cables is None or outcome.status.failed or "wound_length" not in values:
        return outcome
    times, faded = outcome.coordinates["time"], dict[str, tuple[float, float, float]]()
    before = ~(times > values.get("deployment_time", np.nan))
    for plane, cable in scene.cables.present():
        pulleys = scene.pulleys_of(cable)
        slip = cable.slip_speed_over(pulleys)
        speed = friction.usual_winding(times[before], values["wound_length"][plane, before])
        right_angle, tension = np.full(pulleys, 0.5 * np.pi), float(values["peak_tension"])
        seen = friction.Pulleys(right_angle, np.zeros(pulleys), np.full(pulleys, tension))
        decay = -cable.friction.decay(seen, cable.pulley_radius).min(initial=0.0)
        excess = friction.excess(slip, speed, pulleys, float(decay))
        if speed > 0.0 and excess > friction.TOLERATED:
            most = friction.slip_speed(speed, pulleys)
            faded[f"cables.{scene.structure.planes[plane]}.slip_speed"] = slip, most, 100.0 * excess
    if not faded:
        return outcome
    slips, bounds, excesses = zip(*faded.values(), strict=True)
    if max(excesses) < 100.0 * _CRAWLS:
        remark = (
            f"; pulley friction is smoothed, tension far from the winch up to {max(excesses):.0f} "
            f"% too high: {' and '.join(faded)} = {max(slips):.2g} m/s must be at most "
            f"{min(bounds):.2g} m/s"
        )
    else:
        # What stops short with little friction does so with all of it.
        off = "asynchrony_max, peak_tension"
        if np.isfinite(values.get("deployment_time", np.nan)):  # not of what never locks
            off = "asynchrony_max, deployment_time, outcome, peak_tension"
        remark = (
            f"; {SMOOTHED}: the ring moves too easily, and tensions are up to {max(excesses):.0f} "
            f"% too high far from the winch and may be too low near it, so {off} may be off: set "
            f"{' and '.join(faded)} = {min(bounds):.2g} m/s"
        )
    return replace(outcome, reason=outcome.reason + remark)


FIDELITIES: dict[str, Callable[[Scene], Outcome]] = {"full": run, "frame": run_frame}
"""What answers a scene: the full multibody model; or the same rods, joints and cables in joint
coordinates, some thirty times as fast."""


def simulate(
    scene: Scene | str | Path, fidelity: str | None = None, *, start: StoredState | None = None
) -> "xr.Dataset":  # fmt: skip
    """Run a scene and return its dataset (see ``ringsim.dataset.to_dataset``).

    Parameters
    ----------
    scene
        A scene, or what ``load_scene`` reads: the name of a built-in one or a file.
    fidelity
        "full", exudyn's multibody model; "frame", the same rods, joints and cables some thirty
        times as fast; if left out, "frame" wherever the scene allows it, else "full".
    start
        A stored state, see :func:`ringsim.read_state`: the run goes on from there to the end, with
        the engine of that state, and its dataset tells of all from the very beginning.

    InputError if one of them is refused, or if the frame engine cannot represent the scene.

    >>> from ringsim.scene import load_scene
    >>> scene = load_scene("truss2").with_values({"solver.end_time": 0.5})
    >>> run = simulate(scene)
    >>> run.attrs["reason"]
    'solver.end_time = 0.5 s was reached with 0 of 4 V-joints locked'
    >>> bool(run["energy_error"] < 1e-3)
    True
    """
    from ringsim.dataset import to_dataset

    if fidelity is not None and fidelity not in FIDELITIES:
        hint = known_or_nearest(fidelity, FIDELITIES)
        why = GONE.get(fidelity, f"there is no such model ({hint})")
        raise InputError(f"fidelity = {show(fidelity)}: {why}")
    chosen = load_scene(scene) if isinstance(scene, (str, Path)) else scene
    require_fit(start, chosen, fidelity or "frame")
    if start is not None:
        outcome = run_frame(chosen, start=start)
    elif fidelity is not None:
        outcome = FIDELITIES[fidelity](chosen)
    else:
        try:
            outcome = run_frame(chosen)
        except InputError:  # the full model says what is wrong if that is not the frames' alone
            outcome = run(chosen)
    return to_dataset(outcome, chosen)


# Runs that are stepped from outside.


class _StoppedError(BaseException):
    """Nobody asks for the next sample."""


class Steps:
    """A run that whoever iterates over it commands: one turn of the loop for each sample.

    The run computes in a thread of its own and waits while the loop's body decides.  A loop that is
    left early ends the run.

    Attributes
    ----------
    time
        Of the present sample, s.
    """

    def __init__(self, scene: Scene, fidelity: str) -> None:
        self.time = 0.0
        self._scene, self._fidelity, self._winches = scene, fidelity, places_of(scene)
        self._told: dict[str, float] = {}
        self._outcome: Outcome | None = None

    def command(self, **speeds: float) -> None:
        """Speeds (m/s) for winches by name, which they have from the sample's time and the
        controller's ``delay`` on; ``command(**{"upper far": 0.1})`` for a second winch.  InputError
        if there is no such winch, or it takes no commands.
        """
        try:
            self._told |= checked(speeds, self._winches, "command")
        except ValueError as error:
            raise InputError(str(error)) from None

    def __iter__(self) -> Iterator[Readings]:
        self._outcome, self._told = None, {}
        shown: SimpleQueue[tuple[float, Readings] | Outcome | BaseException] = SimpleQueue()
        answers: SimpleQueue[Mapping[str, float] | None] = SimpleQueue()
        left = threading.Event()

        def ask(time: float, readings: Readings) -> Mapping[str, float]:
            shown.put((time, readings))
            if (answer := answers.get()) is None:
                raise _StoppedError
            return answer

        def watch(now: Instant) -> None:
            if left.is_set():
                raise _StoppedError

        def work() -> None:
            OUTSIDE.ask = ask
            try:
                shown.put((run if self._fidelity == "full" else run_frame)(self._scene, watch))
            except BaseException as error:  # for the thread that iterates
                shown.put(error)

        thread = threading.Thread(target=work, name="ringsim.steps", daemon=True)
        thread.start()
        try:
            while True:
                found = shown.get()
                if isinstance(found, BaseException):
                    raise found
                if isinstance(found, Outcome):
                    self._outcome = found
                    return
                self.time, readings = found
                yield readings
                told, self._told = self._told, {}
                answers.put(told)
        finally:
            left.set()
            answers.put(None)
            thread.join()

    @property
    def result(self) -> "xr.Dataset":
        """The dataset of the run, as of ``simulate``; RuntimeError before its end."""
        from ringsim.dataset import to_dataset

        if self._outcome is None:
            raise RuntimeError("the run has not ended: iterate over all of its steps first")
        return to_dataset(self._outcome, self._scene)


def steps(
    scene: Scene | str | Path, fidelity: str = "frame", *, period: float | None = None
) -> Steps:  # fmt: skip
    """A run to iterate over: each turn gives the readings of a sample, as controllers get them.

    Parameters
    ----------
    scene
        A scene, or what ``load_scene`` reads.  Winches of kind "commanded" or "motor" take
        commands.  A ``controller`` of kind "outside" says how it is sampled: delay, errors of
        sensors.
    fidelity
        "frame" or "full", see ``simulate``; either without restarts and error bars, for which the
        loop would have to decide again.
    period
        Time between samples, s, in place of that of the scene's controller.

    InputError if one of them is refused.

    >>> winch = {"winding": {"kind": "commanded", "max_speed": 0.1}}
    >>> scene = load_scene("truss2").with_values(
    ...     {"cables.upper.winch": winch, "cables.lower.winch": winch, "solver.end_time": 2.0}
    ... )
    >>> run = steps(scene, period=0.5)
    >>> for readings in run:
    ...     run.command(upper=0.02, lower=0.02 if readings.tension["lower"] < 1.0 else 0.0)
    >>> round(float(run.result["wound_length"].sel(plane="upper")[-1]), 6)
    0.04
    """
    chosen = load_scene(scene) if isinstance(scene, (str, Path)) else scene
    if fidelity not in FIDELITIES:
        raise InputError(
            f"fidelity = {show(fidelity)}: there is no such model "
            f"({known_or_nearest(fidelity, FIDELITIES)})"
        )
    outside = chosen.controller is not None and chosen.controller.outside
    values: dict[str, Any] = {}
    if not outside:
        if chosen.controller is not None or period is None:
            raise InputError(
                'controller: must be of kind "outside" to be stepped: give it so, or leave it out '
                "and give period (s)"
            )
        values["controller"] = {"kind": "outside", "period": period}
    elif period is not None:
        values["controller.period"] = period
    # A start anew would ask again for what has been decided already.
    values |= {"solver.restarts": 0, "solver.error_bars": False}
    return Steps(chosen.with_values(values), fidelity)
