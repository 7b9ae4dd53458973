"""What a fault does: a truss of two sections with a cut cable, a jammed pulley, a stuck joint.

The sound truss and three broken ones are wound for three seconds; the fault strikes after one.
Angles show which sections go on, the tension at the winch what the motor feels.
"""

import ringsim

SOUND = ringsim.load_scene("truss2").with_values(
    {
        "structure.opening_angle": 60.0,
        "cables.upper.winch.winding": {"kind": "ramp", "speed": 0.05, "duration": 0.5},
        "cables.lower.winch.winding": {"kind": "ramp", "speed": 0.05, "duration": 0.5},
        "solver.end_time": 3.0,
        "solver.tolerance": 3e-3,
    }
)
FAULTS = {
    "none": [],
    "upper cable cut": [{"kind": "cut-cable", "span": "section 1 first hinge to V", "time": 1.0}],
    "upper pulley jammed": [
        {"kind": "jammed-pulley", "pulley": "section 1 second hinge", "time": 1.0}
    ],
    "V-joint 1 stuck": [{"kind": "stuck-vjoint", "plane": "upper", "section": 1, "time": 1.0}],
}

print(f"{'fault':20s} upper angles, deg   tensions at the winches, N   status")
for name, faults in FAULTS.items():
    run = ringsim.simulate(SOUND.with_values({"faults": faults}))
    end = run.sel(time=3.0, method="nearest")
    angles = end["opening_angle"].sel(plane="upper").values
    tensions = end["cable_tension"].isel(span=0).values
    print(
        f"{name:20s} {angles[0]:7.1f} {angles[1]:7.1f}     "
        f"upper {tensions[0]:6.3f}, lower {tensions[1]:6.3f}   "
        f"{run.attrs['reason']}"
    )
