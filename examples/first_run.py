"""A first run: a ring of six sections opens under forces at its V-joints.

Takes a built-in scene, changes a few values, simulates it, prints when it has opened and writes
the result to ``first_run.nc``.  The same from a shell, with figures:

    ringsim run ring18 --set structure.sections=6 --set loads.force=0.03 --plot
"""

import ringsim

scene = ringsim.load_scene("ring18").with_values(
    {
        "structure.sections": 6,
        "structure.aspect_ratio": 1.0,  # corners on a circle
        "loads.force": 0.03,  # N, at every V-joint
        "net": "none",
    }
)
run = ringsim.simulate(scene)  # an xarray.Dataset, also if the run had failed

print(run.attrs["reason"])
print(f"deployed after {float(run['deployment_time']):.2f} s")
print(f"largest asynchrony {float(run['asynchrony_max']):.3f} deg")
print(f"energy balance closed to {float(run['energy_error']):.1e}")

print("\n  t, s   opening angle, deg (mean over the V-joints)")
opening = run["opening_angle"].mean(["plane", "section"]).dropna("time")
for angle in opening.isel(time=slice(0, None, max(1, opening.sizes["time"] // 8))):
    print(f"{float(angle['time']):6.2f}   {float(angle):6.1f}  {'#' * int(angle / 4)}")

run.to_netcdf("first_run.nc")
print("\nwrote first_run.nc")
