"""A merged campaign made by hand: deployments of which every number is known."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ringsim.dataset import to_dataset
from ringsim.outputs.family import VARIABLES, span_names
from ringsim.scene import Scene, load_scene
from ringsim.shapes import shape_of
from ringsim.variables import PLANES, Cause, Fate, Outcome, Status

SECTIONS = 4
TIMES = np.linspace(0.0, 10.0, 21)
TEXT = """
name = "made"
title = "Made by hand <&> quoted"
question = "Does it open & is it <3 deg?"
seed = 3
scene = "ring18-cable"
design = {{ kind = "{kind}", samples = {samples} }}
[set]
"structure.sections" = 4
boom = "none"
[requirements]
asynchrony_max = {{ max = 3.0, probability = 0.9, confidence = 0.9 }}
deployment_time = {{ max = 40.0, probability = 0.5, confidence = 0.9 }}
outcome = {{ is = "deployed", probability = 0.9, confidence = 0.9 }}
"""


def made_scene() -> Scene:
    """Four sections of the built-in scene with cables, without boom."""
    values = {"structure.sections": SECTIONS, "boom": "none", "solver.end_time": 10.0}
    return load_scene("ring18-cable").with_values(values)


def lags(sample: int) -> np.ndarray:
    """Deviation of each V-joint at mid-time in degree, (plane, section), of mean 0."""
    row = np.linspace(-1.0, 1.0, SECTIONS) * (1.0 + 0.25 * sample)
    return np.stack([row, 0.5 * row])


def made_campaign(
    samples: int = 8, *, failed: Sequence[int] = (), stalled: Sequence[int] = (),
    not_run: Sequence[int] = (), kind: str = "random",
) -> xr.Dataset:  # fmt: skip
    """Sample k deploys at 10 s and lags by ``lags(k)``; its tension peaks at 20 + k N in span 1."""
    scene, runs = made_scene(), []
    share = TIMES / TIMES[-1]
    spans = np.arange(1, span_names(scene).shape[1] + 1)
    for k in range(samples):
        angle = 20.0 + 160.0 * share + 4.0 * lags(k)[..., None] * (share * (1.0 - share))
        tension = (20.0 + k) / spans[None, :, None] * np.sin(np.pi * share) * np.ones((2, 1, 1))
        lock = 10.0 - 0.1 * np.arange(2 * SECTIONS).reshape(2, SECTIONS)
        fate = Fate.STALLED if k in stalled else Fate.DEPLOYED
        spread = np.ptp(angle, axis=(0, 1))
        values = {
            "opening_angle": angle, "cable_tension": tension, "asynchrony": spread,
            "asynchrony_max": spread.max(), "peak_tension": np.array(20.0 + k), "lock_time": lock,
            "deployment_time": np.array(10.0),
            "final_time": np.array(10.0), "energy_error": np.array(1e-5 * (k + 1)),
            "restarts": np.array(0),
        }  # fmt: skip
        if k in failed or k in not_run:
            late = (4.0 if k in failed else -1.0) < TIMES
            timed = ("opening_angle", "cable_tension", "asynchrony")
            values = {
                name: np.where(late if name in timed else True, np.nan, array)
                for name, array in values.items()
            }
            fate = Fate.NONE
        if k in stalled:
            values["deployment_time"], values["lock_time"] = np.array(np.nan), lock * np.nan
        values["outcome"] = np.array(int(fate))
        bad = k in failed
        why = f"broke </script> at 4 s in sample {k}" if bad else "all V-joints have locked"
        end = (Status.TIMEOUT, Cause.TIME_LIMIT) if bad else (Status.OK, Cause.NONE)
        runs.append((values, why, *end))
    coordinates = {"plane": np.array(PLANES), "section": np.arange(1, SECTIONS + 1),
                   "time": TIMES, "span": spans}  # fmt: skip
    values, why, status, cause = runs[0]
    found = to_dataset(Outcome(status, why, coordinates, values, cause), scene)
    stacked = {name: [run[0][name] for run in runs] for name in values}
    stacked |= {"reason": [run[1] for run in runs], "status": [int(run[2]) for run in runs],
                "cause": [run[3] for run in runs]}  # fmt: skip
    found = found.assign(reason=found.attrs["reason"]).expand_dims(sample=samples).copy(deep=True)
    found = found.assign_coords(sample=np.arange(samples))
    for name, each in stacked.items():
        array = np.array(each)
        kept = found[name].dtype if array.dtype.kind == "i" else array.dtype
        found[name] = found[name].dims, array.astype(kept), found[name].attrs
    found["status"] = found["status"].astype("i1")
    found["status"][list(not_run)] = -1
    found["outcome"] = found["outcome"].astype("i1")
    for name, values, units in (
        ("rods_young_modulus", 1e11 + 1e9 * np.arange(samples), "Pa"),
        ("cables_upper_friction_coefficient", np.arange(samples)[:, None] + np.ones((1, 3)), "m"),
        ("cables_lower_winch_stop_time", np.where(np.arange(samples) % 2, "none", "3.0"), "s"),
    ):
        dims = ("sample", "pulley")[: values.ndim]
        law = json.dumps({"kind": "uniform", "low": 0.0, "high": 9.0})
        path = name.replace("_", ".", 1)
        says = {"role": "input", "path": path, "units": units, "distribution": law}
        found[name] = (dims, values, says)
    text = TEXT.format(kind=kind, samples=samples)
    stored = {name: json.dumps(tomllib.loads(text)[name]) for name in ("design", "requirements")}
    found.attrs |= {"campaign": text, **stored, "campaign_name": "made",
                    "title": "Made by hand <&> quoted", "seed": 3}  # fmt: skip
    return found


def with_positions(campaign: xr.Dataset, shift: float = 0.5) -> xr.Dataset:
    """The same, with positions as its angles give them, moved along y by ``shift`` m a second."""
    scene = made_scene()
    found, names = np.full((0,), np.nan), dict[str, np.ndarray]()
    rows = []
    for sample in range(campaign.sizes["sample"]):
        run = campaign.isel(sample=sample)
        known = np.isfinite(run["opening_angle"]).all(("plane", "section")).to_numpy()
        if not rows:
            shape = shape_of(campaign.isel(sample=0), scene)
            names = dict(shape.points.coordinates)
        found = np.full((len(names["point"]), 3, len(TIMES)), np.nan)
        if known.any():
            shape = shape_of(run, scene)
            for k in np.flatnonzero(known):
                found[..., k] = shape.at(TIMES[k])
                found[:, 1, k] += shift * TIMES[k]
        rows.append(found)
    told = {"long_name": "position of a point of the structure", "units": "m"}
    more = campaign.assign_coords(names)
    return more.assign(position=(("sample", "point", "axis", "time"), np.array(rows), told))


def with_motors(campaign: xr.Dataset) -> xr.Dataset:
    """The same with motors, margins and a base: sample k has its least margin of -0.5 + 0.1 k at
    the first record, its motors the torque (1 + k) mN m, its base a force of 3 + k N.
    """
    known = np.isfinite(campaign["asynchrony"].transpose("sample", "time").to_numpy())
    k, gone = np.arange(campaign.sizes["sample"]), np.where(known, 0.0, np.nan)
    held = gone[:, None, None, :]
    dims, share = ("sample", "plane", "winch", "time"), TIMES / TIMES[-1]
    size = 1e-3 * (1.0 + k)[:, None, None, None]
    torque = np.broadcast_to(size + held, (len(k), 2, 1, len(share)))
    vector = np.array([0.0, 0.6, 0.8])[:, None] * (3.0 + k)[:, None, None] + gone[:, None, :]
    least = np.where(known.any(axis=1), -0.5 + 0.1 * k, np.nan)
    values = {
        "motor_torque": (dims, torque), "motor_speed": (dims, 300.0 + 0.0 * torque),
        "base_force": (("sample", "axis", "time"), vector),
        "base_torque": (("sample", "axis", "time"), 0.5 * vector),
        "drive_margin": (("sample", "time"), least[:, None] + share + gone),
        "least_drive_margin": ("sample", least),
    }  # fmt: skip
    says = {
        name: {"units": VARIABLES[name].units, "long_name": VARIABLES[name].long_name}
        for name in values
    }
    more = campaign.assign_coords(winch=[1], axis=["x", "y", "z"])
    return more.assign({name: (*each, says[name]) for name, each in values.items()})
