"""A program steps the run: a flight computer that keeps both planes in step, with a sensor lost.

The loop below could be a flight computer's own code, or the steps of its functional mock-up.
"""

import numpy as np

import ringsim

PERIOD, SPEED, GAIN = 0.2, 0.12, 0.1
WINCH = {"winding": {"kind": "commanded", "max_speed": 0.2, "acceleration": 0.12}}
scene = ringsim.load_scene("ring18-cable").with_values(
    {
        "structure.sections": 6,
        "cables.upper.winch": WINCH,
        "cables.lower.winch": WINCH | {"start_time": 0.5},
        "faults": [{"kind": "failed-sensor", "section": 3, "time": 2.0, "shows": "nothing"}],
        "controller": {
            "kind": "outside",
            "period": PERIOD,
            "delay": 0.05,
            "encoder": {"resolution": 0.1, "standard_deviation": 0.05},
        },
    }
)

run = ringsim.steps(scene)
print(" time, s   upper, deg   lower, deg   silent sensors")
for readings in run:
    upper, lower = np.nanmean(readings.opening_angle, axis=1)
    behind = 0.5 * (lower - upper)
    run.command(upper=SPEED * (1.0 + GAIN * behind), lower=SPEED * (1.0 - GAIN * behind))
    if abs(run.time - round(run.time)) < 0.5 * PERIOD:
        silent = int(np.isnan(readings.opening_angle).sum())
        print(f"{run.time:8.1f} {upper:12.2f} {lower:12.2f} {silent:10d}")

result = run.result
apart = np.abs(result["opening_angle"].mean("section").diff("plane")).max()
print(f"{result.attrs['reason']} after {float(result['deployment_time']):.2f} s")
print(f"the planes were at most {float(apart):.2f} deg apart")
