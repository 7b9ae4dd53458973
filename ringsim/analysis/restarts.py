"""How many samples of a campaign started anew, and how many steps their failed starts took."""

from __future__ import annotations

import xarray as xr


def restart_lines(campaign: xr.Dataset) -> list[str]:
    """One line if samples of a merged campaign started anew with smaller steps, else none.

    These samples have ``restarts`` above 0, and the settings that they were computed with in
    ``step_used`` (s) and ``tolerance_used``.
    """
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
