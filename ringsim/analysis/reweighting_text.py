"""Estimates for other distributions of inputs, as lines for people."""

import json
from collections.abc import Iterator

import xarray as xr

from ringsim.analysis.losses import LOST, MARK, NOTE, marked
from ringsim.analysis.quantities import quantities
from ringsim.analysis.reweighting import LEAST_REPLICATES, SOBOL, STATISTICS
from ringsim.analysis.verdicts import Verdict
from ringsim.analysis.weighted import LEAST_OF_MEAN, LEAST_OF_SHARE
from ringsim.sampling.values import label_of
from ringsim.tables import Table, interval_text, number_text, slim, text_table

THIN = " (few)"
"""Stands behind what too few samples decide."""


def reweighting_lines(analysis: xr.Dataset) -> Iterator[str]:
    """Which distributions, how many effective samples, then the estimates beside the old ones."""
    if "reweighted_to" not in analysis:
        return
    bent = MARK * bool(analysis.attrs.get(NOTE))
    laws = json.loads(analysis["reweighted_to"].item())
    told = ", ".join(f"{path} = {label_of(law)}" for path, law in laws.items())
    yield (
        f"reweighted to {told}: {analysis['reweighted_samples'].item()} samples count as "
        f"{number_text(analysis['effective_samples'].item(), 3)} effective ones"
    )
    rows, thin = [], False
    for name, variable in quantities().items():
        if f"{name}_reweighted" not in analysis:
            continue
        for statistic in STATISTICS:
            one = analysis.sel(reweighted_statistic=statistic, statistic=statistic)
            low, high = one[f"{name}_reweighted_interval"].values.tolist()
            decisive = one[f"{name}_decisive_samples"].item()
            few = decisive < (LEAST_OF_MEAN if statistic == "mean" else LEAST_OF_SHARE)
            thin |= few
            rows.append((
                f"{name}{THIN * few}{bent}", "" if variable.units == "1" else variable.units,
                statistic.replace("_", " "),
                number_text(one[name].item()), number_text(one[f"{name}_reweighted"].item()),
                interval_text(low, high), number_text(one[f"{name}_effective_samples"].item(), 3),
                number_text(decisive, 3),
            ))  # fmt: skip
    if rows:
        head = ("output", "unit", "statistic", "as drawn", "reweighted", "95 % interval",
                "effective samples", "that decide it")  # fmt: skip
        yield from text_table(head, rows)
    shares = []
    for event in analysis["event"].values:
        one = analysis.sel(event=event)
        decisive = one["reweighted_share_decisive"].item()
        few = decisive < LEAST_OF_SHARE
        thin |= few
        shares.append((
            f"{event}{THIN * few}{'' if event == LOST else bent}",
            number_text(one["reweighted_share"].item()),
            interval_text(*one["reweighted_share_interval"].values.tolist()),
            number_text(decisive, 3),
        ))  # fmt: skip
    known = bool(analysis["reweighted_share_interval"].notnull().any())
    if shares:
        yield ""
        if analysis.attrs["design"] in SOBOL and not known:
            yield f"intervals of shares and quantiles need design.replicates = {LEAST_REPLICATES}"
        yield from text_table(
            ("probability of", "reweighted", "95 % interval", "samples that decide it"), shares
        )
    if thin:
        yield (
            f"{THIN.strip()}: too few samples decide it (below {LEAST_OF_MEAN:g} effective of a "
            f"mean, {LEAST_OF_SHARE:g} of others): the estimate may be far off, the interval of "
            "a mean is too short, a quantile has none, and that of a probability holds in any case"
        )
    if "reweighted_verdict" in analysis:
        yield ""
        yield from slim(_verdicts(analysis)).lines()


def _verdicts(analysis: xr.Dataset) -> Table:
    """The verdicts for the other distributions, a row a requirement."""
    rows = []
    for name in analysis["requirement"].values:
        one = analysis.sel(requirement=name)
        rows.append((
            one["requirement_text"].item(), f"{one['probability_required'].item():g}",
            f"{one['confidence_required'].item():g}",
            Verdict(one["reweighted_verdict"].item()).word.replace("_", " "),
            number_text(one["reweighted_probability"].item()),
            interval_text(*one["reweighted_bounds"].values.tolist()),
        ))  # fmt: skip
    head = ("requirement, reweighted", "probability", "confidence", "verdict", "estimate",
            "one-sided bounds")  # fmt: skip
    return marked(Table(head, rows), analysis, head.index("estimate"))
