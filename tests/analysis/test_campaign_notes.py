"""What a merged campaign says of its largest values."""

from __future__ import annotations

import numpy as np
import pytest
from made_campaign import made_campaign

from ringsim.analysis.campaign_notes import peak_lines

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
    assert line.endswith("; it states no numerical error, the 2 samples that do have 0.3 N at most")
    assert "nan" not in line
    assert sum("error_bars_every" in line for line in peak_lines(made)) == 1
