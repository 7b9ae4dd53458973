"""How fast V-joints met their latches, and which of these caught."""

from collections.abc import Sequence

import numpy as np

from ringsim.outputs.family import Array, Output, Run, Series, Values, Variable
from ringsim.outputs.peaks import Peak
from ringsim.stepping.latches import history

_PLACE = ("plane", "section")
LEAST = Peak("least_latch_rate", _PLACE, "the smallest latch rate", "opening_angle")
LARGEST = Peak("peak_latch_rate", _PLACE, "the largest latch rate", "opening_angle")


class Latching(Output):
    """The opening rate at which every V-joint first reached 180 deg, and whether its latch holds.

    ECSS-E-ST-33-01C, 4.7.5.4.3, wants latching shown over temperature and tolerances.
    """

    rank = 5
    needs = ("latches",)
    peak = LEAST
    variables = (
        Variable(
            "latch_rate", ("plane", "section"), "rad/s",
            "opening rate at which the V-joint first met its latch; missing if it did not",
        ),
        Variable(
            "least_latch_rate", (), "rad/s",
            "smallest opening rate at which a V-joint first met its latch",
            summary=("least latch rate", "10.3g"), worse="smaller", least_of="latch_rate",
        ),
        *LEAST.variables,
        Variable("latched", ("plane", "section"), "1", "1 if the latch of the V-joint holds", "i4"),
        Variable("latched_joints", (), "1", "V-joints that are held by their latches", "i4",
                 worse="smaller"),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """From the steps, as the engines do while they run."""
        rates = _rates(run)
        caught = np.isfinite(run.held).astype(np.int32)
        return {
            "latch_rate": rates,
            "least_latch_rate": rates.min(),
            # Of a ring in which some joint did not come to its latch there is no least rate.
            **LEAST.at(run, run.locks, np.where(np.isfinite(rates).all(), -rates, np.nan)),
            "latched": caught,
            "latched_joints": caught.sum(),
        }


class FastestLatch(Output):
    """The largest opening rate at which a V-joint met its latch: the shock of latching grows with
    it (I w (1 + e), see ``LockImpulse``).
    """

    rank = 5
    needs = ("latches",)
    peak = LARGEST
    variables = (
        Variable(
            "peak_latch_rate", (), "rad/s",
            "largest opening rate at which a V-joint first met its latch; missing if none did",
            summary=("largest latch rate", "10.3g"), worse="larger", largest_of="latch_rate",
        ),
        *LARGEST.variables,
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """Of the joints that came to their latches, also where others did not."""
        rates = _rates(run)
        return {"peak_latch_rate": np.fmax.reduce(rates, axis=None)} | LARGEST.at(
            run, run.locks, rates
        )


def _rates(run: Run) -> Array:
    """Shape (planes, sections), rad/s; NaN where a joint did not come to its latch."""
    return history(run.scene, run.angles.times, run.angles.values, run.rates.values).rates


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
