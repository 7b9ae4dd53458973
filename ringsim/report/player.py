"""What the page's player draws: a few samples' opening angles, and the lines of the ring."""

import base64
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.campaign_samples import endings, judged_by, median_and_worst
from ringsim.analysis.quantities import used
from ringsim.layout.layout import layout_at_opening
from ringsim.layout.lines import lines_of
from ringsim.scene import Scene, scene_from_toml
from ringsim.structures.pantograph_ring import PantographRing

POSES = 25
"""Mean opening angles at which the ring is tabled: between two, lines are off by about 2 mm."""
MOST_FRAMES, MOST_OTHERS = 240, 5
UNKNOWN = -32768
"""An opening angle that was not recorded."""
_LARGEST = 32767


def player(campaign: xr.Dataset) -> dict[str, Any] | None:
    """Data of the player for JSON; None if the structure is no ring, or nothing was recorded."""
    scene = scene_from_toml(str(campaign.attrs["scene"]), source="attribute scene")
    if not isinstance(scene.structure, PantographRing) or "opening_angle" not in campaign:
        return None
    shown = [_course(campaign, *each) for each in _chosen(campaign)]
    if not shown:
        return None
    lowest = min(each.pop("lowest") for each in shown)
    return {
        "planes": campaign["plane"].values.tolist(),
        "sections": campaign["section"].values.tolist(),
        "samples": shown, "ring": _poses(scene, np.radians(lowest)),
    }  # fmt: skip


def _chosen(campaign: xr.Dataset) -> list[tuple[int, str]]:
    """Samples with what they stand for: the median, the worst, then those that failed."""
    words, samples = endings(campaign), campaign["sample"].to_numpy()
    good, found = np.isin(samples, used(campaign)["sample"]), dict[int, str]()
    if (both := median_and_worst(campaign)) is not None:
        by = f" by {name}" if (name := judged_by(campaign)) else ""
        for sample, word in zip(both, ("median", "worst"), strict=True):
            found.setdefault(sample, f"{word}{by}")
    fell_short = np.flatnonzero(~good | ~np.isin(words, ("deployed", "folded", "finished", "ok")))
    # Those whose numbers do not hold first: nothing else on the page shows them.
    for place in fell_short[np.argsort(good[fell_short], kind="stable")]:
        if len(found) < 2 + MOST_OTHERS:
            found.setdefault(int(samples[place]), "")
    ends = dict(zip(samples.tolist(), words.tolist(), strict=True))
    return [
        (sample, f"sample {sample}: {', '.join(filter(None, (word, ends[sample])))}")
        for sample, word in found.items() if _recorded(campaign, sample)
    ]  # fmt: skip


def _recorded(campaign: xr.Dataset, sample: int) -> bool:
    """Whether there are two records of a sample, which a course takes."""
    angle = campaign["opening_angle"].sel(sample=sample)
    return int(angle.notnull().all(("plane", "section")).sum()) >= 2


def _course(campaign: xr.Dataset, sample: int, name: str) -> dict[str, Any]:
    """Times and opening angles in 0.01 degree, (frame, V-joint), of one sample."""
    angle = campaign["opening_angle"].sel(sample=sample).transpose("time", "plane", "section")
    angle = angle.dropna("time", how="any")
    places = np.unique(np.linspace(0, angle.sizes["time"] - 1, MOST_FRAMES).round().astype(int))
    angle = angle.isel(time=places)
    rows = angle.to_numpy().reshape(len(places), -1)
    return {
        "name": name, "times": np.round(angle["time"].to_numpy(), 4).tolist(),
        "angles": packed(np.clip(100.0 * rows, UNKNOWN, _LARGEST)),
        "lowest": float(rows.mean(axis=1).min()),
    }  # fmt: skip


def _poses(scene: Scene, lowest: float) -> dict[str, Any]:
    """The ring's points at ``POSES`` mean opening angles from ``lowest`` (rad) to 180 degree.

    A V-joint stands at middle + cos(angle / 2) * aside, so that each has its own opening angle;
    all other points follow the mean, as in the figure ``ringsim.plots.ring``.
    """
    means = np.linspace(min(lowest, 0.98 * np.pi), np.pi, POSES)
    ends, moves, middles, asides, names = [], [], [], [], list[str]()
    for mean in means:
        layout = layout_at_opening(scene, float(mean))
        shape = np.ones([len(layout.openings), len(layout.openings[0])])
        flat, folded = lines_of(layout, np.pi * shape), lines_of(layout, 0.0 * shape)
        middle, aside = flat.pop("V-joints")[:, 0], folded.pop("V-joints")[:, 0]
        middles.append(middle)
        asides.append(aside - middle)
        names = [name for name, lines in flat.items() for _ in lines]
        ends.append(np.concatenate([*flat.values()]).reshape(-1, 3))
        moves.append(np.concatenate([folded[name] for name in flat]).reshape(-1, 3))
    tracks = np.array(ends).transpose(1, 0, 2)
    # An end that a joint moves is that joint's; poses agree in which.
    moved = np.abs(moves[0] - ends[0]).max(axis=1) > 1e-9
    apart = np.abs(moves[0][:, None] - (middles[0] + asides[0])[None]).max(axis=2)
    _, first, place = np.unique(
        np.round(tracks[~moved], 6).reshape((~moved).sum(), -1), axis=0, return_index=True,
        return_inverse=True,
    )  # fmt: skip
    points = tracks[~moved][first].transpose(1, 0, 2)
    number = np.empty(len(moved), dtype=int)
    number[~moved], number[moved] = place.ravel(), len(first) + apart[moved].argmin(axis=1)
    whole = np.concatenate([points, np.array(middles), np.array(asides)], axis=1)
    unit = float(np.abs(whole).max()) / _LARGEST
    groups = list(dict.fromkeys(names))
    return {
        "means": np.degrees(means).round(4).tolist(), "unit": unit, "points": packed(whole / unit),
        "fixed": len(first), "joints": len(middles[0]), "groups": groups,
        "lines": [[*pair, groups.index(n)] for pair, n in
                  zip(number.reshape(-1, 2).tolist(), names, strict=True)],
    }  # fmt: skip


def packed(values: NDArray[Any]) -> str:
    """Rounded values as little-endian int16 in base64."""
    return base64.b64encode(np.round(values).astype("<i2").tobytes()).decode("ascii")
