"""What a merged campaign says of its largest values."""

from __future__ import annotations

import numpy as np
import pytest
from made_campaign import made_campaign

from ringsim.analysis.campaign_notes import peak_lines, remark_lines
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told as all_told

pytestmark = pytest.mark.quick


def test_the_numerical_error_of_a_sample_that_is_named_stands_beside_its_value() -> None:
    """Its own where it states one, else the largest of the others, else how to get one."""
    made, name = made_campaign(5), "peak_tension_error"
    where = {"time": [5.0] * 5, "plane": ["upper"] * 5, "span": [1] * 5}
    made = made.assign({f"peak_tension_{k}": ("sample", v) for k, v in where.items()})

    def told(bars: list[float]) -> list[str]:
        lines = peak_lines(made.assign({name: ("sample", bars)}))
        return [line for line in lines if "tension in sample" in line]

    (line,) = told([0.1, np.nan, 0.3, np.nan, 0.25])
    assert "in sample 4: 24" in line
    assert " N +- 0.25 at 5 s" in line
    (line,) = told([0.1, np.nan, 0.3, np.nan, np.nan])
    assert line.endswith("; largest error bar of 2 other samples: 0.3 N")
    assert "nan" not in line
    assert sum("error_bars_every" in line for line in peak_lines(made)) == 1


def test_remarks_of_runs_are_counted_and_the_first_is_quoted() -> None:
    """Alike but for numbers and places; failed runs have reasons, and no remarks that count."""
    made = made_campaign(12, failed=(4,))
    reached = "all V-joints have reached 180 deg"
    steps = "steps of {} ms at the lock at {} s are too long for shocks in the rods (period 1 ms)"
    latch = "whether the latch of {} catches is uncertain, as another joint locked in the same step"
    reasons = [reached] * 12
    for sample, numbers in {1: (2.5, 9.1), 4: (1.0, 9.2), 7: (1.2e-3, 30.25), 9: (3, 9)}.items():
        reasons[sample] += "; " + steps.format(*numbers)
    reasons[9] += "; " + latch.format("upper 3, lower 5 and 2 more")
    reasons[10] += "; " + latch.format("lower 1")
    reasons[11] += "; " + latch.format("upper 2, 4")
    made["reason"] = "sample", np.array(reasons, dtype=object)
    first, second = remark_lines(made)
    assert first == f"in 3 of 11 samples, for example in sample 1: {steps.format(2.5, 9.1)}"
    assert second.startswith(
        "in 3 of 11 samples, for example in sample 9: whether the latch of upper 3"
    )
    lines = "\n".join(all_told(analyse(made)))
    assert " ".join(first.split()) in " ".join(lines.split())
    assert remark_lines(made_campaign(3)) == []
    made["reason"] = "sample", np.array([f"{reached}; {latch}"] * 12, dtype=object)
    assert remark_lines(made) == [f"in all 11 samples, for example in sample 0: {latch}"]
