"""What reports and analyses are to say of a campaign's file, by numpy and scipy from it alone:
nothing of ringsim's own analysis is used here.
"""

from __future__ import annotations

import itertools
import json
import math
import tomllib
from pathlib import Path

import netCDF4
import numpy as np
from scipy.optimize import brentq
from scipy.stats import beta, binom, norm, rankdata

WIDE = float(norm.ppf(0.975))
FATES = {1: "deployed", 2: "partly deployed", 3: "stalled", 6: "cut off", 8: "not latched"}
LOSSES = {3: "diverged", 6: "timeout"}


def agrees(text: str, value: float, digits: int = 4) -> None:
    """A printed number is the value to so many digits."""
    if math.isnan(value):
        assert text == "-", (text, value)
        return
    assert abs(float(text) - value) <= 0.51 * 10.0 ** (1 - digits) * abs(value) + 1e-12, (
        text, value,
    )  # fmt: skip


def estimate_agrees(
    text: str, value: float, ends: tuple[float, float], digits: int = 4
) -> None:  # fmt: skip
    """The same, to two digits of half of its interval where these are fewer."""
    half = 0.5 * (ends[1] - ends[0])
    if not half > 0.0:
        agrees(text, value, digits)
        return
    coarsest = 10.0 ** (math.floor(math.log10(half)) - 1)
    allowed = 0.51 * max(coarsest, 10.0 ** (1 - digits) * abs(value)) + 1e-12
    assert abs(float(text) - value) <= allowed, (text, value, ends)
    _, _, decimals = text.partition(".")
    assert "e" in text or not decimals or 10.0 ** -len(decimals) > 0.09 * coarsest, (text, ends)


def interval_agrees(text: str, ends: tuple[float, float], digits: int = 4) -> None:
    if np.isnan(ends).all():
        assert text == "-", (text, ends)
        return
    for word, end in zip(text.split(" .. "), ends, strict=True):
        estimate_agrees(word, end, ends, digits)


def share_interval(count: int, of: int) -> tuple[float, float]:
    """Clopper and Pearson, by the beta distribution."""
    return bound(count, of, 0.975)[0], bound(count, of, 0.975)[1]


def bound(count: int, of: int, level: float) -> tuple[float, float]:
    low = float(beta.ppf(1.0 - level, count, of - count + 1)) if count else 0.0
    high = float(beta.ppf(level, count + 1, of - count)) if count < of else 1.0
    return low, high


def quantile_interval(values: np.ndarray, level: float) -> tuple[float, float]:
    """The closest two order statistics that hold a quantile with 95 %, the most equal tails."""
    count, ordered, best = len(values), np.sort(values), None
    for low, high in itertools.combinations(range(1, count + 1), 2):
        below, until = binom.cdf([low - 1, high - 1], count, level)
        if until - below >= 0.95 - 1e-12:
            best = min(filter(None, [best, (high - low, abs(below - (1.0 - until)), low)]))
    if best is None:
        return np.nan, np.nan
    return float(ordered[best[2] - 1]), float(ordered[best[2] + best[0] - 1])


def bootstrap(values: np.ndarray, statistic: str) -> tuple[float, float]:
    """Efron's BCa interval of "mean" or "std", of 20,000 resamples of a seed of its own."""
    options = {} if statistic == "mean" else {"ddof": 1}
    measure = getattr(np, statistic)
    count, random = len(values), np.random.default_rng(12345)
    drawn = values[random.integers(0, count, (20_000, count))]
    found, known = np.sort(measure(drawn, axis=1, **options)), measure(values, **options)
    bias = norm.ppf((np.mean(found < known) + np.mean(found <= known)) / 2)
    left = np.array([measure(np.delete(values, k), **options) for k in range(count)])
    apart = left.mean() - left
    bend = (apart**3).sum() / (6.0 * (apart**2).sum() ** 1.5)
    ends = [norm.cdf(bias + (bias + z) / (1.0 - bend * (bias + z))) for z in (-WIDE, WIDE)]
    return tuple(np.quantile(found, ends))


def correlation_interval(value: float, samples: int, held: int) -> tuple[float, float]:
    """Bonett and Wright (2000), of rank correlations."""
    free = samples - held - 3
    if free < 1 or abs(value) >= 1.0 - 1e-12:
        return np.nan, np.nan
    half = WIDE * math.sqrt((1.0 + value**2 / 2.0) / free)
    return math.tanh(math.atanh(value) - half), math.tanh(math.atanh(value) + half)


def area_interval(area: float, inside: int, outside: int) -> tuple[float, float]:
    """Newcombe (2006), method 5."""
    more = (inside + outside) / 2 - 1

    def beyond(other: float) -> float:
        spread = 1 + more * ((1 - other) / (2 - other) + other / (1 + other))
        return abs(area - other) - WIDE * math.sqrt(
            other * (1 - other) * spread / (inside * outside)
        )

    low = 0.0 if area <= 0.0 else brentq(beyond, 1e-12, min(area, 1.0 - 1e-6))
    return low, 1.0 if area >= 1.0 else brentq(beyond, max(area, 1e-6), 1.0 - 1e-12)


class File:
    """A campaign's file, and what is to be said of it."""

    def __init__(self, path: Path) -> None:
        with netCDF4.Dataset(path) as file:
            self.values = {
                name: np.ma.filled(v[:].astype(float), np.nan) for name, v in file.variables.items()
                if v.dimensions == ("sample",) and v.dtype is not str and v.dtype.kind in "fi"
            }  # fmt: skip
            self.scene = tomllib.loads(file.getncattr("scene"))
            told = {"degree": "deg"}  # as CF writes it, and as people do
            units = {name: getattr(v, "units", "") for name, v in file.variables.items()}
            self.units = {name: told.get(unit, unit) for name, unit in units.items()}
            self.words = {name: getattr(v, "long_name", "") for name, v in file.variables.items()}
            self.inputs = {}
            for name, v in file.variables.items():
                if getattr(v, "role", "") == "input":
                    self.inputs.setdefault(getattr(v, "input", v.getncattr("path")), name)
            self.wanted = json.loads(file.getncattr("requirements"))
        self.ok = self.values["status"] == 0
        self.lost = self.values["status"] >= 2

    def of(self, name: str) -> np.ndarray:
        """Values that hold."""
        values = self.values[name][self.ok]
        return values[np.isfinite(values)]

    def input(self, name: str) -> np.ndarray:
        return self.values[self.inputs[name]]

    def violating(self, name: str) -> np.ndarray:
        wanted = self.wanted[name]
        if name == "outcome":
            return self.ok & (self.values["outcome"] != 1)
        values = self.values[name]
        keeps = (values <= wanted.get("max", np.inf)) & (values >= wanted.get("min", -np.inf))
        return self.ok & ~keeps

    def text(self, name: str) -> str:
        wanted, unit = self.wanted[name], self.units[name]
        unit = "" if unit in ("", "1") else f" {unit}"
        if name == "outcome":
            return f"outcome is {wanted['is']}"
        signs = (("<=", "max"), (">=", "min"))
        return f"{name} " + " and ".join(
            f"{s} {wanted[k]:g}{unit}" for s, k in signs if k in wanted
        )

    def group(self, words: str) -> tuple[np.ndarray, np.ndarray]:
        """Samples that words name, of which: the first of several names of the same samples."""
        first = words.split("; ")[0].strip()
        if first == "failed runs" or first.startswith("failed: "):
            codes = [c for c, w in LOSSES.items() if first in ("failed runs", f"failed: {w}")]
            return np.isin(self.values["status"], codes), self.ok | self.lost
        if first.startswith("violates "):
            told = first.removeprefix("violates ")
            (name,) = [n for n in self.wanted if self.text(n) == told]
            return self.violating(name), self.ok
        (fate,) = [code for code, word in FATES.items() if word == first]
        return self.ok & (self.values["outcome"] == fate), self.ok

    def correlation(self, output: str, name: str) -> tuple[float, int]:
        known = self.ok & np.isfinite(self.values[output])
        ranks = [rankdata(column[known]) for column in (self.values[output], self.input(name))]
        return float(np.corrcoef(*ranks)[0, 1]), int(known.sum())

    def partial(self, output: str, name: str) -> float:
        """Of the ranks' rests beside all other inputs."""
        known = self.ok & np.isfinite(self.values[output])
        others = [rankdata(self.input(each)[known]) for each in self.inputs if each != name]
        held = np.column_stack([np.ones(known.sum()), *others])
        rests = []
        for column in (self.values[output], self.input(name)):
            ranks = rankdata(column[known])
            rests.append(ranks - held @ np.linalg.lstsq(held, ranks, rcond=None)[0])
        return float(np.corrcoef(*rests)[0, 1])

    def area(self, words: str, name: str) -> tuple[float, int, int]:
        own, of = self.group(words)
        inside, outside = self.input(name)[own], self.input(name)[of & ~own]
        larger = (inside[:, None] > outside).mean() + 0.5 * (inside[:, None] == outside).mean()
        return float(larger), len(inside), len(outside)

    def worst(self, name: str, k: int = 1) -> list[int]:
        """The samples with the worst values, the worst first."""
        sign = -1.0 if name.startswith(("least", "locked")) else 1.0
        values = np.where(self.ok, sign * self.values[name], np.nan)
        order = np.argsort(-values, kind="stable")
        return [int(s) for s in order if np.isfinite(values[s])][:k]
