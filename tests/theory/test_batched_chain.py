"""The batched chain against ringsim.cable, which works with points in space."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ideal_cases import six
from ringsim.cable.cables import Cables
from ringsim.scene import Scene
from ringsim.theory.ideal_batch import Batch

ROUND_OFF = 1e-10
"""A rope of 1e5 N over 4 m: 1e-15 m of round-off in its path are 3e-11 N."""

BEARING = {"kind": "bearing", "coefficient": 0.0012}
FRICTIONS = (
    {"kind": "none"},
    BEARING,
    {"kind": "bearing-exact", "coefficient": [0.0001 * k for k in range(17)]},
    {"kind": "capstan", "coefficient": 0.1},
)
JAM = {"kind": "jammed-pulley", "time": 0.0, "cable": 2, "pulley": 5}
CUT = {"kind": "cut-cable", "time": 0.0, "cable": 1, "span": 3}


def batch_of(*scenes: Scene) -> Batch:
    return Batch(scenes)


def compare(batch: Batch, sample: int, phi: float, rate: float, wound, speed) -> None:
    equation = batch.equation().take(np.array([sample]))
    state = batch.chain_state(sample, phi, rate, wound, speed)
    at = (np.array([[phi]]), np.array([[rate]]), wound[None, None], speed[None, None])
    found = equation.chain.evaluate(equation.cables, equation.ropes, *at)
    top = max(1.0, float(np.abs(state.tensions).max()))
    near = {"rtol": 1e-9, "atol": ROUND_OFF * top}
    np.testing.assert_allclose(found.tensions[0, 0], state.tensions, **near)
    np.testing.assert_allclose(found.stretch[0, 0], state.paths - state.natural, atol=1e-13)
    lost = state.friction_loss.sum() + state.damping_loss.sum()
    assert found.loss.sum() == pytest.approx(lost, rel=1e-8, abs=ROUND_OFF * top)
    power = state.winch_power.sum() - state.drum_power.sum()
    assert found.winch_power.sum() == pytest.approx(power, rel=1e-8, abs=ROUND_OFF * top)
    assert found.elastic.sum() == pytest.approx(state.elastic_energy.sum(), rel=1e-8)
    torque = equation.chain.torque(equation.cables, equation.ropes, *at).sum()
    moved = float(np.sum(state.tensions * state.rates))
    assert torque * rate == pytest.approx(-moved, rel=1e-8, abs=ROUND_OFF * top)


@pytest.mark.parametrize("friction", FRICTIONS, ids=lambda f: f["kind"])
@pytest.mark.parametrize("end", ["first", "last", "both"])
def test_batched_chain_equals_chain_in_space(end, friction):
    if end == "both" and isinstance(friction.get("coefficient"), list):
        friction = friction | {"coefficient": [*friction["coefficient"], 0.0005]}
    scene = six(cable__end=end, cable__friction=friction, cable__damping_time=0.003)
    other = scene.with_values({"cables.upper.axial_stiffness": 2e4, "cables.winch_distance": 0.5})
    batch = batch_of(scene, other)
    random = np.random.default_rng(3)
    for phi in (1.45, 0.9, 0.3, -0.01):
        wound = random.uniform(0.0, 0.1, (2, 2))
        wound += 0.1 * (1.4 - phi)
        if end != "both":
            wound[:, 1] = 0.0
        speed = random.uniform(-0.05, 0.05, (2, 2)) * (wound > 0.0)
        cables = len(batch.planes)
        for sample in range(2):
            rate = float(random.normal())
            compare(batch, sample, phi, rate, wound[:cables], speed[:cables])


@pytest.mark.parametrize("faults", [[JAM], [CUT], [JAM, CUT]], ids=["jam", "cut", "both"])
def test_batched_chain_knows_faults(faults):
    batch = batch_of(six(faults=faults, cable__friction=BEARING))
    rest = np.zeros((2, 2))
    wound, speed = np.array([[0.02, 0.0], [0.03, 0.0]]), np.array([[0.01, 0.0], [0.02, 0.0]])
    for fault in batch.scenes[0].faults:
        state = batch.chain_state(0, 1.39, 0.0, rest, rest)
        batch.ropes[0] = fault.strike(batch.ropes[0], state)
    compare(batch, 0, 1.3, -0.1, wound, speed)


@given(
    phi=st.floats(-0.05, 1.5),
    rate=st.floats(-2.0, 2.0),
    wound=st.floats(-0.05, 0.8),
    speed=st.floats(-0.3, 0.3),
    friction=st.floats(0.0, 0.0095),
)
def test_friction_feeds_nothing_in_whatever_the_motion(phi, rate, wound, speed, friction):
    law = {"kind": "bearing", "coefficient": friction}
    batch = batch_of(six(cable__friction=law, cable__damping_time=0.001))
    equation = batch.equation()
    assert isinstance(batch.scenes[0].cables, Cables)
    ends = np.array([[[[wound, 0.0]]]]), np.array([[[[speed, 0.0]]]])
    at = np.array([[phi]]), np.array([[rate]])
    found = equation.chain.evaluate(equation.cables, equation.ropes, *at, *ends)
    assert found.loss.min() >= -1e-9 * max(1.0, float(found.tensions.max()))
    assert found.tensions.min() >= 0.0
