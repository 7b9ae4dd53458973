"""Newton's method in a step: Broyden's corrections against the secant method and a linear system's
solution; iterations where motion is smooth; what stops it.
"""

import numpy as np
import pytest

from law_scenes import CABLES, of_cables
from ringsim.core.library import call
from ringsim.frame.integrate import Integration
from ringsim.frame.model import FrameModel
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick


class Secants:
    """The changes since a tangent, with lengths by which turns become ways."""

    def __init__(self, lengths: np.ndarray) -> None:
        self._weights, self._made = lengths**2, 0
        self._changes, self._squares = np.zeros((25, len(lengths))), np.zeros(25)

    def forget(self) -> None:
        self._made = 0

    def corrected(self, change: np.ndarray) -> np.ndarray:
        found = change.copy()
        call("learn", self._weights, self._changes, self._squares, self._made, found)
        self._made += 1
        return found


def test_one_unknown_is_the_secant_method() -> None:
    """x^2 = 2 with the tangent of x = 2: the iterates are those of the secant formula."""

    def g(x: float) -> float:
        return x * x - 2.0

    secants, found = Secants(np.ones(1)), [2.0]
    for _ in range(6):
        change = secants.corrected(np.array([-g(found[-1]) / 4.0]))
        found.append(found[-1] + float(change[0]))
    expected = found[:2]
    for _ in range(5):
        before, now = expected[-2:]
        slope = (g(now) - g(before)) / (now - before)
        expected.append(now - g(now) / slope)
    assert found == pytest.approx(expected, abs=1e-12)
    assert found[-1] == pytest.approx(np.sqrt(2.0), abs=1e-12)


def test_a_linear_system_is_solved_though_its_matrix_is_wrong() -> None:
    """In 2 n changes (Gay, SIAM Journal on Numerical Analysis 16, 1979); without corrections 2e-4
    of the error are left then.
    """
    random = np.random.default_rng(2)
    matrix = np.eye(4) + 0.25 * random.normal(size=(4, 4))
    wanted, secants = random.normal(size=4), Secants(np.ones(4))
    x, plain = np.zeros(4), np.zeros(4)
    for _ in range(9):
        x = x + secants.corrected(matrix @ (wanted - x))
        plain = plain + matrix @ (wanted - plain)
    assert np.abs(x - wanted).max() < 1e-9
    assert np.abs(plain - wanted).max() > 1e-4


def test_a_change_like_the_last_one_is_left_alone() -> None:
    secants, change = Secants(np.ones(2)), np.array([1.0, 2.0])
    assert np.array_equal(secants.corrected(change), change)
    assert np.array_equal(secants.corrected(0.9 * change), 0.9 * change)
    secants.forget()
    assert np.array_equal(secants.corrected(change), change)


def test_a_turn_counts_as_the_way_it_moves() -> None:
    """In other units of length the same changes are corrected alike."""
    random, found = np.random.default_rng(3), []
    changes = random.normal(size=(3, 2)) * [1.0, 0.5]
    for unit in (1.0, 64.0):
        secants, ways = Secants(np.array([1.0, 0.3 * unit])), np.array([unit, 1.0])
        found.append([secants.corrected(ways * change) / ways for change in changes])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12)
    assert not np.allclose(found[0][2], changes[2])


def test_a_flight_takes_few_iterations() -> None:
    """Twenty minutes in steps of some seconds: the motion is smooth, and a cubic foretells it."""
    winding = dict.fromkeys(
        (f"cables.{plane}.winch.winding.speed" for plane in ("upper", "lower")), 0.0026
    )
    values = winding | {"solver.end_time": 1500.0, "solver.step": 5.0}
    run = Integration(FrameModel(load_scene("ring18-cable").with_values(values))).run()
    assert str(run.reason) == "all V-joints have reached 180 deg"
    assert run.newton_iterations < 4 * (len(run.times) - 1)
    assert len(run.times) < 700


@pytest.mark.parametrize("error", [ValueError("no speed goes with it"), KeyboardInterrupt()])
def test_what_python_raises_below_the_core_arrives(
    error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A winch that answers is asked from within Newton's method: nothing is swallowed there."""
    scene = of_cables(CABLES["motor"] | {"solver.end_time": 0.1})
    model = FrameModel(scene)
    run = Integration(model)
    own, asked = model.cables.winches.answer, 0

    def refuse(what: int) -> None:
        nonlocal asked
        asked += 1
        if asked > 20:
            raise error
        own(what)

    monkeypatch.setattr(model.cables.winches, "answer", refuse)
    if isinstance(error, KeyboardInterrupt):
        with pytest.raises(KeyboardInterrupt):
            run.run()
    else:
        assert "no speed goes with it" in str(run.run().reason)
    assert asked > 20
