"""Container recipes and the citation file agree with the project."""

from __future__ import annotations

import re
import subprocess
import tomllib

import yaml

from pages import ROOT

FILE = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = FILE["project"]
DOCKER = (ROOT / "containers" / "Dockerfile").read_text(encoding="utf-8")
APPTAINER = (ROOT / "containers" / "ringsim.def").read_text(encoding="utf-8")


def section(name: str) -> str:
    """A section of the Apptainer recipe."""
    found = re.search(rf"^%{name}\n(.*?)(?=^%|\Z)", APPTAINER, re.DOTALL | re.MULTILINE)
    assert found is not None
    return found[1]


def test_both_recipes_install_the_same_on_the_same() -> None:
    base = re.search(r"^FROM (\S+)$", DOCKER, re.MULTILINE)
    assert base is not None
    assert f"From: {base[1]}\n" in APPTAINER
    install = re.search(r"^RUN (pip install .*)$", DOCKER, re.MULTILINE)
    assert install is not None
    assert install[1] in section("post")
    (extra,) = re.findall(r"\[(\w+)\]", install[1])
    assert extra in PROJECT["optional-dependencies"]
    version = re.search(r"python:(\d+)\.(\d+)", base[1])
    assert version is not None
    assert f">={version[1]}.{version[2]}" == PROJECT["requires-python"]


def test_what_recipes_copy_is_there_and_is_all_that_an_installation_reads() -> None:
    copied = {
        name for line in re.findall(r"^COPY (.*)$", DOCKER, re.MULTILINE)
        for name in line.split()[:-1]
    }  # fmt: skip
    assert copied == {line.split()[0] for line in section("files").splitlines() if line.strip()}
    assert all((ROOT / name).exists() for name in copied)
    own = {"pyproject.toml", "setup.py", "building.py", "ringsim"}
    assert own | {PROJECT["readme"], *PROJECT["license-files"]} == copied
    kept = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert {name.removeprefix("!") for name in kept if name.startswith("!")} == copied


def test_instructions_are_known_and_scripts_parse() -> None:
    text = re.sub(r"\\\n", " ", DOCKER)
    first = {line.split()[0] for line in text.splitlines() if line and line[0] != "#"}
    assert first <= {"FROM", "COPY", "RUN", "ENV", "WORKDIR", "ENTRYPOINT", "CMD"}
    scripts = [section("post"), section("runscript"), section("test")]
    scripts += re.findall(r"^RUN (.*)$", text, re.MULTILINE)
    for script in scripts:
        subprocess.run(["bash", "-n", "-c", script], check=True)


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["cff-version"] == "1.2.0"
    assert citation["title"] == PROJECT["name"]
    # A copy without git is of no release: it is the next one, not yet made.
    first, second, third = map(int, str(citation["version"]).split("."))
    fallback = FILE["tool"]["setuptools_scm"]["fallback_version"]
    assert fallback == f"{first}.{second}.{third + 1}.dev0"
    assert citation["license"] == PROJECT["license"]
    assert citation["message"]
    assert citation["authors"]
