"""What the page's player draws: a few samples' opening angles, and the lines of the ring."""

import base64
from collections import Counter
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ringsim.analysis.courses import deployed
from ringsim.analysis.design import REACHED, UNKNOWN, endings, judged_by, median_and_worst
from ringsim.analysis.intervals import used
from ringsim.layout.layout import layout_at_opening, layout_of
from ringsim.layout.points import Points, points_of
from ringsim.measured import Measurement
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


def player(
    campaign: xr.Dataset, analysis: xr.Dataset, measurement: Measurement | None = None
) -> dict[str, Any] | None:  # fmt: skip
    """Data of the player for JSON; None if the structure has no joints that open between two rods,
    or nothing was recorded.

    Shown are the median, or the base case of single changes, and the worst sample, the worst of
    each failure in ``analysis``, then others that failed; beside them what encoders of a
    ``measurement`` read.
    """
    scene = scene_from_toml(str(campaign.attrs["scene"]), source="attribute scene")
    if "opening_angle" not in campaign or not points_of(layout_of(scene)).openings.size:
        return None
    shown = [_course(campaign, scene, *each) for each in _chosen(campaign, analysis)]
    if not shown:
        return None
    lowest = min(each.pop("lowest") for each in shown)
    computed = sum(each["places"] is not None for each in shown)
    words = {0: FROM_ANGLES, len(shown): COMPUTED}.get(computed, f"{COMPUTED}, or {FROM_ANGLES}")
    return {
        "words": words, "planes": campaign["plane"].values.tolist(),
        "sections": campaign["section"].values.tolist(),
        "samples": shown, "ring": _poses(scene, np.radians(lowest)),
        "measured": [] if measurement is None else _encoders(campaign, measurement),
    }  # fmt: skip


def _encoders(campaign: xr.Dataset, measurement: Measurement) -> list[dict[str, Any]]:
    """Number of the V-joint, times (s) and opening angles (deg) of each encoder of a test."""
    planes, sections = (campaign[name].values.tolist() for name in ("plane", "section"))
    found = []
    for each in measurement.readings:
        if each.sensor.variable == "opening_angle" and len(each.times):
            place = each.sensor.place
            joint = planes.index(place["plane"]) * len(sections) + sections.index(place["section"])
            few = np.unique(np.linspace(0, len(each.times) - 1, MOST_FRAMES).round().astype(int))
            times, values = np.round(each.times[few], 4), np.round(each.values[few], 3)
            found.append({"joint": joint, "times": times.tolist(), "angles": values.tolist()})
    return found


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


def _course(campaign: xr.Dataset, scene: Scene, sample: int, name: str) -> dict[str, Any]:
    """Times and opening angles in 0.01 degree, (frame, V-joint), of one sample; see ``_locks``."""
    angle = campaign["opening_angle"].sel(sample=sample).transpose("time", "plane", "section")
    angle = angle.dropna("time", how="any")
    angle = _thinned(angle, MOST_FRAMES)
    rows, times = angle.to_numpy().reshape(angle.sizes["time"], -1), angle["time"].to_numpy()
    locks, end = _locks(campaign, scene, sample, float(times[-1]))
    return {
        "name": name, "sample": sample, "times": np.round(times, 4).tolist(),
        "locks": locks, "end": round(end, 4),
        "angles": packed(np.clip(100.0 * rows, UNRECORDED, _LARGEST)),
        "lowest": float(rows.mean(axis=1).min()),
        "places": _places(campaign, scene, sample),
    }  # fmt: skip


def _locks(
    campaign: xr.Dataset, scene: Scene, sample: int, last: float
) -> tuple[list[float | None], float]:
    """From when on each V-joint is at 180 deg, s, None where records tell it, and the end of a
    course whose ``last`` record may be before the last lock.

    Of deployed rings alone; without latches V-joints may leave 180 deg again.
    """
    one = campaign.sel(sample=[sample])
    if "lock_time" not in one or not deployed(one).all():
        return [None] * (campaign.sizes["plane"] * campaign.sizes["section"]), last
    latched = scene.stop is not None and scene.stop.latch
    times = one["lock_time"].transpose("sample", "plane", "section").to_numpy().ravel().tolist()
    known = one["deployment_time"].values.tolist() if "deployment_time" in one else times
    end = max(last, *known)
    return [round(time, 4) if latched or time > last else None for time in times], end


def _thinned(series: xr.DataArray, most: int) -> xr.DataArray:
    """So many times of a series at most, evenly spread, both ends among them."""
    last = series.sizes["time"] - 1
    return series.isel(time=np.unique(np.linspace(0, last, most).round().astype(int)))


def _places(campaign: xr.Dataset, scene: Scene, sample: int) -> dict[str, Any] | None:
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
    turns = np.zeros((found.sizes["time"], 3))
    if "base_rotation" in campaign:
        turned = campaign["base_rotation"].sel(sample=sample).transpose("time", "axis")
        turns = np.nan_to_num(np.radians(turned.sel(time=found["time"]).to_numpy()))
    values = _with_spacecraft(scene, points_of(layout_of(scene)), values, turns)
    unit = float(np.abs(values).max()) / _LARGEST
    times = np.round(found["time"].to_numpy(), 4).tolist()
    return {"times": times, "unit": unit, "points": packed(values / unit)}


def _with_spacecraft(
    scene: Scene, points: Points, places: NDArray[Any], turns: NDArray[Any]
) -> NDArray[Any]:  # fmt: skip
    """Places, (frame, point, axis), m, with the spacecraft's centre of mass, if the scene has one,
    before the joints that open; ``turns`` are rotation vectors of the base, (frame, axis), rad.
    """
    base = layout_of(scene).base
    if scene.spacecraft is None or base is None:
        return places
    arm = Rotation.from_rotvec(turns).apply(np.array(scene.spacecraft.centre))
    centre = places[:, points.of_body(base)] + arm
    return np.insert(places, len(points.names) - points.openings.size, centre, axis=1)


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
    whole = _with_spacecraft(scene, points, np.array(poses), np.zeros((len(poses), 3)))
    craft = whole.shape[1] > len(poses[0])
    lines = [
        [*(int(point) + (craft and point >= fixed) for point in pair), group]
        for group, pairs in enumerate(points.lines.values()) for pair in pairs.tolist()
    ]  # fmt: skip
    if craft and first.base is not None:
        lines.append([points.of_body(first.base), fixed, len(points.lines)])
    unit = float(np.abs(whole).max()) / _LARGEST
    return {
        "means": np.degrees(means).round(4).tolist(), "unit": unit, "points": packed(whole / unit),
        "fixed": fixed + craft, "joints": points.openings.size,
        "groups": [*points.lines, *["spacecraft"] * craft], "lines": lines,
        "craft": fixed if craft else None,
    }  # fmt: skip


def packed(values: NDArray[Any]) -> str:
    """Rounded values as little-endian int16 in base64."""
    return base64.b64encode(np.round(values).astype("<i2").tobytes()).decode("ascii")
