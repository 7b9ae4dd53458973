"""``ringsim explain`` names every variable with its codes, and refuses what is none."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

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
    # A word that is a key, too, is told as both.
    assert "clock: offset and drift" in explain("clock")
    assert "clock (measured file)" in explain("clock")


def test_no_word_of_tables_hides_a_variable() -> None:
    assert not WORDS.keys() & VARIABLES.keys()
