"""What README and pages tell users to type works: commands, scripts, campaigns, links."""

from __future__ import annotations

import contextlib
import math
import re
import shlex
import tomllib
from pathlib import Path

import preloaded
import pytest
import tomli_w
from click.testing import CliRunner
from loops import for_each

from pages import PAGES, ROOT, blocks, calls
from ringsim.campaign.specification import Budget, Specification, Stages, campaign_of
from ringsim.cli import VERBS, cli, command_of
from ringsim.measured import Measured
from ringsim.plots import figures
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene

WISHES = (ROOT / "docs" / "i_want_to.md").read_text(encoding="utf-8")
EVIDENCE = [page for page in PAGES if "evidence" in page.parts and page.stem != "index"]
SCENES = sorted(path.stem for path in (ROOT / "ringsim" / "scenes").glob("*.toml"))
TUTORIAL = ROOT / "docs" / "tutorial.md"
CALLS = [
    pytest.param(call, id=f"{page.relative_to(ROOT)}: {' '.join(call)[:60]}")
    for page in PAGES for text in blocks(page, "sh") for call in calls(text)
]  # fmt: skip
SCRIPTS = [
    ROOT / "README.md",
    ROOT / "docs" / "guide" / "commands.md",
    ROOT / "docs" / "guide" / "controllers.md",
    ROOT / "docs" / "howto" / "own_structure.md",
    ROOT / "docs" / "howto" / "go_on.md",
]


@pytest.mark.quick
@for_each("call", CALLS)
def test_commands_and_their_options_exist(call: list[str]) -> None:
    verb, *arguments = call
    assert verb in VERBS
    command = command_of(verb)
    arguments = [each.strip("[]").split("|")[0] for each in arguments if each != "|"]
    command.make_context(verb, arguments).close()


def test_listings_in_toml_are_files_that_are_taken() -> None:
    """All have keys of one kind of file; what belongs to a campaign makes one, with some scene."""
    kinds = [{*Specification.model_fields, *more.model_fields} for more in (Stages, Budget)]
    kinds += [{*Scene.model_fields}, {*Measured.model_fields}]
    count = 0
    for page in PAGES:
        for text in blocks(page, "toml"):
            table, count = tomllib.loads(text), count + 1
            assert any(table.keys() <= known for known in kinds), (page, table.keys())
            campaign = table.keys() <= Specification.model_fields.keys()
            if not campaign or table.keys() <= Scene.model_fields.keys():
                continue
            whole = {"name": "x", "design": {"kind": "random", "samples": 32}} | table
            stops = table.get("stop_when", [])
            for each in stops if isinstance(stops, list) else [stops]:
                if "requirement" in each and "requirements" not in table:
                    bound = {"max": 12.0, "probability": 0.9, "confidence": 0.9}
                    whole |= {"requirements": {each["requirement"]: bound}}
            for scene in [table["scene"]] if "scene" in table else SCENES:
                with contextlib.suppress(InputError):
                    made = campaign_of(tomli_w.dumps(whole | {"scene": scene}), page)
                    made.draw()
                    break
            else:
                raise AssertionError(f"{page}: no scene takes {text}")
    assert count >= 30


def test_what_wishes_lead_to_exists() -> None:
    """Commands of the table are accepted with their options, its keys and variables are known."""
    rows = [line.split(" | ") for line in WISHES.splitlines() if re.match(r"\| [a-z]", line)]
    assert 25 <= len(rows) <= 50
    named = [word for _, told, _ in rows for word in re.findall(r"`([^`]+)`", told)]
    keys = [word for word in named if re.fullmatch(r"[a-z_.]+", word) and word != "kind"]
    commands = [shlex.split(word)[1:] for word in named if word.startswith("ringsim ")]
    assert len(keys) > 20
    assert len(commands) > 15
    for verb, *arguments in commands:
        command_of(verb).make_context(verb, arguments).close()
    done = CliRunner().invoke(cli, ["explain", *keys])
    assert done.exit_code == 0, done.output


@for_each("page", EVIDENCE, ids=lambda path: str(path.relative_to(ROOT)))
def test_evidence_says_below_its_title_which_build_made_it(page: Path) -> None:
    title, made, *_ = page.read_text(encoding="utf-8").split("\n\n")
    assert title.startswith("# ")
    assert re.search(r"made\sby\scommit\s`[0-9a-f]{7}`\s\(2026-\d\d-\d\d\)", made.replace("M", "m"))
    assert re.search(r"again\sby", made, re.IGNORECASE)


@pytest.mark.quick
@for_each("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_to_files(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)#\s]+)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), target


@pytest.mark.parametrize("page", SCRIPTS, ids=lambda path: path.stem)
def test_python_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    script(page, tmp_path, "\n".join(blocks(page, "python")))


@pytest.mark.parametrize(
    "page",
    [
        ROOT / "README.md",
        pytest.param(ROOT / "docs" / "guide" / "commands.md", marks=pytest.mark.slow),
        ROOT / "docs" / "howto" / "go_on.md",
    ],
    ids=lambda path: path.stem,
)
def test_python_of_a_page_runs_in_the_full_model(page: Path, tmp_path: Path) -> None:
    """On a small ring; a state to go on from is the frame engine's alone, and refused with that."""
    text = "\n".join(blocks(page, "python"))
    smaller = '"structure.sections": 3, "solver.end_time": 0.3, "loads.force"'
    full = text.replace('fidelity="frame"', 'fidelity="full"').replace('"loads.force"', smaller)
    full = full.replace("simulate(scene)", 'simulate(scene, fidelity="full")')
    short = 'simulate(ringsim.load_scene("truss2").with_values({"solver.end_time": 0.3}), "full")'
    full = full.replace('simulate("ring18")', short)
    assert full.count('fidelity="full"') >= 1
    if page.stem == "go_on":
        found = script(page, tmp_path, full, code=1)
        assert "choose fidelity" in found
    else:
        script(page, tmp_path, full + "\nassert dataset.status.item() == 0, dataset.reason")


@pytest.mark.slow  # in frames all of that page runs above
def test_the_laws_of_ones_own_run_in_both_engines(tmp_path: Path) -> None:
    """Each listing of that page with a run: same angles at the end, and what the law changes."""
    friction, stribeck, fault = blocks(ROOT / "docs" / "howto" / "own_structure.md", "python")
    compare = """
import numpy as np, ringsim
both = [ringsim.simulate(scene.with_values({"solver.end_time": END}), fidelity=name)
        for name in ("full", "frame")]
assert [run.status.item() for run in both] == [0, 0], [run.reason for run in both]
angles = [run.opening_angle.dropna("time").values[..., -1] for run in both]
moved = angles[0] - both[0].opening_angle.values[..., 0]
assert np.abs(moved).min() > 0.1, moved
assert np.abs(angles[0] - angles[1]).max() < 2e-3 * np.abs(moved).max(), angles
"""
    struck = """
ring = {"structure.sections": 3, "net": "none", "structure.opening_angle": 150.0}
ring["hinge_spring"] = {"kind": "linear", "stiffness": 0.02, "preload": 0.01}
ring["faults"] = [{"kind": "failed-section", "section": 2, "time": 0.01}]
import ringsim
scene = ringsim.load_scene("ring18").with_values(ring)
"""
    for text, end in (friction, 0.5), (stribeck, 0.5), (fault + struck, 0.3):
        script(Path("own_structure"), tmp_path, text + compare.replace("END", str(end)))


def script(page: Path, folder: Path, text: str, *, code: int = 0) -> str:
    """What the text of ``page`` has printed as a script that treats warnings as errors."""
    (folder / f"{page.stem}.py").write_text(text, encoding="utf-8")
    done = preloaded.script(folder / f"{page.stem}.py", folder=folder)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_the_tutorial_takes_five_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As they stand, but with the first three samples, of a ring of three sections.

    The figures of a campaign are drawn in tests/plots: two of them stand in the report here.
    """
    few = [each for each in figures.PICTURES if each.name in ("by_input", "distributions")]
    monkeypatch.setattr(figures, "PICTURES", few)
    commands = [calls(text)[0] for text in blocks(TUTORIAL, "sh", mark="tutorial")]
    assert [len(calls(text)) for text in blocks(TUTORIAL, "sh", mark="tutorial")] == [1] * 5
    monkeypatch.chdir(tmp_path)
    (tmp_path / "campaigns").symlink_to(ROOT / "campaigns")
    printed = []
    for verb, *arguments in commands:
        smaller = ["--samples=3", "--set=structure.sections=3", "--workers=0"]
        if verb == "campaign":
            arguments = [each for each in arguments if each != "--plot"] + smaller
        if verb == "replay":  # which hands its own output to the sample's process
            replayed = preloaded.ringsim(verb, *arguments, folder=tmp_path)
            assert replayed.returncode == 0, replayed.stderr
            printed.append(replayed.stdout)
            continue
        done = CliRunner().invoke(cli, [verb, *arguments])
        assert done.exit_code == 0, done.output
        printed.append(done.output)
    assert "3 to run" in printed[0]
    assert "partly deployed: 1 of 3 (sample 2)" in printed[1]  # the one whose motor stops
    assert "outcome is deployed" in printed[2]
    assert (tmp_path / "late-motor.html").stat().st_size < 2e6
    assert "identical to the stored result" in printed[4]
    assert (tmp_path / "stopped.nc").exists()


def test_the_tutorial_shows_what_is_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All lines of its two listings, without the rest of what the commands print."""
    monkeypatch.chdir(tmp_path)
    file = str(ROOT / "campaigns" / "late_motor.toml")
    commands = ["campaign", file, "--workers=0"], ["analyse", "runs/late-motor"]
    for call, text in zip(commands, blocks(TUTORIAL, "text"), strict=True):
        done = CliRunner().invoke(cli, list(call))
        assert done.exit_code == 0, done.output
        printed = {" ".join(line.split()) for line in done.output.splitlines()}
        for line in (" ".join(each.split()) for each in text.splitlines()):
            begins = any(each.startswith(line.removesuffix("...")) for each in printed)
            assert line in printed or (line.endswith("...") and begins), line


def test_the_tutorial_takes_twelve_lines_of_python(tmp_path: Path) -> None:
    """The same study: inputs, design and seed are those of the file; two samples of it run."""
    (text,) = blocks(TUTORIAL, "python", mark="tutorial")
    assert len([line for line in text.splitlines() if line.strip()]) <= 12
    smaller = text.replace('"structure.sections": 6', '"structure.sections": 3')
    smaller = smaller.replace('"samples": 24', '"samples": 2')
    assert smaller.count("3,") == text.count("3,") + 1
    printed = script(Path("study"), tmp_path, smaller)
    assert re.search(r"^deployed +2 +2 ", printed, re.MULTILINE)
    names: dict[str, object] = {}
    exec(text.partition("campaign = ")[0], names)
    file = tomllib.loads((ROOT / "campaigns" / "late_motor.toml").read_text(encoding="utf-8"))
    assert names["inputs"] == file["inputs"]
    written = names["study"]._described.specification
    assert (written.seed, written.design.samples) == (file["seed"], file["design"]["samples"])


def test_the_list_of_printed_texts_has_them_with_their_values_and_what_explain_and_help_say() -> (
    None
):
    listed = preloaded.script(ROOT / "docs" / "printed_texts.py", folder=ROOT).stdout
    assert "no significant input for {', '.join(quiet)}" in listed
    assert "## ringsim/report/page.html.j2" in listed
    lines = {line.partition(": ")[2] for line in listed.splitlines()}
    assert {"Draw figures beside campaign.nc.", "violating", "Distributions"} <= lines
    assert any(each.startswith("Show how many samples of the campaign in FOLDER") for each in lines)
    assert not any("(?" in each or "\\d" in each for each in lines)
    assert "Lists every text that" not in listed
    assert "How far a campaign is, also while its folder is being filled" not in listed


def test_the_ring_of_another_size_has_the_diameter_that_is_said() -> None:
    """Of N sections the corners stand 2 (half_bar + hinge_offset) / sin(pi / N) apart, across."""
    page = ROOT / "docs" / "guide" / "scenes.md"
    ((verb, name, *options),) = (call for text in blocks(page, "sh") for call in calls(text))
    done = CliRunner().invoke(cli, [verb, name, *options])
    assert done.exit_code == 0, done.output
    ring = load_scene(name).structure
    own = {path: float(value) for path, _, value in (each.partition("=") for each in options[1::2])}
    half = own["structure.half_bar"] + ring.hinge_offset
    told = f"circle of {2.0 * half / math.sin(math.pi / ring.sections):.4f} m"
    assert told in done.output
    assert told in page.read_text(encoding="utf-8")
    ratio = own["structure.half_bar"] / ring.half_bar
    assert own["structure.half_diagonal"] == pytest.approx(ratio * ring.half_diagonal, rel=1e-3)
    assert own["boom.length"] == pytest.approx(ratio * load_scene(name).boom.length, rel=1e-2)
