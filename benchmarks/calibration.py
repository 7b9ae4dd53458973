"""Are the intervals of a calibration honest?  Tests made by runs of known truth.

Run: python benchmarks/calibration.py [--kind coverage | bad | sound | own | wrong | flight]
         [--first N] [--tests N] [--runs N] [--ends] [--gross SHARE] [--file F]

Each test is of a ring of six sections with two cables: truths are drawn from the priors, a run of
the frame engine with them is read by an encoder of 0.1 deg in every V-joint at 2 Hz, and
``ringsim.Calibration`` finds the unknowns from these readings.

coverage  3 to 8 unknowns, chosen by chance.  Printed: how often the 90 and 95 % intervals hold, and
          whether ranks of the truths in the posterior are even (chi-squared of ten classes;
          simulation-based calibration, Talts et al. 2018).
bad       a friction for every pulley of both cables, one of them five times the mean, with a load
          cell of 0.2 N at each winch, too: how often it is named, with how many others, and first.
          Encoders alone do not see the first pulley of a cable: it slows all sections alike.
          With --ends there is a load cell where each rope ends, too.
sound     the same without it: how often any pulley is told to stand out.
own       as bad, but the bad pulley has a prior of its own, as after it was named: how often the
          90 % intervals hold its friction, those of the others, and the asynchrony of the ring
          wound at half the speed, from 64 samples.
wrong     as coverage with four unknowns, but the truth has dry friction in its V-joints, which the
          model lacks: how often the readings are told not to be explained.

--gross   a share of all readings is wrong by 6 to 60 standard deviations, up or down.

flight    the unknowns of campaigns/stand, tested on the ground: the 90 % intervals of the
          asynchrony in flight before and after, from 64 samples each, and whether they hold it.

What each test gave is kept in the file (runs/calibration-KIND.json) as it comes; tests that are
there are not run again.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import scipy.stats
import xarray as xr

import ringsim
from ringsim.analysis.posterior import explained
from ringsim.campaign.calibration import MEMBERS
from ringsim.sampling.distributions import Lognormal, Normal, Uniform

STAND = Path(__file__).parents[1] / "campaigns" / "stand"
RING = {
    "structure.sections": 6, "boom": "none", "solver.end_time": 12.0, "record.interval": 0.02,
}  # fmt: skip
PRIORS: dict[str, dict[str, Any]] = {
    "cables.upper.friction.coefficient":
        {"kind": "lognormal", "mean": 5e-4, "standard_deviation": 2e-4},
    "cables.lower.friction.coefficient":
        {"kind": "lognormal", "mean": 5e-4, "standard_deviation": 2e-4},
    "joints.vjoint.viscous": {"kind": "lognormal", "mean": 0.5, "standard_deviation": 0.15},
    "cables.lower.winch.start_time": {"kind": "uniform", "low": 0.0, "high": 0.5},
    "cables.upper.winch.winding.speed":
        {"kind": "normal", "mean": 0.12, "standard_deviation": 2e-3},
    "structure.opening_angle": {"kind": "normal", "mean": 20.0, "standard_deviation": 0.5},
    "structure.corner_mass": {"kind": "lognormal", "mean": 0.02, "standard_deviation": 0.006},
    "net.stiffness": {"kind": "lognormal", "mean": 1e-3, "standard_deviation": 4e-4},
}  # fmt: skip
"""Unknowns of the coverage; the wrong model has the first four."""
PULLEYS = {
    f"cables.{cable}.friction.coefficient": {
        "kind": "lognormal", "mean": 4e-4, "standard_deviation": 8e-5, "each_section": True,
    } for cable in ("upper", "lower")
}  # fmt: skip
CELL = 0.2
"""Scatter of a reading of a load cell, N."""
BAD = 5.0
"""The bad pulley's friction over the mean."""
MISSING = 0.05, 0.1
"""Dry friction of V-joints (N m) that a wrong model lacks.  Of 0.01 to 0.03 N m, a tenth of what is
viscous, the other unknowns take up so much that readings of 0.1 deg do not tell it."""
OWN = {"kind": "uniform", "low": 0.0, "high": 4e-3}
"""Prior of a pulley that was named, m."""
RUNS = {"coverage": 256, "wrong": 256, "bad": 320, "sound": 320, "own": 320, "flight": 128}
KINDS = {"lognormal": Lognormal, "normal": Normal, "uniform": Uniform}
PLANES, TIMES = ("upper", "lower"), np.arange(0.5, 11.6, 0.5)


def law(table: dict[str, Any]) -> Any:
    """The distribution of a table."""
    return KINDS[table["kind"]](**{k: v for k, v in table.items() if k != "kind"})


def readings_of(
    scene: ringsim.Scene, stream: np.random.Generator, folder: Path, spans: tuple[int, ...] = (),
    gross: float = 0.0,
) -> int:  # fmt: skip
    """Write the readings of a test, stand.toml and stand.csv, with load cells in some spans.  How
    many are grossly wrong, of which there is a share."""
    run = ringsim.simulate(scene, fidelity="frame")
    if run["status"]:
        raise ValueError(f"the truth fails: {run.attrs['reason']}")
    angle = run["opening_angle"]
    sections = range(1, 7)
    names = [f"{plane}{section}" for plane in PLANES for section in sections]
    columns = []
    for name in names:
        place = {"plane": name[:5], "section": int(name[5:])}
        own = angle.sel(place).dropna("time")
        times, lock = own["time"].values, float(run["lock_time"].sel(place))
        # The run ends once all joints have locked, and they stay where they are.
        if lock > times[-1]:
            times, own = np.append(times, lock), np.append(own, 180.0)
        exact = np.interp(TIMES, times, own, right=180.0)
        columns.append(exact + 0.1 * stream.standard_normal(len(TIMES)))
    cells = [(plane, span) for plane in PLANES for span in spans]
    for plane, span in cells:
        tension = run["cable_tension"].sel(plane=plane, span=span).dropna("time")
        exact = np.interp(TIMES, tension["time"], tension, right=np.nan)
        columns.append(exact + CELL * stream.standard_normal(len(TIMES)))
    wrong = stream.random((len(columns), len(TIMES))) < gross if gross else np.zeros((0, 0), bool)
    for k, column in enumerate(columns if gross else ()):
        far = stream.choice([-1, 1], len(TIMES)) * stream.uniform(6.0, 60.0, len(TIMES))
        column += (0.1 if k < len(names) else CELL) * far * wrong[k]
    heads = ["t", *names, *(f"{plane} span {span}" for plane, span in cells)]
    np.savetxt(folder / "stand.csv", np.column_stack([TIMES, *columns]), delimiter=",",
               header=",".join(heads), comments="", fmt="%.4f")  # fmt: skip
    lines = ['name = "stand"', 'file = "stand.csv"', "[clock]", 'column = "t"']
    for name in names:
        lines += ["[[sensors]]", f'column = "{name}"', 'variable = "opening_angle"',
                  f'place = {{ plane = "{name[:5]}", section = {name[5:]} }}', 'unit = "deg"',
                  "standard_deviation = 0.1"]  # fmt: skip
    for plane, span in cells:
        lines += ["[[sensors]]", f'column = "{plane} span {span}"', 'variable = "cable_tension"',
                  f'place = {{ plane = "{plane}", span = {span} }}', 'unit = "N"',
                  f"standard_deviation = {CELL}"]  # fmt: skip
    (folder / "stand.toml").write_text("\n".join(lines))
    return int(wrong.sum())


def one(
    kind: str, number: int, runs: int, ends: bool = False, gross: float = 0.0
) -> dict[str, Any]:
    """What one test gives."""
    if kind == "flight":
        return flight(number, runs)
    stream = np.random.default_rng([number, 1])
    base = ringsim.load_scene("ring18-cable").with_values(RING)
    pulleys = kind in ("bad", "sound", "own")
    if pulleys:
        priors = PULLEYS
    elif kind == "wrong":
        priors = dict(list(PRIORS.items())[:4])
    else:
        chosen = sorted(stream.choice(len(PRIORS), size=stream.integers(3, 9), replace=False))
        priors = {name: PRIORS[name] for name in np.array(list(PRIORS))[chosen].tolist()}
    found: dict[str, Any] = {"number": number}
    values: dict[str, Any] = {}
    for name, table in priors.items():
        count = base.spans - 1 if table.get("each_section") else 1
        drawn = law({k: v for k, v in table.items() if k != "each_section"}).quantile(
            stream.random(count)
        )
        values[name] = drawn.tolist() if table.get("each_section") else float(drawn[0])
    if kind in ("bad", "own"):
        name = list(priors)[stream.integers(2)]
        place = int(stream.integers(len(values[name])))
        values[name][place] = BAD * priors[name]["mean"]
        found["place"] = [name, place]
        if kind == "own":
            priors = priors | {f"{name}[{place + 1}]": OWN}
    truth = base.with_values(values)
    if kind == "wrong":
        truth = truth.with_values({"joints.vjoint.coulomb": float(stream.uniform(*MISSING))})
    with tempfile.TemporaryDirectory() as place_:
        folder = Path(place_)
        cells = (1, base.spans) if ends else (1,)
        found["gross"] = readings_of(truth, stream, folder, cells if pulleys else (), gross)
        calibration = ringsim.Calibration(
            base, priors, folder / "stand.toml", runs=runs, seed=number, fidelity="frame"
        )
        with contextlib.redirect_stderr(io.StringIO()):
            posterior = calibration.run(workers=0, out=folder / "out")
            if kind == "own":
                slow = {
                    "cables.upper.winch.winding.speed": 0.06,
                    "cables.lower.winch.winding.speed": 0.06,
                    "solver.end_time": 24.0,
                }
                found["half_speed"] = float(
                    ringsim.simulate(truth.with_values(slow), fidelity="frame")["asynchrony_max"]
                )
                found["foretold"] = foretold(
                    base.with_values(slow), {"from": str(folder / "out" / "posterior.nc")},
                    number, folder / "slow",
                )  # fmt: skip
    chances = posterior["chance"].values.tolist(), posterior["chance_of_all"].values.tolist()
    found["unexplained"] = not explained(*chances)
    found["lost"] = int(posterior["lost"].sum())
    found["strays"] = int(posterior["strays"].sum())
    if kind == "own":
        return found | {"ranks": _ranks(posterior, values)}
    if pulleys:
        return found | _standing(posterior, found.get("place"))
    found["learnt"] = posterior["learnt"].values.tolist()
    return found | {"unknowns": list(values), "ranks": _ranks(posterior, values)}


def _ranks(posterior: xr.Dataset, values: dict[str, Any]) -> list[int]:
    """How many samples of each unknown lie below its truth."""
    drawn = {str(posterior[v].attrs["path"]): posterior[v].values
             for v in posterior if "path" in posterior[v].attrs}  # fmt: skip
    ranks = []
    for name, value in values.items():
        if isinstance(value, list):  # of one place each, or of all
            for k, one_ in enumerate(value):
                own = drawn.get(f"{name}[{k + 1}]")
                ranks.append(int(((drawn[name][:, k] if own is None else own) < one_).sum()))
        else:
            ranks.append(int((drawn[name] < value).sum()))
    return ranks


def foretold(
    scene: ringsim.Scene, inputs: dict[str, Any], number: int, folder: Path
) -> list[float]:
    """The 90 % interval of the asynchrony from 64 samples."""
    runs = ringsim.Campaign(
        scene, inputs, {"kind": "random", "samples": 64}, number, fidelity="frame"
    ).run(workers=0, out=folder)
    # The k-th of n values stands for k / (n + 1): then a further one, as the truth is, lies between
    # the two with 90 %; of numpy's own quantiles of 64 it would be 87 %.
    values = runs["asynchrony_max"].dropna("sample")
    ends: list[float] = np.quantile(values, [0.05, 0.95], method="weibull").tolist()
    return ends


def flight(number: int, runs: int) -> dict[str, Any]:
    """What a test on the ground tells of the asynchrony in flight."""
    stream = np.random.default_rng([number, 2])
    stand = tomllib.loads((STAND / "friction.toml").read_text(encoding="utf-8"))
    aloft = tomllib.loads((STAND / "flight_before.toml").read_text(encoding="utf-8"))
    priors = stand["inputs"]
    values = {name: float(law(t).quantile(stream.random(1))[0]) for name, t in priors.items()}
    ground = ringsim.load_scene(stand["scene"]).with_values(stand["set"])
    scene = ringsim.load_scene(aloft["scene"]).with_values(aloft["set"])
    shared = {name: value for name, value in values.items() if name in aloft["inputs"]}
    truth = float(ringsim.simulate(scene.with_values(shared), fidelity="frame")["asynchrony_max"])
    found: dict[str, Any] = {"number": number, "truth": truth}
    with tempfile.TemporaryDirectory() as place, contextlib.redirect_stderr(io.StringIO()):
        folder = Path(place)
        readings_of(ground.with_values(values), stream, folder)
        ringsim.Calibration(
            ground, priors, folder / "stand.toml", runs=runs, seed=number, fidelity="frame"
        ).run(workers=0, out=folder / "cal")
        alone = [name for name in priors if name not in shared]
        inputs = {
            "before": aloft["inputs"],
            "after": {"from": {"file": str(folder / "cal" / "posterior.nc"), "without": alone}},
        }
        for when, given in inputs.items():
            found[when] = foretold(scene, given, number, folder / when)
    return found


def _standing(posterior: xr.Dataset, place: list[Any] | None) -> dict[str, Any]:
    group = posterior["group"].values
    found: dict[str, Any] = {
        "alarms": int((group > 0).sum()),
        "least_chance": float(posterior["contrast_chance"].min()),
    }
    if place is not None:
        own = np.flatnonzero(posterior["input"].values == place[0])[place[1]]
        found |= {"sigma": float(posterior["contrast"].values[own]),
                  "stands_out": bool(group[own] > 0),
                  "first": bool(np.abs(posterior["contrast"].values).argmax() == own)}  # fmt: skip
    return found


def told(kind: str, tests: list[dict[str, Any]]) -> str:
    """What all tests say."""
    count = len(tests)
    if kind == "sound":
        return f"{sum(t['alarms'] > 0 for t in tests)} of {count} tests have a false alarm"
    if kind == "bad":
        return (
            f"{sum(t['stands_out'] for t in tests)} of {count} bad pulleys are named, "
            f"{sum(t['first'] for t in tests)} of them first; pulleys named in the median "
            f"{np.median([t['alarms'] for t in tests]):g}, at most "
            f"{max(t['alarms'] for t in tests)}"
        )
    if kind == "flight":
        cut = [np.ptp(t["after"]) / np.ptp(t["before"]) for t in tests]
        held = {
            w: sum(t[w][0] <= t["truth"] <= t[w][1] for t in tests) for w in ("before", "after")
        }
        return (
            f"intervals after the test are {np.median(cut):.3f} times those before (at most "
            f"{max(cut):.3f}); they hold the truth in {held['after']} of {count}, those before in "
            f"{held['before']}"
        )
    if kind == "own":
        places = [17 * (t["place"][0] == list(PULLEYS)[1]) + t["place"][1] for t in tests]
        shares = [(np.array(t["ranks"]) + 0.5) / (MEMBERS + 1) for t in tests]
        holds = [np.abs(each - 0.5) < 0.45 for each in shares]
        own = [bool(each[k]) for each, k in zip(holds, places, strict=True)]
        rest = np.concatenate([np.delete(each, k) for each, k in zip(holds, places, strict=True)])
        slow = [t["foretold"][0] <= t["half_speed"] <= t["foretold"][1] for t in tests]
        return (
            f"{count} tests: intervals of 90 % hold the friction of {sum(own)} bad pulleys, of "
            f"others in {rest.mean():.3f}, the asynchrony at half the speed in {sum(slow)}"
        )
    if kind == "wrong":
        return f"{sum(t['unexplained'] for t in tests)} of {count} wrong models are told"
    ranks = (np.concatenate([t["ranks"] for t in tests]) + 0.5) / (MEMBERS + 1)
    shares = [float(np.mean(np.abs(ranks - 0.5) < 0.5 * level)) for level in (0.9, 0.95)]
    classes = np.bincount((10 * ranks).astype(int), minlength=10)
    even = scipy.stats.chisquare(classes).pvalue
    return (
        f"{count} tests, {len(ranks)} unknowns: intervals of 90 and 95 % hold in {shares[0]:.3f} "
        f"and {shares[1]:.3f}; ranks {classes.tolist()}, even with p = {even:.2g}; "
        f"{sum(t['unexplained'] for t in tests)} told not to be explained, "
        f"{sum(t['lost'] for t in tests)} runs lost, {sum(t['strays'] for t in tests)} readings "
        f"set aside of {sum(t.get('gross', 0) for t in tests)} that are grossly wrong"
    )


def main() -> None:
    """Run what is missing, and print."""
    asked = argparse.ArgumentParser()
    asked.add_argument("--kind", choices=(*RUNS,), default="coverage")
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--tests", type=int, default=20)
    asked.add_argument("--runs", type=int)
    asked.add_argument("--ends", action="store_true")
    asked.add_argument("--gross", type=float, default=0.0)
    asked.add_argument("--file", type=Path)
    wanted = asked.parse_args()
    file = wanted.file or Path("runs") / f"calibration-{wanted.kind}.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    tests = json.loads(file.read_text()) if file.exists() else []
    for number in range(wanted.first, wanted.first + wanted.tests):
        if any(test["number"] == number for test in tests):
            continue
        runs = wanted.runs or RUNS[wanted.kind]
        tests.append(one(wanted.kind, number, runs, wanted.ends, wanted.gross))
        file.write_text(json.dumps(tests))
        print(tests[-1], flush=True)
    print(told(wanted.kind, tests))


if __name__ == "__main__":
    main()
