"""Tangent, elimination and solution of the whole frame model against dense differences.

Every case is away from balance by random changes of all unknowns in one step, so that rods are
strained, ropes taut and all terms of the tangent there.  Bounds are on an entry's error over the
root of the diagonal entries of its row and column (``numeric_tangent.error``).
"""

from typing import Any

import numpy as np
import pytest

from numeric_tangent import Probe, error
from ringsim.core.library import call
from ringsim.frame.elimination import EIGHT, Fronts
from ringsim.frame.mesh import Mesh
from ringsim.frame.model import FrameModel
from ringsim.scene import Scene, load_scene

DIFFERENCES = 1e-6
"""Central differences of 1e-7 leave this much: round-off of stiff rods over soft angles."""
NET = {"stiffness": 0.05, "neutral_length": 0.3, "damping": 0.01, "hub_mass": 0.02}
EDGE = {"kind": "boundary", "axial_stiffness": 50.0, "strain": [0.1, 0.06, 0.08]}
OPEN = {"structure.closed": False, "structure.polygon_sections": 18, "boom.base": "fixed"}
FLEXIBLE = {"boom.kind": "flexible", "boom.elements": 3}


def scene(name: str = "ring18", **values: Any) -> Scene:
    """A ring of four; keywords name parts of fields, two underscores stand for a dot."""
    chosen = {key.replace("__", "."): value for key, value in values.items()}
    base = {"structure.sections": 4, "net": "none", "structure.opening_angle": 60.0}
    return load_scene(name).with_values(base | chosen)


@pytest.mark.parametrize(
    "values",
    [
        {"boom": "none"},
        {"boom": "none", "structure.sections": 3},
        {"boom": "none", "structure.sections": 9},
        {"boom": "none", "rods.elements": 3},
        {"boom": "none", "structure.sections": 6, "net": NET},
        {"boom": "none", "structure.sections": 3, "structure.opening_angle": 150.0, "net": EDGE},
        OPEN | {"structure.sections": 3, "structure.opening_angle": 150.0, "net": EDGE},
        OPEN | {"structure.sections": 1},
        OPEN | {"structure.sections": 2},
        OPEN | {"structure.sections": 5, "rods.elements": 2},
    ],
    ids=[
        "free-4", "free-3", "free-9", "three-elements", "net", "edge", "arc-edge",
        "arc-1", "arc-2", "arc-5",
    ],
)  # fmt: skip
def test_tangent_of_rings(values: dict[str, Any]) -> None:
    """Changes of 1e-5 bend no rod by more than that: no second-order terms are seen."""
    made = scene().with_values(values)
    assert error(Probe(made, 1e-5, time=1e-2, step=1e-2)) < DIFFERENCES


@pytest.mark.parametrize("base", ["free", "fixed"])
@pytest.mark.parametrize(
    "boom", [{}, {"boom.joint": "prismatic"}, FLEXIBLE], ids=["rigid", "prismatic", "flexible"]
)
def test_tangent_of_booms(base: str, boom: dict[str, Any]) -> None:
    """How the sliding body's gap turns with the boom is left out: the gap's force, up to 1e-9 m of
    1e9 N/m here, over inertias and stiffnesses of 100 N m/rad and more;
    3e-6 has been found, and ten times that at gaps ten times as large.
    """
    made = scene(boom__base=base).with_values(boom)
    assert error(Probe(made, 1e-9, time=1e-2, step=1e-2)) < 1e-5


TAUT = {f"cables.{plane}.initial_slack": -5e-4 for plane in ("upper", "lower")}
"""Tens of newtons from the start, and rates of some mm/s."""
SMOOTH = {f"cables.{plane}.friction": {"kind": "none"} for plane in ("upper", "lower")}


@pytest.mark.parametrize(
    "values",
    [
        {},
        OPEN | {"structure.sections": 2, "boom.kind": "rigid", "boom.length": 0.9},
        {"cables.upper.end": "last", "cables.lower.end": "both"},
        {"cables.upper.bracket": {"kind": "bar-half", "angle": 95.0}},
        {"cables.upper.damping_time": 1e-3},
        {
            "cables.upper.winch.winding": {
                "kind": "stall", "speed": 0.1, "max_tension": 30.0, "band": 0.5,
                "backdrivable": True,
            }
        },
        {
            "cables.upper.winch.winding": {
                "kind": "tension-feedback", "target": 30.0, "max_speed": 0.2, "max_payout": 0.1
            }
        },
    ],
    ids=["first-end", "arc", "both-ends", "bar-half", "damped", "stall", "feedback"],
)  # fmt: skip
def test_tangent_of_ropes_without_friction(values: dict[str, Any]) -> None:
    """Nothing is left out."""
    made = scene("ring18-cable", boom="none").with_values(TAUT | SMOOTH | values)
    assert error(Probe(made, 1e-6, time=0.5, step=1e-2)) < DIFFERENCES


@pytest.mark.parametrize(
    "friction",
    [
        {"kind": "bearing", "coefficient": 4e-4},
        {"kind": "bearing-exact", "coefficient": 5e-4},
        {"kind": "capstan", "coefficient": 0.05},
    ],
    ids=lambda friction: friction["kind"],
)
def test_tangent_of_pulleys(friction: dict[str, Any]) -> None:
    """Pulleys whose friction is full to 1e-4 of it are left out of the tangent on purpose: 4e-5 has
    been found.
    """
    made = scene("ring18-cable", boom="none").with_values(TAUT)
    made = made.with_values({"cables.upper.friction": friction})
    assert error(Probe(made, 1e-6, time=0.5, step=1e-2)) < 1e-4


@pytest.mark.parametrize("taut", [True, False])
def test_a_tangent_outlives_the_pull_of_its_strings(taut: bool) -> None:
    """Strings of a hub turn taut or slack between two tangents: solutions are those of the last."""
    net = NET | {"neutral_length": 0.1 if taut else 9.0}
    made = scene("ring18-cable", structure__sections=6, net=net, boom="none")
    probe = Probe(made, 1e-5, time=1e-2, step=1e-2)
    model, first = probe.model, probe.solved()
    assert model.cables is not None
    used, row = model.cables.roped.border.used, np.linspace(0.0, 1.0, model.size)
    assert bool(used[1]) == taut
    solutions = []
    for _ in range(2):
        x = row.copy()
        call("relax", model.system, model.cables.roped, x)
        solutions.append(x)
        used[1] = not taut
    assert np.isfinite(first).all()
    assert solutions[0].tolist() == solutions[1].tolist()


@pytest.mark.parametrize(
    "values",
    [{"boom": "none", "structure.sections": n} for n in (3, 4, 5, 18)]
    + [OPEN | {"structure.sections": n} for n in (1, 2, 5)]
    + [{"boom.base": "fixed"}, FLEXIBLE, {"rods.elements": 4}, FLEXIBLE | {"boom.elements": 20}],
    ids=[
        "3", "4", "5", "18", "arc-1", "arc-2", "arc-5", "fixed", "flexible", "four-elements", "boom"
    ],
)  # fmt: skip
def test_elimination_solves_as_numpy_does(values: dict[str, Any]) -> None:
    check_elimination(FrameModel(scene().with_values(values)).mesh)


def test_blocks_of_three_planes_are_eliminated_in_panels() -> None:
    """Four blocks of 18 unknowns, the last of them carried along, with a part before each."""
    lists = [[*range(7 * k, 7 * k + 7), *range(28 + 18 * k, 46 + 18 * k)] for k in range(4)]
    for k in range(4):
        rest = sorted({k, k + 1, 3} & set(range(k, 4)))
        lists.append([28 + 18 * one + place for one in rest for place in range(18)])
    spots, up = np.full((2, len(lists), max(map(len, lists))), -1)
    gone, parent = np.array([7] * 4 + [18] * 4), np.array([4, 5, 6, 7, 5, 6, 7, -1])
    for number, own in enumerate(lists):
        spots[number, : len(own)] = own
        left = own[gone[number] :]
        up[number, gone[number] : len(own)] = [lists[parent[number]].index(spot) for spot in left]
    mesh = FrameModel(scene(boom="none")).mesh._replace(
        gone=gone, size=np.array([len(own) for own in lists]), spots=spots, parent=parent, up=up,
        fixed=np.array([30, 50]), unknowns=100,
    )  # fmt: skip
    check_elimination(mesh)


def check_elimination(mesh: Mesh) -> None:
    """Random fronts with heavy diagonals, unsymmetric: to round-off."""
    rng, fronts = np.random.default_rng(0), Fronts.empty(mesh)
    # One matrix a front, however many panels: what many elements a rod take grows no faster.
    assert len(fronts.whole) == len(mesh.gone)
    dense = np.zeros((mesh.unknowns, mesh.unknowns))
    for front, spots, size in zip(fronts.whole, mesh.spots, mesh.size, strict=True):
        front[:size, :size] = rng.normal(size=(size, size)) + 30.0 * np.eye(size)
        dense[np.ix_(spots[:size], spots[:size])] += front[:size, :size]
    dense[mesh.fixed] = dense[:, mesh.fixed] = 0.0
    dense[mesh.fixed, mesh.fixed] = 1.0
    right = rng.normal(size=(mesh.unknowns, 2 * EIGHT))
    right[mesh.fixed] = 0.0
    found = right.copy()
    assert call("factor", mesh, fronts)
    call("solve", mesh, fronts, found)
    assert found == pytest.approx(np.linalg.solve(dense, right), abs=1e-13)
    one = right[:, 0].copy()
    call("solve_one", mesh, fronts, one)
    assert one == pytest.approx(found[:, 0], abs=1e-14)


def test_a_pivot_that_vanishes_is_told() -> None:
    mesh = FrameModel(scene(boom="none")).mesh
    fronts = Fronts.empty(mesh)
    fronts.whole[:, :, : fronts.whole.shape[1]] = np.eye(fronts.whole.shape[1])
    assert call("factor", mesh, fronts)
    fronts.whole[0, 0, :2] = 1e-12, 1.0
    assert not call("factor", mesh, fronts)
