"""V pulleys on brackets that are fixed to a bar half: paths, work and a run."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from driven import outcome, truss
from ringsim.exudyn.build import build
from ringsim.refusal import InputError
from ringsim.rigid.mechanism import Mechanism
from ringsim.scene import Scene
from ringsim.variables import Outcome, Status


def scene(half: str = "first", **values: Any) -> Scene:
    fields: dict[str, Any] = {
        "structure__opening_angle": 60.0,
        "both__bracket": {"kind": "bar-half", "angle": 110.0, "half": half},
        "both__winch__winding": {"kind": "ramp", "speed": 0.05, "duration": 0.5},
        "solver__end_time": 12.0,
    }
    return truss(2, **(fields | values))


@cache
def opened(half: str, engine: str) -> Outcome:
    return outcome(scene(half, solver__tolerance=1e-3), engine)


@pytest.mark.parametrize("end", ["first", "last", "both"])
@pytest.mark.parametrize("half", ["first", "second"])
@pytest.mark.parametrize("opening", [60.0, 130.0])
def test_points_of_the_model_are_those_of_the_bracket(half: str, end: str, opening: float) -> None:
    given = scene(half, both__end=end, structure__opening_angle=opening)
    drive = build(given).cables
    assert drive is not None
    assert given.cables is not None
    _, placed = drive.evaluate(drive.reference, 0.0 * drive.reference, 0.0)
    mechanism = Mechanism(given)
    now = mechanism.at(given.structure.coordinate)
    expected = np.vstack([now.places(mechanism.points.path(k)) for k in range(2)])
    assert placed.points == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize(
    ("half", "engine"),
    [
        # test_points_of_the_model above is of exudyn's model, in any case.
        pytest.param("first", "full", marks=pytest.mark.slow),
        ("first", "frame"),
        ("second", "frame"),
        pytest.param("second", "full", marks=pytest.mark.slow),
    ],
)
def test_a_truss_opens_by_the_rope_that_is_wound(half: str, engine: str) -> None:
    """Where the brackets were turned in the model, the path would not follow the bracket's law."""
    given = scene(half)
    found = opened(half, engine)
    assert found.status == Status.OK
    assert found.values["energy_error"] < 1e-3
    assert given.cables is not None
    assert given.cables.upper is not None
    bracket, ring = given.cables.upper.bracket, given.structure
    time = found.coordinates["time"]
    kept = (time > 2.0) & (time < float(np.nanmin(found.values["lock_time"])) - 0.2)
    assert np.count_nonzero(kept) > 40
    angles = np.radians(found.values["opening_angle"][0][:, kept])
    path, start = (
        np.array(bracket.spans(ring.half_bar, 0.105, a)).sum(axis=0)
        for a in (angles, np.radians(60))
    )
    taken = (start - path).sum(axis=0)
    # Taut rope: elongations of 1e-5 m and rods that bend by a few times that.
    assert found.values["cable_tension"][0, :, kept].min() > 0.05
    assert taken == pytest.approx(found.values["wound_length"][0, kept], abs=2e-4)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"structure__opening_angle": 15.0}, "bracket.angle = 110.0 deg must be at most 105 deg"),
        ({"rods__kind": "ancf"}, 'bracket.kind = "bar-half" needs rods.kind'),
    ],
)
def test_brackets_that_cannot_be_are_refused(values: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError) as refused:
        scene(**values)
    assert text in str(refused.value)
