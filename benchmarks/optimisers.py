"""Which library finds a best design by few evaluations?

Run: python benchmarks/optimisers.py [--problems N]     (optuna, cma and pymoo if installed)

Made problems in the unit box: a quadratic cost with ripples and a kink of a tenth of it, and a
constraint that its optimum breaks.  Printed is the median of what is left to the best value (COBYQA
with 2,000 evaluations) after 40 and 80 evaluations.
"""

from __future__ import annotations

import argparse
import contextlib
import warnings
from collections.abc import Callable

import numpy as np
import scipy
from scipy.stats import qmc

from ringsim.analysis.optimum import Objective, Problem, course
from ringsim.analysis.requirements import Requirement

Value = Callable[[np.ndarray], tuple[float, float]]
"""Cost and constraint (at most 0) at a point."""
BATCH = 8


def problem(size: int, seed: int) -> Value:
    """Cost and constraint of a made problem."""
    stream = np.random.default_rng(seed)
    best, root = stream.uniform(0.2, 0.8, size), stream.normal(size=(size, size))
    curved = root @ root.T / size + np.eye(size)
    side = stream.normal(size=size)
    side /= np.linalg.norm(side)

    def value(x: np.ndarray) -> tuple[float, float]:
        off = x - best
        kinks = 0.05 * np.sin(9.0 * off @ side) ** 2 + 0.1 * abs(off @ curved[0])
        return float(off @ curved @ off + kinks), float(side @ off + 0.1)

    return value


def kept(value: Value) -> tuple[Value, list[tuple[float, float]]]:
    """The same, which remembers."""
    told: list[tuple[float, float]] = []

    def remembering(x: np.ndarray) -> tuple[float, float]:
        told.append(value(np.asarray(x)))
        return told[-1]

    return remembering, told


def sobol(value: Value, size: int, count: int, seed: int) -> None:
    """Points spread evenly."""
    for x in qmc.Sobol(size, seed=seed).random(count):
        value(x)


def cobyqa(value: Value, size: int, count: int, _seed: int) -> None:
    """Quadratic models in a trust region."""
    known: dict[bytes, tuple[float, float]] = {}

    def at(x: np.ndarray) -> tuple[float, float]:
        if x.tobytes() not in known:
            known[x.tobytes()] = value(x)
        return known[x.tobytes()]

    scipy.optimize.minimize(
        lambda x: at(x)[0], np.full(size, 0.5), method="COBYQA", bounds=[(0.0, 1.0)] * size,
        constraints=scipy.optimize.NonlinearConstraint(lambda x: at(x)[1], -np.inf, 0.0),
        options={"maxfev": count, "initial_tr_radius": 0.25},
    )  # fmt: skip


def rounds(value: Value, size: int, count: int, _seed: int) -> None:
    """What ringsim optimise does: the same, then steps on radial functions."""
    wanted = {"y": Requirement(max=0.0, probability=0.5, confidence=0.6)}
    asked = Problem([Objective("c")], wanted, np.full(size, 0.5), count, 1000)
    search, told, known = course(asked), None, dict[bytes, tuple[float, float]]()
    with contextlib.suppress(StopIteration):
        while True:
            design = search.send(told)
            if (key := design.point.tobytes()) not in known:
                known[key] = value(design.point)
            told = {name: np.full(4, each) for name, each in zip("cy", known[key], strict=True)}


def tpe(value: Value, size: int, count: int, seed: int) -> None:
    """optuna's tree of Parzen estimators, in batches."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    sampler = optuna.samplers.TPESampler(
        seed=seed, multivariate=True, constant_liar=True, n_startup_trials=2 * size + 2,
        constraints_func=lambda trial: trial.user_attrs["beyond"],
    )  # fmt: skip
    study = optuna.create_study(sampler=sampler)
    box = {f"x{k}": optuna.distributions.FloatDistribution(0.0, 1.0) for k in range(size)}
    for _ in range(count // BATCH):
        for trial in [study.ask(box) for _ in range(BATCH)]:
            cost, beyond = value(np.array([trial.params[name] for name in box]))
            trial.set_user_attr("beyond", (beyond,))
            study.tell(trial, cost)


def cma_es(value: Value, size: int, count: int, seed: int) -> None:
    """cma's evolution strategy; what breaks the constraint ranks behind all else."""
    import cma

    options = {"bounds": [0, 1], "seed": seed + 1, "popsize": BATCH, "verbose": -9}
    strategy, worst = cma.CMAEvolutionStrategy(np.full(size, 0.5), 0.3, options), 0.0
    for _ in range(count // BATCH):
        points = strategy.ask()
        told = [value(x) for x in points]
        worst = max(worst, *(cost for cost, _ in told))
        strategy.tell(points, [cost if g <= 0.0 else worst + g for cost, g in told])


def nsga2(value: Value, size: int, count: int, seed: int) -> None:
    """pymoo's genetic algorithm."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    class Made(ElementwiseProblem):
        def __init__(self) -> None:
            super().__init__(n_var=size, n_obj=1, n_ieq_constr=1, xl=0.0, xu=1.0)

        def _evaluate(self, x, out, *_args, **_keys):
            out["F"], out["G"] = value(x)

    minimize(Made(), NSGA2(pop_size=BATCH), ("n_eval", count), seed=seed)


def main() -> None:
    """Run all that is installed, and print."""
    asked = argparse.ArgumentParser()
    asked.add_argument("--problems", type=int, default=6)
    wanted = asked.parse_args()
    warnings.filterwarnings("ignore")
    for size in (2, 4, 8):
        for count in (40, 80):
            cells = []
            for search in (sobol, tpe, cma_es, nsga2, cobyqa, rounds):
                left = []
                with contextlib.suppress(ImportError):
                    for seed in range(wanted.problems):
                        truth, exact = kept(problem(size, seed))
                        cobyqa(truth, size, 2000, seed)
                        value, told = kept(problem(size, seed))
                        search(value, size, count, seed)
                        best, found = (
                            min((f for f, g in each if g <= 0.0), default=np.inf)
                            for each in (exact, told[:count])
                        )
                        left.append(found - best)
                if left:
                    cells.append(f"{search.__name__} {np.median(left):.4f}")
            print(f"{size} variables, {count} evaluations: {', '.join(cells)}", flush=True)


if __name__ == "__main__":
    main()
