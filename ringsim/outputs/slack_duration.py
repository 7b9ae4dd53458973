"""How long cables were slack."""

import math

import numpy as np

from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable


class SlackDuration(Output):
    """Time for which each cable was slack at its first winch."""

    rank = 41
    needs = ("cables",)
    variables = (
        Variable(
            "slack_duration",
            ("plane",),
            "s",
            "time for which the cable is slack at its winch, until its plane has locked",
        ),
    )

    def read(self, now: Reading) -> Array | None:
        """1 where the rope at the first winch is slack, else 0, shape (planes,)."""
        chain = now.chain
        return None if chain is None else now.by_plane(chain.is_slack[chain.ropes.of_end[:, 0]])

    def reduce(self, run: Run, series: Series) -> Values:
        """The sum of the steps, of which those that begin or end taut count half."""
        locked = np.nan_to_num(run.locks.max(axis=1), nan=math.inf)
        slack, steps = series.values, np.diff(np.minimum(series.times[:, None], locked), axis=0)
        return {"slack_duration": np.sum(0.5 * steps * (slack[1:] + slack[:-1]), axis=0)}
