"""How many samples of a campaign started anew, and what their failed starts took."""

from __future__ import annotations

import numpy as np
import xarray as xr


def restart_lines(campaign: xr.Dataset) -> list[str]:
    """One line if samples started anew with smaller steps, none if they did not.

    Parameters
    ----------
    campaign
        A merged campaign.  The samples concerned have ``restarts`` above 0, and the settings that
        they were computed with in ``step_used`` (s) and ``tolerance_used``.
    """
    if not {"restarts", "steps", "total_steps"} <= set(campaign.data_vars):
        return []
    anew = campaign["restarts"].to_numpy() > 0
    if not anew.any():
        return []
    counted, every = (
        float(np.nansum(np.where(found > 0, found, 0)))
        for found in (campaign[name].to_numpy() for name in ("steps", "total_steps"))
    )
    share = 1.0 - counted / every if every > 0.0 else 0.0
    return [
        f"{int(anew.sum())} of {len(anew)} samples started anew with smaller steps (restarts, "
        f"step_used): {share:.0%} of all {every:.0f} steps went to starts that failed"
    ]
