"""Runs made by hand: a smooth opening with small deviations, so that figures have known data."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from matplotlib.layout_engine import ConstrainedLayoutEngine
from ring_rods import RODS

from ringsim.dataset import to_dataset
from ringsim.plots import style
from ringsim.scene import Scene, scene_from_table
from ringsim.variables import PLANES, Fate, Outcome, Status

DEPLOYED = 17.58
REASON = "the step fell below its bound at 9.3 s: lower solver.step or raise solver.tolerance"


def _scene_of(sections: int = 18, *, closed: bool = True, parts: bool = True) -> Scene:
    structure = {"kind": "pantograph-ring", "sections": sections, "closed": closed}
    if not closed:
        structure["polygon_sections"] = max(18, sections + 1)
    table = {
        "name": f"made{sections}",
        "title": f"{sections}-section ring made by hand",
        "structure": structure,
        "loads": {"force": 0.015},
        "record": {"stress": True},
    }
    if parts:
        table |= {"boom": {"kind": "rigid"}, "net": {}}
    return scene_from_table(table, source="test")


def _made_run(
    scene: Scene, *, status: Status = Status.OK, until: float | None = None, stress: bool = True
) -> xr.Dataset:
    """A run from the scene's opening angle to 180 degrees at 17.58 s, recorded ``until``."""
    sections = scene.structure.sections
    time = np.arange(179) / 10.0
    number = np.arange(1, sections + 1)
    start = scene.structure.opening_angle
    u = np.clip(time / DEPLOYED, 0.0, 1.0)
    mean = start + (180.0 - start) * u**2.2
    shape = np.cos(2 * np.pi * (number - 1) / sections)[:, None] * (8 * u**3 * (1 - u))
    wiggle = 0.15 * np.sin(0.9 * time[None, :] * (1 + 0.02 * number[:, None])) * (u * (1 - u))
    angle = np.stack([mean + shape + wiggle, mean - 0.6 * shape + wiggle])
    angle[:, :, time > DEPLOYED] = 180.0
    lock = DEPLOYED - 0.12 * np.abs(np.stack([np.sin(number), np.cos(1.3 * number)]))
    lock[0, 0] = DEPLOYED
    work = 0.1 * (1 - np.cos(np.radians((mean - start) / 2)))
    lost = np.where(time > DEPLOYED, 0.97 * work, 0.004 * work)
    elastic = 2e-3 * u**6
    drift = 1e-6 * np.sin(time) * u
    stress_shape = (8, sections, len(time))
    phase = np.arange(8)[:, None, None] + 0.3 * number[None, :, None]
    rods = np.abs(2.4e6 * u**2 * np.sin(4 * u + phase) + 2e5 * np.sin(9 * time + phase))
    values = {
        "opening_angle": angle,
        "asynchrony": np.ptp(angle, axis=(0, 1)),
        "kinetic_energy": work - elastic - lost + drift,
        "elastic_energy": elastic,
        "work": work,
        "dissipation": lost,
        "constraint_violation": np.full(len(time), 1e-9),
    }
    if stress:
        values["rod_stress"] = np.broadcast_to(rods, stress_shape).copy()
    last = DEPLOYED + 0.3 if until is None else until
    for array in values.values():
        array[..., time > last] = np.nan
    fate = Fate.DEPLOYED if until is None else Fate.NONE if status.failed else Fate.CUT_OFF
    values |= {"final_time": np.array(last), "outcome": np.array(int(fate))}
    if until is None:
        values |= {
            "deployment_time": np.array(DEPLOYED),
            "lock_time": lock,
            "asynchrony_max": np.array(values["asynchrony"][time <= DEPLOYED].max()),
            "energy_error": np.array(2.3e-5),
        }
    coordinates = {
        "plane": np.array(PLANES),
        "section": number,
        "time": time,
        "rod": np.array(RODS),
    }
    reason = "all V-joints have locked" if until is None else REASON
    return to_dataset(Outcome(status, reason, coordinates, values), scene)


@pytest.fixture(scope="session")
def scene_of() -> Callable[..., Scene]:
    """A scene by its number of sections."""
    return _scene_of


@pytest.fixture(scope="session")
def made_run() -> Callable[..., xr.Dataset]:
    """A run of a scene."""
    return _made_run


@pytest.fixture(scope="session")
def deployed() -> xr.Dataset:
    return _made_run(_scene_of(18))


@pytest.fixture(scope="session")
def failed() -> xr.Dataset:
    return _made_run(_scene_of(6), status=Status.SOLVER_FAILED, until=9.25)


@pytest.fixture(scope="session")
def unfinished() -> xr.Dataset:
    return _made_run(_scene_of(2, closed=False), until=12.0)


@pytest.fixture
def settled() -> None:
    """The layout is found, and words inside axes move to where they cover least, as for users."""


@pytest.fixture(autouse=True)
def _nothing_moves(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A layout costs more than all of the drawing; who looks at places asks for ``settled``."""
    if "settled" not in request.fixturenames:
        monkeypatch.setattr(style, "settle", lambda figure: None)
        monkeypatch.setattr(ConstrainedLayoutEngine, "execute", lambda engine, figure: None)
