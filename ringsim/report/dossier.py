"""The verification dossier: what a campaign holds of what a review of a mechanism asks for.

One subject is one function, with ``@item`` for each clause that it answers; nothing else knows it.
"""

import re
import tomllib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from ringsim.analysis import campaign_notes as notes
from ringsim.analysis.design import REACHED, by_path, called, endings, inputs, learnt_lines
from ringsim.analysis.engines import differences, verdict
from ringsim.analysis.influence_text import what_matters
from ringsim.analysis.intervals import CHECKED, good, is_moment, numbers, quantities, ran
from ringsim.analysis.requirements import OUTCOME
from ringsim.analysis.residuals import clock_line, residual_table, residuals
from ringsim.analysis.study import SOURCES, analyse
from ringsim.analysis.study_text import error_tables, head_lines, statistics_table, unit_of
from ringsim.analysis.tails import tail_table
from ringsim.analysis.worst import (
    command,
    margin_table,
    one_at_a_time,
    other_than_base,
    worst_tables,
)
from ringsim.files import write_text
from ringsim.measured import Measurement
from ringsim.outputs.balance import rules
from ringsim.outputs.family import Array
from ringsim.overrides import flat
from ringsim.refusal import InputError
from ringsim.report.answers import (
    Answer,
    Ask,
    Of,
    bars_in,
    cells_of,
    drawn_lines,
    evidence_of,
    fates,
    field_text,
    outputs,
    verdicts,
)
from ringsim.report.page import provenance, values_of
from ringsim.report.shell import written
from ringsim.sampling.distributions import labels_of
from ringsim.tables import Table, block_lines, counted, number_text, with_unit
from ringsim.variables import Status

ECSS = "ECSS-E-ST-33-01C (6 March 2009), Mechanisms"
NASA = "NASA-STD-7009, credibility of models and simulations"
KNOWN = {
    ECSS: "Clauses in ringsim's own words, after the text of 6 March 2009, which was read. Rev. 1 "
    "(2017) and Rev. 2 (2019) were not: check numbers of clauses against the edition in force",
    NASA: "The eight factors are known second-hand, from summaries by others: neither the edition "
    "of 2008 nor 7009A (2016) or 7009B (2024) was read. ringsim gives no levels: people do",
}
"""The standards, and how their text is known."""
HEAD = ("clause", "what it asks", "state", "result", "evidence")
STATES = ANALYSED, PARTLY, MISSING = "analysed", "in part", "not analysed"
_MEANS = (
    f"{ANALYSED} says that the campaign has the numbers, not that the antenna complies: the review "
    "judges that; what is missing stands in the result, in brackets what would supply it"
)


class Item(NamedTuple):
    """A clause, and what answers it."""

    standard: str
    clause: str
    asks: str
    answer: Ask

    @property
    def place(self) -> tuple[list[int], str]:
        """By what the items of a standard are ordered: the first number of the clause."""
        first = re.findall(r"\d+(?:\.\d+)*", self.clause)[0]
        return [int(part) for part in first.split(".")], self.clause


ITEMS = list[Item]()
"""All items, in any order."""


def item(standard: str, clause: str, asks: str) -> Callable[[Ask], Ask]:
    """Decorator: a function that answers a clause of a standard."""

    def register(answer: Ask) -> Ask:
        ITEMS.append(Item(standard, clause, asks, answer))
        return answer

    return register


def dossier(
    campaign: xr.Dataset, analysis: xr.Dataset | None = None, test: Measurement | None = None
) -> list[Table]:
    """A table a standard, a row a clause, columns ``HEAD``; cells may have several lines.

    All numbers are those of ``analysis``, what ``analyse`` gives, by default of today; readings of
    a ``test`` stand beside the samples.  InputError if it is no campaign, its requirements cannot
    be judged, or it does not have what was measured.
    """
    if not {"scene", "campaign"} <= campaign.attrs.keys():
        raise InputError(
            "this is not a campaign as ringsim merges it: give the folder that ringsim campaign "
            "has written"
        )
    analysis = analyse(campaign) if analysis is None else analysis
    scene = flat(tomllib.loads(str(campaign.attrs["scene"])))
    told = statistics_table(analysis, every=True), error_tables(analysis, every=True)
    beside = (
        Table((), ())
        if test is None
        else residual_table(residuals(campaign, test), clock_line(campaign, test))
    )
    mark = notes.MARK * bool(analysis.attrs[notes.NOTE])
    of = Of(campaign, analysis, scene, *told, mark, beside)
    found = list[Table]()
    for standard, known in KNOWN.items():
        own = sorted((e for e in ITEMS if e.standard == standard), key=lambda each: each.place)
        rows = [(each, each.answer(of)) for each in own]
        table = Table(HEAD, [
            (
                each.clause, each.asks,
                MISSING if not told.result else PARTLY if told.lacks else ANALYSED,
                "\n".join([*told.result, *(f"Missing: {k} ({v})" for k, v in told.lacks.items())]),
                "\n".join(told.evidence),
            )
            for each, told in rows
        ], [known], left=len(HEAD), title=standard)  # fmt: skip
        found.append(notes.doubted(table, analysis.attrs, notes.off_note(analysis.attrs)))
    return found


def write_dossier(
    campaign: xr.Dataset, out: Path, folder: str, test: Measurement | None = None
) -> tuple[int, list[str]]:  # fmt: skip
    """Write the page of a merged campaign; its size in bytes, and its lines for a terminal.

    ``folder`` is what readers give to ``ringsim replay``; InputError as of ``dossier``, and if the
    file cannot be written.
    """
    analysis = analyse(campaign)
    tables = dossier(campaign, analysis, test)
    says, counts = campaign.attrs, Counter(row[2] for each in tables for row in each.rows)
    told = ", ".join(f"{counts[state]} {state}" for state in STATES if counts[state])
    head = [
        *head_lines(analysis),
        f"computed by {says.get('source', 'unknown')}; commit {says.get('git_commit', 'unknown')}, "
        f"sources {says.get('sources', 'unknown')}",
        f"any sample k again: {command(folder, 0)[:-1]}k",
        f"{counted(counts.total(), 'clause')}: {told}", _MEANS,
    ]  # fmt: skip
    context = {
        "title": f"Verification dossier: {says.get('title') or 'campaign'}",
        "head": head, "tables": tables, "provenance": list(provenance(campaign)),
    }  # fmt: skip
    text = written("dossier.html.j2", context, ())
    write_text(out, text)
    return len(text.encode("utf-8")), block_lines(tables, head)


# ECSS-E-ST-33-01C.


@item(ECSS, "4.2.5.1, 4.8.2.9 Reliability", "How often the function succeeds.")
def _reliability(of: Of) -> Answer:
    shown, found, rare = verdicts(of, OUTCOME), Answer(fates(of)), tail_table(of.analysis)
    found.result += [f"{rare.head[1]}: {what}: {told}" for what, told in rare.rows]
    if not shown.result:
        law = 'outcome = { is = "deployed", probability = P, confidence = C }'
        found.lacks["how often it must succeed"] = f"[requirements] {law}"
    return found + shown


@item(ECSS, "4.7.4.2, 4.8.2.3 Thermal design", "It works at all temperatures and gradients.")
def _temperature(of: Of) -> Answer:
    found = Answer(
        drawn_lines(of, lambda path, unit: unit == "K" or path.startswith("temperature."))
    )
    for path, values in of.scene.items():
        if path.startswith("temperature.") and path.endswith(".temperatures"):
            known = f"{path.removesuffix('.temperatures')} for {values[0]:g} to {values[-1]:g} K"
            found.evidence.append(f"the scene has {known}")
    if not found.result:
        cure = "draw temperature.joint.value, temperature.pulley.value or an input of unit K"
        return found + Answer(lacks={"scatter of temperatures": cure})
    found.result += fates(of)
    one = re.compile(r"temperature\.\w+\.value")
    drawn = (of.campaign[n].ndim > 1 for path, n in by_path(of.campaign).items() if one.match(path))
    lists = (isinstance(v, list) for path, v in of.scene.items() if one.match(path))
    if not any([*drawn, *lists]):
        found.lacks["gradients"] = "draw temperature.joint.value with each_section, or set a list"
    return found


_ALLOWABLES = {"peak_tension": "limits.tension", "peak_rod_stress": "limits.rod_stress"}


@item(
    ECSS, "4.7.5.2.5, 4.7.5.2.6, 4.8.2.4 Margin of safety",
    "Allowable / (worst load x factor) - 1 > 0; a factor of 3 for cables against rupture.",
)  # fmt: skip
def _strength(of: Of) -> Answer:
    found, margins = outputs(**dict.fromkeys(_ALLOWABLES, ""))(of), margin_table(of.analysis).rows
    for name, limit in _ALLOWABLES.items():
        own = [row for row in margins if row[0].startswith(limit)]
        for told, of_what, worst, margin, sample, beyond in own:
            worst += f" in sample {sample}; beyond it {beyond}"
            found.result.append(f"{told}: margin {margin}, of {of_what} {worst}")
            factor = "the project's, of cables against rupture 3"
            found.lacks["factor of safety F"] = f"{factor}; then (1 + margin) / F - 1"
        if stress := name == "peak_rod_stress" and name not in of.analysis:
            found.lacks[name] = "record.stress = true"
        there = stress or name in of.analysis  # without cables nothing has a tension
        if there and not own and limit not in of.scene.keys() | by_path(of.campaign).keys():
            found.lacks[f"allowable of {name}"] = limit
    return found


@item(
    ECSS, "4.7.5.3, 4.8.2.8 Functional dimensioning (motorization)",
    "At every position the drive is at least twice the sum of all resistances, each times its "
    "factor; momentum does not count.",
)  # fmt: skip
def _drive(of: Of) -> Answer:
    name, kind, wanted = "least_drive_margin", of.scene.get("margin.kind"), "ecss-e-st-33-01c"
    cure = f'margin.kind = "{wanted}", and winches with motors, whose pull has a bound'
    found, held = outputs(least_drive_margin=cure)(of), good(of.campaign)
    values = np.where(held, numbers(of.campaign, name), np.nan)
    if not np.isfinite(values).any():
        return found
    k, late = int(np.nanargmin(values)), of.analysis.attrs.get(notes.LATE)
    angle, time = (numbers(of.campaign, f"{name}_{word}")[k] for word in ("angle", "time"))
    found.result += [
        f"in sample {int(of.campaign['sample'][k])} it is least at {angle:.3g} deg, {time:.3g} s",
        _below_zero(values),
        *notes.drive_notes(of.analysis.attrs),
    ]
    later = f"{name}_started"
    if later in of.analysis and (late or verdicts(of, later).result):
        values = numbers(of.campaign, later)[held]
        found += outputs(**{later: ""})(of) + Answer([f"{later}: {_below_zero(values)}"])
    own = ((path, field_text(of, path)) for path in of.scene if path.startswith("margin."))
    factors = (f"{path.removeprefix('margin.').replace('_', ' ')} {told}" for path, told in own)
    found.evidence.append(f"static margin at all angles passed; {', '.join(factors)}")
    if kind != wanted:
        found.lacks["the factors of this clause"] = f'margin.kind = "{wanted}"'
    return found


def _below_zero(values: Array) -> str:
    """In how many samples a margin is not enough."""
    short, known = int((values < 0.0).sum()), int(np.isfinite(values).sum())
    return f"below 0 in {short} of {known} samples" + ": NOT enough" * bool(short)


@item(ECSS, "4.7.5.4.3 Latching or locking", "Latches catch at all temperatures and tolerances.")
def _latching(of: Of) -> Answer:
    found = outputs(latched_joints="stop.latch = true", least_latch_rate="")(of)
    if found.result:
        found.result = [line for line in fates(of) if line.startswith(REACHED)] + found.result
        if of.scene.get(rate := "latch.min_rate") or rate in by_path(of.campaign):
            found.evidence.append(f"rate from which a latch catches, rad/s: {field_text(of, rate)}")
        others = _temperature(of).lacks | _tolerances(of).lacks
        found.lacks |= {what: others[what] for what in others if what.startswith("scatter")}
    return found


@item(ECSS, "4.8.2.1 Cases", "Extremes together, and what the ground changes: weight, test rig.")
def _cases(of: Of) -> Answer:
    kind, found = of.analysis.attrs["design"], Answer()
    if kind in ("grid", "list", "one-at-a-time"):
        found.result.append(f"cases are chosen: design {kind}")
    else:
        found.lacks[_EXTREMES] = f'design {kind} meets them by chance; "grid" or "list" places them'
    ground = [
        f"{path} = {field_text(of, path)}"
        for path, value in of.scene.items()
        if path.startswith(("gravity.", "offload.")) and value != []  # no corners named: all
    ]
    found.result.append(", ".join(ground) or "in orbit: no gravity, no lines of a test rig")
    cure = "the same seed with gravity and offload, then ringsim compare"
    return found if ground else found + Answer(lacks={"the ground": cure})


@item(ECSS, "4.8.2.2 Worst-case identification", "Which cases size the mechanism.")
def _worst(of: Of) -> Answer:
    rows = ((each.title, *each.rows[0]) for each in worst_tables(of.analysis, ""))
    told = [f"{what}: worst sample {k}, {value}; inputs: {odd}" for what, k, value, odd, _ in rows]
    none = "no sample fails or violates a requirement; worst samples of outputs stand above"
    found = Answer(told or [none] * bool(of.analysis.attrs["samples_run"]))
    sound = {} if good(of.campaign).any() else {"sound runs": "the cures of those that failed"}
    return found + Answer(lacks=sound)


_EXTREMES = "extremes together"
_LENGTHS = "structure.", "rods.length_error", "rods.diagonal", "rods.bar", "boom.length"


@item(ECSS, "4.8.2.5 Tolerance budget", "Manufacturing tolerances together with worst loads.")
def _tolerances(of: Of) -> Answer:
    own = drawn_lines(of, lambda path, unit: path.startswith(_LENGTHS) and unit in ("m", ""))
    if own:
        return Answer(own) + outputs(best_fit_rms="record.shape = true")(of)
    return Answer(lacks={"scatter of lengths": "draw rods.length_error or structure.hinge_error"})


@item(ECSS, "4.8.2.6.3 a Conformance", "Each requirement is kept, with parameters at their worst.")
def _requirements(of: Of) -> Answer:
    found = verdicts(of)
    if not found.result:
        return Answer(lacks={"requirements": "[requirements]"})
    return found + Answer(lacks={k: v for k, v in _cases(of).lacks.items() if k == _EXTREMES})


_LATE = 0.01
"""Share of a run from which on a start that is drawn is a late winch, and no tolerance."""


def reached_by_words(campaign: xr.Dataset, start: str) -> list[str]:
    """How many samples reached their goal with each word that was drawn of inputs whose paths begin
    so, as "deployed without faults: 37 of 37".
    """
    held, words, lines = ran(campaign), endings(campaign), list[str]()
    came = np.isin(words, REACHED)
    for name in inputs(campaign):
        values = campaign[name].to_numpy()
        if not called(campaign[name]).startswith(start) or values.dtype.kind not in "OU":
            continue
        told = labels_of(values) if values.ndim == 1 else values
        drawn_words = Counter(told[held].tolist() if told.ndim == 1 else ())
        for word, count in drawn_words.most_common(_MOST_WORDS):
            own = held & (told == word)
            gone = int((own & ~good(campaign)).sum())
            more = f", {counted(gone, 'failed run')}" * bool(gone)
            how = f"without {start}" if word == "none" else f"with {word}"
            lines.append(f"deployed {how}: {int((own & came).sum())} of {count}{more}")
        if (left := len(drawn_words) - _MOST_WORDS) > 0:
            lines.append(f"and with {counted(left, 'other value')}: see campaign.nc")
    return lines


_MOST_WORDS = 8
"""Values of an input of words that are told one by one."""


@item(ECSS, "4.8.2.6.3 b Failure cases", "Failures of parts, and what to do then.")
def _faults(of: Of) -> Answer:
    drawn, ran = by_path(of.campaign), numbers(of.campaign, "final_time")
    lasts = float(np.median(ran[np.isfinite(ran)])) if np.isfinite(ran).any() else 0.0

    def late(path: str, _: str) -> bool:
        if not path.endswith(".start_time") or path not in drawn:
            return False
        return bool(numbers(of.campaign, drawn[path]).max() > _LATE * lasts)

    failed = drawn_lines(of, lambda path, _: path.startswith("faults") or "stop_time" in path)
    found = Answer([*failed, *drawn_lines(of, late)])
    found.result += reached_by_words(of.campaign, "faults")
    if single := one_at_a_time(of.campaign):
        ends = Counter(of.analysis["case_outcome"].values.tolist())
        told = ", ".join(f"{count} {end}" for end, count in ends.items())
        found.result.append(f"{counted(sum(ends.values()), 'case')} of one change each: {told}")
    if not failed and not single:  # a late start is no failed part
        found.lacks["failures"] = 'draw faults under [inputs], or design.kind = "one-at-a-time"'
    return found


@item(ECSS, "4.8.2.6.3 c Integrity check", "A check within the results, as an energy balance.")
def _integrity(of: Of) -> Answer:
    rows = [row for each in of.errors for row in each.rows if "median" in each.head]
    found = Answer([f"{name}: median {median}, largest {most}" for name, median, most, _ in rows])
    most = of.scene.get("solver.energy_tolerance")
    found.evidence += [f"a run is refused whose imbalance exceeds {most:g}"] * bool(most)
    found.evidence += sorted({f"{row[-1]} samples" for row in rows})
    found.evidence += notes.remark_lines(of.campaign)
    return found if rows else Answer(lacks={"energy balance": "no sample has a valid result"})


_SHOWN = 5  # outputs that are told what matters for, where no requirement chooses them


@item(ECSS, "4.8.2.6.3 d Sensitivity analysis", "Which uncertain parameters matter.")
@item(NASA, "factor 5, results robustness (second-hand)", "How results change with the inputs.")
def _sensitivity(of: Of) -> Answer:
    table = what_matters(of.analysis)
    wanted = [line.partition(":")[0] for line in verdicts(of).evidence]
    if one_at_a_time(of.campaign):
        names = [n for n, one in quantities().items() if one.summary and n in of.analysis]
        names = [name for name in names if name in wanted] or names[:_SHOWN]
        told = [line for name in names if (line := _farthest(of, name))]
        return Answer(told, lacks={} if told else {"effects": "run the base case again: it failed"})
    rows = [row for row in table.rows if row[0]]
    plain = [row for row in rows if row[0] in quantities() and quantities()[row[0]].summary]
    own = [row for row in rows if row[0] in wanted] or (plain or rows)[:_SHOWN]
    cells = [(row, zip(table.head[2:], row[2:], strict=True)) for row in own]
    found = Answer([
        f"{row[0]} most by {row[1]}: "
        + ", ".join(f"{head} {cell}" for head, cell in each if cell not in ("", "-"))
        for row, each in cells
    ])  # fmt: skip
    found.evidence += ["ringsim analyse --full lists all outputs and inputs"] * bool(rows)
    found.evidence += [note for note in table.notes if note.startswith("no significant")]
    cure = "more samples, or inputs that scatter"
    return found if rows else found + Answer(lacks={"effects beyond chance": cure})


def _farthest(of: Of, name: str) -> str:
    """The one change of all cases that moves an output most; empty if the base case has none."""
    values = np.where(good(of.campaign), numbers(of.campaign, name), np.nan)
    if not np.isfinite(values[0]) or not np.isfinite(values[1:]).any():
        return ""
    (factor, unit), far = unit_of(of.analysis, name), int(np.nanargmax(np.abs(values - values[0])))
    if values[far] == values[0]:
        return f"{name}: {with_unit(number_text(factor * values[0]), unit)}, which no change moves"
    base, most = (with_unit(number_text(factor * values[k]), unit) for k in (0, far))
    change = other_than_base(of.campaign, far)
    return f"{name}: {base} in the base case, farthest {most} with {change}"


@item(ECSS, "4.8.2.6.3 e, f Test", "Differences of test and prediction are explained.")
@item(NASA, "factor 2, validation (second-hand)", "How well results agree with the real thing.")
def _validation(of: Of) -> Answer:
    found = Answer(learnt_lines(of.campaign))
    for row in of.test.rows:
        cell = dict(zip(of.test.head, row, strict=True))
        most, sigma = (with_unit(cell[n], cell["unit"]) for n in ("largest difference", "sigma"))
        found.result.append(
            f"{cell['sensor']}: {cell['within 90 %'].split()[0]} of {cell['readings']} readings in "
            f"the band of 90 % of the samples; largest difference {most} at {cell['at (s)']} s, "
            f"scatter of a reading {sigma}"
        )
        if (beyond := cell["beyond all samples"]) != "-":
            found.lacks[f"why {beyond} of {cell['sensor']} lie beyond all samples"] = "people"
    if not of.test.rows:
        found.lacks["readings of a test"] = "ringsim dossier DIR --measured TEST.toml"
    return found + Answer(evidence=list(of.test.notes))


# NASA-STD-7009.


@item(NASA, "factor 1, verification (second-hand)", "How large numerical errors are.")
def _verification(of: Of) -> Answer:
    found, own = _integrity(of), [name for name in quantities() if not is_moment(name)]
    told = {name: evidence_of(of, name).partition("; ")[2] for name in own if name in of.analysis}
    found.result += [f"{name}: {errors}" for name, errors in told.items() if errors]
    if not any("bar" in errors for errors in told.values()):
        found.lacks["numerical error bars"] = "error_bars_every"
    if f"status{CHECKED}" not in of.campaign:
        fast = of.campaign.attrs.get("fidelity") == "frame"
        found.lacks["the other engine"] = 'fidelity = "frame" with ' * (not fast) + "check_every"
        return found
    checked = (of.campaign[f"status{CHECKED}"] == Status.OK).to_numpy() & good(of.campaign)
    found.evidence.append(f"{counted(int(checked.sum()), 'sample')} answered by both engines")
    found.result += verdict(of.campaign, differences(of.campaign))
    return found


_ORIGINS = {
    "drawn": "varied", "drawn in part": "varied in part", "campaign": "set by the campaign",
    "inferred": "marked inferred in the scene", "scene": "of the scene's file",
    "default": "defaults of ringsim",
}  # fmt: skip
_UNTOLD = "of the scene's file or defaults of ringsim"
"""Of a scene of one's own a campaign does not tell which."""


@item(NASA, "factor 3, input pedigree (second-hand)", "Where inputs come from, and how sure.")
def _pedigree(of: Of) -> Answer:
    values, head = values_of(of.campaign)
    counts = Counter(each.origin for each in values)
    words = _ORIGINS if head else _ORIGINS | {"scene": _UNTOLD}
    told = ", ".join(f"{counts[k]} {word}" for k, word in words.items() if counts[k])
    found = Answer([f"{counts.total()} values: {told}", *drawn_lines(of, lambda *_: True)])
    found.result += [
        f"{each.path} = {each.value}, set by the campaign"
        for each in values
        if each.origin == "campaign"
    ]
    found.evidence.append("ringsim report lists every value and its origin")
    found.result += learnt_lines(of.campaign)
    if not learnt_lines(of.campaign):
        found.lacks["inputs that a test has told"] = 'ringsim calibrate, then from = "posterior.nc"'
    if not counts["inferred"] + counts["default"]:
        found.lacks["which values are assumed"] = "a file of one's own does not tell: list them"
    return found


_UNMEASURED = "no error bars (error_bars_every), numerical errors not known"
_NO_BARS = "no error bar is made of these, numerical errors not known"


@item(NASA, "factor 4, results uncertainty (second-hand)", "How uncertain the results are.")
def _uncertainty(of: Of) -> Answer:
    found, says = Answer(), of.analysis.attrs
    ends = [of.analysis[f"{n}_interval"].values for n in quantities() if n in of.analysis]
    if np.isfinite(ends).any():
        found.result += [says["intervals"], *filter(None, [says[notes.NOTE], says["stopping"]])]
    else:
        found.lacks["intervals"] = says["intervals"] or "more samples"
    found.evidence.append(f"{says['samples_run']} of {says['samples']} samples have run")
    largest = dict[str, list[str]]()
    for name in quantities():
        cell = cells_of(of.errors, name)
        source = cell.get("dominates", "-").partition(" ")[0].strip("-")
        if source and not is_moment(name):
            bare = cell["numerical (error bars)"] == "-"
            kind = _UNMEASURED if name in rules() else _NO_BARS
            largest.setdefault(kind if bare else source, []).append(name)
    if not largest and not any(bars_in(of.campaign, n).any() for n in quantities()):
        found.lacks["numerical errors"] = "error_bars_every"
    for source, names in largest.items():
        bare = source in (_UNMEASURED, _NO_BARS)
        many = bare or source == SOURCES[0]
        told = counted(len(names), "output") if many else ", ".join(names)
        part = f"largest part of the error of the mean is {source}"
        found.evidence.append(f"{source if bare else part}: {told}")
    return found


@item(NASA, "factor 7, management (second-hand)", "Which model ran, and whether it can run again.")
def _management(of: Of) -> Answer:
    says = dict(provenance(of.campaign))
    names = "ringsim version", "git commit", "sources", "identity", "seed"
    found = Answer([f"{name} {says[name]}" for name in names if name in says])
    others = [f"{k} {v}" for k, v in says.items() if k.endswith("version") and k not in names]
    found.evidence += filter(None, [", ".join(others)])
    if not re.fullmatch("[0-9a-f]+", says.get("git commit", "")):
        found.lacks["a commit that holds all that ran"] = "commit changes before a campaign"
    return found


# Clauses that outputs alone answer, and those of which no campaign holds anything.


_REACTIONS = "record.reactions = true"
_CARRIED = f'boom.base = "fixed" or [spacecraft], {_REACTIONS}'
"""Nothing carries a ring whose base is free and has no spacecraft."""
for _clause, _asks, _cures in (
    ("4.4.2 Mechanism function", "The motion over time, and its tolerances.",
     {"deployment_time": "no sample has deployed",
      "asynchrony_max": "sound runs of a ring with V-joints"}),
    ("4.7.5.2.2, 4.8.2.12 Loads", "Loads and motion of the spacecraft from the dynamics.",
     {"peak_base_force": _CARRIED, "peak_base_torque": _CARRIED,
      "base_rotation_max": f'boom.base = "free", {_REACTIONS}',
      "base_rate_max": f"[spacecraft], {_REACTIONS}"}),
    ("4.7.5.4.3 i, 4.7.5.4.4 End stops, 4.8.2.11 Shock", "Shocks of latches and stops.",
     {"peak_latch_rate": "stop.latch = true", "peak_lock_impulse": f"{_REACTIONS}, with stops",
      "peak_acceleration_max": "record.accelerations = true"}),
):  # fmt: skip
    item(ECSS, _clause, _asks)(outputs(**_cures))


@item(NASA, "factor 6, use history (second-hand)", "Whether the model served like cases before.")
@item(NASA, "factor 8, people (second-hand)", "Whether those who ran and judge it are qualified.")
@item(
    ECSS, "4.8.2.7, 4.8.2.10, 4.8.2.13 to 4.8.2.19 Other analyses",
    "Contact stress, gears, control, lubrication, life, humidity, magnets, radiation, electrics.",
)  # fmt: skip
def _not_here(_: Of) -> Answer:
    return Answer(lacks={"all of it": "no campaign holds it: by other means, or say why not"})
