"""What rigid rods cannot represent is refused, with field, reason and cure."""

import pytest

from ideal_cases import six
from ringsim.refusal import InputError
from ringsim.simulation import run_ideal
from ringsim.variables import Status

STUCK = [{"kind": "stuck-vjoint", "time": 1.0, "section": 2}]
UNEVEN = [0.001, 0.001, 0.001, 0.001, 0.001, 0.01]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"faults": STUCK}, ["faults[1].kind", "stuck", "leave it out"]),
        ({"record__stress": True}, ["record.stress", "no stress", "set it to false"]),
        ({"net__stiffness": UNEVEN, "net__damping": 0.01}, ["net.damping", "hub", "set it to 0"]),
        ({"net__hub_mass": 0.1}, ["net.hub_mass", "inertia", "lower it"]),
    ],
    ids=lambda v: next(iter(v)) if isinstance(v, dict) else "",
)
def test_refusal_names_field_reason_and_cure(values, words):
    with pytest.raises(InputError) as caught:
        run_ideal(six(**values))
    for word in [*words, "full fidelity"]:
        assert word in str(caught.value)


def test_an_unbalanced_net_without_damping_is_accepted():
    run_ideal(six(net__stiffness=UNEVEN, solver__end_time=0.2))


def test_lists_whose_sum_counts_are_accepted():
    run_ideal(six(joints__vjoint__viscous=[0.5, 0.4, 0.6, 0.5, 0.5, 0.5], solver__end_time=0.2))


def test_cables_without_an_answer_end_with_a_status():
    """Without an offset of the pins the short spans on the hinge assemblies have no length."""
    scene = six(solver__end_time=0.5)
    structure = scene.structure.model_copy(update={"hinge_offset": 0.0})
    outcome = run_ideal(scene.model_copy(update={"structure": structure}))
    assert outcome.status == Status.SOLVER_FAILED
    assert "no length" in outcome.reason
