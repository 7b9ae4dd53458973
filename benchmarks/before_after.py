"""Do two checkouts give the same results, and which is faster?

    python benchmarks/before_after.py run --tree A --out a.pkl [--scenes 40 --first 0]
    python benchmarks/before_after.py run --tree B --out b.pkl --scenes-from a.scenes.json
    python benchmarks/before_after.py compare a.pkl b.pkl [--details]
    python benchmarks/before_after.py compare-times A B --scenes-from a.scenes.json

``run`` solves the built-in scenes and random ones (benchmarks/random_scenes.py) with the ringsim of
a checkout, in a process of its own that sees that checkout alone, through the public words
``load_scene``, ``with_values`` and ``simulate``.  Scenes that take more than 20 s are left out of
the list that it writes (``--scenes-to``, or beside the results); with ``--scenes-from`` that list
is run as it stands.  ``--only WORD`` picks the scenes whose names hold a word.

``compare`` says per scene by how much outputs differ: numbers and series over their largest value,
and over the error bar of the run; at the end per output.  ``compare-times`` lets both checkouts
solve every scene in turn, so that whatever else the machine does hits both alike.
"""

from __future__ import annotations

import argparse
import itertools
import json
import pickle
import statistics
from pathlib import Path
from typing import Any

import numpy as np
from checkout import Checkout
from random_scenes import random_scene

BUILT_IN = ("ring18", "ring18-cable", "truss2", "planar-truss")
DEAR = 15.0
"""Processor time of a random scene, in s, from which on it is left out."""
STUCK = 600.0
"""Processor time of any scene, in s, after which it is given up."""
TIMINGS = ("wall_time", "cpu_time")
COUNTS = ("steps", "repeated_steps", "newton_iterations", "jacobians", "restarts")
COUNTS += tuple(f"total_{name}" for name in COUNTS)
ABSOLUTE = ("energy_error", "constraint_error", "constraint_violation")
"""Errors: that of the energy is relative already, gaps are compared in metre."""
FLOORS = {"degree": 1e-6, "N": 1e-6, "J": 1e-9, "m": 1e-9, "s": 1e-6, "Pa": 1.0, "1": 1e-12}
"""Least scale of a relative difference by unit: what is smaller is round-off throughout."""
BARS = {"lock_time": "deployment_time_error"}
"""Error bars of outputs whose bar does not bear their name."""


def built_in() -> list[dict[str, Any]]:
    bars = {"solver.error_bars": True}
    return [{"name": n, "scene": n, "values": bars, "fidelity": "full"} for n in BUILT_IN]


def scenes_of(file: Path, only: str) -> list[dict[str, Any]]:
    return [entry for entry in json.loads(file.read_text()) if only in entry["name"]]


def run(asked: argparse.Namespace) -> None:
    checkout, found = Checkout(asked.tree), {}
    drawn = (random_scene(seed) for seed in itertools.count(asked.first))
    given = scenes_of(asked.scenes_from, asked.only) if asked.scenes_from else None
    wanted = len(given) if given is not None else len(BUILT_IN) + asked.scenes
    kept: list[dict[str, Any]] = []
    for entry in given if given is not None else itertools.chain(built_in(), drawn):
        choosing = given is None and entry["name"] not in BUILT_IN
        result = checkout.solve(entry | ({"limit": DEAR} if choosing else {"limit": STUCK}))
        text = f"{entry['name']:28s} {result['status']:14s} {result['cpu']:6.2f} s"
        if choosing and result["status"] in ("too dear", "refused"):
            print(f"{text} left out: {result['reason']}", flush=True)
            continue
        print(text, result["reason"] if result["status"] != "ok" else "", flush=True)
        found[entry["name"]] = result
        kept.append(entry)
        asked.out.write_bytes(pickle.dumps({"tree": str(asked.tree), "found": found}))
        if len(kept) == wanted:
            break
    checkout.close()
    if given is None:
        scenes_to = asked.scenes_to or asked.out.with_suffix(".scenes.json")
        scenes_to.write_text(json.dumps(kept, indent=1))


def differences(one: dict[str, Any], two: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """Difference over the largest value, and over the error bar (NaN without one), by output.

    Infinite where only one of both has the output, or a number where the other has none.
    """
    found = {}
    for name in dict.fromkeys([*one["values"], *two["values"]]):
        if name in TIMINGS or name in COUNTS or name == "status":
            continue
        if name not in one["values"] or name not in two["values"]:
            found[name] = (np.inf, np.nan)
            continue
        (dims, a), (_, b) = one["values"][name], two["values"][name]
        a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
        if "time" in dims:  # a run may end an output time earlier or later
            shared = min(a.shape[-1], b.shape[-1])
            a, b = a[..., :shared], b[..., :shared]
        if a.shape != b.shape or np.any(np.isnan(a) != np.isnan(b)):
            found[name] = (np.inf, np.nan)
            continue
        apart = np.nan_to_num(np.abs(a - b))
        scale = _scale(name, a, one)
        share = apart / bar if (bar := _bar(name, one, apart.shape)) is not None else np.nan
        found[name] = (float(np.max(apart, initial=0.0)) / scale, _largest(share))
    return found


def _largest(values: Any) -> float:
    there = np.asarray(values, dtype=float)
    there = there[np.isfinite(there)]
    return float(there.max()) if there.size else float("nan")


def _scale(name: str, a: np.ndarray, run: dict[str, Any]) -> float:
    if name in ABSOLUTE:
        return 1.0
    of = name.removesuffix("_error")  # a bar is compared with the value that it bounds
    size = np.asarray(run["values"][of][1], dtype=float) if of in run["values"] else a
    largest = max(_largest(np.abs(size)), _largest(np.abs(a)), 0.0)
    return max(largest, FLOORS.get(run["units"].get(name) or "", 1e-12))


def _bar(name: str, run: dict[str, Any], shape: tuple[int, ...]) -> np.ndarray | None:
    bar = run["values"].get(BARS.get(name, f"{name}_error"))
    if bar is None:
        return None
    values = np.asarray(bar[1], dtype=float)
    values = values[: shape[-1]] if values.ndim else values
    with np.errstate(invalid="ignore"):
        return np.where(values > 0.0, values, np.nan)


def compare(asked: argparse.Namespace) -> None:
    before, after = (pickle.loads(f.read_bytes())["found"] for f in (asked.before, asked.after))
    shared = [name for name in before if name in after]
    print("| scene | status | largest of numbers | of series | over error bar | steps | time |")
    print("|---|---|---|---|---|---|---|")
    every: dict[str, list[tuple[float, float]]] = {}
    for name in shared:
        one, two = before[name], after[name]
        found = differences(one, two)
        for output, pair in found.items():
            every.setdefault(output, []).append(pair)
        dims = {n: d for run in (one, two) for n, (d, _) in run["values"].items()}
        series = {n: d for n, (d, _) in found.items() if "time" in dims[n]}
        numbers = {n: d for n, (d, _) in found.items() if n not in series}
        bars_over = {n: share for n, (_, share) in found.items()}
        steps = [int(r["values"]["steps"][1]) if "steps" in r["values"] else -1 for r in (one, two)]
        status = one["status"] if one["status"] == two["status"] else (
            f"**{one['status']} -> {two['status']}**")  # fmt: skip
        cells = [name, status, worst(numbers), worst(series), worst(bars_over),
                 str(steps[0]) if steps[0] == steps[1] else f"{steps[0]} -> {steps[1]}",
                 f"{two['cpu'] / one['cpu']:.2f}"]  # fmt: skip
        print(f"| {' | '.join(cells)} |")
        if one["reason"] != two["reason"] and asked.details:
            print(f"|  | before: {one['reason']} | after: {two['reason']} | | | | |")
        if asked.details:
            listed = {n: pair for n, pair in found.items() if pair[0] > 1e-12}
            for output, (apart, share) in sorted(listed.items(), key=lambda item: -item[1][0]):
                over = "" if np.isnan(share) else f"{share:.1e}"
                print(f"|  | {output} | {apart:.1e} | | {over} | | |")
    print("\n| output | scenes | equal | median difference | largest | largest over bar |")
    print("|---|---|---|---|---|---|")
    for output, pairs in every.items():
        apart = [pair[0] for pair in pairs]
        bars = _largest([pair[1] for pair in pairs])
        print(f"| {output} | {len(apart)} | {sum(a == 0.0 for a in apart)} | "
              f"{statistics.median(apart):.1e} | {max(apart):.1e} | "
              f"{'' if np.isnan(bars) else format(bars, '.1e')} |")  # fmt: skip
    print(f"\n{len(shared)} scenes; {len(set(before) ^ set(after))} are in one file alone")
    report_times([(before[name]["cpu"], after[name]["cpu"]) for name in shared])


def worst(found: dict[str, float]) -> str:
    there = {name: value for name, value in found.items() if not np.isnan(value)}
    if not there:
        return ""
    name = max(there, key=lambda n: there[n])
    return "0" if there[name] == 0.0 else f"{there[name]:.1e} {name}"


def report_times(pairs: list[tuple[float, float]]) -> None:
    known = [(a, b) for a, b in pairs if np.isfinite(a) and np.isfinite(b)]
    total = [sum(column) for column in zip(*known, strict=True)]
    median = statistics.median(b / a for a, b in known)
    print(f"processor time: {total[0]:.1f} s before, {total[1]:.1f} s after, "
          f"ratio {total[1] / total[0]:.3f} in total, {median:.3f} in the median")  # fmt: skip


def compare_times(asked: argparse.Namespace) -> None:
    one, two = Checkout(asked.before), Checkout(asked.after)
    pairs = []
    for number, entry in enumerate(scenes_of(asked.scenes_from, asked.only)):
        taken: dict[Checkout, list[float]] = {one: [], two: []}
        for repeat in range(asked.repeats):
            order = (one, two) if (number + repeat) % 2 == 0 else (two, one)
            for checkout in order:
                taken[checkout].append(checkout.solve(entry)["cpu"])
        pairs.append((min(taken[one]), min(taken[two])))
        print(f"{entry['name']:28s} {pairs[-1][0]:7.2f} s {pairs[-1][1]:7.2f} s "
              f"{pairs[-1][1] / pairs[-1][0]:6.3f}", flush=True)  # fmt: skip
    report_times(pairs)


def main() -> None:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    one = verbs.add_parser("run", help="solve scenes with one checkout")
    one.add_argument("--tree", type=Path, required=True)
    one.add_argument("--out", type=Path, required=True)
    one.add_argument("--scenes", type=int, default=40)
    one.add_argument("--first", type=int, default=0, help="first seed")
    one.add_argument("--scenes-to", type=Path)
    two = verbs.add_parser("compare", help="compare the results of two runs")
    two.add_argument("--details", action="store_true", help="every output that differs")
    times = verbs.add_parser("compare-times", help="solve scenes with two checkouts in turn")
    times.add_argument("--repeats", type=int, default=1, help="the shortest time counts")
    for verb in (two, times):
        verb.add_argument("before", type=Path)
        verb.add_argument("after", type=Path)
    for verb in (one, times):
        verb.add_argument("--scenes-from", type=Path, required=verb is times)
        verb.add_argument("--only", default="", help="scenes whose name holds this word")
    asked = parser.parse_args()
    {"run": run, "compare": compare, "compare-times": compare_times}[asked.verb](asked)


if __name__ == "__main__":
    main()
