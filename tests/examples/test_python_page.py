"""The blocks of docs/guide/python.md run as they stand, as one script without a main guard."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import preloaded
import pytest
from click.testing import CliRunner
from scipy.io import loadmat

from ringsim.cli import cli
from ringsim.plots import animation, figures

ONE_PICTURE = tuple(one for one in figures.PICTURES if one.name == "distributions")

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "guide" / "python.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "page.py").write_text("\n".join(blocks("python")), encoding="utf-8")

    def lines(done: subprocess.CompletedProcess[str]) -> list[str]:
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    printed = lines(preloaded.script(tmp_path / "page.py", folder=tmp_path))
    assert printed[0] == "all V-joints have reached 180 deg"
    assert float(printed[1]) > 0.0
    assert "8 of 8 samples are ok" in printed
    assert any(line.startswith("deployed") for line in printed)
    assert re.fullmatch(r"(upper|lower) [1-4]", printed[-2])
    low, high = map(float, printed[-1].strip("[]").split())
    assert 0.0 < low < high

    monkeypatch.chdir(tmp_path)
    # All figures and frames have tests of their own.
    monkeypatch.setattr(figures, "PICTURES", ONE_PICTURE)
    monkeypatch.setattr(animation, "FRAMES", 2)
    (commands,) = blocks("sh")
    *others, replay = (command.split()[1:] for command in commands.splitlines())
    for words in others:
        done = CliRunner().invoke(cli, words)
        assert done.exit_code == 0, done.output
    told = lines(preloaded.ringsim(*replay, folder=tmp_path))
    assert told[-1] == "identical to the stored result"
    assert (tmp_path / "tables" / "campaign-sample.csv").exists()
    assert loadmat(tmp_path / "tables" / "campaign.mat")["status"].ravel().tolist() == [0] * 8
    assert (tmp_path / "paraview" / "campaign-sample0.pvd").exists()
    assert list((tmp_path / "figures").glob("campaign-sample*.gif"))
