"""A topology of one's own that is no pantograph: a hoop truss with telescopic diagonals.

Bays of two longerons and a post at each joint; one diagonal of a bay grows as the truss opens, a
telescope with an end stop, and the other one shrinks: a rope along it drives the truss.  It is one
file, and runs in both engines, with margin, rope, latches and figures.
"""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from pydantic import Field

from ringsim.layout.bodies import Lump
from ringsim.layout.draft import Draft, Track
from ringsim.layout.layout import Layout, internal_mobility, layout_of
from ringsim.parts.laws import PairLaw, PairRecord, Reaction, one_sided
from ringsim.plots.figures import figures_of
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate
from ringsim.structures.family import Structure
from ringsim.variables import Fate, Status


class Telescope(PairRecord):
    """A tube in a tube: a damper, and a stop at its full length."""

    kind: Literal["telescope"] = "telescope"
    damping: float = 20.0
    stop: float = 1e4

    def reaction(self, stretch: Any, rate: Any, natural: Any, xp: Any = np) -> Reaction:
        stopped = one_sided(stretch, rate, self.stop, 0.0, 1e-4, xp)
        return Reaction(stopped.elastic, stopped.damping + self.damping * rate, stopped.stored)


class HoopTruss(Structure):
    """Longerons of length ``bay`` fold by an angle theta = pi - opening from level, to and fro."""

    kind: Literal["hoop-truss"] = "hoop-truss"
    sections: int = Field(default=4, ge=4, multiple_of=2)
    opening_angle: float = Field(default=110.0, gt=90.0, lt=180.0)
    bay: float = 1.0
    height: float = 0.8
    joint_mass: float = 0.2
    closed: ClassVar[bool] = True
    shaping: ClassVar[tuple[str, ...]] = ("structure.sections",)

    @classmethod
    def cable_points(cls, sections: int) -> tuple[str, ...]:
        return tuple(f"joint {k}" for k in range(1, sections + 2))

    @property
    def coordinate(self) -> float:
        return 0.5 * (np.pi - np.radians(self.opening_angle))

    @property
    def reach(self) -> float:
        return self.bay

    def path_slope(self, cable: Any, angles: Any) -> float:
        a, h = self.bay, self.height
        diagonal = np.sqrt(a**2 + h**2 + 2.0 * a * h * np.sin(angles))
        return float(np.sum(a * h * np.cos(angles) / diagonal))

    def layout(self, scene: Any, coordinate: Any) -> Layout:
        draft, n, theta = Draft(scene), self.sections, 2.0 * coordinate
        radius = 0.5 * self.bay * np.cos(theta) / np.sin(np.pi / n)
        around = 2.0 * np.pi * np.arange(n) / n
        lump = Lump("joints", self.joint_mass, np.zeros(3), 1e-3 * self.joint_mass * np.eye(3))
        rise = 0.5 * self.bay * np.sin(theta) * (-1.0) ** np.arange(n)
        rows = []
        for level in (0.5, -0.5):
            z = level * self.height + rise
            places = [
                np.array([radius * np.cos(p), radius * np.sin(p), at])
                for p, at in zip(around, z, strict=True)
            ]
            rows.append([(draft.body(at, [lump]), at) for at in places])
        draft.corners = [[body for body, _ in row] for row in rows]
        whole, rods, young = (0.0, 1.0), scene.rods, float(np.mean(scene.rods.young_modulus))
        pairs = []
        for k in range(n):
            middle = around[k] + np.pi / n
            out = np.array([np.cos(middle), np.sin(middle), 0.0])
            along = np.array([-np.sin(middle), np.cos(middle), 0.0])
            axes = np.stack([along, [0.0, 0.0, 1.0], out], axis=1)
            (top, at_top), (low, at_low) = rows[0][k], rows[1][k]
            post = draft.rod("post", k, "posts", (at_low, at_top), out, rods.bar, whole, young)
            for body, at in ((low, at_low), (top, at_top)):
                draft.joint("revolute", "hinge", k, (post, body), at, axes)
            for plane, (name, row) in enumerate(zip(("upper", "lower"), rows, strict=True)):
                ends = row[k], row[(k + 1) % n]
                rod = draft.rod(f"longeron_{name}", k, "longerons", [at for _, at in ends], out,
                                rods.diagonal, whole, young)  # fmt: skip
                hinges = [
                    draft.joint("revolute", "hinge", k, (rod, body), at, axes) for body, at in ends
                ]
                draft.opening(plane, hinges[0], (-1.0) ** k, np.zeros(3))
            grows = (low, rows[0][(k + 1) % n][0]) if k % 2 == 0 else (top, rows[1][(k + 1) % n][0])
            pairs.append([body.number for body in grows])
        full = np.full(n, np.hypot(self.bay, self.height))
        draft.pairs.append(
            PairLaw("telescopes", Telescope(), np.array(pairs), np.arange(n), lambda: full)
        )
        stations = [draft.on(*rows[k % 2][k % n]) for k in range(n + 1)]
        draft.tracks[0] = Track(stations, np.array([0.0, 0.0, 1.0]))
        return draft.finish()


NEARLY_OPEN = 150.0


def truss(**values: Any) -> Scene:
    scene = load_scene("ring18-cable")
    table = scene.to_table()
    upper = table["cables"]["upper"]
    upper["winch"] = {"winding": {"kind": "ramp", "speed": 0.5, "duration": 0.5}}
    table |= {
        "structure": {"kind": "hoop-truss"}, "boom": "none", "net": "none",
        "cables": {"upper": upper, "lower": "none"}, "joints": {"hinge": {"viscous": 0.02}},
        "solver": {"end_time": 6.0}, "stop": {"stiffness": 50.0, "damping": 0.5, "latch": True},
    }  # fmt: skip
    return Scene.model_validate(table | values)


ENGINES = pytest.mark.parametrize("engine", ["frame", pytest.param("full", marks=pytest.mark.slow)])


def test_four_bays_can_only_fold() -> None:
    layout = layout_of(truss())
    assert internal_mobility(layout) == 1
    angles, rates = layout.opening_angles()
    assert angles == pytest.approx(np.radians(110.0))
    assert rates == pytest.approx(-2.0)


@pytest.fixture(scope="module")
def runs() -> dict[str, Any]:
    return {"frame": simulate(nearly_open(), fidelity="frame")}


def nearly_open() -> Scene:
    return truss(structure={"kind": "hoop-truss", "opening_angle": NEARLY_OPEN})


@ENGINES
def test_it_opens_and_latches(runs: dict[str, Any], engine: str) -> None:
    if engine not in runs:
        runs[engine] = simulate(nearly_open(), fidelity=engine)
    for run in runs.values():
        assert int(run.status) == Status.OK, run.attrs["reason"]
        assert int(run.outcome) == Fate.DEPLOYED
        assert run.opening_angle.isel(time=0).values == pytest.approx(NEARLY_OPEN, abs=1e-6)
        assert float(run.constraint_error) < 1e-6
        assert float(run.energy_error) < 1e-3
        # The rope that is wound is the path that its diagonals lose, and less than 1 % of stretch.
        long, short = (np.sqrt(1.64 + 1.6 * np.sin(np.radians(x))) for x in (NEARLY_OPEN, 180.0))
        wound = float(run.wound_length.sel(plane="upper").dropna("time").max())
        assert wound == pytest.approx(4.0 * (long - short), rel=0.01)
    one, other = runs["frame"], runs[engine]
    # At the default tolerance, of which a shock at the winch's start is the largest error.
    assert float(one.deployment_time) == pytest.approx(float(other.deployment_time), rel=1e-3)
    assert float(one.peak_tension) == pytest.approx(float(other.peak_tension), rel=0.01)


def test_figures_of_rings_alone_are_left_out(runs: dict[str, Any]) -> None:
    names = {picture.name for picture, _ in figures_of(runs["frame"])}
    assert {"opening_angles", "ring", "asynchrony"} <= names
    assert not names & {"cables", "pulleys", "nodal_forces"}
