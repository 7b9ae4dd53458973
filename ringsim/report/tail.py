"""The rare event of a campaign of subset simulation, for a report."""

from typing import NamedTuple

import xarray as xr

from ringsim.analysis.binomial import share_interval
from ringsim.analysis.tails import short_of, tail, unseen_lines
from ringsim.report.tables import Rows


class RareEvent(NamedTuple):
    """A table of what was found, and what it leaves out."""

    rows: Rows
    notes: list[str]


def rare_event(campaign: xr.Dataset) -> RareEvent | None:
    """Probability with its interval, how sure it is and why; None for any other design."""
    if not (found := xr.Dataset(tail(campaign))):
        return None
    event = str(found["tail_probability"].attrs["event"])
    runs, lost = campaign.sizes["sample"], int(found["tail_lost"])
    replicates, levels = found.sizes["tail_replicate"], int(found["tail_levels"].max())
    rows = [["event", event]]
    if not int(found["tail_ended"]):
        rows += [["runs so far", str(runs)]]
        return RareEvent(rows, ["Not all levels have run: there is no probability yet"])
    low, high = found["tail_probability_interval"].to_numpy()
    each = ", ".join(f"{p:.2g}" for p in found["tail_replicate_probability"].to_numpy())
    by_chains = f"{float(found['tail_variation_of_chains']):.2g} by the chains alone"
    scatter = f"{float(found['tail_variation']):.2g} by the replicates, "
    if why := short_of(found):
        rows += [["probability", why[0]]]
    else:
        rows += [
            ["probability", f"{float(found['tail_probability']):.3g}"],
            ["95 % interval, of the parts that chains found", f"{low:.2g} to {high:.2g}"],
            ["coefficient of variation", f"{scatter if replicates > 1 else ''}{by_chains}"],
            ["by each replicate", each],
        ]
    rows += [
        ["levels", f"{levels} at most, in {replicates} replicates"],
        ["runs", f"{runs}, {lost} lost and taken as no event"],
    ]
    notes = [each[0].upper() + each[1:] for each in why[1:] or unseen_lines(found)]
    if why:
        notes.append("Raise samples or most_levels, so that every replicate reaches the event")
    if checked := int(found["tail_checked"]):
        confirmed = int(found["tail_confirmed"])
        low, high = share_interval(confirmed, checked)
        rows.append([
            "in the event by the full engine, too",
            f"{confirmed} of {checked} repeated runs (95 %: {low:.2g} to {high:.2g} of all)",
        ])  # fmt: skip
    if outside := int(found["tail_checked_outside"]):
        rows.append([
            "in the event by the full engine alone",
            f"{int(found['tail_missed'])} of the {outside} nearest runs outside it",
        ])  # fmt: skip
    if (checked or outside) and not why:
        apart = found["tail_difference"]
        farther, nearer = found["tail_probability_moved"].to_numpy()
        rows.append([
            f"probability with the limit moved by {float(apart):.2g} {apart.attrs['units']}, what "
            "the engines differ by",
            f"{farther:.3g} to {nearer:.3g}",
        ])  # fmt: skip
    return RareEvent(rows, notes)
