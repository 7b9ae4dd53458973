"""Imports, style and types: every tool runs with the tests, so that one command proves all."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TOOLS = Path(sys.executable).parent


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(["lint-imports", "--no-cache"], id="imports", marks=pytest.mark.quick),
        pytest.param(["ruff", "check", "--no-cache", "."], id="lint", marks=pytest.mark.quick),
        pytest.param(
            ["ruff", "format", "--no-cache", "--check", "."], id="format", marks=pytest.mark.quick
        ),
        pytest.param(["mypy"], id="types"),
    ],
)
def test_tool_finds_nothing(command: list[str]) -> None:
    done = subprocess.run(
        [str(TOOLS / command[0]), *command[1:]], cwd=ROOT, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
