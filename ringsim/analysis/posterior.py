"""What measured data tell of unknown inputs: posterior distributions from runs of an ensemble.

Inputs are points u of standard normal space, x = F^-1(Phi(u)) with the prior's F, so that the prior
is N(0, 1) along each axis.  Each stage has an ensemble of points and its runs.  Outputs y, over the
scatter of the readings, are a linear map of the points about that ensemble, and what is left:

    y = b + J u + e,    Cov(e) = S

S, by how far the runs lie off the map, counts as an error of the map beside the scatter I of the
readings d, so that

    C = (I + J' (I + S)^-1 J)^-1,    m = C J' (I + S)^-1 (d - b)

are wide as long as the ensemble is too wide for a linear map, and the posterior once it is narrow.
The next ensemble is drawn from N(m, WIDER^2 C): no factors to choose, and nothing to tune.
Source: Cleary, Garbuno-Inigo, Lan, Schneider and Stuart, J. Comput. Phys. 424 (2021) 109716,
"Calibrate, emulate, sample", here with a linear emulator; for a linear model it is the closed form.
"""

from typing import NamedTuple

import numpy as np
import scipy.special
import xarray as xr

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

WIDER = 1.3
"""Scale of an ensemble over the posterior that it is drawn from, so that the map is known at its
edge, too, where a stage was a little wrong."""
MEMBERS_AN_UNKNOWN = 2
"""Runs at least of a stage for each coefficient of the map: as many again tell how far off it is.
"""
UNEXPLAINED = 1e-3
"""Chance of a misfit below which the model, and not the scatter, is to blame."""
_HARDLY = 0.9
"""Posterior over prior scatter from which on an unknown has hardly been learnt: a fifth of the
variance at most is gone."""
_TOGETHER = 0.8
"""Correlation of two unknowns from which on the data tell a combination of them and hardly more."""
_SEEN = 0.1
"""Scatter of an ensemble along a direction of the outputs, over that of the readings, below which
the direction tells nothing: a hundredth of what one reading does."""


class Posterior(NamedTuple):
    """A posterior distribution in standard normal space, and the readings that it explains."""

    mean: Array
    """Shape (unknowns,)."""
    covariance: Array
    """Shape (unknowns, unknowns)."""
    expected: Array
    """What the sensors would read at the mean, over their scatter, shape (readings,)."""

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
    middle = outputs.mean(axis=0)
    _, sizes, across = np.linalg.svd(outputs - middle, full_matrices=False)
    told = int((sizes > _SEEN * np.sqrt(runs - 1.0)).sum())
    # Of more directions than that the residual covariance would be known too badly.
    across = across[: max(1, min(told, runs // 4))]
    reduced, wanted = (outputs - middle) @ across.T, (data - middle) @ across.T
    known = np.column_stack([np.ones(runs), points])
    (start, *slopes), *_ = np.linalg.lstsq(known, reduced, rcond=None)
    slopes = np.array(slopes)  # (unknowns, directions)
    left = reduced - known @ np.vstack([start, slopes])
    error = np.eye(len(across)) + left.T @ left / (runs - unknowns - 1)
    weighed = np.linalg.solve(error, slopes.T)
    covariance = np.linalg.inv(np.eye(unknowns) + slopes @ weighed)
    mean = covariance @ (weighed.T @ (wanted - start))
    whole, *_ = np.linalg.lstsq(known, outputs, rcond=None)
    return Posterior(mean, 0.5 * (covariance + covariance.T), np.concatenate([[1.0], mean]) @ whole)


class Fit(NamedTuple):
    """How well the posterior's mean explains the readings of one sensor."""

    sensor: str
    readings: int
    rms: float
    """Of readings less what is expected, over the scatter of a reading."""
    chance: float
    """Probability of so large an rms by the scatter alone; at most 1 for all sensors together."""


def fits(found: Posterior, data: Array, sensors: list[str]) -> list[Fit]:
    """Of each sensor; ``sensors`` names that of each reading, ``data`` is as in ``posterior_of``.

    The sum of n squares is chi-squared with n degrees of freedom; what the unknowns were fitted by
    makes it smaller.  Chances are those of the worst of so many sensors (Bonferroni).
    """
    names = list(dict.fromkeys(sensors))
    which, apart = np.array(sensors), data - found.expected
    rows = []
    for name in names:
        own = apart[which == name]
        beyond = float(scipy.special.chdtrc(len(own), float(own @ own)))
        rms = float(np.sqrt(np.mean(own**2)))
        rows.append(Fit(name, len(own), rms, min(1.0, len(names) * beyond)))
    return rows


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
        "90 % intervals; remaining scatter: that of the posterior over that of the prior, 1 where "
        "the data say nothing",
        *_hardly(found),
        *_together(found),
    ]
    head = ("unknown", "unit", "prior", "median", "posterior", "remaining scatter")
    first = Table(head, rows, notes)
    sensors = [
        (str(one["sensor"].item()), str(int(one["readings"])), number_text(rms, 3),
         chance_text(float(one["chance"])))
        for k in np.argsort(-found["rms_in_deviations"].values, kind="stable")
        for one in [found.isel(sensor=int(k))]
        for rms in [float(one["rms_in_deviations"])]
    ]  # fmt: skip
    return [first, Table(("sensor", "readings", "rms / sigma", "by scatter alone"), sensors,
                         _verdict(found))]  # fmt: skip


def _hardly(found: xr.Dataset) -> list[str]:
    names = found["unknown"].values[found["learnt"].values > _HARDLY]
    return [f"hardly learnt from these sensors: {', '.join(names)}"] if len(names) else []


def _together(found: xr.Dataset) -> list[str]:
    names, matrix = found["unknown"].values, found["correlation"].values
    lines = []
    for one, other in zip(*np.triu_indices(len(names), 1), strict=True):
        if abs(r := matrix[one, other]) > _TOGETHER:
            how = "difference" if r > 0.0 else "sum"
            lines.append(
                f"{names[one]} and {names[other]}: the data tell their {how}, and each alone less "
                f"well (correlation {r:+.2f})"
            )
    return lines


def _verdict(found: xr.Dataset) -> list[str]:
    """Whether the model explains the data, and what was left out."""
    beyond = found["chance"].values < UNEXPLAINED
    notes = []
    if beyond.any():
        names = found["sensor"].values[beyond]
        notes.append(
            f"NOT EXPLAINED: {', '.join(names)} differ by more than the scatter of readings from "
            "what any values of these unknowns give: the model lacks something, numerical errors "
            "(solver.tolerance) count, or sigma is too small; the intervals above are too narrow "
            "then"
        )
    else:
        notes.append("the posterior explains every sensor within the scatter of its readings")
    lost, unused = int(found["lost"].sum()), int(found["unused"][-1])
    if lost:
        notes.append(f"{counted(lost, 'run')} of {found.attrs['runs']} failed and told nothing")
    if unused:
        notes.append(f"{counted(unused, 'reading')} left out, for which some run has no value")
    return notes
