"""Laws that are played back against the laws themselves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from loops import for_each

from ringsim.cable.friction import (
    BearingFriction,
    CapstanFriction,
    ExactBearingFriction,
    Frictionless,
)
from ringsim.frame.laws import Tape, play, taped
from ringsim.parts.faults import StuckVJoint
from ringsim.parts.joints import (
    Latch,
    LinearSpring,
    SpringDamperStop,
    TableSpring,
    TapeSpring,
    ViscousCoulombFriction,
)
from ringsim.parts.net import SpringNet
from ringsim.refusal import InputError

pytestmark = pytest.mark.quick

SHAPE = (2, 5)
STOP = SpringDamperStop(stiffness=50.0, damping=0.3, stowed_angle=10.0)
TABLE = TableSpring(angles=(30.0, 90.0, 150.0), torques=(0.2, -0.1, 0.4))
EACH = np.linspace(0.5, 1.5, SHAPE[1])
RAMP = Latch(peak_torque=0.05, reach=20.0).model_copy(update={"peak_torque": 0.05 * EACH})
RUBBING = ViscousCoulombFriction(viscous=0.01, coulomb=0.02, rate=0.3)
ROUND_OFF = 1e-15
"""Of numbers of order 1: numpy's tanh and the mathematical library's differ in the last place."""


def laws() -> dict[str, Any]:
    angle = {"deep": 0.01, "wide": 3.0}
    found: dict[str, Any] = {
        f"stop-{name}": (lambda x, v, on, k=k: STOP.reaction(k * x, v, on))
        for name, k in angle.items()
    }
    for spring in (
        LinearSpring(stiffness=0.2, preload=0.1), TABLE, TapeSpring(force=2.0, radius=0.03)
    ):  # fmt: skip
        found[f"spring-{spring.kind}"] = lambda x, *_, s=spring: s.torque(3.0 * x)
    for sided in (False, True):
        net = SpringNet(stiffness=0.3, damping=0.02, two_sided=sided)
        found[f"net-{sided}"] = lambda x, v, _, n=net: n.reaction(x, v, 1.0)
    fault = StuckVJoint(section=1, time=0.0)
    found["stuck"] = lambda x, v, _: fault.reaction(x, v, 0.0)
    found["latch"] = lambda x, *_: RAMP.reaction(x, 0.0, 0.0)
    found["dry"] = lambda _x, v, _: (0.0, RUBBING.torque(v), 0.0)
    return found


def played(tape: Tape, given: list[Any], results: int) -> list[Any]:
    for row, value in enumerate(given):
        tape.rows[row] = value.ravel()
    play(tape)
    return [tape.rows[len(given) + n].reshape(SHAPE) for n in range(results)]


@pytest.mark.parametrize("name", laws())
def test_a_tape_does_what_its_law_does(name: str) -> None:
    law, random = laws()[name], np.random.default_rng(0)
    tape = taped([(law, SHAPE, None)], 3, 3)
    for _ in range(3):  # a tape keeps nothing of what it was played with before
        x, v = random.normal(size=(2, *SHAPE))
        on = 1.0 * (random.random(SHAPE) > 0.5)
        expected = [np.broadcast_to(each, SHAPE) for each in law(x, v, on)]
        assert max(np.abs(each).max() for each in expected) > 1e-6
        for found, each in zip(played(tape, [x, v, on], 3), expected, strict=True):
            assert np.abs(found - each).max() <= ROUND_OFF * max(1.0, np.abs(each).max())


@pytest.mark.parametrize(
    "friction",
    [
        BearingFriction(coefficient=8e-4), ExactBearingFriction(coefficient=8e-4),
        CapstanFriction(coefficient=0.1), Frictionless(),
    ],
    ids=lambda friction: friction.kind,
)  # fmt: skip
@pytest.mark.parametrize("what", ["log_decay", "log_slope"])
def test_pulleys(friction: Any, what: str) -> None:
    law = getattr(friction, what)
    angles = np.linspace(0.1, 3.1, 10).reshape(SHAPE)
    (found,) = played(taped([(lambda a: law(a, 0.01), SHAPE, friction)], 1, 1), [angles], 1)
    assert np.abs(found - law(angles, 0.01)).max() <= ROUND_OFF


@pytest.mark.parametrize(
    "law",
    [
        lambda x, y: np.exp(x) - np.log(np.abs(y)), lambda x, y: np.sqrt(np.abs(x)) * np.sign(y),
        lambda x, y: np.square(x) / y + x**3 - y**2, lambda x, y: -np.sin(x) + np.cos(+y),
        lambda x, y: np.where(np.less(x, y), np.tanh(x), np.arctanh(0.1 * y)),
        lambda x, y: np.maximum(x, y) * np.minimum(x, 0.5) + np.greater(y, x),
        lambda x, y: np.clip(x, -0.5, 0.5) + (x >= y) - (y <= 0.0) + np.arctan(y),
        lambda x, y: np.log1p(np.abs(x)) - np.expm1(y),
    ],
)  # fmt: skip
def test_functions(law: Any) -> None:
    x, y = np.random.default_rng(2).normal(size=(2, *SHAPE))
    (found,) = played(taped([(law, SHAPE, None)], 2, 1), [x, y], 1)
    assert np.abs(found - law(x, y)).max() <= 4.0 * ROUND_OFF * np.abs(found).max()


def test_laws_behind_one_another_keep_to_their_own_columns() -> None:
    x, v = np.random.default_rng(1).normal(size=(2, 4))
    tape = taped(
        [
            (lambda x, v: 2.0 * x + v, (3,), None),
            (lambda x, v: np.where(x > v, x * v, 0.0), (1,), None),
        ],
        2,
        1,
    )
    tape.rows[0], tape.rows[1] = x, v
    play(tape)
    last = x[3] * v[3] if x[3] > v[3] else 0.0
    assert tape.rows[2].tolist() == [*(2.0 * x + v)[:3], last]


def branching(x: Any) -> Any:
    return 2.0 * x if x > 0.0 else -5.0 * x


@for_each(
    ("law", "cause"),
    [
        (lambda x: np.floor(x), "floor"),
        (lambda x: np.add.reduce(x), "add"),
        (lambda x: np.round(x), "round"),
        (branching, "branches"),
        (lambda x: max(x, 0.0), "branches"),
        (lambda x: np.where(np.asarray(x) > 0.0, x, 9.0), "branches"),
        (lambda x: (x > 0.0) and (x < 1.0), "branches"),
        (lambda x: (x, x), "2 values, not 1"),
        (lambda x: x.sum(), "sum"),
    ],
)
def test_what_tapes_do_not_know_is_refused(law: Any, cause: str) -> None:
    with pytest.raises(InputError, match=f'frame" does not represent the law of .*Stop: .*{cause}'):
        taped([(law, SHAPE, STOP)], 1, 1)


@for_each(
    ("law", "cause"),
    [
        (lambda x: x * STOP.stiffnes, "no attribute 'stiffnes'"),
        (lambda x: x * stifness, "name 'stifness' is not defined"),  # noqa: F821
    ],
)
def test_a_slip_in_a_law_is_told_as_what_it_is(law: Any, cause: str) -> None:
    with pytest.raises(InputError, match=f"^the law of .*Stop does not work: .*{cause}"):
        taped([(law, SHAPE, STOP)], 1, 1)


def test_numbers_that_are_none_stay_so() -> None:
    x = np.full(SHAPE, np.nan)
    tape = taped([(lambda x: np.maximum(x, 0.0) + np.minimum(0.0, x), SHAPE, None)], 1, 1)
    assert np.isnan(played(tape, [x], 1)[0]).all()
