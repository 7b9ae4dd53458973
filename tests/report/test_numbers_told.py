"""Every number of ``analyse``, of the report and of the closing lines of ``campaign`` is that of
the campaign's file: of campaigns with violations, with lost runs, and with stalls.
"""

from __future__ import annotations

import itertools
import json
import re
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from made_campaign import made_campaign, with_motors

from ringsim.analysis.campaign_notes import notes
from ringsim.analysis.study_text import verdict_lines
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.plots import figures
from told_numbers import (
    FATES,
    LOSSES,
    File,
    agrees,
    area_interval,
    bootstrap,
    bound,
    correlation_interval,
    estimate_agrees,
    interval_agrees,
    quantile_interval,
    share_interval,
)

COUNT = 32
KINDS = {
    "violating": {},
    "lost": {"failed": (2, 5, 11, 30), "stalled": (7,)},
    "stalled": {"failed": (0,), "stalled": (1, 4, 9, 13, 20)},
}
WANTED = {
    "asynchrony_max": {"max": 3.0, "probability": 0.9, "confidence": 0.9},
    "deployment_time": {"max": 11.9, "probability": 0.5, "confidence": 0.9},
    "least_drive_margin": {"min": 0.02, "probability": 0.9, "confidence": 0.8},
    "outcome": {"is": "deployed", "probability": 0.9, "confidence": 0.9},
}


def made(kind: str) -> xr.Dataset:
    """Outputs of a few random inputs, one of which two paths share."""
    found, random = with_motors(made_campaign(COUNT, **KINDS[kind])), np.random.default_rng(11)
    cold, stiff, loose = random.random((3, COUNT))
    gone = found["status"].to_numpy() > 0
    known, deployed = np.isfinite(found["asynchrony_max"]), np.isfinite(found["deployment_time"])
    for name, values in {
        "asynchrony_max": 1.0 + 3.0 * cold**2 + 0.4 * loose + 0.3 * random.random(COUNT),
        "peak_tension": 20.0 + 4.0 * random.normal(size=COUNT),
        "least_drive_margin": 0.6 - 0.9 * cold + 0.2 * random.normal(size=COUNT),
        "energy_error": 1e-5 * (1.0 + random.random(COUNT)),
    }.items():
        # Lost runs have what was computed until then: it must not count.
        values = np.where(gone, 1e3, np.where(known, values, np.nan))
        found[name] = "sample", values, found[name].attrs
    times = np.where(deployed & known, 10.0 + 2.5 * stiff + 0.2 * random.random(COUNT), np.nan)
    found["deployment_time"] = "sample", times, found["deployment_time"].attrs
    found["peak_tension_error"] = 0.01 * found["peak_tension"]
    found["peak_tension_error"].attrs = {"units": "N", "long_name": "error bar"}
    for name in ("least_drive_margin_time", "least_drive_margin_angle", "peak_tension_time"):
        values = np.where(known, 1.0 + random.random(COUNT), np.nan)
        units = "degree" if name.endswith("angle") else "s"
        found[name] = "sample", values, {"units": units, "long_name": name}
    found["peak_tension_plane"] = "sample", np.where(known, "upper", "").astype(object)
    found["peak_tension_span"] = "sample", np.where(known, 1 + np.arange(COUNT) % 3, -1)
    old = [n for n, v in found.data_vars.items() if v.attrs.get("role") == "input"]
    found = found.drop_vars(old)
    law = {"kind": "uniform", "low": 0.0, "high": 1.0}
    both = ["temperature.joint.value", "temperature.pulley.value"]
    for path, own, values, more in (
        (both[0], "cold", cold, {"shared": both}), (both[1], "cold", cold, {"shared": both}),
        ("rods.young_modulus", "rods.young_modulus", 1e11 * (1.0 + stiff), {}),
        ("hinges", "hinges", loose, {}),
    ):  # fmt: skip
        says = {"role": "input", "path": path, "input": own, "units": "m"}
        says["distribution"] = json.dumps(law | more)
        found[path.replace(".", "_")] = "sample", values, says
    found.attrs["requirements"] = json.dumps(WANTED)
    found.attrs["design"] = json.dumps({"kind": "random", "samples": COUNT})
    return found


# Of the second kind one run stalls, too.
@pytest.fixture(
    scope="module",
    params=["violating", "lost", pytest.param("stalled", marks=pytest.mark.slow)],
)
def told(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[File, list[str], str, list[str]]:
    """The file; the lines of analyse, the page, and the closing lines."""
    folder, campaign = tmp_path_factory.mktemp("told"), made(request.param)
    save(campaign, folder / "campaign.nc")
    with pytest.MonkeyPatch.context() as patch:
        few = [each for each in figures.PICTURES if each.name == "by_input"]
        patch.setattr(figures, "PICTURES", few)
        page = folder / "page.html"
        for words in (["analyse", str(folder)], ["report", str(folder), "--out", str(page)]):
            done = CliRunner().invoke(cli, words)
            assert done.exit_code == 0, done.output
            if words[0] == "analyse":
                lines = done.output.splitlines()
    held = xr.load_dataset(folder / "campaign.nc")
    closing = [*notes(held), *verdict_lines(held)]
    return File(folder / "campaign.nc"), lines, page.read_text(), closing


class Tables(HTMLParser):
    """Head and rows of every table of a page, with its id and the heading before it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: dict[str, tuple[str, list[list[str]]]] = {}
        self.heading, self.at, self.texts = "", "", list[str]()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("p", "h3"):
            self.at = tag
            self.texts.append("")
            if tag == "h3":
                self.heading = ""
        if tag == "table":
            self.found[str(dict(attrs)["id"])] = self.heading, []
        if tag == "tr":
            [*self.found.values()][-1][1].append([])
        if tag in ("td", "th"):
            self.at = "cell"
            [*self.found.values()][-1][1][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        if tag in ("td", "th", "p", "h3"):
            self.at = ""

    def handle_data(self, data: str) -> None:
        if self.at == "cell":
            [*self.found.values()][-1][1][-1][-1] += data
        elif self.at:
            self.texts[-1] += data
            if self.at == "h3":
                self.heading += data

    def rows(self, name: str) -> list[dict[str, str]]:
        head, *rows = self.found[name][1]
        return [dict(zip(_unique(head), row, strict=True)) for row in rows]


def _unique(head: list[str]) -> list[str]:
    return [f"{h} {k}" if h in head[:k] else h for k, h in enumerate(head)]


def text_tables(lines: list[str]) -> tuple[dict[str, list[dict[str, str]]], list[str]]:
    """The tables of a terminal by the first words of their heads, and all other lines."""
    found, others, k = dict[str, list[dict[str, str]]](), list[str](), 0
    while k < len(lines):
        if k + 1 < len(lines) and re.fullmatch(r"\s*-+(  +-+)+", lines[k + 1]):
            spans = [m.span() for m in re.finditer(r"-+", lines[k + 1])]
            head = _unique([lines[k][a:b].strip() for a, b in spans])
            rows, k = [], k + 2
            while k < len(lines) and lines[k].strip() and _fits(lines[k], spans):
                cells = [lines[k][a:b].strip() for a, b in spans]
                rows.append(dict(zip(head, cells, strict=True)))
                k += 1
            found[head[0]] = rows
        else:
            others += [lines[k].strip()] * bool(lines[k].strip())
            k += 1
    return found, others


def _fits(line: str, spans: list[tuple[int, int]]) -> bool:
    """Whether a line is a row: nothing of it lies between two columns."""
    gaps = itertools.pairwise(spans)
    return len(line) <= spans[-1][1] and not any(line[a[1] : b[0]].strip() for a, b in gaps)


def outcomes(file: File, rows: list[dict[str, str]]) -> None:
    wanted = {FATES[int(c)] for c in file.values["outcome"][file.ok]}
    wanted |= {f"failed: {LOSSES[int(c)]}" for c in file.values["status"][file.lost]}
    assert {row["outcome"] for row in rows} == wanted
    of = file.ok | file.lost
    run, total, gone = np.flatnonzero(of), int(of.sum()), int(file.lost.sum())
    for row in rows:
        own, _ = file.group(row["outcome"])
        # What lost ones would have done nobody knows: none of them may be of the kind, or all.
        count, more = int(own.sum()), 0 if row["outcome"].startswith("failed") else gone
        assert row["samples"] == f"{count} of {total}" + f" ({more} failed)" * bool(more)
        ends = share_interval(count, total)[0], share_interval(count + more, total)[1]
        estimate_agrees(row["share"], count / total, ends)
        interval_agrees(row["95 % interval"], ends)
        for part in (25, 50, 75):
            first = run[: round(part / 100 * len(run))]
            agrees(row[f"of the first {part} %"], own[first].sum() / of[first].sum())


def verdicts(file: File, rows: list[dict[str, str]], lines: list[str]) -> None:
    wanted = [file.text(name) for name in file.wanted]
    assert [row["requirement"] for row in rows] == wanted
    used, lost = int(file.ok.sum()), int(file.lost.sum())
    for name, row in zip(file.wanted, rows, strict=True):
        level, share = file.wanted[name]["confidence"], file.wanted[name]["probability"]
        bad = int(file.violating(name).sum())
        assert (row["samples used"], row["violating"], row["failed runs"]) == (
            str(used),
            str(bad),
            str(lost),
        )
        agrees(row["share that meets it"], 1 - bad / used)
        agrees(row["probability"], share)
        agrees(row["confidence"], level)

        def word(ends: tuple[float, float], share: float = share) -> str:
            return "met" if ends[0] >= share else "not met" if ends[1] < share else "not yet shown"

        run, worse = used + lost, bad + lost  # lost ones violate it, or keep to it
        ends = bound(run - worse, run, level)[0], bound(run - bad, run, level)[1]
        # Four digits, rounded outwards: what is printed bounds as surely as what was computed.
        outward = zip(("at least", "at most"), ends, (ROUND_FLOOR, ROUND_CEILING), strict=True)
        told = [
            f"{words} {float(Context(prec=4, rounding=way).create_decimal(f'{end:.12g}')):.4g}"
            for words, end, way in outward
        ]
        decisive = {"met": told[0], "not met": told[1], "not yet shown": ", ".join(told)}
        assert row["one-sided bound"] == decisive[word(ends)]
        assert row["verdict"] == word(ends)
        if lost:
            alone = word(bound(used - bad, used, level))
            assert row["verdict without failed runs"] == alone
        many = range(worse + 1, 10_000)
        needed = next(n for n in many if bound(n - worse, n, level)[0] >= share)
        further = needed - run if row["verdict"] == "not yet shown" else 0
        assert row.get("samples to go", "-") == (str(further) if further > 0 else "-")
        if further > 0:
            start = f"{name}: {bad} of {used} violate it so far; " if bad else f"{name}: "
            start += f"{further} further sample"
            assert any(each.startswith(start) for each in lines)
            assert not lost or any(f"if the {lost} failed run" in each for each in lines)
        probable = [each for each in lines if each.startswith(f"{name}: violated with a prob")]
        assert len(probable) == (bad > 0)
        for each in probable:
            numbers = [float(n) for n in re.findall(r"\d[\d.e-]*", each.removeprefix(name))]
            for number, value in zip(numbers, (bad / used, 1 - ends[1], 1 - ends[0]), strict=True):
                assert number == pytest.approx(value, rel=1e-3, abs=1e-12)
        if name == "outcome":
            continue
        absent = int((file.ok & np.isnan(file.values[name])).sum())
        short = file.ok & (file.values["outcome"] != 1) & ~file.violating(name)
        for count, words in (
            (absent, f"{name}: violations without a value (the antenna did not get that far): "),
            (int(short.sum()), f"{name}: "),
        ):
            text = f"{words}{count}" if words.endswith("far): ") else (
                f"{words}{count} of the {used - bad} samples that meet it ended before "
            )  # fmt: skip
            assert any(each.startswith(text) for each in lines) == (count > 0), text


def outputs(file: File, rows: list[dict[str, str]]) -> None:
    """The table of analyse, one row an output."""
    listed = {row["output"] for row in rows}
    assert {"asynchrony_max", "peak_tension", "deployment_time", "least_drive_margin"} <= listed
    for row in rows:
        name = row["output"]
        values, run = file.of(name), int((file.ok | file.lost).sum())
        assert row["samples used"] == (
            str(run) if len(values) == run else f"{len(values)} of {run}"
        )
        assert row["unit"] == ("" if file.units[name] == "1" else file.units[name])
        estimate_agrees(row["mean"], values.mean(), ends_of(row))
        near(row["95 % interval of it"], bootstrap(values, "mean"))
        agrees(row["std. dev."], values.std(ddof=1))
        for word, level in (("5 %", 0.05), ("median", 0.5), ("95 %", 0.95)):
            agrees(row[word], np.quantile(values, level))
        agrees(row["least"], values.min())
        agrees(row["most"], values.max())
        worst = "-" if name.endswith(("_time", "_angle")) and name != "deployment_time" else (
            str(file.worst(name)[0])
        )  # fmt: skip
        assert row["worst sample"] == worst, name


def near(text: str, ends: tuple[float, float], most: float = 0.1) -> None:
    """A bootstrap interval, by another way of drawing.

    The end of 1,999 resamples of a normal one at 99 %, where BCa may look, scatters by 2.1 % of the
    width between 2.5 and 97.5 %: ``most`` is almost five times that.
    """
    found = np.array([float(end) for end in text.split(" .. ")])
    assert np.abs(found - ends).max() < most * np.ptp(ends), (text, ends)


def matters(file: File, rows: list[dict[str, str]]) -> None:
    output = ""
    assert rows
    for row in rows:
        output, name = row["what matters for"] or output, row["input"]
        plain, count = file.correlation(output, name)
        for cell, value, held in (
            (row.get("rank correlation", "-"), plain, 0),
            (row["partial rank correlation"], file.partial(output, name), len(file.inputs) - 1),
        ):
            if cell == "-":
                continue
            number, _, ends = cell.partition(" (")
            assert abs(float(number) - value) < 0.0051
            interval_agrees(
                ends.rstrip(")") or "-", correlation_interval(value, count, held), digits=2
            )
    assert {row["input"] for row in rows} <= set(file.inputs)
    assert ("asynchrony_max", "cold") in {(r["what matters for"], r["input"]) for r in rows}


def separates(file: File, rows: list[dict[str, str]]) -> None:
    words = ""
    for row in rows:
        words = row["what separates"] or words
        group, count = re.fullmatch(r"(.*) \((\d+)\)", words).groups()
        area, inside, outside = file.area(group, row["input"])
        assert int(count) == inside
        directed(area, inside, outside, row)


def directed(area: float, inside: int, outside: int, row: dict[str, str]) -> None:
    """Larger or smaller, in so many of all pairs, in percent."""
    word, share = re.fullmatch(
        r"(\w+) in (\S+) % of pairs", row["compared with other samples"]
    ).groups()
    assert word == ("larger" if area >= 0.5 else "smaller")
    area = max(area, 1.0 - area)
    agrees(share, 100.0 * area, digits=3)
    ends = tuple(100.0 * end for end in area_interval(area, inside, outside))
    interval_agrees(row["95 % interval"], ends, digits=3)


def errors(file: File, rows: list[dict[str, str]]) -> None:
    for row in rows:
        values = file.of(row["error of the mean of"])
        sampling = values.std(ddof=1) / len(values) ** 0.5
        agrees(row["sampling (standard error)"], sampling, digits=2)
        if row["error of the mean of"] == "peak_tension":
            bars = np.sqrt(np.mean((0.01 * values) ** 2))
            agrees(row["numerical (error bars)"], bars, digits=2)
            assert row["samples with bars"] == str(len(values))
            most, sample = re.fullmatch(r"(\S+) \(sample (\d+)\)", row["largest bar"]).groups()
            agrees(most, 0.01 * values.max(), digits=2)
            assert file.values["peak_tension"][int(sample)] == values.max()
            larger = "numerical" if bars > sampling else "sampling"
            assert row["dominates"] == larger
    assert "peak_tension" in {row["error of the mean of"] for row in rows}


def worst_sample(
    file: File, words: str, sample: int, value: str, odd: str, seen: list[int]
) -> None:
    """What is told of one of the worst samples, of which ``seen`` have been told before."""
    names = [n for n in file.wanted if file.text(n) in words and n != "outcome"]
    own, _ = file.group(words)
    assert own[sample]
    if names and np.isfinite(file.values[names[0]][sample]):
        (name,) = names
        agrees(value.split()[0], file.values[name][sample])
        # Each requirement here has the bound at the end that is the worse one.
        assert sample == [s for s in file.worst(name, COUNT) if own[s]][len(seen)]
    for each in odd.split("; ") if odd != "nothing unusual" else ():
        name, number, far, end = re.fullmatch(
            r"(\S+) (\S+) m \(([^,]*)(, the lowest|, the highest)?\)", each
        ).groups()
        column = file.input(name)
        agrees(number, column[sample])
        agrees(far.removesuffix(" %").lstrip("+"), 100.0 * (column[sample] / np.median(column) - 1),
               digits=1) if far.endswith("%") else agrees(
            far.split()[0], column[sample] / np.median(column), digits=2)  # fmt: skip
        extremes = {", the lowest": column.min(), ", the highest": column.max()}
        assert (end in extremes) == (column[sample] in extremes.values())
        assert min((column <= column[sample]).mean(), (column >= column[sample]).mean()) <= 0.2


def heads(file: File, text: str) -> str:
    words, count, of = re.fullmatch(r"(.*) \((\d+) of (\d+) samples?\)", text).groups()
    own, _ = file.group(words)
    assert (int(count), int(of)) == (int(own.sum()), int((file.ok | file.lost).sum()))
    return words


def failing(file: File) -> int:
    """In how many ways samples failed, those of the same samples without a value taken as one."""
    groups = [file.group(w) for w in ("stalled", "failed: timeout")]
    found = {own.tobytes() for own, _ in groups if own.any()}
    return len(
        found | {file.violating(n).tobytes() for n in file.wanted if file.violating(n).any()}
    )


def limits(file: File, rows: list[dict[str, str]]) -> None:
    """The scene has no limit of a load, but a drive margin."""
    (row,) = rows
    sample = file.worst("least_drive_margin")[0]
    least = file.values["least_drive_margin"][sample]
    assert (row["limit"], row["in sample"]) == ("least_drive_margin >= 0", str(sample))
    agrees(row["margin"].partition(":")[0], least, digits=3)
    assert row["margin"].endswith(": NOT enough") == (least < 0.0)


CHECKS = {
    "limit": limits, "outcome": outcomes, "output": outputs, "error of the mean of": errors,
    "what matters for": matters, "what separates": separates,
    "error of the solution": lambda file, rows: balance(file, rows),
}  # fmt: skip
"""What checks the rows of a table, by the head of its first column."""


def test_analyse_says_what_the_file_holds(told: tuple[File, list[str], str, list[str]]) -> None:
    file, lines, _, _ = told
    tables, others = text_tables(lines)
    assert (
        {"outcome", "output", "what matters for", "requirement"}
        <= tables.keys()
        <= {*CHECKS, "requirement"}
    )
    for name, rows in tables.items():
        if name == "requirement":
            verdicts(file, rows, others)
        else:
            CHECKS[name](file, rows)
    words, seen, ways = "", list[int](), 0
    for k, line in enumerate(others):
        if line.startswith("worst of: "):
            words, seen, ways = heads(file, line.removeprefix("worst of: ")), [], ways + 1
        elif match := re.fullmatch(r"sample (\d+): (.*)", line):
            sample, odd = int(match[1]), others[k + 1].removeprefix("inputs: ")
            worst_sample(file, words, sample, match[2], odd, seen)
            assert re.fullmatch(rf"ringsim replay \S+ {sample}", others[k + 2])
            seen.append(sample)
    assert ways == failing(file)
    assert others[0].endswith(f": {COUNT} samples, design random")


def test_the_report_says_what_the_file_holds(told: tuple[File, list[str], str, list[str]]) -> None:
    file, _, text, _ = told
    page = Tables(text)
    texts = [" ".join(each.split()) for each in page.texts]
    count = int(file.ok.sum())
    counted = f"{count} of {COUNT} samples are in the statistics"
    counted = "All samples have valid results" if count == COUNT else counted
    assert any(counted in each for each in texts)
    known = {"model-table", "inputs-table", "failures-table"}
    for name in page.found:
        if name.startswith("worst-table"):
            words = heads(file, page.found[name][0][0].lower() + page.found[name][0][1:])
            seen = list[int]()
            for row in page.rows(name):
                sample, odd = int(row["sample"]), row["unusual inputs"]
                worst_sample(file, words, sample, row["found"], odd, seen)
                assert row["run it again"].endswith(f" {sample}")
                assert row["player"] in (f"show {sample}", "-")
                seen.append(sample)
        elif page.found[name][1][0][0] == "requirement":
            verdicts(file, page.rows(name), texts)
        elif name.startswith("every-matters-table"):
            measures(file, page.rows(name))
        elif name == "every-statistics-table2":
            statistics(file, page.rows(name))
        else:
            heads_of = {row: of for row, of in CHECKS.items() if row in page.found[name][1][0]}
            assert heads_of or name in known, name
            for check in heads_of.values():
                check(file, page.rows(name))
    assert sum(name.startswith("worst-table") for name in page.found) == failing(file)
    assert [row["Input"] for row in page.rows("inputs-table")] == [*file.inputs]
    for row in page.rows("inputs-table"):
        extent = np.sort(file.input(row["Input"]))[[0, -1]]
        for end, value in zip(row["Drawn"].split(" to "), extent, strict=True):
            agrees(end, value, digits=5)
    short = {int(k) for k in np.flatnonzero(file.lost | (file.values["outcome"] == 3))}
    rows = page.rows("failures-table") if "failures-table" in page.found else []
    ended = [k for row in rows for k in row["Samples"].partition(" ")[2].split(", ")]
    # Those whose end the tables of the worst tell are not told again.
    worst = [name for name in page.found if name.startswith("worst-table")]
    ended += [row["sample"] for name in worst for row in page.rows(name)]
    assert short <= {*map(int, ended)}
    assert {int(k) for row in rows for k in row["Samples"].partition(" ")[2].split(", ")} <= short
    reached = any("No run ended short of its goal" in each for each in texts)
    assert reached == (not short)
    kept = any("keeps to all requirements" in each for each in texts)
    assert kept == (not short and not any(file.violating(n).any() for n in file.wanted))


def ends_of(row: dict[str, str]) -> tuple[float, float]:
    """The interval that a row tells."""
    ends = row.get("95 % interval", row.get("95 % interval of it", "-"))
    low, high = ends.split(" .. ") if " .. " in ends else ("nan",) * 2
    return float(low), float(high)


def statistics(file: File, rows: list[dict[str, str]]) -> None:
    """The table with a row a statistic."""
    assert {"mean", "standard deviation", "minimum"} <= {row["statistic"] for row in rows}
    for row in rows:
        name, word = row["output"], row["statistic"]
        values = file.of(name)
        levels = {"quantile 05": 0.05, "median": 0.5, "quantile 95": 0.95}
        if word in levels:
            estimate_agrees(row["estimate"], np.quantile(values, levels[word]), ends_of(row))
            interval_agrees(row["95 % interval"], quantile_interval(values, levels[word]))
        elif word in ("mean", "standard deviation"):
            # Of the spread there are several good intervals, which differ by their ends' tails.
            of, most = ("mean", 0.1) if word == "mean" else ("std", 0.4)
            value = values.mean() if word == "mean" else values.std(ddof=1)
            estimate_agrees(row["estimate"], value, ends_of(row))
            near(row["95 % interval"], bootstrap(values, of), most)
        else:
            end, sample = values.min() if word == "minimum" else values.max(), int(row["in sample"])
            agrees(row["estimate"], end)
            assert file.values[name][sample] == end
            assert file.ok[sample]
            assert (row["its error bar"] != "-") == (name == "peak_tension")
            if name == "peak_tension":
                agrees(row["its error bar"], 0.01 * end, digits=2)
        if word not in ("minimum", "maximum"):
            assert row["in sample"] == row["its error bar"] == "-"
        assert row["samples used"] == str(len(values))
        assert row["failed runs"] == str(file.lost.sum())
        assert row["no value"] == str(file.ok.sum() - len(values))


def balance(file: File, rows: list[dict[str, str]]) -> None:
    """Errors of the solution itself."""
    for row in rows:
        name = next(n for n, words in file.words.items() if words == row["error of the solution"])
        values = file.of(name)
        agrees(row["median"], np.median(values), digits=2)
        most, sample = re.fullmatch(r"(\S+) \(sample (\d+)\)", row["largest"]).groups()
        agrees(most, values.max(), digits=2)
        assert file.values[name][int(sample)] == values.max()
        assert row["samples"] == str(len(values))


def measures(file: File, rows: list[dict[str, str]]) -> None:
    """All rank correlations, or all areas of groups."""
    for row in rows:
        first, *cells = row.values()
        if "rank correlation" in row:
            output, name = first.split(" with ")
            plain, count = file.correlation(output, name)
            partial, held = file.partial(output, name), len(file.inputs) - 1
            agrees(cells[0], plain, digits=2)
            interval_agrees(cells[1], correlation_interval(plain, count, 0), digits=2)
            agrees(cells[2], partial, digits=2)
            interval_agrees(cells[3], correlation_interval(partial, count, held), digits=2)
            assert cells[4] == str(count)
        else:
            words, name = first.rsplit(": ", 1)
            area, inside, outside = file.area(words, name)
            directed(area, inside, outside, row)
            assert row["samples"] == str(inside)


def test_the_closing_lines_of_a_campaign_say_it(
    told: tuple[File, list[str], str, list[str]],
) -> None:
    file, _, _, lines = told
    tables, others = text_tables(lines)
    verdicts(file, tables["requirement"], others)
    run, peaks = int((file.ok | file.lost).sum()), set[str]()
    for line in others:
        if match := re.match(r"(deployed|stalled|timeout): (\d+) of (\d+)(.*)", line):
            word = f"failed: {match[1]}" if match[1] == "timeout" else match[1]
            own, _ = file.group(word)
            assert (int(match[2]), int(match[3])) == (int(own.sum()), run)
            named = re.search(r"samples? (\d+(?:, \d+)*)", match[4])
            assert named is None or all(own[int(k)] for k in named[1].split(", "))
        elif match := re.match(r"(.*) in sample (\d+): +(\S+)", line):
            name = {"largest tension": "peak_tension", "least drive margin": "least_drive_margin"}
            sample = int(match[2])
            assert sample == file.worst(name[match[1]])[0]
            agrees(match[3], file.values[name[match[1]]][sample], digits=3)
            extra = re.search(r"at (\S+) deg and (\S+) s", line) or re.search(r"at (\S+) s", line)
            ends = ["_angle", "_time"] if len(extra.groups()) == 2 else ["_time"]
            for text, end in zip(extra.groups(), ends, strict=True):
                agrees(text, file.values[name[match[1]] + end][sample])
            enough = file.values["least_drive_margin"][sample] >= 0.0
            assert match[1] != "least drive margin" or ("NOT enough" in line) != enough
            peaks.add(match[1])
    assert peaks == {"largest tension", "least drive margin"}
