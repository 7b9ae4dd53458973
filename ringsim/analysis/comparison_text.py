"""A comparison of two campaigns or runs as tables: for terminals and pages alike."""

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from ringsim.analysis import derived
from ringsim.analysis.campaign_notes import NOTE, marked
from ringsim.analysis.comparison import BADNESS
from ringsim.analysis.design import LOST, NOT_RUN, REACHED, UNKNOWN
from ringsim.analysis.indices import largest_by_chance
from ringsim.analysis.intervals import NOTHING, ROUND_OFF, TWIN, all_alike, is_moment, quantities
from ringsim.analysis.requirements import COUNTS, MARGINS
from ringsim.analysis.study_text import Section
from ringsim.outputs.base import DOUBT
from ringsim.tables import (
    Table,
    counted,
    digits_of,
    estimate_text,
    interval_text,
    number_text,
    readable,
    slim,
    unit_text,
    with_unit,
)
from ringsim.variables import Fate

_NAMED, _VALUES = 12, 60
"""Changed outcomes, and values of scenes, that are listed at most."""
_ALIKE = 1e-3
"""Difference over the larger mean below which neither is told to be worse, however sure it is."""
_FRACTIONS = 999.5
"""Percent from which on three digits would take an exponent."""
_LOW = 0.5
"""Rank correlation of pairs below which one campaign hardly tells which samples of the other are
bad: it explains a quarter of the variance of ranks."""
_OPPOSITE = -0.7
"""Rank correlation below which the worst of one are the best of the other: half of the variance."""
_STILL = 0.01
"""Standard deviation over the mean below which the rank correlations of the table are enough: the
samples are hardly in any order."""
_SHORT = 16
"""Letters of a name up to which it heads columns."""


def compared(found: xr.Dataset) -> list[str]:
    """All lines: how samples are paired, what differs in the scenes, outcomes, outputs."""
    lines = head_lines(found)
    for each in sections(found).values():
        for table in each.tables:
            lines += ["", *table.lines()]
    return lines


def head_lines(found: xr.Dataset) -> list[str]:
    """Which two, how their samples are paired, lost runs that bend it, and missing intervals."""
    pairs = ""
    if (count := found.attrs["pairs"]) and not found.attrs["runs"]:
        sizes = found.attrs["first_ran"], found.attrs["second_ran"]
        rest = "" if set(sizes) == {count} else (
            f" of {sizes[0]} and {sizes[1]} samples that have run: "
            "all tables and figures are of these pairs"
        )  # fmt: skip
        pairs = f" ({counted(count, 'pair')}{rest})"
    lines = list[str]()
    for side, name in zip(("first", "second"), names_of(found), strict=True):
        title = found.attrs[side]
        if title or name != side:
            own = found.attrs[f"{side}_name"]
            told = f" ({own})" if title and name != side and own != title else ""
            lines.append(f"{side}: {title or found.attrs[f'{side}_name']}{told}")
    lines.append(f"{found.attrs['pairing']}{pairs}")
    lines += [*_not_run(found), *filter(None, [found.attrs[NOTE], found.attrs["intervals"]])]
    lines += [*_cut_off(found), *_doubts(found)]
    return [*lines, *_turned(found), *_other_verdicts(found)]


def _not_run(found: xr.Dataset) -> Iterator[str]:
    for side, name in zip(("first", "second"), names_of(found), strict=True):
        ran, planned = found.attrs[f"{side}_ran"], found.attrs[f"{side}_planned"]
        if ran < planned:
            yield f"{name}: {ran} of {planned} samples have run"


_COUNTED = "_doubtful"


def doubtful(found: xr.Dataset) -> dict[str, tuple[int, ...]]:
    """In how many samples of both runs say that an output may be off, if any does."""
    return {
        str(name).removesuffix(_COUNTED): tuple(found[name].values.tolist())
        for name in found.data_vars if str(name).endswith(_COUNTED)
    }  # fmt: skip


def _doubts(found: xr.Dataset) -> Iterator[str]:
    """What runs themselves say of their numbers, alike ones together."""
    alike: dict[tuple[int, ...], list[str]] = {}
    for name, counts in doubtful(found).items():
        alike.setdefault(counts, []).append(name)
    names, told = names_of(found), list[str]()
    for counts, outputs in sorted(alike.items(), reverse=True):
        if found.attrs["runs"]:
            where = " and ".join(n for n, count in zip(names, counts, strict=True) if count)
        else:
            of = found.attrs["first_samples"], found.attrs["second_samples"]
            where = " and ".join(
                f"{count} of {size} samples of {name}"
                for count, size, name in zip(counts, of, names, strict=True)
            )
        told.append(f"{', '.join(outputs)} in {where}")
    if told:
        since = found[f"{next(iter(doubtful(found)))}{_COUNTED}"].attrs["since"]
        yield f"numbers with{DOUBT} may be off, as their runs say, since {since}: {'; '.join(told)}"


def _questioned(table: Table, found: xr.Dataset) -> Table:
    """A table with the mark behind each output that may be off, and requirement or limit on it."""
    names, limits = doubtful(found), dict[str, str]()
    if "limit" in found.dims:
        limits = dict(zip(found["limit"].values, found["limit_output"].values, strict=True))
    rows = [
        (f"{row[0]}{DOUBT}", *row[1:])
        if row[0] and limits.get(row[0], row[0].split()[0]) in names else row
        for row in table.rows
    ]  # fmt: skip
    return table._replace(rows=rows)


def _turned(found: xr.Dataset) -> Iterator[str]:
    """Main outputs by which the samples of one are in another order than those of the other, of
    those that vary.
    """
    # Draws at the same place of the unit cube rank alike whatever their distributions; with other
    # places an input has nothing in common.
    if " places)" in found.attrs["pairing"]:
        return
    turned, tend, apart, weak = (dict[str, float]() for _ in range(4))
    still = list[str]()
    for name, variable in quantities().items():
        own = name in derived.declared()
        if not (variable.summary or own) or f"{name}_rank_correlation" not in found:
            continue
        together = found[f"{name}_rank_correlation"].item()
        sizes = np.abs(found[f"{name}_mean"].values)
        spread, errors = found[f"{name}_spread"].values, found[f"{name}_numerical_error"].values
        if (spread < np.fmax(_STILL * sizes, errors)).any():
            still += [name] * bool(np.isfinite(together))
            continue
        pairs = int(found[f"{name}_samples"].values[0])
        chance = float(largest_by_chance(pairs, np.zeros(()), 1))
        if together < -chance:
            (turned if together < _OPPOSITE else tend)[name] = together
        elif together < _LOW:
            (apart if together < chance else weak)[name] = together
    for some, sense in (
        (turned, "turn round: samples that are bad in one are good in the other"),
        (tend, "tend to turn round: samples that are bad in one are rather good in the other"),
        (apart, "hardly go together: which samples are bad in one tells little of the other"),
        (weak, "go together weakly"),
    ):
        if some:
            named = ", ".join(f"{name} ({each:+.2f})" for name, each in some.items())
            yield f"the ranks of pairs {sense} (rank correlation): {named}"
    if still:
        yield (
            f"the ranks of pairs say little of {', '.join(still)}: in one of the two, or in both, "
            f"the samples scatter by less than {100 * _STILL:g} % of their mean, or than the "
            "numerical error"
        )


def _other_verdicts(found: xr.Dataset) -> Iterator[str]:
    """The requirements whose verdict is another one in the second, however sure either is."""
    for text in found["requirement"].values if "kept_verdict_text" in found else ():
        first, second = found["kept_verdict_text"].sel(requirement=text).values.tolist()
        mark = DOUBT if text.split()[0] in doubtful(found) else ""
        if np.ptp(found["kept_verdict"].sel(requirement=text).values):
            yield f"{text}{mark}: {first} -> {second}"


def _cut_off(found: xr.Dataset) -> Iterator[str]:
    """What the samples that ended before their antenna came to rest mean for the numbers."""
    word = Fate.CUT_OFF.words
    if found.attrs["runs"] or word not in found["kind"].values:
        return
    counts = found["kind_samples"].sel(kind=word).values.tolist()
    for side, name, count in zip(("first", "second"), names_of(found), counts, strict=True):
        if count:
            samples = f"{count} of {counted(found.attrs[f'{side}_samples'], 'sample')}"
            yield (
                f"{name}: {samples} cut off at solver.end_time: their largest values may have "
                "grown later, and are lower bounds"
            )


def names_of(found: xr.Dataset) -> tuple[str, str]:
    """What the two are called in tables and figures: first and second where names are long."""
    own = str(found.attrs["first_name"]), str(found.attrs["second_name"])
    return own if own[0] != own[1] and max(map(len, own)) <= _SHORT else ("first", "second")


def sections(found: xr.Dataset) -> dict[str, Section]:
    """All that a comparison tells, by name, parts without rows and notes left out."""
    parts = (
        Section("settings", "Differences in the input", [_settings(found)]),
        Section("outcomes", "Outcomes", [
            _shares(found, "kind", "kind", "outcome"), _changed(found)
        ]),
        Section("requirements", "Requirements", [
            _questioned(_shares(found, "kept", "requirement", "samples that meet"), found),
            _moved(found),
        ]),
        Section("limits", "Margins to limits", [_questioned(_limits(found), found)]),
        Section("outputs", "Numbers", [_questioned(_outputs(found)[0], found)]),
    )  # fmt: skip
    return {
        each.name: each._replace(tables=tables)
        for each in parts
        if (tables := [slim(t) for t in each.tables if t.rows or t.notes])
    }


def _settings(found: xr.Dataset) -> Table:
    """The values, distributions and requirements in which the two differ."""
    paths, count = found["setting"].values.tolist(), found.sizes["setting"]
    columns = (found[f"setting_{side}"].values.tolist() for side in ("first", "second"))
    rows = [(str(p), str(a), str(b)) for p, a, b in zip(paths, *columns, strict=True)]
    more = f"and {count - _VALUES} more; ringsim compare --out FILE.nc stores all"
    notes = [more] * (count > _VALUES)
    return Table(("differs in", *names_of(found)), rows[:_VALUES], notes, left=3)


def _shares(found: xr.Dataset, word: str, dim: str, head: str) -> Table:
    """Counts and shares of the samples compared, and the difference of the shares; counts alone of
    all samples where there are no shares.
    """
    rows, single = [], found.attrs["runs"]
    if single and dim == "kind":
        counts = found["kind_samples"].values.T.astype(bool)
        ends = tuple(str(found["kind"].values[own][0]) for own in counts)
        return Table(("", *names_of(found)), [(head, *ends)], left=3)
    for name in found[dim].values if dim in found.dims else ():
        one = {str(n): v.values for n, v in found.sel({dim: name}).items()}
        shares, of = one[f"{word}_share"].tolist(), one[f"{word}_compared"].tolist()
        counts = one[f"{word}_samples"].tolist()
        if np.isfinite(shares).all() and not single:
            each = zip(shares, of, strict=True)
            cells = [f"{round(share * n)} of {n} ({number_text(share, 3)})" for share, n in each]
        else:
            # None of them may be compared: of those that have run on one side alone, for example.
            cells = [
                f"{count} of {n}" if n else str(count) for count, n in zip(counts, of, strict=True)
            ]
        low, high = one[f"{word}_share_difference_interval"].tolist()
        apart = estimate_text(one[f"{word}_share_difference"].item(), low, high, 3)
        verdicts = one.get(f"{word}_verdict_text", np.empty(0)).tolist()
        rows.append((str(name), *cells, apart, interval_text(low, high, 3), *verdicts))
    heads: tuple[str, ...] = (head, *names_of(found), "difference", "95 % interval")
    if f"{word}_verdict_text" in found:
        heads += tuple(f"verdict in {name}" for name in names_of(found))
    columns = 3 if single else len(heads)
    return marked(Table(heads[:columns], [row[:columns] for row in rows]), found)


def _moved(found: xr.Dataset) -> Table:
    """The verdicts on requirements whose limits differ: shares that meet them are of two things."""
    lines = found.attrs["moved"].split("\n") if found.attrs["moved"] else []
    return Table((), (), [f"limits differ: {line}" for line in lines])


def _limits(found: xr.Dataset) -> Table:
    """The worst values of both and their margins to limits, which may differ between the two."""
    rows, names = [], names_of(found)
    for text in found["limit"].values if "limit" in found.dims else ():
        one = found.sel(limit=text)
        values = one["limit_value"].values
        factor, units = readable(
            quantities()[one["limit_output"].item()].units, np.abs(values).max()
        )
        worst = (with_unit(number_text(factor * value), units) for value in values.tolist())
        margins = one["limit_margin"].values.tolist()
        rows.append(
            (str(text), *worst, *(f"{m:+.3g}{': NOT enough' * (m < 0.0)}" for m in margins))
        )
    heads = (f"{what} in {name}" for what in ("worst value", "margin") for name in names)
    return Table(("limit", *heads), rows, left=1)


def _numerical(found: xr.Dataset, names: Sequence[str]) -> list[str]:
    """Which differences numerical errors may have made, as far as error bars tell."""
    within, wider = list[str](), list[str]()
    every = [found[str(name)] for name in found.data_vars if str(name).endswith("_numerical_error")]
    known = any(bool(np.isfinite(each).any()) for each in every)
    for name in names:
        errors = found[f"{name}_numerical_error"].values
        size = float(np.sqrt(np.nansum(errors**2)))
        factor, unit = readable(quantities()[name].units, size)
        sides = zip(names_of(found), np.isfinite(errors), strict=True)
        of = [f", of {side} alone" for side, has in sides if has]
        words = with_unit(number_text(factor * size, 2), unit) + "".join(of[: len(of) == 1])
        interval = found.get(f"{name}_difference_interval", np.array(np.nan))
        if _within(found, name):
            within.append(f"{name} ({words})")
        elif size > 0.5 * float(np.ptp(np.asarray(interval))):
            wider.append(f"{name} ({words})")
    if not names:
        return []
    if not known:
        return [f"numerical errors are not measured in either ({_cure(found)}), and not counted"]
    told = "differences within the numerical errors (root sum of squares of the error bars of both)"
    alone = "intervals are of sampling alone; " * (not found.attrs["runs"])
    more = "differences that numerical errors leave more uncertain than sampling"
    return [f"{told}: {', '.join(within)}"] * bool(within) + [
        *[f"{more}: {', '.join(wider)}"] * bool(wider),
        f"{alone}a numerical error that both runs have alike is not in their difference",
        *_without_bars(found, every),
    ]


def _cure(found: xr.Dataset) -> str:
    return "solver.error_bars" if found.attrs["runs"] else "error_bars_every"


def _without_bars(found: xr.Dataset, every: Sequence[xr.DataArray]) -> list[str]:
    """The side of which no error is known, where the other one has some."""
    return [
        f"{name} has no error bars ({_cure(found)}): its numerical errors are not counted"
        for side, name in enumerate(names_of(found))
        if not any(np.isfinite(each.values[side]) for each in every)
    ]


def _changed(found: xr.Dataset) -> Table:
    """The pairs whose outcome is another one, a row for each two outcomes."""
    changed, pairs = found.sizes["change"], found.attrs["pairs"]
    if not pairs or found.attrs["runs"]:
        return Table((), ())
    if not changed:
        return Table((), (), ["no outcome differs"])
    names = ("changed_outcome_first", "changed_outcome_second", "changed_sample_first")
    alike: dict[tuple[str, str], list[int]] = {}
    for first, second, sample in zip(*(found[name].values for name in names), strict=True):
        alike.setdefault((str(first), str(second)), []).append(int(sample))
    rows = [
        (*ends, str(len(samples)), ", ".join(map(str, samples[:_NAMED])) + ", ..." * (
            len(samples) > _NAMED))
        for ends, samples in alike.items()
    ]  # fmt: skip
    notes = [f"the outcome differs in {changed} of {pairs}"]
    if any(len(samples) > _NAMED for samples in alike.values()):
        notes.append("ringsim compare --out FILE.nc stores all samples")
    both = names_of(found)
    head = (*(f"in {name}" for name in both), "pairs", f"samples of {both[0]}")
    return Table(head, rows, notes, left=4)


def _outputs(found: xr.Dataset) -> tuple[Table, list[str]]:
    """Means of both, their difference with its interval, and the pair that differs most; and the
    outputs of which a note says that they neither differ nor scatter by what tables tell.
    """
    rows, alike, again, flat = [], list[str](), list[str](), dict[str, str]()
    for name, variable in quantities().items():
        if f"{name}_difference" not in found or is_moment(name):
            continue
        first, second = found[f"{name}_mean"].values
        if np.isnan(first) and not found.attrs["pairs"]:
            continue
        counts = found[f"{name}_samples"].values.tolist()
        factor, unit = readable(variable.units, np.nanmax(np.abs([first, second]), initial=0.0))
        first, second = factor * first, factor * second
        apart = factor * found[f"{name}_difference"].item()
        low, high = factor * found[f"{name}_difference_interval"].values
        # That one has none, and how many the other has; or that of no pair both have one.
        where = found.get(f"{name}_largest_difference_sample")
        if not all(counts) or (where is not None and where == -1):
            each = zip((first, second), counts, strict=True)
            cells = [number_text(value) if count else "none" for value, count in each]
            used = " and ".join(map(str, counts))
            rows.append((name, unit_text(unit), *cells, *["-"] * 4, used, *["-"] * 3))
            continue
        largest, place, together = "-", "-", "-"
        if f"{name}_largest_difference" in found:
            most = factor * found[f"{name}_largest_difference"].item()
            if all_alike(*sorted((first, second))) and all_alike(*sorted((first, first + most))):
                value = number_text(first) if abs(first) > NOTHING else "0"
                # Of pairs it is a mean, which need not be the value of any.
                told = f" {value} {unit_text(unit)}".rstrip() * bool(found.attrs["runs"])
                alike.append(f"{name}{told}")
                continue
            size = max(abs(first), abs(second))
            scatter = factor * float(found[f"{name}_spread"].values.max())
            if max(abs(second - first), abs(most), scatter) < _ALIKE * size:
                flat[name] = f"{name} {number_text(first)} {unit_text(unit)}".rstrip()
                continue
            largest = number_text(most)
            place = str(found[f"{name}_largest_difference_sample"].item())
            rank = found[f"{name}_rank_correlation"].item()
            together = "-" if np.isnan(rank) else f"{rank:+.2f}"
        if twin := found[f"{name}_difference"].attrs.get(TWIN):
            again.append(f"{name} is {twin}")
            continue
        rounded = ROUND_OFF * max(abs(first), abs(second))
        if not found.attrs["pairs"] and np.abs([apart, low, high]).max() <= rounded:
            alike.append(f"{name} {number_text(first)} {unit_text(unit)}".rstrip())
            continue
        fine = digits_of(min(first, second), max(first, second))
        rows.append((
            name, unit_text(unit),
            *(estimate_text(mean, low, high, fine) for mean in (first, second)),
            estimate_text(apart, low, high),
            "-" if _is_place(name) or name in MARGINS else _percent(first, second),
            interval_text(low, high),
            _worse(found, name),
            str(counts[0]) if found.attrs["pairs"] else " and ".join(map(str, counts)),
            largest, place, together,
        ))  # fmt: skip
    head = (
        "output" if found.attrs["runs"] else "mean of", "unit", *names_of(found),
        "difference", "in %", "95 % interval", "worse in",
        "samples", "largest difference of a pair", "in sample", "rank correlation of pairs",
    )  # fmt: skip
    columns = 8 if found.attrs["runs"] else len(head)
    same = "the same in each pair" if found.attrs["pairs"] else "the same in all samples of both"
    same = "the same in both" if found.attrs["runs"] else same
    notes = [f"{same}: {', '.join(alike)}"] * bool(alike) + _numerical(found, [r[0] for r in rows])
    both = "in both runs" if found.attrs["runs"] else "in all samples of both"
    notes += [f"{both} {', '.join(again)}"] * bool(again)
    named = ", ".join(flat.values())
    what = "differences" if found.attrs["runs"] else "differences and scatter"
    notes += [f"{what} below {100 * _ALIKE:g} %: {named}"] * bool(flat)
    for name, side in zip(names_of(found), ("first", "second"), strict=True):
        only = found.attrs[f"only_{side}"]
        notes += [f"in {name} alone: {only}"] * bool(only)
    notes += _unlike_ends(found) if rows else []
    table = Table(head[:columns], [row[:columns] for row in rows], notes)
    return marked(table, found), [*flat]


def _unlike_ends(found: xr.Dataset) -> list[str]:
    """That numbers of rings that did not open stand beside those of rings that did."""
    if "kind" not in found.dims:
        return []
    ran = found["kind_samples"].sel(kind=[
        kind for kind in found["kind"].values.tolist()
        if not kind.startswith(LOST) and kind not in (UNKNOWN, NOT_RUN)
    ])  # fmt: skip
    # Rings that did not latch have come all the way.
    goals = [k for k in ran["kind"].values.tolist() if k in (*REACHED, Fate.NOT_LATCHED.words)]
    came = (ran.sel(kind=goals).sum("kind") / ran.sum("kind")).values
    if not np.isfinite(came).all() or came[0] == came[1]:
        return []
    fewer = names_of(found)[int(came.argmin())]
    if found.attrs["runs"]:
        return [f"{fewer} ended before its goal: its numbers tell only how far it came"]
    return [
        f"of {fewer} a larger share of the samples ended before their goal: the numbers of these "
        "tell only how far they came"
    ]


def _is_place(name: str) -> bool:
    """Whether an output is the angle at which another one was, of which no share tells anything."""
    output, angle, _ = name.rpartition("_angle")
    return bool(angle) and output in quantities()


def _percent(first: float, second: float) -> str:
    """The difference in percent of the first; of what may be below zero it would tell nothing."""
    if not (first > NOTHING and second > -NOTHING):
        return "-"
    percent = 100.0 * (second - first) / abs(first)
    return f"{percent:+.3g}" if abs(percent) < _FRACTIONS else f"{percent:+.0f}"


def _within(found: xr.Dataset, name: str) -> bool:
    """Whether the error bars, as far as they are known, may have made a difference."""
    errors = found[f"{name}_numerical_error"].values
    apart = abs(found[f"{name}_difference"].item())
    return bool(np.isfinite(errors).any() and apart <= np.sqrt(np.nansum(errors**2)))


def _worse(found: xr.Dataset, name: str) -> str:
    """In which of the two an output is worse, where the interval of the difference leaves out zero;
    of two runs by the difference itself.  In neither where numerical errors may have made it.
    """
    ends = found[f"{name}_difference_interval"].values
    if found.attrs["runs"]:
        ends = np.full(2, found[f"{name}_difference"].item())
    ends = np.sort(_badness(found, name) * ends)
    first, second = names_of(found)
    size = np.abs(found[f"{name}_mean"].values).max()
    if abs(found[f"{name}_difference"].item()) < _ALIKE * size or _within(found, name):
        return "-"
    return second if ends[0] > 0.0 else first if ends[1] < 0.0 else "-"


def below_a_thousandth(found: xr.Dataset) -> list[str]:
    """Outputs that a note below the table has instead of a row."""
    return _outputs(found)[1]


def differing(found: xr.Dataset) -> Iterator[str]:
    """The outputs that are not the same in both, those first that an engineer fears to be worse."""
    table, flat = _outputs(found)
    every = [*(row[0] for row in table.rows), *flat]
    names = [name for name in every if np.isfinite(found[f"{name}_difference"])]
    yield from sorted(names, key=lambda name: not _badness(found, name))


def _badness(found: xr.Dataset, name: str) -> int:
    joints = np.array(found.attrs["joints"], dtype=float)
    if name in COUNTS and joints.all() and joints[0] != joints[1]:
        # All of fewer V-joints are not fewer: by the share of them that is missing.
        lacks = 1.0 - found[f"{name}_mean"].values / joints
        apart = lacks[1] - lacks[0] if abs(lacks[1] - lacks[0]) > ROUND_OFF else 0.0
        return int(np.sign(apart) * np.sign(found[f"{name}_difference"].item()))
    return int(found[f"{name}_difference"].attrs.get(BADNESS, quantities()[name].badness))
