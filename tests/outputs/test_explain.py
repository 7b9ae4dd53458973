"""``ringsim explain`` names every variable with its codes, and refuses what is none."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner
from made_campaign import made_campaign, with_motors

from ringsim.analysis import comparison_text
from ringsim.analysis import study_text as study
from ringsim.analysis.comparison import compare
from ringsim.analysis.study import analyse
from ringsim.cli import cli
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME
from ringsim.reference import WORDS

pytestmark = pytest.mark.quick


def explain(*names: str) -> str:
    return CliRunner().invoke(cli, ["explain", *names]).output


def test_every_variable_is_explained() -> None:
    lines = explain().splitlines()
    assert [line.partition("(")[0] for line in lines] == [*COORDINATES, SPAN_NAME.name, *VARIABLES]


def test_a_variable_has_units_meaning_and_needs() -> None:
    words = explain("peak_tension_error")
    assert " N " in words
    assert "numerical error bar of the largest tension" in words
    assert "only with error bars, cables" in words


def test_codes_have_words() -> None:
    assert "2 solver_failed" in explain("status")
    assert "10 step_limit" in explain("cause")


def test_an_unknown_name_is_refused_with_the_nearest() -> None:
    found = CliRunner().invoke(cli, ["explain", "asynchronie"])
    assert found.exit_code == 2
    assert "asynchrony" in found.output


def test_names_beside_an_unknown_one_are_explained() -> None:
    found = CliRunner().invoke(cli, ["explain", "nonsense", "status", "solver.step", "nought"])
    assert found.exit_code == 2
    assert found.stdout == explain("status") + explain("solver.step")
    first, second = found.stderr.splitlines()
    assert first.startswith("nonsense: neither a key")
    assert second.startswith("nought: neither a key")


def test_words_of_tables_are_explained() -> None:
    assert explain("Samples to go").startswith("samples to go: how many more samples")
    assert explain("posteriors").startswith("posterior: what is known")
    # A head of a table is told without what it is of.
    for head, known in (
        ("verdict in flight", "verdict"), ("sampling (standard error)", "sampling"),
        ("error of the mean of", "error of the mean"), ("95 % interval of it", "interval"),
        ("of the first 25 %", "of the first"), ("95 %", "quantile"),
    ):  # fmt: skip
        assert explain(head).startswith(f"{known}: {WORDS[known]}")
    for unknown in ("lock", "flag", "maxdifference", "amping", "wors"):  # near another word
        assert CliRunner().invoke(cli, ["explain", unknown]).exit_code == 2, unknown
    # A word that is a key, too, is told as both.
    assert "clock: offset and drift" in explain("clock")
    assert "clock (measured file)" in explain("clock")


def test_every_head_of_the_tables_of_campaigns_is_explained() -> None:
    """Of an analysis and of a comparison, but names of campaigns, and words that say what is below
    them.
    """
    made = with_motors(made_campaign(24, stalled=(1, 4, 7)))
    wanted = {"max": 3.0, "probability": 0.9, "confidence": 0.9}
    made.attrs["requirements"] = json.dumps({"asynchrony_max": wanted})
    found = analyse(made)
    parts = [
        *study.sections(found).values(),
        *comparison_text.sections(compare(made, made)).values(),
    ]
    tables = [t for part in parts for t in (*part.tables, *getattr(part, "more", ()))]
    heads = {head for table in tables for head in table.head if head}
    plain = {"first", "second", "in sample", "found", "from -> to", "its", "largest", "of"}
    plain |= {"run it again", "margin in first", "margin in second"}
    assert len(heads) > 50
    for head in heads - plain:
        assert CliRunner().invoke(cli, ["explain", head]).exit_code == 0, head


def test_no_word_of_tables_hides_a_variable() -> None:
    assert not WORDS.keys() & VARIABLES.keys()
