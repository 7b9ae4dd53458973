"""What the page's player draws: a few samples' opening angles, and the lines of the ring."""

import base64
from collections import Counter
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.design import REACHED, UNKNOWN, endings, judged_by, median_and_worst
from ringsim.analysis.intervals import used
from ringsim.layout.layout import layout_at_opening, layout_of
from ringsim.layout.points import points_of
from ringsim.plots.campaign.frame import base_of, of_cases
from ringsim.scene import Scene, scene_from_toml
from ringsim.shapes import COMPUTED, FROM_ANGLES, middle_of

POSES = 25
"""Mean opening angles at which the ring is tabled: between two, lines are off by about 2 mm."""
MOST_FRAMES, MOST_OTHERS = 240, 8
UNRECORDED = -32768
"""An opening angle that was not recorded."""
_LARGEST = 32767
_MOST_BYTES, _LEAST_FRAMES = 42_000, 30
"""Of the positions of a sample: ten samples and all figures are to fit into one mail."""


def player(campaign: xr.Dataset, analysis: xr.Dataset) -> dict[str, Any] | None:
    """Data of the player for JSON; None if the structure has no joints that open between two rods,
    or nothing was recorded.

    Shown are the median, or the base case of single changes, and the worst sample, the worst of
    each failure in ``analysis``, then others that failed.
    """
    scene = scene_from_toml(str(campaign.attrs["scene"]), source="attribute scene")
    if "opening_angle" not in campaign or not points_of(layout_of(scene)).openings.size:
        return None
    shown = [_course(campaign, *each) for each in _chosen(campaign, analysis)]
    if not shown:
        return None
    lowest = min(each.pop("lowest") for each in shown)
    computed = sum(each["places"] is not None for each in shown)
    words = {0: FROM_ANGLES, len(shown): COMPUTED}.get(computed, f"{COMPUTED}, or {FROM_ANGLES}")
    return {
        "words": words, "planes": campaign["plane"].values.tolist(),
        "sections": campaign["section"].values.tolist(),
        "samples": shown, "ring": _poses(scene, np.radians(lowest)),
    }  # fmt: skip


def _chosen(campaign: xr.Dataset, analysis: xr.Dataset) -> list[tuple[int, str]]:
    """Samples with what they stand for: the median or base case, the worst, the worst of each
    failure in turn, then others that failed.
    """
    words, samples = endings(campaign), campaign["sample"].to_numpy()
    good, found = np.isin(samples, used(campaign)["sample"]), dict[int, list[str]]()
    if (both := median_and_worst(campaign)) is not None:
        by = f" by {name}" if (name := judged_by(campaign)) else ""
        if of_cases(campaign):
            base = base_of(campaign)
            found |= {} if base is None else {base: ["base case"]}
        else:
            found[both[0]] = [f"median{by}"]
        found.setdefault(both[1], list[str]()).append(f"worst{by}")
    fell_short = np.flatnonzero(~good | ~np.isin(words, (*REACHED, UNKNOWN)))
    # Those whose numbers do not hold first: nothing else on the page shows them.
    fell_short = fell_short[np.argsort(good[fell_short], kind="stable")]
    # A failure is no ending: what ended as "stalled" need not be told so twice.
    violating = "violates "
    for sample, failure in [*_in_turn(analysis), *((int(samples[k]), "") for k in fell_short)]:
        if sample in found or len(found) < 2 + MOST_OTHERS:
            own = found.setdefault(sample, [])
            own += [each for each in failure.split("; ") if each.startswith(violating)]
    ends = dict(zip(samples.tolist(), words.tolist(), strict=True))
    return [
        (sample, f"sample {sample}: {', '.join([*word, ends[sample]])}")
        for sample, word in found.items() if _recorded(campaign, sample)
    ]  # fmt: skip


def _in_turn(analysis: xr.Dataset) -> list[tuple[int, str]]:
    """The worst sample of each failure, then the second of each, ..., with their failures."""
    if "worst" not in analysis.dims:
        return []
    rows = zip(
        analysis["worst_sample"].values.tolist(), analysis["worst_failure"].values.tolist(),
        strict=True,
    )  # fmt: skip
    turns, ordered = Counter[str](), list[tuple[int, int, str]]()
    for sample, failure in rows:
        ordered.append((turns[failure], sample, failure))
        turns[failure] += 1
    return [(sample, failure) for _, sample, failure in sorted(ordered, key=lambda each: each[0])]


def _recorded(campaign: xr.Dataset, sample: int) -> bool:
    """Whether there are two records of a sample, which a course takes."""
    angle = campaign["opening_angle"].sel(sample=sample)
    return int(angle.notnull().all(("plane", "section")).sum()) >= 2


def _course(campaign: xr.Dataset, sample: int, name: str) -> dict[str, Any]:
    """Times and opening angles in 0.01 degree, (frame, V-joint), of one sample."""
    angle = campaign["opening_angle"].sel(sample=sample).transpose("time", "plane", "section")
    angle = angle.dropna("time", how="any")
    angle = _thinned(angle, MOST_FRAMES)
    rows = angle.to_numpy().reshape(angle.sizes["time"], -1)
    return {
        "name": name, "sample": sample, "times": np.round(angle["time"].to_numpy(), 4).tolist(),
        "angles": packed(np.clip(100.0 * rows, UNRECORDED, _LARGEST)),
        "lowest": float(rows.mean(axis=1).min()),
        "places": _places(campaign, sample),
    }  # fmt: skip


def _thinned(series: xr.DataArray, most: int) -> xr.DataArray:
    """So many times of a series at most, evenly spread, both ends among them."""
    last = series.sizes["time"] - 1
    return series.isel(time=np.unique(np.linspace(0, last, most).round().astype(int)))


def _places(campaign: xr.Dataset, sample: int) -> dict[str, Any] | None:
    """Times, unit (m) and positions, (frame, point, axis), of one sample; None if not recorded."""
    if "position" not in campaign:
        return None
    found = campaign["position"].sel(sample=sample).transpose("time", "point", "axis")
    found = found.dropna("time", how="any")
    if found.sizes["time"] < 2:
        return None
    most = min(MOST_FRAMES, max(_LEAST_FRAMES, _MOST_BYTES // (6 * found.sizes["point"])))
    found = _thinned(found, most)
    values = found.to_numpy()
    # The player turns the ring about its middle at the end; on the way it is where it is.
    values = values - 0.5 * (values[-1].min(axis=0) + values[-1].max(axis=0))
    unit = float(np.abs(values).max()) / _LARGEST
    times = np.round(found["time"].to_numpy(), 4).tolist()
    return {"times": times, "unit": unit, "points": packed(values / unit)}


def _poses(scene: Scene, lowest: float) -> dict[str, Any]:
    """The ring's points at ``POSES`` mean opening angles from ``lowest`` (rad) to 180 degree.

    A V-joint stands at middle + cos(angle / 2) * aside, so that each has its own opening angle;
    all other points follow the mean, as in the figure ``ringsim.plots.ring``.
    """
    means = np.linspace(min(lowest, 0.98 * np.pi), np.pi, POSES)
    points = points_of(first := layout_of(scene))
    fixed, shape = len(points.names) - points.openings.size, np.ones(points.openings.shape)
    poses = []
    for mean in means:
        layout = layout_at_opening(scene, float(mean), first)
        flat, folded = (
            points.places(layout, angle * shape) - middle_of(layout) for angle in (np.pi, 0.0)
        )
        poses.append(np.concatenate([flat, folded[fixed:] - flat[fixed:]]))
    whole = np.array(poses)
    unit = float(np.abs(whole).max()) / _LARGEST
    return {
        "means": np.degrees(means).round(4).tolist(), "unit": unit, "points": packed(whole / unit),
        "fixed": fixed, "joints": points.openings.size, "groups": [*points.lines],
        "lines": [
            [*pair, group] for group, pairs in enumerate(points.lines.values())
            for pair in pairs.tolist()
        ],
    }  # fmt: skip


def packed(values: NDArray[Any]) -> str:
    """Rounded values as little-endian int16 in base64."""
    return base64.b64encode(np.round(values).astype("<i2").tobytes()).decode("ascii")
