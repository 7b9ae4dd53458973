"""Paper 002: the angles of the first section (its fig. 10), and folding by the reversed forces.

Of fig. 10 the text gives what is drawn (the angles between the V-folding bars of the first section
while the antenna deploys) and where the three curves end; the paper obtains the stowed state by the
same forces the other way round.  The curves between are checked with the energy quadrature.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from ring_runs import ENGINES, ideal_time, run
from ringsim.scene import load_scene
from ringsim.variables import Status

PUBLISHED = {0.015: 17.58, 0.02: 15.06, 0.03: 12.16}
RING = load_scene("ring18")
STOWED = RING.structure.opening_angle


@pytest.mark.slow  # tests/readme/test_main_line.py looks at 0.015 N in a run that it has anyway
@pytest.mark.parametrize("force", PUBLISHED)
def test_the_first_section_opens_along_the_curve_of_the_quadrature(force: float) -> None:
    found = run(RING.with_values({"loads.force": force}))
    first, rates = found.angles[:, :, 0], found.rates[:, :, 0]
    free = found.before_contact()
    # It starts at rest at the stowed angle, opens without turning back, and ends at 180 deg when
    # the paper says: to 0.5 %, case 1 being the one that the angle was calibrated on.
    assert np.degrees(first[0]) == pytest.approx(STOWED, abs=1e-9)
    assert np.all(rates[0] == 0.0)
    assert np.all(rates[1:][free[1:]] > 0.0)
    locks = found.locks[:, 0]
    assert locks == pytest.approx(PUBLISHED[force], rel=5e-3)
    assert np.all(np.degrees(first).max(axis=0) >= 180.0)  # its stops have no latches: it bounces
    # The time step alone is good for 1e-4 of the time, 0.02 deg at 10 deg/s; near the end the
    # sections run apart, by 0.1 deg of 170.
    for plane in range(2):
        curve = CubicHermiteSpline(found.times, first[:, plane], rates[:, plane])
        for angle, close in (
            (55.0, 0.01),
            (75.0, 0.02),
            (90.0, 0.03),
            (120.0, 0.06),
            (150.0, 0.15),
        ):
            shown = math.degrees(float(curve(ideal_time(found.scene, angle))))
            assert shown == pytest.approx(angle, abs=close)


@pytest.mark.parametrize(
    ("sections", "start"),
    [*(pytest.param(18, start, marks=pytest.mark.slow) for start in (150.0, 175.0)), (6, 175.0)],
)
@ENGINES
def test_reversed_forces_fold_it_to_the_stowed_stop(
    sections: int, start: float, engine: str
) -> None:
    """How the paper stows its ring: released nearly open, forces of case 1 the other way round.

    The quadrature runs backwards too: from a small bar angle to a large one, the net pulling along.
    """
    scene = RING.with_values(
        {
            "structure.sections": sections,
            "structure.opening_angle": start,
            "net.neutral_length": 0.7116 * sections / 18,
            "loads.force": -0.015,
            "stop.stowed_angle": STOWED,
            "solver.settling_time": 0.0,
            "solver.tolerance": 3e-5,  # relative to the whole way to the stop; see below
        }
    )
    found = run(scene, engine)
    assert found.history.status is Status.OK
    assert found.history.reason == "all V-joints have reached the stowed stop"
    # At 140 deg, where six sections have hardly left 175 deg, steps are off by 1.3e-4 of the time
    # and rods give 4e-5 of it (limit of smaller steps); less of both later on.
    for angle in (140.0, 90.0, 60.0, 47.6):
        expected = ideal_time(scene, angle)
        assert found.reaches(angle) == pytest.approx(expected, rel=2.5e-4)
    # It rests on its stop, within what the stop gives, and has not gone through it.
    end = np.degrees(found.angles[-1])
    assert np.all(np.abs(end - STOWED) < 1.5)
    assert np.degrees(found.angles.min()) > STOWED - 0.5
