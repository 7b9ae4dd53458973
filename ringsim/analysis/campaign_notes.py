"""What a merged campaign says about its numerics, in lines for people."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr


class Budget(NamedTuple):
    """Spread and errors of one output over the samples of a campaign, in its unit.

    ``spread`` is the standard deviation, ``standard_error`` that of the mean, ``numerical_error``
    the root mean square of the error bars, each of which bounds the error of one sample.
    Numerical errors of neighbouring samples are alike, so they do not average out: they are
    compared with the standard error as they are.
    """

    output: str
    units: str
    samples: int
    bars: int
    mean: float
    spread: float
    standard_error: float
    numerical_error: float


def error_budget(campaign: xr.Dataset) -> list[Budget]:
    """Budgets of all outputs with error bars; samples that did not end well are left out."""
    good = campaign.isel(sample=np.flatnonzero(campaign.status == 0))
    found = []
    for name in map(str, good.data_vars):
        of = name.removesuffix("_error")
        if of == name or of not in good or good[of].dims != ("sample",):
            continue
        values, bars = (good[each].dropna("sample").to_numpy().astype(float) for each in (of, name))
        if len(values) >= 2 and len(bars):
            mean, spread = float(values.mean()), float(values.std(ddof=1))
            errors = (spread / len(values) ** 0.5, float(np.sqrt(np.mean(bars**2))))
            units = str(good[of].attrs.get("units", "1"))
            found.append(Budget(of, units, len(values), len(bars), mean, spread, *errors))
    return found


def budget_lines(campaign: xr.Dataset) -> list[str]:
    """Whether numerical or sampling error dominates the mean, a line for each output with bars."""
    return [
        f"{b.output}: mean {b.mean:.6g}{'' if b.units == '1' else f' {b.units}'}, "
        f"spread {b.spread:.2g}, standard error {b.standard_error:.2g}, numerical error at most "
        f"{b.numerical_error:.2g} ({b.bars} of {b.samples} samples): "
        f"{'numerical' if b.numerical_error > b.standard_error else 'sampling'} error dominates "
        "the mean"
        for b in error_budget(campaign)
    ]


def restart_lines(campaign: xr.Dataset) -> list[str]:
    """One line if samples started anew with smaller steps (``restarts`` above 0), else none."""
    if not {"restarts", "steps", "total_steps"} <= set(campaign.data_vars):
        return []
    anew = int((campaign["restarts"] > 0).sum())
    # Missing counts are negative.
    counted, every = (float(campaign[n].clip(min=0).sum()) for n in ("steps", "total_steps"))
    if not anew:
        return []
    return [
        f"{anew} of {campaign.sizes['sample']} samples started anew with smaller steps (restarts, "
        f"step_used): {1.0 - counted / max(every, 1.0):.0%} of all {every:.0f} steps went to "
        "starts that failed"
    ]
