"""``ringsim stability --quick`` from the command to its files."""

from __future__ import annotations

import re

import pytest
import xarray as xr
from click.testing import CliRunner

from ringsim.analysis.stability import ENDED, OK
from ringsim.cli import cli


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    out = tmp_path_factory.mktemp("stability") / "map"
    done = CliRunner().invoke(
        cli, ["stability", "--quick", "--out", str(out), "--workers", "2"], standalone_mode=False
    )
    assert done.exception is None
    assert done.return_value == 0, done.output
    return out, done.output


def told(output: str) -> list[str]:
    """The line of counts."""
    return [line for line in output.splitlines() if " cells in " in line]


def test_every_cell_is_ok_or_ended_with_a_cause(quick) -> None:
    with xr.open_dataset(quick[0] / "stability.nc") as found:
        assert found.sizes["cell"] == 12
        verdicts = found["verdict"].values.astype(str)
        assert set(verdicts) == {OK, ENDED}
        causes = found["cause"].values.astype(str)
        assert "end time" in causes
        assert all((verdicts == OK) == (causes == ""))
        assert (found["check"].values.astype(str) == "holds").sum() >= 1


def test_text_and_figure_are_written(quick) -> None:
    out, said = quick
    assert re.search(r"12 cells in 2 groups: \d+ ended, \d+ ok", said)
    assert "## Borders" in (out / "stability.md").read_text(encoding="utf-8")
    assert (out / "stability.png").read_bytes().startswith(b"\x89PNG")


def test_the_same_command_goes_on_without_running_anything_again(quick) -> None:
    out, said = quick
    stamps = {path: path.stat().st_mtime_ns for path in out.glob("*/*/journals/*")}
    again = CliRunner().invoke(
        cli, ["stability", "--quick", "--out", str(out)], standalone_mode=False
    )
    assert again.return_value == 0
    assert told(again.output) == told(said)
    assert stamps
    assert {path: path.stat().st_mtime_ns for path in out.glob("*/*/journals/*")} == stamps
