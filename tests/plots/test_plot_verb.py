"""``ringsim plot FILE`` and the formats of figures."""

from __future__ import annotations

from fnmatch import fnmatch
from pathlib import Path

import pytest
import xarray as xr
from click.testing import CliRunner, Result

from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.plots import figures as pictures
from ringsim.refusal import EXIT_BAD_INPUT, EXIT_DONE

ROOT = Path(__file__).parents[2]
STARTS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


def ringsim(*words: str) -> Result:
    return CliRunner().invoke(cli, list(words))


@pytest.fixture
def file(failed: xr.Dataset, tmp_path: Path) -> Path:
    save(failed, tmp_path / "ring6.nc")
    return tmp_path / "ring6.nc"


@pytest.fixture
def _two_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    few = [each for each in pictures.PICTURES if each.name in ("ring", "energy")]
    monkeypatch.setattr(pictures, "PICTURES", few)


@pytest.fixture
def _stresses(monkeypatch: pytest.MonkeyPatch) -> None:
    few = [each for each in pictures.PICTURES if each.name in ("energy", "rod_stress")]
    monkeypatch.setattr(pictures, "PICTURES", few)


@pytest.mark.usefixtures("_two_figures")
def test_figures_of_a_file_have_the_formats_asked_for(file: Path) -> None:
    done = ringsim("plot", str(file), "--plot-format", "pdf,svg,PNG")
    assert done.exit_code == EXIT_DONE, done.output
    written = [Path(line.removeprefix("wrote ")) for line in done.output.splitlines()]
    assert len(written) == 3 * 2
    for path in written:
        assert path.read_bytes().startswith(STARTS[path.suffix[1:]])
        assert path.name.startswith("ring6-fig-")


def test_git_ignores_all_figures(file: Path) -> None:
    ignored = (ROOT / ".gitignore").read_text().splitlines()
    for kind in STARTS:
        assert any(fnmatch(f"ring6-fig-energy.{kind}", pattern) for pattern in ignored)


@pytest.mark.usefixtures("_two_figures")
def test_figures_are_png_beside_the_file_or_in_the_folder_asked_for(file: Path) -> None:
    assert ringsim("plot", str(file), "--out", str(file.parent / "new")).exit_code == EXIT_DONE
    names = {path.name for path in (file.parent / "new").iterdir()}
    assert "ring6-fig-ring.png" in names
    assert {Path(name).suffix for name in names} == {".png"}


@pytest.mark.parametrize(("text", "words"), [
    ("svgz", "--plot-format svgz: 'svgz' is not a figure format (did you mean svg?)"),
    ("png,", "--plot-format png,: '' is not a figure format (known: png, svg, pdf)"),
])  # fmt: skip
def test_an_unknown_format_is_refused(text: str, words: str, file: Path) -> None:
    for verb in (["plot", str(file)], ["run", "ring18", "--plot"]):
        done = ringsim(*verb, "--plot-format", text)
        assert (done.exit_code, done.stderr.strip()) == (EXIT_BAD_INPUT, words)


def test_a_format_without_figures_is_refused(tmp_path: Path) -> None:
    done = ringsim("run", "ring18", "--plot-format", "svg", "--out", str(tmp_path / "a.nc"))
    words = "--plot-format svg: has no effect without --plot; give both"
    assert (done.exit_code, done.stderr.strip()) == (EXIT_BAD_INPUT, words)


def test_files_that_hold_no_run_are_refused(file: Path, failed: xr.Dataset) -> None:
    campaign, text, other = (file.with_name(name) for name in ("campaign.nc", "a.nc", "b.nc"))
    save(failed[["status"]].expand_dims(sample=3), campaign)
    text.write_text("no netCDF")
    xr.Dataset({"x": 1.0}).to_netcdf(other)
    for path, words in (
        (campaign, "has neither a run nor a campaign: give a file that ringsim run or ringsim"),
        (text, "cannot be read as a netCDF file: "),
        (other, "has neither a run nor a campaign: give a file that"),
        (file.with_name("c.nc"), "there is no such file or folder"),
    ):
        done = ringsim("plot", str(path))
        assert done.exit_code == EXIT_BAD_INPUT
        assert done.stderr.startswith(f"{path}: {words}")
        assert len(done.stderr.splitlines()) == 1


SHORT = ("--set", "structure.sections=3", "--set", "boom=none", "--set", "solver.end_time=0.5")
HINT = "figures of stress need --set record.stress=true"


@pytest.mark.usefixtures("_stresses")
@pytest.mark.parametrize("more", [(), ("--set", "record.stress=true")], ids=["as it is", "stress"])
def test_plotting_does_not_change_what_is_computed(tmp_path: Path, more: tuple[str, ...]) -> None:
    for name, plot in (("plain", ()), ("drawn", ("--plot",))):
        words = [*SHORT, *more, *plot, "--fidelity", "frame", "--out", str(tmp_path / f"{name}.nc")]
        done = ringsim("run", "ring18", *words)
        assert done.exit_code == EXIT_DONE, done.output
        assert (done.output.splitlines()[-1] == HINT) == (bool(plot) and not more)
    plain, drawn = (xr.load_dataset(tmp_path / f"{name}.nc") for name in ("plain", "drawn"))
    timings = ["wall_time", "cpu_time"]
    xr.testing.assert_equal(plain.drop_vars(timings), drawn.drop_vars(timings))
    assert (tmp_path / "drawn-fig-rod_stress.png").exists() == bool(more)


@pytest.mark.usefixtures("_stresses")
def test_what_has_no_stress_to_draw_is_not_told_how(tmp_path: Path) -> None:
    out = str(tmp_path / "run.nc")
    done = ringsim("run", "ring18", *SHORT, "--set", "rods.kind=ancf", "--plot", "--out", out)
    assert done.exit_code == EXIT_DONE, done.output
    assert HINT not in done.output
