"""When the V-joints reached 180 deg."""

import numpy as np

from ringsim.outputs.family import ErrorBar, Output, Run, Series, Values, Variable


class Deployment(Output):
    """The lock time of every V-joint, and the latest of them."""

    rank = 0
    variables = (
        Variable(
            "deployment_time", (), "s", "time at which the last V-joint reached 180 deg",
            error_bar=ErrorBar("deployment time", safety=2.7),
            summary=("deployment time", "10.4f"), worse="larger", largest_of="lock_time",
        ),
        Variable(
            "lock_time", ("plane", "section"), "s", "time at which the V-joint reached 180 deg"
        ),
        Variable(
            "locked_joints", (), "1", "V-joints that have reached 180 deg", "i4", worse="smaller"
        ),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """As the run knows them; see ``ringsim.stepping.locks.lock_times``."""
        if not run.scene.structure.locks:
            return {}
        return {
            "lock_time": run.locks,
            "deployment_time": run.locks.max(),
            "locked_joints": np.isfinite(run.locks).sum(),
        }
