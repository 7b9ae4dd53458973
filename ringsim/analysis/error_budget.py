"""Whether numerical or sampling error dominates what a campaign says."""

from __future__ import annotations

import numpy as np
import xarray as xr

_END = "_error"


def error_budget(campaign: xr.Dataset) -> xr.Dataset:
    """Spread, standard error and numerical error of every output that has error bars.

    Parameters
    ----------
    campaign
        A merged campaign; samples that did not end well are left out.

    Returns
    -------
    xr.Dataset
        Over ``output``: ``mean`` and ``spread`` (standard deviation over the samples),
        ``standard_error`` of the mean, ``numerical_error`` (root mean square of the bars, which
        bound the error of one sample), all in the unit in ``units``, and how many ``samples`` and
        ``bars`` there are.  Numerical errors of neighbouring samples are alike, so they do not
        average out: they are compared with the standard error as they are.
    """
    good = campaign.isel(sample=np.flatnonzero(campaign.status.to_numpy() == 0))
    rows = []
    for name in map(str, campaign.data_vars):
        of = name.removesuffix(_END)
        if not name.endswith(_END) or of not in good or good[of].dims != ("sample",):
            continue
        values = good[of].to_numpy().astype(float)
        values = values[np.isfinite(values)]
        bars = good[name].to_numpy().astype(float)
        bars = bars[np.isfinite(bars)]
        if len(values) < 2 or len(bars) == 0:
            continue
        spread = float(values.std(ddof=1))
        rows.append(
            {
                "output": of,
                "mean": float(values.mean()),
                "spread": spread,
                "standard_error": spread / np.sqrt(len(values)),
                "numerical_error": float(np.sqrt(np.mean(bars**2))),
                "samples": len(values),
                "bars": len(bars),
                "units": str(good[of].attrs.get("units", "1")),
            }
        )
    names = [str(row["output"]) for row in rows]
    keys = [key for key in rows[0] if key != "output"] if rows else []
    return xr.Dataset(
        {key: ("output", [row[key] for row in rows]) for key in keys}, coords={"output": names}
    )


def budget_lines(budget: xr.Dataset) -> list[str]:
    """One line an output, for people."""
    lines = []
    for name in budget.output.values:
        row = budget.sel(output=name)
        numerical, sampling = float(row.numerical_error), float(row.standard_error)
        units = "" if str(row.units.item()) == "1" else f" {row.units.item()}"
        larger = "numerical" if numerical > sampling else "sampling"
        lines.append(
            f"{name}: mean {float(row['mean']):.6g}{units}, spread {float(row.spread):.2g}, "
            f"standard error {sampling:.2g}, numerical error at most {numerical:.2g} "
            f"({int(row.bars)} of {int(row.samples)} samples): {larger} error dominates the mean"
        )
    return lines
