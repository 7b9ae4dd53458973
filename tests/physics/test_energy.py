"""Energy, momentum and symmetry: what an undamped ring must keep."""

import numpy as np
import pytest

from ring_runs import Run, ring, run


@pytest.fixture(scope="module", params=["frame", "full"])
def engine(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def usual(engine: str) -> Run:
    return run(ring(3), engine)


@pytest.fixture(scope="module")
def fine(engine: str) -> Run:
    return run(ring(3, solver__tolerance=8e-6), engine)


def test_energy_is_closed_before_the_first_contact(fine: Run) -> None:
    """Velocities are of second order in the step, h^2 ~ tolerance; ten times the tolerance."""
    assert np.abs(fine.balance()[fine.before_contact()]).max() < 1e-4


def test_energy_error_falls_with_the_tolerance(usual: Run, fine: Run) -> None:
    """12.5 times the tolerance, 7.1 times the error (3.6e-4 and 5.2e-5).

    Steps that lack too much energy are repeated, which takes more from the larger error.
    """
    errors = [np.abs(r.balance()[r.before_contact()]).max() for r in (usual, fine)]
    assert errors[0] < 5e-4
    assert 5.0 < errors[0] / errors[1] < 20.0


def test_energy_converges_over_the_impact(fine: Run, engine: str) -> None:
    """Steps that lack energy are repeated, over the stop as well (4.6e-4 and 9.0e-5).

    What is left is the smallest step, which goes with the largest: all are halved, by the tolerance
    and ``solver.step``.  Here twice: halvings leave 4.6e-4, 1.6e-4, 9.0e-5, 4.8e-5, 1.0e-5,
    unevenly, as what is left of single steps that gain and lose ten times as much.
    """
    coarse = run(ring(3, solver__tolerance=1.28e-4, solver__step=0.8), engine)
    errors = [np.abs(r.balance()).max() for r in (coarse, fine)]
    assert errors[1] < 1e-4
    assert errors[1] < 0.25 * errors[0]


def test_stops_and_rods_take_energy_and_never_give_any(fine: Run) -> None:
    energies = np.array(fine.history.energies)
    assert (energies[:, 3] >= 0.0).all()
    assert (energies[fine.before_contact(), 3] == 0.0).all()


def test_joints_stay_closed() -> None:
    # Position constraints to Newton's last bit: coordinates of 1 m in doubles.
    assert max(run(ring(3, solver__end_time=1.0)).history.gaps) < 1e-13


def test_both_planes_move_alike(engine: str) -> None:
    """No gravity: with the boom left out of sight, above and below are mirror images."""
    free = run(ring(3, boom="none"), engine)
    # Newton leaves 1e-5 of the driving forces.
    np.testing.assert_allclose(free.angles[:, 0], free.angles[:, 1], atol=1e-6)
    # And a circle of equal sections turns into itself.
    np.testing.assert_allclose(np.ptp(free.angles, axis=(1, 2)), 0.0, atol=1e-6)


def test_sections_on_both_sides_of_the_boom_mirror_each_other(usual: Run) -> None:
    before = usual.angles[usual.before_contact()]
    np.testing.assert_allclose(before, before[:, :, ::-1], atol=2e-6)


def test_an_arc_is_its_own_mirror_image(engine: str) -> None:
    arc = run(ring(3, structure__closed=False, boom="none", solver__end_time=1.0), engine)
    differences = np.ptp(arc.angles[-1])
    assert differences > 1e-6
    np.testing.assert_allclose(arc.angles, arc.angles[:, :, ::-1], atol=1e-3 * differences)


def test_where_nothing_moves_round_off_is_no_imbalance(engine: str) -> None:
    """A ring that nothing drives: what is exchanged is round-off, as is what is lacking."""
    still = ring(3, loads__force=0.0, solver__end_time=0.3)
    told = run(still, engine).history.outcome().values
    assert np.nanmax(np.abs(told["work"])) < 1e-12
    assert told["energy_error"] < 1e-6
