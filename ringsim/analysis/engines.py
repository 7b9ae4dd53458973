"""How far the answers of the frame engine and of the full one are apart, output by output."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from ringsim.analysis.blocks import population_of
from ringsim.analysis.design import placement
from ringsim.analysis.quantities import CHECKED, good, numbers, quantities
from ringsim.outputs.family import Array
from ringsim.tables import counted, text_table
from ringsim.variables import Fate, Outcome, Status

_NOT_CHECKED = -1
_NAMED = 6


def main_outputs() -> list[str]:
    """Those of the numbers that summaries tell."""
    return [name for name, variable in quantities().items() if variable.summary is not None]


@dataclass(frozen=True)
class Difference:
    """One output in the samples that both engines answered, shapes (checked samples,)."""

    name: str
    units: str
    samples: Array
    apart: Array
    """Magnitude of the difference; infinite where one engine has a number and the other none."""
    share: Array
    """The same over the magnitude of the full engine's value."""
    bars: Array
    """Sum of the error bars that both state, or for one that states none the largest that its
    engine states in other samples, or that of the other engine; NaN without any."""
    standard_error: float
    """Of the mean of all samples that ended well, as the design tells it; NaN if it does not."""

    @property
    def worst(self) -> int:
        """Place of the sample with the largest difference."""
        return int(np.argmax(self.apart))


def differences(campaign: xr.Dataset) -> list[Difference]:
    """All outputs of a merged campaign that was checked; none if no check ended well."""
    ok = good(campaign)
    both = np.flatnonzero(ok & (campaign[f"status{CHECKED}"].to_numpy() == Status.OK))
    stand, placed, found = population_of(campaign), placement(campaign), []
    for name, variable in quantities().items():
        if name not in campaign or f"{name}{CHECKED}" not in campaign or not len(both):
            continue
        frame, full = (numbers(campaign, f"{name}{end}") for end in ("", CHECKED))
        apart, share = _apart(frame[both], full[both])
        if not np.isfinite([frame[both], full[both]]).any():
            continue
        own, theirs = (numbers(campaign, f"{name}_error{end}") for end in ("", CHECKED))
        own, theirs = (np.where(np.isnan(x), _largest(x), x) for x in (own, theirs))
        bars = np.where(np.isnan(own), theirs, own) + np.where(np.isnan(theirs), own, theirs)
        every = numbers(stand, name)
        known = good(stand) & np.isfinite(every)
        error = placed.error_of_mean(every[known], stand["sample"].to_numpy()[known])
        samples = campaign["sample"].to_numpy()[both]
        found.append(Difference(name, variable.units, samples, apart, share, bars[both], error))
    return found


def _largest(values: Array) -> float:
    return float(np.fmax.reduce(values, initial=np.nan))


def _apart(frame: Array, full: Array) -> tuple[Array, Array]:
    """Differences and their shares of the full engine's values."""
    apart = np.where(np.isnan(frame) & np.isnan(full), 0.0, np.abs(frame - full))
    apart = np.where(np.isnan(apart), np.inf, apart)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(apart == 0.0, 0.0, apart / np.abs(full))
    return apart, np.where(np.isnan(share), np.inf, share)


def check_lines(campaign: xr.Dataset) -> list[str]:
    """What the checks of a merged campaign gave, its last line the verdict; none without checks."""
    if f"status{CHECKED}" not in campaign:
        return []
    status = campaign[f"status{CHECKED}"].to_numpy()
    done = np.flatnonzero(status != _NOT_CHECKED)
    lines = [f"{len(done)} of {len(status)} samples were checked with the full engine"]
    if len(failed := np.flatnonzero(status >= Status.SOLVER_FAILED)):
        why = str(campaign[f"reason{CHECKED}"].to_numpy()[failed[0]])[:200]
        lines.append(f"{counted(len(failed), 'check')} failed, first sample {failed[0]}: {why}")
    found = differences(campaign)
    if found:
        both = counted(len(found[0].samples), "sample")
        lines.append(f"median and worst are of the {both} that ended well with both engines")
    rows = [
        (
            each.name, each.units, f"{np.median(each.apart):.2g}", f"{each.apart[each.worst]:.2g}",
            str(each.samples[each.worst]), f"{each.share[each.worst]:.2g}",
            _or_dash(each.bars[each.worst]), _or_dash(each.standard_error),
        )
        for each in found
    ]  # fmt: skip
    if rows:
        head = (
            "difference of", "unit", "median", "worst", "sample", "share", "error bars",
            "standard error",
        )  # fmt: skip
        lines += text_table(head, rows)
    return [*lines, *_other_ends(campaign), *verdict(campaign, found)]


def _or_dash(value: float) -> str:
    return f"{value:.2g}" if np.isfinite(value) else "-"


def _other_ends(campaign: xr.Dataset) -> list[str]:
    """A line if the engines do not agree on what the antenna did."""
    frame, full = (campaign[f"outcome{end}"].to_numpy() for end in ("", CHECKED))
    ok = (campaign["status"] == Status.OK) & (campaign[f"status{CHECKED}"] == Status.OK)
    other = np.flatnonzero(ok.to_numpy() & (frame != full))
    if not len(other):
        return []
    words = [
        f"sample {k}: {Fate(frame[k]).word}, full engine: {Fate(full[k]).word}"
        for k in other[:_NAMED]
    ]
    return [f"the outcome differs in {len(other)} of {int(ok.sum())}: {'; '.join(words)}"]


def verdict(campaign: xr.Dataset, found: list[Difference]) -> list[str]:
    """Whether the engines differ by more than they state, and by more than the campaign allows."""
    beyond, stated = [], False
    for each in found:
        stated = stated or bool(np.isfinite(each.bars).any())
        over = np.flatnonzero(each.apart > each.bars)
        if len(over):
            k = over[np.argmax(each.apart[over] / each.bars[over])]
            beyond.append(
                f"{each.name} (sample {each.samples[k]}: {each.apart[k]:.2g} {each.units}, "
                f"error bars {each.bars[k]:.2g})"
            )
    lines = []
    if beyond:
        lines = [f"the engines differ by more than their error bars in {', '.join(beyond)}"]
    elif stated:
        lines = ["the engines differ by no more than their error bars"]
    return lines + too_far(campaign, found)


def too_far(campaign: xr.Dataset, found: list[Difference] | None = None) -> list[str]:
    """One line if ``max_difference`` of the campaign is exceeded, or nothing tells; else none."""
    limits = limits_of(json.loads(campaign.attrs.get("max_difference", "null")))
    if not limits or f"status{CHECKED}" not in campaign:
        return []
    known = {each.name: each for each in (differences(campaign) if found is None else found)}
    if not known:
        return ["max_difference cannot be judged: no sample ended well with both engines"]
    over = [
        f"{name} ({share:.2g} of the value in sample {known[name].samples[k]}, max_difference = "
        f"{limits[name]:g})"
        for name in limits.keys() & known.keys()
        for k in [int(np.argmax(known[name].share))]
        if (share := known[name].share[k]) > limits[name]
    ]
    words = f"the engines differ by more than the campaign allows in {', '.join(sorted(over))}"
    return [words] if over else []


def limits_of(given: float | Mapping[str, float] | None) -> dict[str, float]:
    """Largest differences by output, as shares of the value; one number is for the main outputs."""
    if given is None:
        return {}
    return dict(given) if isinstance(given, Mapping) else dict.fromkeys(main_outputs(), given)


def run_lines(frame: Outcome, full: Outcome) -> list[str]:
    """The same table for one run of a scene with both engines."""
    rows: list[tuple[str, ...]] = []
    for name, variable in quantities().items():
        if name not in frame.values or name not in full.values:
            continue
        one, other = (float(each.values[name]) for each in (frame, full))
        apart, share = (float(x) for x in _apart(np.array(one), np.array(other)))
        stated = [each.values.get(f"{name}_error", np.array(np.nan)) for each in (frame, full)]
        numbers = f"{one:.6g}", f"{other:.6g}", f"{apart:.2g}", f"{share:.2g}"
        rows.append((name, variable.units, *numbers, _or_dash(float(sum(stated)))))
    head = ("output", "unit", "frame", "full", "difference", "share", "error bars")
    lines = text_table(head, rows) if rows else []
    if frame.fate != full.fate:
        lines.append(f"the outcome differs: {frame.fate.word}, full engine: {full.fate.word}")
    return lines


def with_frame(full: xr.Dataset, frame: xr.Dataset) -> xr.Dataset:
    """The dataset of the full engine, with the frame engine's variables as ``NAME_frame``."""
    own: dict[str, Any] = {f"{name}_frame": values for name, values in frame.data_vars.items()}
    for values in own.values():
        values.attrs["long_name"] = f"{values.attrs['long_name']}, of the frame engine"
    told = {"fidelity": "both", "reason_frame": frame.attrs["reason"]}
    return full.assign(own).assign_attrs(told)
