"""Stops, latches, folding back, and how runs end."""

import math

import numpy as np
import pytest

from ring_runs import ENGINES, ideal_time, ring, run
from ringsim.simulation import run as outcome_of
from ringsim.simulation import simulate
from ringsim.stepping.instant import Energies, Instant
from ringsim.stepping.locks import Locks, StopContact
from ringsim.variables import Fate, Status


def test_without_stops_the_run_ends_when_all_have_deployed() -> None:
    dataset = simulate(ring(3, stop="none"))
    assert str(dataset.attrs["reason"]) == "all V-joints have reached 180 deg"
    assert int(dataset["status"]) == 0
    deployed = float(dataset["deployment_time"])
    # The elastic ring without contact; see the spread of lock times in test_against_quadrature.
    assert deployed == pytest.approx(ideal_time(ring(3)), rel=1e-3)
    assert deployed <= float(dataset["final_time"]) < deployed + 0.02


def test_reversed_forces_fold_an_open_ring() -> None:
    dataset = simulate(
        ring(3, structure__opening_angle=170.0, loads__force=-0.03, stop__stowed_angle=40.0)
    )
    assert int(dataset["status"]) == 0
    assert "stowed" in str(dataset.attrs["reason"])
    assert math.isnan(float(dataset["deployment_time"]))
    opening = dataset["opening_angle"].dropna("time")
    assert float(opening.isel(time=-1).mean()) == pytest.approx(40.0, abs=2.0)


def locks(opening: float) -> tuple[Locks, np.ndarray]:
    """The memory of joints that start at an opening angle, their stowed stop at 40 deg."""
    angles = np.full((2, 3), math.radians(opening))
    return Locks(angles, math.radians(40.0)), angles


def contact(memory: Locks, angles: np.ndarray, rates: np.ndarray) -> StopContact:
    return memory.contact(Instant(0.0, angles, rates, Energies(0.0, 0.0, 0.0, 0.0)))


def test_joints_that_bounce_have_reached_the_stowed_stop() -> None:
    memory, angles = locks(90.0)
    folding = np.full((2, 3), -1.0)
    for place in np.ndindex(2, 3):
        assert not memory.stowed.all()
        angles[:] = math.radians(42.0)  # those that came before have bounced
        angles[place] = math.radians(39.9)
        memory.note(angles)
        assert memory.stowed[place]
    assert memory.stowed.all()
    # They rest near the stop, with contact steps, and wait for no first meeting.
    found = contact(memory, angles, folding)
    assert found.resting_rate == 1.0
    assert found.time_to_next == math.inf
    # Far from it they are free again.
    assert contact(memory, np.full((2, 3), math.radians(60.0)), folding).resting_rate == 0.0


def test_the_first_joint_to_meet_the_stowed_stop_sets_the_step() -> None:
    memory, angles = locks(90.0)
    rates = np.zeros((2, 3))
    rates[1, 2] = -2.0
    found = contact(memory, angles, rates)
    assert found.time_to_next == pytest.approx(math.radians(50.0) / 2.0)
    assert found.rate_of_next == 2.0
    assert found.resting_rate == 0.0


def test_a_ring_that_starts_on_its_stowed_stop_has_not_folded() -> None:
    memory, angles = locks(40.02)
    memory.note(angles - 1e-3)
    assert not memory.stowed.any()
    # Pressed into the stop it needs contact steps all the same.
    assert contact(memory, angles - 1e-3, np.full((2, 3), 0.5)).resting_rate == 0.5
    for opened in (60.0, 39.9):
        memory.note(np.full((2, 3), math.radians(opened)))
    assert memory.stowed.all()


def test_folding_takes_the_time_that_the_quadrature_gives() -> None:
    scene = ring(3, structure__opening_angle=170.0, loads__force=-0.03, solver__end_time=20.0)
    found = run(scene)
    # Released near 180 deg, where the sections are least tied together, the rods give more than
    # when stowed: 2.3e-4 when this was written.
    assert found.reaches(60.0) == pytest.approx(ideal_time(scene, 60.0), rel=4e-4)


def test_an_unfinished_run_says_so_and_ends_in_nan() -> None:
    dataset = simulate(ring(3, solver__end_time=1.0))
    assert int(dataset["status"]) == Status.OK
    assert int(dataset["outcome"]) == Fate.CUT_OFF
    assert int(dataset["locked_joints"]) == 0
    assert "end_time" in str(dataset.attrs["reason"])
    assert math.isnan(float(dataset["deployment_time"]))
    assert np.isnan(dataset["lock_time"]).all()
    assert float(dataset["final_time"]) == pytest.approx(1.0, rel=1e-12)
    assert np.isfinite(dataset["opening_angle"]).all()


def test_what_lies_after_the_end_is_nan() -> None:
    dataset = simulate(ring(3, solver__end_time=10.0))
    after = dataset["time"] > dataset["final_time"]
    assert bool(after.any())
    opening = dataset["opening_angle"]
    assert bool(opening.where(after, drop=True).isnull().all())
    assert bool(opening.where(~after, drop=True).notnull().all())


@pytest.mark.parametrize(
    "hardship",
    [
        pytest.param({"solver__newton_tolerance": 1e-12}, id="newton-below-round-off"),
        pytest.param(
            {"solver__step": 1.0, "solver__step_control": "constant"}, id="steps-of-a-second"
        ),
        pytest.param({"loads__force": 1e4}, id="violent", marks=pytest.mark.slow),
        pytest.param({"rods__young_modulus": 1e15}, id="stiff-as-nothing"),
    ],
)
def test_hard_cases_end_in_a_sound_number_or_a_cure(hardship: dict[str, float]) -> None:
    scene = ring(3, solver__end_time=4.0, **hardship)
    dataset = simulate(scene)
    reason = str(dataset.attrs["reason"])
    match Status(int(dataset["status"])):
        case Status.OK if int(dataset["outcome"]) == Fate.CUT_OFF:
            assert ideal_time(scene) > 4.0
        case Status.OK:  # the spread of lock times of the elastic ring
            assert float(dataset["deployment_time"]) == pytest.approx(ideal_time(scene), rel=2e-3)
        case Status.SOLVER_FAILED | Status.DIVERGED:
            assert "solver." in reason
        case other:
            pytest.fail(f"{other.word}: {reason}")


def test_a_run_that_creeps_is_given_up_with_the_cure() -> None:
    outcome = outcome_of(ring(3, solver__step_limit=20))
    assert outcome.status is Status.SOLVER_FAILED
    assert "solver.step_limit = 20" in outcome.reason
    assert "raise solver.tolerance" in outcome.reason
    assert int(outcome.values["steps"]) == 20


@ENGINES
def test_settling_counts_from_the_last_lock(engine: str) -> None:
    """Not from the end of the step in which it happens, which would shake every peak after it."""
    for tolerance in (1e-3, 1e-4):
        late = {"structure__opening_angle": 150.0, "solver__settling_time": 0.03}
        found = run(ring(3, solver__tolerance=tolerance, **late), engine)
        assert found.times[-1] - found.locks.max() == pytest.approx(0.03, abs=1e-9)
