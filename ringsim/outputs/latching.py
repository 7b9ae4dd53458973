"""How fast V-joints met their latches, and which of these caught."""

from collections.abc import Sequence

import numpy as np

from ringsim.outputs.family import Output, Run, Series, Values, Variable
from ringsim.stepping.latches import history


class Latching(Output):
    """The opening rate at which every V-joint first reached 180 deg, and whether its latch holds.

    ECSS-E-ST-33-01C, 4.7.5.4.3, wants latching shown over temperature and tolerances.
    """

    rank = 5
    needs = ("latches",)
    variables = (
        Variable(
            "latch_rate", ("plane", "section"), "rad/s",
            "opening rate at which the V-joint first met its latch; missing if it did not",
        ),
        Variable(
            "least_latch_rate", (), "rad/s",
            "smallest opening rate at which a V-joint first met its latch",
            summary=("least latch rate", "10.3g"),
        ),
        Variable("latched", ("plane", "section"), "1", "1 if the latch of the V-joint holds", "i4"),
        Variable("latched_joints", (), "1", "V-joints that are held by their latches", "i4"),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """From the steps, as the engines do while they run."""
        rates = history(run.scene, run.angles.times, run.angles.values, run.rates.values).rates
        caught = np.isfinite(run.held).astype(np.int32)
        return {
            "latch_rate": rates,
            "least_latch_rate": rates.min(),
            "latched": caught,
            "latched_joints": caught.sum(),
        }


def missed(values: Values, planes: Sequence[str]) -> str:
    """Which latches did not catch though their joints came to them, in words; empty if none."""
    if "latched" not in values:
        return ""
    open_ = np.argwhere(np.isfinite(values["lock_time"]) & (values["latched"] == 0)).tolist()
    if not open_:
        return ""
    names = [f"{planes[plane]} {section + 1}" for plane, section in open_]
    more = f" and {len(names) - 6} more" if len(names) > 6 else ""
    count = f"{len(names)} of {values['latched'].size} latches did not catch"
    return f"; {count}: {', '.join(names[:6])}{more}"
