"""Stands in for the simulation: quick, exact, and able to fail in every way."""

from __future__ import annotations

import os
import signal
import sys
import time

import numpy as np

from ringsim.scene import Scene
from ringsim.variables import Fate, Outcome, Status


def run(scene: Scene) -> Outcome:
    """A deployment whose numbers depend on the inputs alone."""
    force = scene.loads.force if scene.loads else 0.0
    modulus = float(np.mean(scene.rods.young_modulus))
    begin = time.perf_counter()
    times = (
        np.arange(int(scene.solver.end_time / scene.record.interval) + 1) * scene.record.interval
    )
    duration = 2.0 / np.sqrt(force) * (1.0 + 1e9 / modulus)
    sections = scene.structure.sections
    angle = np.where(times <= duration, 180.0 * (times / duration) ** 2, np.nan)
    return Outcome(
        Status.OK,
        "all V-joints have reached 180 deg",
        {
            "plane": np.array(["upper", "lower"]),
            "section": np.arange(1, sections + 1),
            "time": times,
        },
        {
            "deployment_time": np.array(duration),
            "opening_angle": np.broadcast_to(angle, (2, sections, len(times))),
            "asynchrony": np.where(times <= duration, 0.0, np.nan),
            "lock_time": np.full((2, sections), duration),
            "final_time": np.array(duration),
            "steps": np.array(100),
            "wall_time": np.array(time.perf_counter() - begin),
        },
    )


def fated(scene: Scene) -> Outcome:
    """Deploys below a force of 0.011 N, fails above 0.012 N, stalls between."""
    outcome, force = run(scene), scene.loads.force
    if force > 0.012:
        return Outcome(Status.SOLVER_FAILED, "Newton does not converge: try a smaller step")
    fate, why = (
        (Fate.DEPLOYED, "all open") if force < 0.011 else (Fate.STALLED, "nothing drives it")
    )
    return Outcome(
        Status.OK, why, outcome.coordinates, outcome.values | {"outcome": np.array(fate)}
    )


def nothing(scene: Scene) -> Outcome:
    """The least that a run can give."""
    return Outcome(Status.OK, "nothing to do", {}, {"deployment_time": np.array(scene.loads.force)})


def poisoned(scene: Scene) -> Outcome:
    """Fails in the way that ``rods.poisson_ratio`` names, in percent."""
    way = round(100 * scene.rods.poisson_ratio)
    print(f"way {way}")
    sys.stdout.flush()
    match way:
        case 1:
            raise ZeroDivisionError("on purpose")
        case 2:
            os.kill(os.getpid(), signal.SIGSEGV)
        case 3:
            os._exit(7)
        case 4:
            while True:
                pass
        case 5:
            return _eat()
        case 6:
            outcome = run(scene)
            outcome.values["asynchrony"][1] = np.nan
            return outcome
        case 7:
            outcome = run(scene)
            outcome.values["lock_time"] = np.full((2, 6), lambda: 0, dtype=object)
            return outcome
        case 8:
            sys.exit(5)
        case 9:
            return Outcome(Status.SOLVER_FAILED, "Newton does not converge: try a smaller step")
        case 11:
            if "CURED" not in os.environ:
                raise ZeroDivisionError("not cured")
        case 12 if scene.solver.tolerance > 2e-4:
            return Outcome(Status.SOLVER_FAILED, "a tolerance too large")
    return run(scene)


def _eat() -> Outcome:
    hoard = []
    while True:
        hoard.append(np.ones(1 << 22))


def loud(scene: Scene) -> Outcome:
    """Prints 100 MB, and a last line that it does not flush; every other run fails."""
    for _ in range(100):
        sys.stdout.write("x" * (1 << 20))
    print(f"force {scene.loads.force}", end="")
    if scene.rods.poisson_ratio < 0.25:
        raise ValueError("a name that is no text: \udcff and a zero byte \0")
    return run(scene)


def shapeless(scene: Scene) -> Outcome:
    """Other output times for strong forces, an array without its axis for the strongest."""
    outcome = run(scene)
    if scene.loads.force > 0.0125:
        times = outcome.coordinates["time"][:-1]
        outcome = Outcome(
            Status.OK, "shorter", outcome.coordinates | {"time": times},
            {"asynchrony": np.zeros(len(times))},
        )  # fmt: skip
    if scene.loads.force > 0.0135:
        outcome.values["asynchrony"] = np.zeros(3)
    return outcome


def traced(scene: Scene) -> Outcome:
    """Takes ten milliseconds and adds a byte to a file when it has ended."""
    time.sleep(0.01)
    outcome = run(scene)
    with open(os.environ["TRACE"], "ab", buffering=0) as trace:
        trace.write(b".")
    return outcome


def spy(scene: Scene) -> Outcome:
    """Tells what should not be in the solver's process."""
    heavy = sorted({"mpi4py", "xarray", "matplotlib", "netCDF4"} & set(sys.modules))
    inherited = [name for name in os.environ if name.startswith(("PMI", "OMPI", "HYDRA", "PMIX"))]
    threads = [] if os.environ["OMP_NUM_THREADS"] == "1" else ["many threads"]
    return Outcome(Status.OK, ", ".join(heavy + inherited + threads) or "clean", {}, {})


def judge(scene: Scene) -> Outcome:
    """Another engine: all deploys a tenth of a percent later; it dies where it is told to."""
    if "JUDGE_DIES" in os.environ:
        os.kill(os.getpid(), signal.SIGSEGV)
    outcome = run(scene)
    outcome.values["deployment_time"] = 1.001 * outcome.values["deployment_time"]
    return outcome


def slow(scene: Scene) -> Outcome:
    """Sleeps for as many seconds as ``rods.damping``."""
    time.sleep(scene.rods.damping)
    return run(scene)


def gated(scene: Scene) -> Outcome:
    """All but the first five runs wait until there is a certain file."""
    with open(os.environ["TRACE"], "ab", buffering=0) as trace:
        trace.write(b".")
        place = trace.tell()
    while place > 5 and not os.path.exists(os.environ["GATE"]):
        time.sleep(0.02)
    return run(scene)
