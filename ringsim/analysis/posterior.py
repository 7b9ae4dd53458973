"""What measured data tell of unknown inputs: posterior distributions from runs of an ensemble.

Inputs are points u of standard normal space, x = F^-1(Phi(u)) with the prior's F, so that the prior
is N(0, 1) along each axis.  Each stage has an ensemble of points and its runs.  Outputs y, over the
scatter of the readings, are a linear map of the points about that ensemble, and what is left:

    y = b + J u + e,    Cov(e) = S

S, by how far the runs lie off the map, counts as an error of the map beside the scatter I of the
readings d, so that

    C = (I + J' (I + S)^-1 J)^-1,    m = C J' (I + S)^-1 (d - b)

are wide as long as the ensemble is too wide for a linear map, and the posterior once it is narrow.
Readings are first reduced to the directions of J, of which there are no more than unknowns, so that
few runs tell S; where it mixes these with others, a little of what the data tell is given away.
The next ensemble is drawn from N(m, WIDER^2 C): no factors to choose, and nothing to tune.
Source: Cleary, Garbuno-Inigo, Lan, Schneider and Stuart, J. Comput. Phys. 424 (2021) 109716,
"Calibrate, emulate, sample", here with a linear emulator; for a linear model it is the closed form.
"""

import json
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.special
import scipy.stats
import xarray as xr
from numpy.typing import NDArray

from ringsim.measured import Told
from ringsim.stepping.instant import Array
from ringsim.tables import (
    Table,
    chance_text,
    counted,
    interval_text,
    number_text,
    readable,
    unit_text,
)

Mask = NDArray[np.bool_]

WIDER = 1.3
"""Scale of an ensemble over the posterior that it is drawn from, so that the map is known at its
edge, too, where a stage was a little wrong."""
MEMBERS_AN_UNKNOWN = 2
"""Runs at least of a stage for each coefficient of the map: as many again tell how far off it is.
"""
UNEXPLAINED = 1e-3
"""Chance of a misfit below which the model, and not the scatter, is to blame."""
FALSE_ALARM = 0.01
"""Probability at most with which any place of an input is told to stand out although all are as the
prior says."""
_STRAY = 0.01
"""Probability with which a test without faults has a stray reading."""
_OF_SENSOR, _OF_ALL = 0.25, 0.1
"""Shares of a sensor's readings, and of those of all, up to which strays are believed."""
_TOO_MANY = "more than a tenth of all readings"
"""Why readings are kept of which more than ``_OF_ALL`` are off."""
_IN_A_ROW = 2
"""Strays that may always follow each other: what a model lacks takes longer."""
_UNLIKELY = 0.05
"""Chance below which a sensor has more strays than the others, if it is not few of its own."""
_LEAST_KNOWN = 1e-12
"""Variance of a contrast of which the data say nothing, in place of round-off."""
_LEAST_LEFT = 1e-3
"""Share of a variance below which something else has explained it."""
_HOLDS = 0.99
"""Probability with which the places that are named together hold the one that is unlike."""
_LEAST_ROW = 5
"""Readings of a sensor from which on their course tells anything."""
HARDLY = 0.9
"""Posterior over prior scatter from which on an unknown has hardly been learnt: a fifth of the
variance at most is gone."""
_TOGETHER = 0.8
"""Correlation of two unknowns from which on the data tell a combination of them and hardly more."""
_FAR = 4.0
"""Sigmas from the median of a prior beyond which it hardly holds a value: once in 16,000."""
LISTED = 6
"""Unknowns up to which each has a column in a table of sensors."""


class Posterior(NamedTuple):
    """A posterior distribution in standard normal space, and the readings that it explains."""

    mean: Array
    """Shape (unknowns,)."""
    covariance: Array
    """Shape (unknowns, unknowns)."""
    expected: Array
    """What the sensors would read at the mean, over their scatter, shape (readings,)."""
    off: Array
    """Scatter of runs off the map, the same way, shape (readings,)."""
    leverage: Array
    """How far the posterior follows each reading, shape (readings,): its misfit has the variance
    1 - leverage, where runs lie on the map."""

    def draw(self, count: int, stream: np.random.Generator, scale: float = 1.0) -> Array:
        """Points of it, wider by ``scale``, shape (count, unknowns)."""
        free = stream.standard_normal((count, len(self.mean)))
        return np.asarray(self.mean + scale * free @ np.linalg.cholesky(self.covariance).T)


def posterior_of(points: Array, outputs: Array, data: Array) -> Posterior:
    """The posterior by the linear map of an ensemble.

    Parameters
    ----------
    points
        Of the runs in standard normal space, shape (runs, unknowns); at least
        ``MEMBERS_AN_UNKNOWN`` runs for each unknown and one more.
    outputs
        What the sensors would read in each run, over the scatter of a reading, shape
        (runs, readings).
    data
        What they have read, the same way, shape (readings,).

    Examples
    --------
    >>> stream = np.random.default_rng(1)
    >>> points = stream.standard_normal((50, 1))
    >>> found = posterior_of(points, 3.0 * points, np.array([3.0]))
    >>> found.mean.round(6), found.covariance.round(6)  # 9 / (1 + 9), 1 / (1 + 9)
    (array([0.9]), array([[0.1]]))
    """
    runs, unknowns = points.shape
    known = np.column_stack([np.ones(runs), points])
    start, *slopes = np.linalg.pinv(known) @ outputs
    left, freedom = outputs - known @ np.vstack([start, *slopes]), runs - unknowns - 1
    # Along what the map tells nothing of there is no need to know how far runs lie off it.
    along, sizes, across = np.linalg.svd(np.array(slopes), full_matrices=False)
    slopes, aside = along * sizes, left @ across.T  # (unknowns, directions), (runs, directions)
    weighed = np.linalg.solve(np.eye(len(across)) + aside.T @ aside / freedom, slopes.T)
    covariance = np.linalg.inv(np.eye(unknowns) + slopes @ weighed)
    mean = covariance @ (weighed.T @ (across @ (data - start)))
    off = np.sqrt((left**2).sum(axis=0) / freedom)
    each = slopes @ across
    leverage = (each * (covariance @ each)).sum(axis=0)
    covariance = 0.5 * (covariance + covariance.T)
    return Posterior(mean, covariance, start + mean @ each, off, leverage)


class Fit(NamedTuple):
    """How well the posterior's mean explains the readings of one sensor."""

    sensor: str
    readings: int
    """That were used."""
    strays: list[int]
    """Which were set aside: alone among readings that fit, and too far off for chance."""
    stray_sizes: list[float]
    """Of each of them less what is expected, over the scatter of a reading."""
    rms: float
    """Of readings less what is expected, over the scatter of a reading."""
    chance: float
    """Probability of so large an rms by the scatter alone."""
    pattern: float
    """How alike successive misfits are, N(0, 1) if nothing but scatter makes them; see ``_alike``.
    """
    off: float
    """Root mean square of how far runs lie off the linear map, over the scatter of a reading."""


def explained(sensors: Sequence[float], together: Sequence[float]) -> bool:
    """Whether the posterior explains the readings, by the chances of each sensor and of all."""
    least = min(min(sensors) * len(sensors), min(together) * len(together))
    return bool(least >= UNEXPLAINED)


def _is_explained(found: xr.Dataset) -> bool:
    return explained(found["chance"].values.tolist(), found["chance_of_all"].values.tolist())


class Learnt(NamedTuple):
    """What an ensemble and the data tell together."""

    posterior: Posterior
    fits: list[Fit]
    chances: dict[str, float]
    """Probability by scatter alone of so large an rms of all readings ("rms"), of successive
    misfits so alike in all sensors together ("pattern"), and in any sensor ("sensor pattern").  A
    model that is wrong by less than the scatter of a reading shows in its many readings.
    """
    held: list[str]
    """What was off where chance does not put strays, and so was kept."""


def learn(points: Array, told: Sequence[Told]) -> Learnt:
    """The posterior by all sensors, without stray readings; ``points`` as in ``posterior_of``.

    A reading is a stray if it is further off than one in ``1 / _STRAY`` tests has any by chance,
    farthest first, and does not fit what the others tell.  Readings that are off where chance does
    not put strays (see ``_no_strays``) are kept.
    """
    kept = [np.ones(len(each.measured), dtype=bool) for each in told]
    back, held = set[_Reading](), list[str]()

    def fit() -> tuple[Posterior, list[Array], list[Array], list[Array]]:
        """The posterior by what is kept; by sensor misfits, bare and scaled, and ``off``."""
        own = [each.only(mask) for each, mask in zip(told, kept, strict=True)]
        data = np.concatenate([each.scaled(each.measured) for each in own])
        found = posterior_of(
            points, np.concatenate([each.scaled(each.computed) for each in own], axis=1), data
        )
        # What the posterior follows hides its own misfit.
        left = np.sqrt(np.maximum(1.0 + found.off**2 - found.leverage, _LEAST_LEFT))
        misfits, ends = data - found.expected, np.cumsum([len(each.measured) for each in own])[:-1]
        apart, sizes, off = (
            np.split(v, ends) for v in (misfits, np.abs(misfits) / left, found.off)
        )
        return found, apart, sizes, off

    while True:
        found, apart, sizes, offs = fit()
        least = -float(scipy.special.ndtri(0.5 * _STRAY / len(found.expected)))
        # Others may only look stray beside a farther one.
        limit = max(least, 0.5 * max((float(s.max()) for s in sizes if len(s)), default=0.0))
        worst = [k for k, size in enumerate(sizes) if (size > limit).any()]
        for k in worst:
            kept[k][np.flatnonzero(kept[k])[sizes[k] > limit]] = False
        if not any(mask.any() for mask in kept):  # no others that any of them could be stray beside
            kept, held = [np.ones_like(mask) for mask in kept], [_TOO_MANY]
            break
        if worst:
            continue
        aside = [_set_aside(found, points, *each) for each in zip(told, kept, strict=True)]
        # One that fits was only far off beside others; put back once, or there is no end.
        fits = {(k, i) for k, each in enumerate(aside) for i, _, s in each if abs(s) < least} - back
        if not fits:
            break
        back |= fits
        for k, i in fits:
            kept[k][i] = True
    while elsewhere := _no_strays(kept, told):
        held += [why for why in elsewhere if why not in held]
        for k, i in {each for readings in elsewhere.values() for each in readings}:
            kept[k][i] = True
    if held:  # beside these others may look stray, which are none
        found, apart, sizes, offs = fit()
        aside = [_set_aside(found, points, *each) for each in zip(told, kept, strict=True)]
    rows = list[Fit]()
    for each, strays, misfit, off in zip(told, aside, apart, offs, strict=True):
        count, there = len(misfit), bool(len(misfit))
        chance = float(scipy.special.chdtrc(count, float(misfit @ misfit))) if there else 1.0
        rms, wide = (float(np.sqrt(np.mean(v**2))) if there else np.nan for v in (misfit, off))
        rows.append(
            Fit(each.sensor, count, [i for i, _, _ in strays], [size for _, size, _ in strays],
                rms, chance, _alike(misfit), wide)
        )  # fmt: skip
    every = np.concatenate(apart)
    alike = np.array([row.pattern for row in rows if row.readings >= _LEAST_ROW] or [0.0])
    chances = {
        "rms": float(scipy.special.chdtrc(len(every), float(every @ every))),
        "pattern": float(scipy.special.ndtr(-alike.sum() / np.sqrt(len(alike)))),
        "sensor pattern": min(1.0, len(alike) * float(scipy.special.ndtr(-alike.max()))),
    }
    return Learnt(found, rows, chances, held)


def _set_aside(
    found: Posterior, points: Array, told: Told, kept: Mask
) -> list[tuple[int, float, float]]:
    """Of each reading of a sensor that is not kept: which, how far it is from what is expected,
    without the bias that the others tell, over its scatter, and over all that scatters there.
    """
    places = np.flatnonzero(~kept)
    if not len(places):
        return []
    known = np.column_stack([np.ones(len(points)), points])
    outputs = told.computed / told.deviation
    map_ = np.linalg.pinv(known) @ outputs
    apart = told.measured / told.deviation - np.append(1.0, found.mean) @ map_
    ratio = (told.bias / told.deviation) ** 2
    weight = kept.sum() * ratio
    apart = apart - weight / (1.0 + weight) * (apart[kept].mean() if kept.any() else 0.0)
    off = ((outputs - known @ map_) ** 2).sum(axis=0) / (len(points) - known.shape[1])
    new = (map_[1:] * (found.covariance @ map_[1:])).sum(axis=0)
    sizes = apart / np.sqrt(1.0 + new + off + ratio / (1.0 + weight))
    return [(int(i), float(apart[i]), float(sizes[i])) for i in places]


_Reading = tuple[int, int]
"""Number of its sensor, and its own."""


def _no_strays(kept: Sequence[Mask], told: Sequence[Told]) -> dict[str, list[_Reading]]:
    """Readings that are off where chance does not put strays, by why not.

    Strays are independent.  So no sensor has far more of them than the others, no row of them is
    longer than chance makes it, nor are several sensors off at one time, with the share that is
    found elsewhere; and all are few.
    """
    every, counts = sum(map(len, kept)), [int((~mask).sum()) for mask in kept]
    strays, found = sum(counts), dict[str, list[_Reading]]()
    off = [(k, i) for k, mask in enumerate(kept) for i in np.flatnonzero(~mask).tolist()]

    def share(of_these: int, among: int) -> float:
        """Of strays elsewhere; one more than there is, since none tells of no share."""
        return min((strays - of_these + 1) / (every - among + 1), 1.0)

    for k, (mask, count) in enumerate(zip(kept, counts, strict=True)):
        chance = len(kept) * scipy.stats.binom.sf(count - 1, len(mask), share(count, len(mask)))
        if count > max(1.0, _OF_SENSOR * len(mask)) and chance < _UNLIKELY:
            why = f"{counted(count, 'reading')} of {told[k].sensor}, far more than of others"
            found[why] = [each for each in off if each[0] == k]
            continue
        for begin, row in _rows(~mask):
            if row > _IN_A_ROW and every * share(row, row) ** row < UNEXPLAINED:
                why = f"{row} readings of {told[k].sensor} in a row"
                found[why] = [(k, i) for i in range(begin, begin + row)]
    times = [np.full(len(m), np.nan) if t.times is None else t.times
             for m, t in zip(kept, told, strict=True)]  # fmt: skip
    for time in sorted({float(times[k][i]) for k, i in off if np.isfinite(times[k][i])}):
        there = sum(bool((each == time).any()) for each in times)
        those = [(k, i) for k, i in off if times[k][i] == time]
        chance = scipy.stats.binom.sf(len(those) - 1, there, share(len(those), there))
        if len(those) > 1 and max(map(len, kept)) * chance < UNEXPLAINED:
            found[f"{len(those)} sensors together at {time:.6g} by the clock"] = those
    return found or ({_TOO_MANY: off} if strays > _OF_ALL * every else {})


def _rows(strays: Mask) -> list[tuple[int, int]]:
    """Beginning and length of each row of strays."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], strays, [False]])))
    return [(int(a), int(b - a)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _alike(misfit: Array) -> float:
    """The correlation r of n misfits with those before them, over its scatter.

    Of independent normal ones r = sum e_i e_i+1 / sum e_i^2 has the mean 0, the variance
    (n - 1) / (n (n + 2)), and lighter tails than a normal variable.
    """
    count, size = len(misfit), float(misfit @ misfit)
    if count < _LEAST_ROW or not size:
        return 0.0
    scatter = np.sqrt((count - 1.0) / (count * (count + 2.0)))
    return float(misfit[1:] @ misfit[:-1] / size / scatter)


class Contrasts(NamedTuple):
    """How unlike the others each place of an input is."""

    sigma: Array
    """Distance from the mean of the others, over its scatter before the data, shape (places,)."""
    chance: Array
    """Probability of so much in any place if all are as the priors say."""
    group: list[int]
    """0 for a place that does not stand out; else the number of the fault that it may have: the
    data cannot tell apart places of one number."""


def contrasts(mean: Array, covariance: Array, prior: Array, inputs: int = 1) -> Contrasts:
    """Which of some places stands out, by the posterior's mean and covariance and the prior
    covariance of their values in standard normal space, shapes (places,) and (places, places).

    Before the data the posterior mean m is N(0, P - C), so that a'm of a contrast a has the
    variance a'(P - C)a.  What all have in common (a warmer test) cancels.  After the farthest place
    the others are judged by what it does not explain of them.  Probabilities are Bonferroni's, over
    all places and so many ``inputs``.  If one place is unlike by an unknown amount, its sigma s
    gives it a likelihood of exp(s^2 / 2): the likeliest are named that hold it with ``_HOLDS``.
    """
    count = len(mean)
    each = (count * np.eye(count) - 1.0) / (count - 1.0)
    spread = each @ (prior - covariance) @ each.T
    scatter = np.sqrt(np.maximum(np.diag(spread), _LEAST_KNOWN))
    alike = spread / np.outer(scatter, scatter)
    first = each @ mean / scatter
    sigma, left, group = first.copy(), np.ones(count), [0] * count
    for number in range(1, count):
        free = [k for k in range(count) if not group[k] and left[k] > _LEAST_LEFT]
        best = max(free, key=lambda k: abs(sigma[k]), default=None)
        if best is None or _of_any(sigma[best], inputs * count) >= FALSE_ALARM:
            break
        free.sort(key=lambda k: -abs(sigma[k]))
        likely = np.cumsum(np.exp(0.5 * (sigma[free] ** 2 - sigma[best] ** 2)))
        for k in free[: int(np.searchsorted(likely, _HOLDS * likely[-1])) + 1]:
            group[k] = number
        # Values of the others, given that of the best, over what is left of their scatter.
        shared = alike[:, best] / np.sqrt(left[best])
        rest = sigma * np.sqrt(left) - shared * sigma[best]
        alike = alike - np.outer(shared, shared)
        left = np.maximum(np.diag(alike), 0.0)
        sigma = rest / np.sqrt(np.maximum(left, _LEAST_LEFT))
    return Contrasts(first, np.array([_of_any(v, inputs * count) for v in first]), group)


def _of_any(sigma: float, count: int) -> float:
    return min(1.0, 2.0 * count * float(scipy.special.ndtr(-abs(sigma))))


# What a posterior says, as tables.


def calibration_tables(found: xr.Dataset) -> list[Table]:
    """What a calibration found (the dataset of its posterior): unknowns, then sensors."""
    rows = []
    for name in found["unknown"].values:
        one = found.sel(unknown=name)
        units = str(one["unknown_units"].item())
        prior, posterior = one["prior_quantile"].values, one["posterior_quantile"].values
        factor, unit = readable(units, float(np.abs(prior).max()))
        rows.append((
            str(name), unit_text(unit), interval_text(*(factor * prior[[0, -1]])),
            number_text(factor * posterior[1]), interval_text(*(factor * posterior[[0, -1]])),
            number_text(float(one["learnt"]), 2),
        ))  # fmt: skip
    notes = [
        "90 % intervals; remaining scatter: that of the posterior over that of the prior, both of "
        "the normal variable behind the law (lognormal: the logarithm), 1 where the data say "
        "nothing",
        *_hardly(found),
        *_together(found),
        *_beyond(found),
        *_standing_out(found),
    ]
    head = ("unknown", "unit", "prior", "median", "posterior", "remaining scatter")
    first = Table(head, rows, notes)
    sensors = [
        (str(one["sensor"].item()), str(int(one["readings"])) if one["readings"] else "none",
         str(int(one["strays"])) if one["strays"] else "-",
         number_text(float(one["rms_in_deviations"]), 3), chance_text(float(one["chance"])))
        for k in np.argsort(-found["rms_in_deviations"].fillna(-1.0).values, kind="stable")
        for one in [found.isel(sensor=int(k))]
    ]  # fmt: skip
    heads = ("sensor", "readings", "set aside", "rms / sigma", "by scatter alone")
    return [first, Table(heads, sensors, _verdict(found))]


def _hardly(found: xr.Dataset) -> list[str]:
    far = found["learnt"].values > HARDLY
    names = []
    for name in dict.fromkeys(str(each) for each in found["input"].values):
        own = found["input"].values == name
        if (count := int((own & far).sum())) > 1:
            names.append(f"{name} ({count} of {int(own.sum())} places)")
        elif count:
            names.append(str(found["unknown"].values[own & far][0]))
    return [f"hardly learnt from these sensors: {', '.join(names)}"] if names else []


def _together(found: xr.Dataset) -> list[str]:
    names, matrix = found["unknown"].values, found["correlation"].values
    hardly, lines = found["learnt"].values > HARDLY, list[str]()
    for one, other in zip(*np.triu_indices(len(names), 1), strict=True):
        if abs(r := matrix[one, other]) > _TOGETHER and not (hardly[one] and hardly[other]):
            how = "difference" if r > 0.0 else "sum"
            lines.append(
                f"{names[one]} and {names[other]}: the data tell their {how}, and each alone less "
                f"well (correlation {r:+.2f})"
            )
    return lines


def _beyond(found: xr.Dataset) -> list[str]:
    """Unknowns whose prior hardly holds what was found."""
    lines, groups = list[str](), found["input"].values
    for k in np.flatnonzero(np.abs(found["shift"].values) > _FAR).tolist():
        several = int((groups == groups[k]).sum()) > 1
        place = ", if it is no fault of this one place" * several
        lines.append(
            f"{found['unknown'].values[k]} lies {float(found['shift'][k]):+.1f} sigma from the "
            f"median of its prior: widen the prior{place}"
        )
    return lines


def _standing_out(found: xr.Dataset) -> list[str]:
    """Places of an input that are unlike its others, most probable ones first."""
    if not _is_explained(found):
        return []
    lines = []
    for name in dict.fromkeys(str(n) for n in found["input"].values):
        own = found.isel(unknown=np.flatnonzero(found["input"].values == name))
        if not np.isfinite(own["contrast"]).any():
            continue
        sigma = own["contrast"].values
        called = [str(each).removeprefix(name) for each in own["unknown"].values]
        parts = []
        for number in range(1, int(own["group"].max()) + 1):
            same = sorted(np.flatnonzero(own["group"] == number), key=lambda k: -abs(sigma[k]))
            told = ", ".join(f"{called[k]} ({sigma[k]:+.1f} sigma)" for k in same)
            parts.append(told if len(same) == 1 else f"one of {told}: the data cannot tell which")
        best = int(np.abs(sigma).argmax())
        lines.append(
            f"{name}: " + (f"stands out from the other places: {'; and '.join(parts)}" if parts else
                           f"no place stands out; the farthest is {called[best]} "
                           f"({sigma[best]:+.1f} sigma)")
            + f" (false alarms: at most {FALSE_ALARM:g} if all are as the prior says)" * bool(parts)
        )  # fmt: skip
        if parts:
            at = int(np.flatnonzero(own["group"] > 0)[0])
            most = 10.0 * float(own["prior_quantile"][at, 1])
            law = f'{{ kind = "uniform", low = 0.0, high = {most:.2g} }}' if most > 0.0 else "..."
            lines.append(
                "the prior of the others holds the value of such a place back: give each that is "
                f"named a wide one of its own beside theirs, '{name}{called[at]}' = {law}, and "
                "calibrate again"
            )
    return lines


_WRONG = {
    "rms": "the misfits of all sensors together are larger than scatter",
    "pattern": "misfits of successive readings are alike in all sensors together",
    "sensor pattern": "misfits of successive readings of a sensor are alike",
}


def _verdict(found: xr.Dataset) -> list[str]:
    """Whether the model explains the data, and what was left out."""
    notes, held = list[str](), json.loads(str(found.attrs.get("held", "[]")))
    widest = float(found["off"].max())
    if not _is_explained(found):
        beyond = found["chance"].values * found.sizes["sensor"] < UNEXPLAINED
        names = ", ".join(found["sensor"].values[beyond])
        many = "differs" if beyond.sum() == 1 else "differ"
        why = [f"{names} {many} by more than scatter"] if names else []
        why += [words for test, words in _WRONG.items()
                if 3.0 * float(found["chance_of_all"].sel(test=test)) < UNEXPLAINED]  # fmt: skip
        why += held
        cause = (
            "no values of these unknowns near the posterior give these readings. The model lacks "
            "something, numerical errors (solver.tolerance) count, or sigma is too small"
        )
        # Then the posterior itself may be wrong, and with it what it does not explain.
        if widest > 1.0:
            cause = (
                "the stages have not come to values that give these readings. Give more runs and "
                "stages before the model is blamed"
            )
        notes.append(
            f"NOT EXPLAINED: {'; '.join(why)}: {cause}; the intervals above are too narrow then"
        )
    else:
        notes.append("the posterior explains every sensor within the scatter of its readings")
        if held:
            notes.append(
                "too far off for chance, and kept, since chance does not put strays so: "
                + "; ".join(held)
            )
    if widest > 1.0:
        notes.append(
            f"runs of the last stage lie {widest:.2g} sigma off a linear map: use more stages, or "
            "look whether two separate sets of values explain the readings"
        )
    if strays := int(found["strays"].sum()):
        notes.append(
            f"set aside: {counted(strays, 'reading')} too far off for chance, among readings "
            f"of their sensor that fit: {_strays(found)}"
        )
    lost, unused = int(found["lost"].sum()), int(found["unused"])
    silent = ", ".join(found["sensor"].values[found["readings"].values == 0])
    none = "some run has no value"
    more = {
        f"{counted(lost, 'run')} of {found.attrs['runs']} failed and told nothing": lost,
        f"told nothing, since {none} at any of their readings: {silent}": silent,
        f"{counted(unused, 'reading')} left out, for which {none}": unused,
    }
    notes += [words for words, there in more.items() if there]
    return notes


def _strays(found: xr.Dataset) -> str:
    """The readings that were set aside, those farthest off."""
    sizes, unit = found["stray_size"].values, str(found.attrs.get("clock_unit", "s"))
    order = np.argsort(-np.abs(sizes), kind="stable")[:LISTED]
    told = [
        str(one["stray_sensor"].item())
        + (f" at {number_text(when, 6)} {unit}" if np.isfinite(when) else "")
        + f" ({float(one['stray_size']):+.1f} sigma)"
        for one in (found.isel(stray=int(k)) for k in order)
        for when in [float(one["stray_time"])]
    ]
    left = len(sizes) - len(told)
    return ", ".join(told) + (f" and {left} more (stray_time in the file)" if left else "")
