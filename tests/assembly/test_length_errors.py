"""Rods that are not as long as drawn: what they strain, and where the structure then is."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from loops import for_each

from ringsim import simulation
from ringsim.execution import work
from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.frame.integrate import solve as by_frames
from ringsim.layout.bodies import STEP, Lump, Rod
from ringsim.layout.draft import Draft
from ringsim.layout.layout import Layout, layout_at_opening, layout_of
from ringsim.parts.rods import LengthError
from ringsim.refusal import InputError
from ringsim.rigid.assembling import assembled, deployed, strains
from ringsim.scene import Scene, load_scene
from ringsim.variables import Cause, Status

NAMES = tuple(LengthError.model_fields)


def ring(sections: int = 4, **values: Any) -> Scene:
    """A free ring of sections and loads alone; of its values a double underscore is a dot."""
    plain = {"structure.sections": sections, "net": "none", "boom": "none"}
    given = {name.replace("__", "."): value for name, value in values.items()}
    return load_scene("ring18").with_values(plain | given)


def scattered(size: float, sections: int = 4, seed: int = 1) -> dict[str, list[float]]:
    draw = np.random.default_rng(seed)
    return {name: (size * draw.standard_normal(sections)).tolist() for name in NAMES}


def length(rod: Rod) -> float:
    """Distance of the ends as assembled."""
    return float(np.linalg.norm(rod.nodes[-1].place - rod.nodes[0].place))


def axial_force(rod: Rod) -> float:
    """By the strain of a straight rod."""
    natural = rod.length * (1.0 + rod.strain)
    return rod.young_modulus * rod.tube.area * (length(rod) / natural - 1.0)


def square(errors: list[float]) -> Layout:
    """A square of 1 m with both diagonals, six rods on pins: once statically indeterminate."""
    scene = load_scene("truss2").with_values(
        dict.fromkeys(("boom", "net", "cables", "joints.vjoint"), "none")
    )
    draft = Draft(scene.with_values({"loads": "none"}))
    still = 0j * STEP
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) + still
    lump = Lump("hinges", 0.01, np.zeros(3), 1e-6 * np.eye(3))
    bodies = [draft.body(at, [lump]) for at in corners]
    normal = np.array([0.0, 0.0, 1.0]) + still
    pairs = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)]
    for number, (pair, error) in enumerate(zip(pairs, errors, strict=True)):
        ends = [corners[k] for k in pair]
        rod = draft.rod(
            f"rod_{number}", 0, "rods", ends, normal, scene.rods.bar, (0.0, 1.0), 1e11, strain=error
        )
        for k in pair:
            draft.joint("revolute", "hinge", 0, (rod, bodies[k]), corners[k])
    return draft.finish()


def test_forces_of_an_indeterminate_truss_are_those_of_linear_statics() -> None:
    """Its state of self-stress is s = 1 in the sides and -sqrt(2) in the diagonals: the forces are
    s X with sum s (e L + s X L / EA) = 0.  What is left out is quadratic in the errors.
    """
    errors = [2e-6, -1e-6, 0.5e-6, 3e-6, -2e-6, 1e-6]
    layout = square(errors)
    found = assembled(layout, load_scene("truss2").rods)
    s = np.array([1.0, 1.0, 1.0, 1.0, -math.sqrt(2.0), -math.sqrt(2.0)])
    lengths = np.array([rod.length for rod in layout.rods])
    rigidity = 1e11 * layout.rods[0].tube.area
    free = float(np.sum(s * errors * lengths))
    x = -free / float(np.sum(s * s * lengths)) * rigidity
    forces = np.array([axial_force(rod) for rod in found.layout.rods])
    assert np.abs(forces / (s * x) - 1.0).max() < 1e-4
    energy = 0.5 * float(np.sum((s * x) ** 2 * lengths)) / rigidity
    assert found.energy == pytest.approx(energy, rel=1e-4)


Bar = tuple[tuple[int, int], tuple[int, int], float]
"""Plane and corner of both ends, and how much longer it is than drawn, m."""


def of_pin_jointed_truss(at: np.ndarray, bars: list[Bar]) -> np.ndarray:
    """How far the corners ``at`` (planes, corners, 3), m, of a truss of so many bars as hold them
    move: B u = e L, with u the displacements less those of a rigid body, as in the best fit.
    """
    rows = []
    for one, other, _ in bars:
        along = at[other] - at[one]
        row = np.zeros(at.shape)
        row[one], row[other] = -along, along
        rows.append(row.ravel() / np.linalg.norm(along))
    matrix = np.array(rows)
    assert np.linalg.matrix_rank(matrix) == len(bars) == at.size - 6
    moved = np.linalg.lstsq(matrix, np.array([longer for *_, longer in bars]), rcond=None)[0]
    return np.asarray(np.linalg.norm(moved.reshape(-1, 3), axis=1))


def test_corners_of_a_deployed_ring_of_three_are_those_of_a_pin_jointed_truss() -> None:
    """12 bars hold its 6 corners.  Rods bend where diagonals do not cross in their middles, with
    1e-3 of the stiffness.
    """
    errors = scattered(1e-5, 3)
    scene = ring(3, structure__hinge_offset=0.0, rods__length_error=errors)
    drawn = layout_at_opening(scene, math.pi)
    at = np.array([[drawn.bodies[k].pose.place for k in plane] for plane in drawn.corners])
    bars: list[Bar] = []
    for k in range(3):
        following = (k + 1) % 3
        for plane, name in enumerate(("upper", "lower")):
            halves = errors[f"bar_{name}_left"][k] + errors[f"bar_{name}_right"][k]
            bars.append(((plane, k), (plane, following), 0.5 * halves))
        bars.append(((1, k), (0, following), errors["diagonal_rising"][k]))
        bars.append(((0, k), (1, following), errors["diagonal_falling"][k]))
    bars = [
        (one, other, error * float(np.linalg.norm(at[other] - at[one])))
        for one, other, error in bars
    ]
    expected = of_pin_jointed_truss(at, bars)
    found = deployed(scene).deviations.ravel()
    assert np.abs(found - expected).max() < 5e-3 * expected.max()


def test_errors_that_fit_strain_nothing() -> None:
    """Two sections give way by their angles, and a ring of equal errors is a larger one."""
    open_arc = load_scene("truss2").with_values({"rods.length_error": scattered(1e-4, 2)})
    found = assembled(layout_of(open_arc), open_arc.rods)
    assert found.energy < 1e-18
    for rod in found.layout.rods:
        assert length(rod) == pytest.approx((1.0 + rod.strain) * rod.length, abs=1e-13)
    larger = ring(rods__length_error=dict.fromkeys(NAMES, 1e-3))
    assert assembled(layout_of(larger), larger.rods).energy < 1e-15
    assert deployed(larger).energy < 1e-15


def test_forces_are_what_the_energy_changes_by() -> None:
    """d E / d e = -N L at the least energy (Castigliano, Engesser), at the same mean angle."""
    errors, step = scattered(1e-4), 1e-7

    def at(change: float) -> Any:
        moved = errors | {"diagonal_rising": list(errors["diagonal_rising"])}
        moved["diagonal_rising"][2] += change
        scene = ring(rods__length_error=moved)
        return assembled(layout_of(scene), scene.rods)

    layout = at(0.0).layout
    rod = next(r for r in layout.rods if (r.name, r.section) == ("diagonal_rising", 2))
    natural = rod.natural_lengths
    place, axes = (np.array([getattr(node, k) for node in rod.nodes]) for k in ("place", "axes"))
    # Along the arc: bending brings the ends as near to each other as the force does.
    stretch = strains(natural)(place[:-1], axes[:-1], place[1:], axes[1:])[:, 0]
    forces = rod.young_modulus * rod.tube.area * stretch / natural
    slope = (at(step).energy - at(-step).energy) / (2.0 * step)
    assert slope == pytest.approx(-float(np.sum(forces * rod.lengths)), rel=2e-3)


def test_the_mean_angle_stays_and_joints_stay_closed() -> None:
    scene = ring(rods__length_error=scattered(1e-3))
    drawn, found = layout_of(scene), assembled(layout_of(scene), scene.rods).layout
    angles, before = found.opening_angles()[0], drawn.opening_angles()[0]
    assert abs(angles.mean() - before.mean()) < 1e-12
    assert np.ptp(angles) > math.radians(0.1)
    for joint in found.joints:
        first, second = found.pose(joint.first), found.pose(joint.second)
        assert np.abs(first.place - second.place).max() < 1e-12
        assert first.axes[:, 2] @ second.axes[:, 2] > 1.0 - 1e-12


def test_both_engines_start_where_they_balance() -> None:
    """The prestress is theirs, and what accelerates them is the loads: without any they rest, but
    for what the prestress changes by as the ring opens.
    """
    loaded = ring(rods__length_error=scattered(1e-4), solver__end_time=0.4, record__interval=0.1,
                  solver__step_control="constant", solver__step=0.02)  # fmt: skip
    one, two = by_exudyn(loaded).values, by_frames(loaded).values
    prestress = assembled(layout_of(loaded), loaded.rods).energy
    for values in (one, two):
        assert values["prestress_energy"] == pytest.approx(prestress, rel=1e-6)
    assert np.abs(one["opening_angle"] - two["opening_angle"]).max() < 1e-6
    assert one["rod_energy"] == pytest.approx(two["rod_energy"], rel=1e-5)
    free = loaded.with_values({"loads": "none", "solver.end_time": 0.1})
    values = by_frames(free).values
    assert np.nanmax(values["kinetic_energy"]) < 1e-3 * prestress


@pytest.mark.parametrize("base", ["free", "fixed"])
def test_a_boom_stands_where_the_bodies_on_it_are(base: str) -> None:
    """Two sections with longer diagonals fit without strain, and the boom is straight: nothing
    is stored but what the ropes hold, and forces are those of one that is as drawn.  Nodes on the
    drawn axis, and a body beside it, held 5e-2 J, and the run ended as "diverged".
    """
    errors = {"rods.length_error": {"diagonal_falling": [1e-4, 2e-4]}}
    drawn = load_scene("truss2").with_values(
        {"boom": {"kind": "flexible", "base": base}, "record.reactions": True,
         "record.interval": 2e-3, "solver.step_control": "constant", "solver.step": 2e-3,
         "solver.end_time": 0.02}
    )  # fmt: skip
    made = drawn.with_values(errors)
    layout = assembled(layout_of(made), made.rods).layout
    top, low = (layout.bodies[plane[0]].pose for plane in layout.corners)
    assert (np.abs(top.axes - np.eye(3)).max() > 1e-6) == (base == "free")
    assert np.abs((top.axes.T @ (low.place - top.place))[:2]).max() < 1e-12
    for solve in (by_exudyn, by_frames):
        plain, found = solve(drawn).values, solve(made).values
        assert abs(found["elastic_energy"][0] - plain["elastic_energy"][0]) < 1e-14
        for name in ("base_rotation",) if base == "free" else ("base_force", "base_torque"):
            largest = np.abs(plain[name]).max()
            # A percent is what a tilt of 1e-4 does to the motion.
            assert np.abs(found[name] - plain[name]).max() < 2e-2 * largest, (name, solve)


def test_a_boom_that_starts_in_a_strained_ring_rests() -> None:
    """It is straight, and what bends it then is a hundred thousandth of what the rods hold."""
    scene = ring(
        boom={"kind": "flexible", "base": "fixed"}, rods__length_error=scattered(1e-4),
        loads="none", solver__step_control="constant", solver__step=2e-3, solver__end_time=0.1,
        record__interval=2e-3,
    )  # fmt: skip
    prestress = assembled(layout_of(scene), scene.rods).energy
    for solve in (by_exudyn, by_frames):
        values = solve(scene).values
        assert values["elastic_energy"][0] == pytest.approx(prestress, rel=1e-6)
        assert np.nanmax(values["kinetic_energy"]) < 1e-3 * prestress


@pytest.mark.parametrize("solve", [by_exudyn, by_frames], ids=["exudyn", "frames"])
def test_a_start_that_assembly_does_not_account_for_is_told(
    solve: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rod is built longer by 1e-4 than the one that the structure was put together with: nothing
    else would say so.
    """
    scene = ring(boom={"kind": "rigid", "base": "fixed"}, rods__length_error=scattered(1e-4),
                 solver__end_time=0.3, record__interval=0.1)  # fmt: skip
    assert solve(scene).status.word == "ok"

    def wrong(layout: Layout, rods: Any) -> Any:
        made = assembled(layout, rods)
        first, *others = made.layout.rods
        longer = replace(first, strain=first.strain + 1e-4)
        return made._replace(layout=replace(made.layout, rods=(longer, *others)))

    engine = {by_exudyn: "ringsim.exudyn.model", by_frames: "ringsim.frame.model"}[solve]
    monkeypatch.setattr(f"{engine}.assembled", wrong)
    found = solve(scene)
    assert found.status.word == "diverged"
    assert found.cause is Cause.STRAINED
    assert "at the start" in found.reason


def test_sections_are_held_at_their_own_angles_until_they_are_released() -> None:
    """The energy goes with the square of how far angles differ; held alike they strain nothing."""
    apart = np.array([0.02, -0.01, 0.03, -0.04])
    found = {}
    for size in (1.0, 2.0):
        scene = ring(structure__angle_error=(size * apart).tolist())
        drawn = layout_of(scene)
        made = assembled(drawn, scene.rods)
        more = np.degrees(made.layout.opening_angles()[0] - drawn.opening_angles()[0])
        assert np.abs(more - size * apart).max() < 1e-9
        found[size] = made.energy
    assert found[2.0] == pytest.approx(4.0 * found[1.0], rel=2e-2)
    alike = ring(structure__angle_error=0.5)
    assert assembled(layout_of(alike), alike.rods).energy < 1e-16
    shared = {"solver__end_time": 0.3, "record__interval": 0.1}
    held = by_frames(ring(structure__angle_error=apart.tolist(), **shared)).values
    assert held["prestress_energy"] == pytest.approx(found[1.0], rel=1e-6)
    at_start = held["opening_angle"][..., 0]
    assert np.abs(at_start - alike.structure.opening_angle - apart).max() < 1e-9


def test_a_ring_that_has_come_to_rest_has_the_shape_and_the_energy_of_statics() -> None:
    """What is left are loads, the give of the stops under them, and what still vibrates."""
    scene = ring(
        rods__length_error=scattered(1e-4), record__shape=True, stop__latch=True,
        rods__damping=1e-2, solver__settling_time=5.0, solver__end_time=15.0,
    )  # fmt: skip
    found, expected = by_frames(scene).values, deployed(scene)
    assert np.isfinite(found["deployment_time"])
    largest = float(expected.deviations.max())
    assert np.abs(found["corner_deviation"] - expected.deviations).max() < 0.1 * largest
    last = found["rod_energy"][np.isfinite(found["rod_energy"])][-1]
    assert last == pytest.approx(expected.energy, rel=0.05)


def test_a_scene_without_errors_is_as_it_was() -> None:
    scene = ring()
    layout = layout_of(scene)
    assert assembled(layout, scene.rods).layout is layout
    assert "length_error" not in scene.to_toml()
    assert "temperature" not in scene.to_toml()
    zero = ring(rods__length_error={}, solver__end_time=0.3)
    plain = ring(solver__end_time=0.3)
    one, two = by_frames(plain).values, by_frames(zero).values
    for name in one.keys() - {"wall_time", "cpu_time"}:
        assert str(one[name].tolist()) == str(two[name].tolist()), name


@for_each(("scene", "values", "words"), [
    ("ring18", {"rods.length_error": {"bar_upper_left": 0.1}}, "bar_upper_left = 0.1"),
    ("ring18", {"rods.length_error": {"bar_upper_left": [1e-4, 0.0]}}, "has 2 values"),
    ("ring18", {"rods.length_error": {}, "rods.kind": "ancf"}, "rods.length_error needs rods.kind"),
    ("ring18", {"structure.angle_error": -20.0, "structure.opening_angle": 12.0}, "must leave"),
    ("ring18", {"structure.angle_error": 0.1, "rods.kind": "ancf"}, "angle_error needs rods.kind"),
    ("planar-truss", {"rods.length_error": {}}, '"planar-truss" has no such parts'),
    ("planar-truss", {"record.shape": True}, 'structure.kind = "planar-truss" has no corners'),
])  # fmt: skip
def test_bad_input_is_refused(scene: str, values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_scene(scene).with_values(values)


@pytest.mark.parametrize(("diameter", "times"), [(0.1, 1.0), (0.012, 8e3), (0.1, 8e3)])
def test_the_stiffest_rods_are_put_together_as_all_others(diameter: float, times: float) -> None:
    """Where round-off is more than any force of small tubes: the same shape, and an energy that
    goes with the stiffness.
    """
    rng, tube = (
        np.random.default_rng(4),
        {"outer_diameter": diameter, "inner_diameter": 0.9 * diameter},
    )
    errors = {name: (1e-5 * rng.standard_normal(18)).tolist() for name in NAMES}
    young = float(load_scene("ring18").rods.young_modulus)
    found = []
    for modulus in (young, times * young):
        scene = ring(18, rods__diagonal=tube, rods__bar=tube, rods__young_modulus=modulus)
        scene = scene.with_values({"rods.length_error": errors})
        found.append(assembled(layout_of(scene), scene.rods))
    (first, energy), (second, larger) = found
    assert larger == pytest.approx(times * energy, rel=1e-6)
    for one, other in zip(first.bodies, second.bodies, strict=True):
        np.testing.assert_allclose(one.pose.place, other.pose.place, atol=1e-9)


@pytest.mark.parametrize("solver", ["run", "run_frame"])
def test_a_ring_that_cannot_be_put_together_is_refused_and_a_sample_is_a_row(solver: str) -> None:
    """In a line that names the fields: it is the input that is wrong, not the solver."""
    errors = {"diagonal_rising": 0.01, "diagonal_falling": -0.01}
    scene = ring(6, structure__opening_angle=179.5)
    words = r"rods\.length_error, .* cannot be put together"
    with pytest.raises(InputError, match=f"^{words}"):
        getattr(simulation, solver)(scene.with_values({"rods.length_error": errors}))
    values = {f"rods.length_error.{name}": value for name, value in errors.items()}
    found = work.solve(getattr(simulation, solver), scene, 0, values)
    assert (found.status, found.cause) == (Status.ERROR, Cause.REFUSED)
    assert re.match(words, found.reason)


@pytest.mark.parametrize("errors", [
    {"rods__length_error": scattered(2e-4, 3)}, {"structure__angle_error": [0.05, -0.03, 0.02]},
])  # fmt: skip
def test_ropes_begin_as_long_as_the_path_that_the_assembly_leaves(errors: dict[str, Any]) -> None:
    """In both engines: without slack and before the winch turns a rope has 0.69 of its width."""
    values = {name.replace("__", "."): value for name, value in errors.items()}
    scene = load_scene("ring18-cable").with_values(
        {"structure.sections": 3, "boom": "none", "net": "none", "solver.end_time": 0.05,
         "solver.step": 0.05, "record.interval": 0.05} | values
    )  # fmt: skip
    frames, full = (solve(scene).values["cable_tension"] for solve in (by_frames, by_exudyn))
    at_rest = scene.cables.upper.slack_width * math.log(2.0)
    for tension in (frames, full):
        assert np.abs(tension[..., 0] / at_rest - 1.0).max() < 1e-4
