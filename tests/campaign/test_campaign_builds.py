"""What was run with other inputs or by another build is refused, never taken for one's own."""

from __future__ import annotations

import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import netCDF4
import pytest

from campaign_bench import START, Bench, journals, opened
from ringsim import build
from ringsim.campaign.folder import open_folder
from ringsim.refusal import InputError
from ringsim.storage.journal import Journal, read_journal, survey

SHIFTED = ("low = 0.01, high = 0.05", "low = 0.02, high = 0.05")


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """The same campaign but for one limit of a distribution, finished: same seed, scene, paths."""
    bench = Bench(tmp_path_factory.mktemp("other"))
    file = bench.write()
    file.write_text(file.read_text().replace(*SHIFTED))
    bench.run(*START)
    return bench


def assert_refused(bench, *words):
    (line,) = bench.run(*words, code=2).splitlines()
    assert "was run with other inputs than design.nc of this folder gives" in line
    assert "take that file out of the folder" in line


@pytest.mark.parametrize("verb", [START, ("status", "out"), ("merge", "out"), ("replay", "out", 0)])
def test_journals_of_other_inputs_are_refused(verb, copied, other):
    """All else is the same: their samples were told as done, with the numbers of other inputs."""
    for path in journals(copied):
        path.unlink()
    for path in journals(other):
        shutil.copy(path, copied.folder / "out" / "journals")
    assert_refused(copied, *verb)


@pytest.mark.parametrize("verb", [("status", "out"), (*START, "--retry-failed")])
def test_a_swapped_design_is_refused(verb, copied, other):
    shutil.copy(other.folder / "out" / "design.nc", copied.folder / "out" / "design.nc")
    assert_refused(copied, *verb)


def test_every_value_and_the_sample_number_count(copied):
    """Records of other samples of the same campaign, and of one more pulley, are others, too."""
    folder = (copied.folder / "out") / "journals"
    design = copied.folder / "out" / "design.nc"
    with netCDF4.Dataset(design, "a") as file:
        values = file["rods_young_modulus"]
        values[3, 5] = values[3, 5] * (1.0 + 1e-15)
    assert_refused(copied, "merge", "out")
    with pytest.raises(InputError, match=r"sample 0 .*\(20 records of other runs"):
        survey(folder.parent, ["another"] * 20)


@pytest.mark.parametrize("again", [(), ("--retry-failed",)])
def test_a_folder_that_another_build_began_is_refused_with_both_names(again, copied):
    with netCDF4.Dataset(copied.folder / "out" / "design.nc", "a") as design:
        design.setncatts(
            {"sources": "0123456789ab", "git_commit": "fade", "ringsim_version": "9.9"}
        )
    (line,) = copied.run(*START, *again, code=2).splitlines()
    assert "ringsim 9.9 (sources 0123456789ab, commit fade) began this campaign" in line
    assert (
        f"you run ringsim {build.provenance()['ringsim_version']} (sources {build.sources()}"
        in line
    )
    assert "choose another folder with --out" in line


def test_a_replay_by_another_build_says_so(copied):
    """A sample that differs may differ because of that."""
    folder = open_folder(copied.folder / "out")
    folder.attributes["sources"] = "0123456789ab"
    with netCDF4.Dataset(folder.path / "design.nc", "a") as design:
        design.sources = "0123456789ab"
    (path,) = journals(copied)
    new = Journal(folder.path, "all-rank0")
    for *_, result in read_journal(path):
        new.append(replace(result, run_with=folder.run_with[result.sample]))
    path.unlink()
    printed = copied.run("replay", "out", 0)
    assert "(sources 0123456789ab" in printed.splitlines()[0]
    assert "identical to the stored result" in printed


def test_a_folder_that_names_no_build_is_refused(copied):
    with netCDF4.Dataset(copied.folder / "out" / "design.nc", "a") as design:
        design.delncattr("sources")
    assert "an older version of ringsim began this campaign" in copied.run(*START, code=2)


def test_a_version_that_changed_with_a_figure_goes_on(copied):
    """The sources that make results decide, not the version or the commit."""
    with netCDF4.Dataset(copied.folder / "out" / "design.nc", "a") as design:
        design.setncatts({"git_commit": "fade", "ringsim_version": "9.9"})
    assert "20 of 20 samples done" in copied.run(*START)
    copied.run("merge", "out")
    merged = opened(copied.folder / "out" / "campaign.nc").attrs
    assert (merged["ringsim_version"], merged["git_commit"]) == ("9.9", "fade")  # who ran it
    assert merged["sources"] == build.sources()


def test_what_is_left_out_of_the_sources_lies_above_the_simulation() -> None:
    """And so no result can depend on it: the import contracts see to that."""
    root = Path(__file__).parents[2]
    contracts = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers = next(each["layers"] for each in contracts["contracts"] if "layers" in each)
    above = layers[: layers.index("(simulation)")]
    rooms = {word.strip(" ()") for layer in above for word in layer.replace(":", "|").split("|")}
    names = {name if (build.ROOT / name).is_dir() else f"{name}.py" for name in rooms}
    assert set(build.AROUND) == names | {"__main__.py"}


def test_the_digest_is_that_of_a_copy_and_sees_every_byte(tmp_path, monkeypatch):
    mine, digest = build.sources(), build.sources.__wrapped__
    copy = tmp_path / "site-packages" / "ringsim"
    ignored = shutil.ignore_patterns("__pycache__", "plots", "*.toml")
    shutil.copytree(build.ROOT, copy, ignore=ignored)
    monkeypatch.setattr(build, "ROOT", copy)
    assert digest() == mine
    law = copy / "cable" / "chain.py"
    law.write_bytes(law.read_bytes() + b"\n")
    assert digest() != mine
