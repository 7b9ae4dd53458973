"""Which V-joint is ahead of all others, and which is behind."""

import numpy as np
import xarray as xr

from ringsim.analysis.quantities import used
from ringsim.refusal import InputError

_WHO = {"leader": "leads", "laggard": "lags"}


def over_time(run: xr.Dataset) -> xr.Dataset:
    """The most and the least open joint of a run over time, in words, and their distance.

    Among joints that are equally open the first one stands; empty and NaN where nothing was
    recorded.
    """
    if "opening_angle" not in run:
        raise InputError("leader: needs opening_angle, which this dataset does not hold")
    angles = run["opening_angle"].transpose("time", "plane", "section")
    rows = angles.to_numpy().reshape(angles.sizes["time"], -1)
    names = np.array(
        [f"{p} {s}" for p in run["plane"].to_numpy() for s in run["section"].to_numpy()]
    )
    known = np.isfinite(rows).all(axis=1)
    filled = np.where(known[:, None], rows, 0.0)
    found = {
        "leader": (filled.argmax(axis=1), "V-joint that is most open"),
        "laggard": (filled.argmin(axis=1), "V-joint that is least open"),
    }
    apart = np.where(known, np.ptp(filled, axis=1), np.nan)
    return xr.Dataset(
        {
            name: ("time", np.where(known, names[joint], ""), {"long_name": words})
            for name, (joint, words) in found.items()
        }
        | {
            "asynchrony": (
                "time", apart,
                {"long_name": "how far they are apart", "units": angles.attrs.get("units", "")},
            )
        },
        coords={"time": run["time"]},
    )  # fmt: skip


def often(campaign: xr.Dataset) -> xr.Dataset:
    """In how many samples each joint leads and lags at the largest asynchrony, (plane, section).

    ``samples`` among the attributes are those that tell: their numbers hold, and their joints have
    been apart.
    """
    needed = [f"asynchrony_{who}_{dim}" for who in _WHO for dim in ("plane", "section")]
    if absent := [name for name in needed if name not in campaign]:
        raise InputError(
            f"leader: needs {absent[0]}, which this campaign has left out, or which its fidelity "
            "does not tell"
        )
    good = used(campaign)
    planes, sections = (campaign[dim].to_numpy().tolist() for dim in ("plane", "section"))
    found = xr.Dataset(coords={"plane": campaign["plane"], "section": campaign["section"]})
    told = np.asarray(good[needed[0]].to_numpy() != "", dtype=bool)
    for who, word in _WHO.items():
        counts = np.zeros((len(planes), len(sections)), dtype="i8")
        rows = good[f"asynchrony_{who}_plane"].to_numpy()[told]
        columns = good[f"asynchrony_{who}_section"].to_numpy()[told]
        np.add.at(
            counts, ([planes.index(p) for p in rows], [sections.index(int(s)) for s in columns]), 1
        )
        words = {"long_name": f"samples in which the V-joint {word} most", "units": "1"}
        found[word] = (("plane", "section"), counts, words)
    found.attrs = {"samples": int(told.sum()), "of": campaign.sizes["sample"]}
    return found
