"""Read a campaign with xarray: quantiles, what went wrong, and which input matters most.

    python analysis.py [campaign.nc]

Without a file it runs examples/campaign.py first.  Inputs and outputs share the dimension
``sample``, so that any statistics package can go on from here.
"""

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from campaign import run_campaign
from scipy.stats import spearmanr

path = Path(sys.argv[1]) if len(sys.argv) > 1 else run_campaign()
with xr.open_dataset(path) as campaign:
    good = campaign.where(campaign["status"] == 0, drop=True)
    inputs = good.filter_by_attrs(role="input")
    print(f"{good.sizes['sample']} of {campaign.sizes['sample']} samples are ok")

    time = good["deployment_time"]
    low, median, high = time.quantile([0.05, 0.5, 0.95]).values
    print(f"deployment time: median {median:.2f} s, 90 % within {low:.2f} .. {high:.2f} s")
    error = float(time.std(ddof=1)) / np.sqrt(time.size)
    print(f"mean {float(time.mean()):.2f} s, known to {error:.2f} s (standard error)\n")

    print("rank correlation with the deployment time")
    for values in inputs.data_vars.values():
        rank = spearmanr(values, time).statistic
        print(f"  {values.attrs['path']:24s} {rank:+.2f}  {'#' * round(20 * abs(rank))}")
