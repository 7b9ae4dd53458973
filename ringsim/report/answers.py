"""What answers to clauses are made of: outputs with their verdicts, inputs, endings, each out of a
table of the analysis.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis import campaign_notes as notes
from ringsim.analysis.design import by_path, worst_is_largest
from ringsim.analysis.intervals import good, numbers
from ringsim.analysis.requirements import OUTCOME
from ringsim.analysis.study_text import outcome_table, unit_of
from ringsim.analysis.verdicts import BOUND, SHARE_MET, ended_short, verdict_table
from ringsim.refusal import show
from ringsim.report.page import drawn_inputs
from ringsim.tables import Table, counted, number_text, with_unit


class Of(NamedTuple):
    """What items are answered from."""

    campaign: xr.Dataset
    analysis: xr.Dataset
    scene: Mapping[str, Any]
    """Values of the scene by path."""
    numbers: Table
    """The statistics of all outputs."""
    errors: Sequence[Table]
    """The error budget, and errors of the solution."""
    mark: str
    """What stands behind outputs that lost runs bend."""
    test: Table
    """Readings of a test beside the samples, without rows where there are none."""


@dataclass
class Answer:
    """What a campaign says about one clause."""

    result: list[str] = field(default_factory=list)
    evidence: list[str] = field(default_factory=list)
    lacks: dict[str, str] = field(default_factory=dict)
    """What is missing, and the key or command that would supply it."""

    def __add__(self, other: "Answer") -> "Answer":
        """Both, each line once."""
        return Answer(
            list(dict.fromkeys(self.result + other.result)),
            list(dict.fromkeys(self.evidence + other.evidence)),
            self.lacks | other.lacks,
        )


Ask = Callable[[Of], Answer]


def cells_of(tables: Iterable[Table], name: str) -> dict[str, str]:
    """The cells of an output in tables, by the heads of their columns; empty without a row."""
    rows = ((each.head, row) for each in tables for row in each.rows)
    own = (
        dict(zip(*each, strict=True)) for each in rows if each[1][0] in (name, name + notes.MARK)
    )
    return next(own, {})


def outputs(**cures: str) -> Ask:
    """An answer by outputs, each with the verdict on what is required of it, and what supplies
    those that are missing, if that is said.
    """

    def answer(of: Of) -> Answer:
        found, evidence, judged = Answer(), dict[str, list[str]](), Answer()
        for name, cure in cures.items():
            if name in of.analysis:
                own = verdicts(of, name)
                found.result += [output_line(of, name), *own.result]
                judged.evidence += own.evidence
                evidence.setdefault(evidence_of(of, name), []).append(name)
            elif cure:
                found.lacks[name] = _still_lacking(of.scene, cure)
        for told, names in evidence.items():
            found.evidence.append(f"{', '.join(names)}: " * (len(evidence) > 1) + told)
        return found + judged

    return answer


def _still_lacking(scene: Mapping[str, Any], cure: str) -> str:
    """A cure, "[table], key = value, words", without what the scene has of it already.

    >>> _still_lacking({"boom.base": "free"}, 'boom.base = "free", record.reactions = true')
    'record.reactions = true'
    >>> _still_lacking({"a.b": 1}, '[a] or [c], record.reactions = true')
    'record.reactions = true'
    """
    parts, there = cure.split(", "), set[str]()
    for part in parts:
        for each in part.split(" or "):
            key, _, value = each.partition(" = ")
            if each.startswith("[") and any(path.startswith(f"{each[1:-1]}.") for path in scene):
                there.add(part)
            if value and key in scene and show(scene[key]) == value:
                there.add(part)
    keyed = {part for part in parts if part.startswith("[") or " = " in part}
    if keyed and keyed <= there:
        return "no sample has a value"
    return ", ".join(part for part in parts if part not in there)


def output_line(of: Of, name: str) -> str:
    """An output: mean with its interval, the quantile at its worse end, the worst sample."""
    (factor, unit), told = unit_of(of.analysis, name), f"{name}{of.mark}"
    cell, larger = cells_of([of.numbers], name), worst_is_largest(of.analysis, name)
    if not cell:
        value = number_text(factor * float(of.analysis[name][-1]))
        return f"{told}: {with_unit(value, unit)} in all samples that have it"
    words = [f"from {cell['least']} to {with_unit(cell['most'], unit)}"]
    if cell["mean"] != "-":
        known, far = cell["95 % interval of it"], "95 %" if larger else "5 %"
        words = [f"mean {with_unit(cell['mean'], unit)}" + f" (interval {known})" * (known != "-")]
        words += [f"{far} quantile {with_unit(cell[far], unit)}"]
    if (sample := cell["worst sample"]) != "-":
        worst = with_unit(cell["most" if larger else "least"], unit)
        words.append(f"worst {worst} in sample {sample}")
    if absent := int(of.analysis[f"{name}_samples"].values[2]):
        words.append(f"{counted(absent, 'sample')} without a value")
    return f"{told}: {'; '.join(words)}"


def evidence_of(of: Of, name: str) -> str:
    """Of how many samples an output is, and its largest numerical errors."""
    used, lost, absent, _ = of.analysis[f"{name}_samples"].values
    cell, unit = cells_of(of.errors, name), unit_of(of.analysis, name)[1]
    words, campaign = [f"{used} of {used + lost + absent} samples"], of.campaign
    if cell.get("largest bar", "-") == "-" and (bars := bars_in(campaign, name)).any():
        # A design without means has no table of errors.
        factor, worst = unit_of(of.analysis, name)[0], int(np.argmax(bars))
        where = f"(sample {campaign['sample'].values[worst]})"
        cell = cell | {"largest bar": f"{number_text(factor * bars[worst], 2)} {where}",
                       "samples with bars": str(np.count_nonzero(bars))}  # fmt: skip
    if OUTCOME in campaign and len(campaign[OUTCOME]) == used + lost + absent:
        valued = good(campaign) & np.isfinite(numbers(campaign, name))
        short = int((valued & ended_short(campaign)).sum())
        words[0] += f", {short} of them not deployed, as they ended" * bool(short)
    for most, count, told in (
        ("largest bar", "samples with bars", "error bar"),
        ("largest difference", "samples checked", "engine difference"),
    ):
        if cell.get(most, "-") != "-":
            number, _, where = cell[most].partition(" ")
            of_all = "largest of " * (cell[count] != "1") + counted(int(cell[count]), told)
            words.append(f"{of_all}: {with_unit(number, unit)} {where}".rstrip())
    return "; ".join(words)


def bars_in(campaign: xr.Dataset, name: str) -> NDArray[np.float64]:
    """The error bar of an output in each sample that holds; 0 where there is none."""
    return np.nan_to_num(np.where(good(campaign), numbers(campaign, f"{name}_error"), 0.0))


def verdicts(of: Of, name: str = "") -> Answer:
    """The verdict on a requirement; without a name those on all."""
    found, table, judged = Answer(), verdict_table(of.analysis), list[str]()
    for row in table.rows:
        cell = dict(zip(table.head, row, strict=True))
        own = cell["requirement"].split()[0]
        if name not in ("", own):
            continue
        judged.append(own)
        bound, lost, go = cell[BOUND], cell["failed runs"], cell["samples to go"]
        found.result.append(
            f"{cell['requirement']} in at least {cell['probability']} of all (confidence "
            f"{cell['confidence']}): {cell['verdict']}" + f"; {SHARE_MET}: {bound}" * (bound != "-")
        )
        found.evidence.append(
            f"{own}: {cell['violating']} of {cell['samples used']} samples violate it"
            + f", {lost} failed" * (lost != "0")
            + f"; {go} more without a violation would prove it" * (go != "-")
        )
    recorded = notes.records_line(of.campaign, judged) if judged else ""
    return found + Answer(evidence=[recorded] * bool(recorded))


def field_text(of: Of, path: str) -> str:
    """A field of the scene as the samples have it: its value, or what is drawn of it."""
    known = by_path(of.campaign)
    if path in known:
        values = of.campaign[known[path]].to_numpy()
        if values.dtype.kind in "OUb":
            return f"{', '.join(sorted({str(v).lower() for v in values.ravel().tolist()}))} (drawn)"
        ends = dict.fromkeys(number_text(end(values), 4) for end in (np.nanmin, np.nanmax))
        return f"{' .. '.join(ends)} (drawn)"
    if any(path.startswith(f"{each}.") for each in known):
        return "drawn"
    return show(of.scene[path]) + ", drawn in part" * any(e.startswith(f"{path}[") for e in known)


def drawn_lines(of: Of, chosen: Callable[[str, str], bool]) -> list[str]:
    """Inputs that are chosen by path and unit, with their laws and the values that samples have."""
    return [
        f"{name}: {law}; values: {extent} {unit}".rstrip(" -")
        for name, unit, _, law, extent, paths in drawn_inputs(of.campaign)
        if any(chosen(path, unit) for path in paths.split(", "))
    ]


def fates(of: Of) -> list[str]:
    """What became of the antennas, with shares."""
    return [
        f"{kind}: {samples}" + f", share {share} (interval {ends})" * (ends != "-")
        for kind, samples, share, ends, *_ in outcome_table(of.analysis).rows
    ]
