#!/usr/bin/env -S uv run --script
# /// script
# dependencies = ["nox>=2025.2.9"]
# ///
"""What is tried before a release: ``nox`` runs all sessions, ``nox -s lint`` one."""

from pathlib import Path

import nox

nox.needs_version = ">=2025.2.9"
nox.options.default_venv_backend = "uv|virtualenv"
nox.options.reuse_existing_virtualenvs = True
PYTHONS = ["3.11", "3.12", "3.13", "3.14"]


@nox.session(python=PYTHONS)
def tests(session: nox.Session) -> None:
    """The quick tests, in an environment of each Python; ``nox -s tests -- tests`` runs all."""
    session.install(".[mpich,test]")
    session.run("pytest", "-n", "2", *(session.posargs or ["-m", "quick"]))


@nox.session(python=PYTHONS[0], venv_backend="uv")
def lowest(session: nox.Session) -> None:
    """The quick tests with the oldest versions that pyproject.toml allows."""
    session.install("--resolution", "lowest-direct", ".[mpich,test]")
    session.run("pytest", "-n", "2", *(session.posargs or ["-m", "quick"]))


@nox.session(python=PYTHONS[0])
def lint(session: nox.Session) -> None:
    """Style, types, and which room imports from which."""
    session.install(".[test]")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")
    session.run("lint-imports")


@nox.session(python=PYTHONS[0])
def docs(session: nox.Session) -> None:
    """The documentation, warnings being errors."""
    session.install(".[docs]")
    session.run("sphinx-build", "-W", "docs", "docs/_build/html")


@nox.session(python=PYTHONS[0])
def package(session: nox.Session) -> None:
    """The source archive and a wheel of it, which runs a scene where there is no checkout."""
    folder = session.create_tmp()
    session.install("build", "twine")
    session.run("python", "-m", "build", "--outdir", f"{folder}/dist")
    session.run("twine", "check", "--strict", *_in(f"{folder}/dist"))
    session.install("--force-reinstall", *(f for f in _in(f"{folder}/dist") if f.endswith(".whl")))
    with session.chdir(folder):
        session.run("ringsim", "run", "ring18", "--fidelity", "frame", "--out", "ring18.nc")


def _in(folder: str) -> list[str]:
    return sorted(map(str, Path(folder).iterdir()))


if __name__ == "__main__":
    nox.main()
