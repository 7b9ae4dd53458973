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


@nox.session(python=PYTHONS[0])
@nox.parametrize("machine", ["x86_64", "aarch64"])
def wheels(session: nox.Session, machine: str) -> None:
    """A wheel for any Linux since glibc 2.28, compiled here for another processor, too."""
    folder = session.create_tmp()
    session.install("build", "wheel", "setuptools", "setuptools-scm", "ziglang")
    zig = f"python -m ziglang cc -target {machine}-linux-gnu.2.28 -mcpu=baseline"
    where = {"CC": zig, "LDSHARED": f"{zig} -shared", "CFLAGS": "-fno-sanitize=all",
             "_PYTHON_HOST_PLATFORM": f"linux-{machine}"}  # fmt: skip
    session.run("python", "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, env=where)
    plain = [file for file in _in(folder) if file.endswith(f"-linux_{machine}.whl")]
    session.run("wheel", "tags", "--remove", f"--platform-tag=manylinux_2_28_{machine}", *plain)


def _in(folder: str) -> list[str]:
    return sorted(map(str, Path(folder).iterdir()))


if __name__ == "__main__":
    nox.main()
