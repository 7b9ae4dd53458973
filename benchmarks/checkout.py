"""A process of its own that solves scenes with the ringsim of one checkout, and sees that alone."""

from __future__ import annotations

import json
import os
import pickle
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np


def answer() -> None:
    """Read a scene a line on standard input, write what it gave: what a checkout's process does."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what the solver prints must not mix with the answers
    import ringsim

    for line in sys.stdin:
        entry, begin = json.loads(line), time.process_time()
        if "limit" in entry:  # above it the system ends this process
            limit = int(begin + entry["limit"]) + 1
            resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))
        found: dict[str, Any] = {"home": str(Path(str(ringsim.__file__)).parents[1])}
        try:
            scene = ringsim.load_scene(entry["scene"]).with_values(entry["values"])
            dataset = ringsim.simulate(scene, entry["fidelity"])
            found["cpu"] = time.process_time() - begin
            status = int(dataset["status"])
            found["status"] = str(dataset["status"].attrs["flag_meanings"]).split()[status]
            found["reason"] = dataset.attrs["reason"]
            found["values"] = {str(n): (v.dims, v.values) for n, v in dataset.data_vars.items()}
            found["units"] = {str(n): v.attrs.get("units") for n, v in dataset.data_vars.items()}
            found["times"] = dataset["time"].values if "time" in dataset else np.zeros(0)
        except Exception as error:
            found |= {"status": "refused", "reason": f"{type(error).__name__}: {error}"}
            found |= {"values": {}, "units": {}, "cpu": time.process_time() - begin}
        pickle.dump(found, answers)
        answers.flush()


class Checkout:
    """The process; what crashes it or takes too long costs that scene alone."""

    def __init__(self, tree: Path) -> None:
        self.tree = tree.resolve()
        self.start()

    def start(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, __file__],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=os.environ | {"PYTHONPATH": str(self.tree)}, cwd=self.tree,
        )  # fmt: skip
        for fidelity in ("full", "frame"):  # imports are no part of the first scene's time
            short = {"solver.end_time": 0.1, "record.interval": 0.1}
            found = self.solve({"scene": "truss2", "values": short, "fidelity": fidelity})
        if Path(found["home"]) != self.tree:
            raise SystemExit(f"{self.tree}: its process found ringsim in {found['home']}")

    def solve(self, entry: dict[str, Any]) -> dict[str, Any]:
        stdin, stdout = self.process.stdin, self.process.stdout
        assert stdin is not None and stdout is not None  # noqa: PT018
        try:
            stdin.write(json.dumps(entry).encode() + b"\n")
            stdin.flush()
            found: dict[str, Any] = pickle.load(stdout)
            return found
        except (EOFError, BrokenPipeError):
            code = self.process.wait()
            self.start()
            status = "too dear" if code == -signal.SIGXCPU else "crashed"
            return {"status": status, "reason": f"exit code {code}", "values": {}, "units": {},
                    "cpu": float("nan")}  # fmt: skip

    def close(self) -> None:
        self.process.communicate()


if __name__ == "__main__":
    answer()
