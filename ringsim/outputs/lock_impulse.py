"""The shock of every lock."""

import numpy as np

from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable


class LockImpulse(Output):
    """Angular impulse of the stop on every V-joint while it first holds it: from its lock until the
    torque ends or turns round.

    A V-joint that meets its stop alone, at the rate w and with the inertia I, takes I w (1 + e), e
    its coefficient of restitution.
    """

    rank = 48
    needs = ("reactions", "stop")
    variables = (
        Variable(
            "lock_impulse", ("plane", "section"), "N m s",
            "angular impulse of the stop on the V-joint at its lock; missing if it did not lock",
        ),
        Variable(
            "peak_lock_impulse", (), "N m s",
            "largest angular impulse of a stop at a lock; missing if no V-joint has locked",
            summary=("largest lock impulse", "10.3g"), worse="larger", largest_of="lock_impulse",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (planes, sections), N m."""
        return None if now.carried is None else now.carried.stops

    def reduce(self, run: Run, series: Series) -> Values:
        """Trapezoids over the steps, which resolve a bounce."""
        found = np.full(run.locks.shape, np.nan)
        for place in np.argwhere(np.isfinite(run.locks)):
            where = tuple(place)
            found[where] = first_impulse(series.times, series.values[:, *where], run.locks[where])
        peak = np.fmax.reduce(found, axis=None)  # without a lock NaN
        return {"lock_impulse": found, "peak_lock_impulse": peak}


def first_impulse(times: Array, torques: Array, lock: float) -> float:
    """Impulse (N m s) of the first contact after a lock (s), of torques (N m) at times (s)."""
    begun = max(int(np.searchsorted(times, lock)) - 1, 0)
    pushed = np.flatnonzero(torques[begun:]) + begun
    if not len(pushed):
        return 0.0
    first = int(pushed[0])
    over = np.flatnonzero(torques[first:] * torques[first] <= 0.0) + first
    last = int(over[0]) if len(over) else len(torques)
    # The contact begins at the lock and ends between two steps.
    held = slice(first, last)
    own = np.concatenate([[min(lock, times[first])], times[held], times[last : last + 1]])
    from scipy.integrate import trapezoid  # here: only scenes that record reactions need it

    ends = np.zeros(1 + len(times[last : last + 1]))
    return float(abs(trapezoid(np.concatenate([ends[:1], torques[held], ends[1:]]), own)))
