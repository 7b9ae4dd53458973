"""Prints the rows of docs/evidence/measured_angles.md: forces from angles and those of the nodes.

ringsim run truss2 --fidelity frame --set record.positions=true --out truss2.nc
ringsim run ring18-cable --fidelity frame --set record.positions=true --out ring18-cable.nc
python docs/measured_angles.py truss2.nc ring18-cable.nc
"""

import sys
from typing import NamedTuple

import numpy as np
import xarray as xr

from ringsim.cable.records import Cable
from ringsim.layout.layout import layout_of
from ringsim.plots.rods_and_cables import pulley_forces, section_spans
from ringsim.scene import Scene, scene_from_toml

PARTS = {"2 s to half of the time": (2.0, 0.5), "half to 0.99 of it": (0.0, 0.99)}
"""From when (s, at least half of the time if 0) to what share of the time of deployment."""


class Compared(NamedTuple):
    """Of the upper cable until all has locked.

    ``forces`` are errors of the force on the V pulleys, (section, time), if its direction is that
    of the angles, as a share of it; ``path`` (m) of the path's length by the angles, and ``alone``
    is the tension at the winch (N) that follows from it, where that of the run is ``tension``.
    """

    times: np.ndarray
    forces: np.ndarray
    path: np.ndarray
    tension: np.ndarray
    alone: np.ndarray


def compared(run: xr.Dataset) -> Compared:
    """From a deployed run with positions, of a cable that winds at the first section alone."""
    run = run.sel(time=run["time"] <= float(run["deployment_time"]))
    scene = scene_from_toml(str(run.attrs["scene"]), source="attribute scene")
    assert scene.cables is not None
    cable, of = scene.cables.upper, run.sel(plane="upper")
    assert isinstance(cable, Cable)
    at = section_spans(run, "upper")
    spans = np.stack(at.lengths, axis=1).reshape(-1, run.sizes["time"])
    moving = np.array([" V" in name for name in scene.span_names["upper"]])
    lengths = np.tile(drawn(scene)[:, None], spans.shape[1])
    lengths[moving] = spans
    path = lengths.sum(axis=0)
    natural = path[0] - of["wound_length"].values
    # Eqs 22 to 26, corrected: every span has its share of the tension at the winch.
    ratios = np.nan_to_num(of["pulley_ratio"].values, nan=1.0)
    shares = np.cumprod(np.vstack([np.ones(len(natural)), ratios]), axis=0)
    force = cable.axial_stiffness * (path - natural) / natural
    mean = cable.slack_width * np.logaddexp(0.0, force / cable.slack_width)
    return Compared(
        run["time"].values, _directions(run, scene, cable),
        path - natural * (1.0 + of["rope_strain"].values), of["cable_tension"].values[0],
        mean * path / (shares * lengths).sum(axis=0),
    )  # fmt: skip


def drawn(scene: Scene) -> np.ndarray:
    """Lengths of the upper cable's spans at the start, m."""
    layout = layout_of(scene)
    places = np.array([layout.sheave(sheave)[0] for sheave in layout.paths[0]])
    return np.asarray(np.linalg.norm(np.diff(places, axis=0), axis=1))


def _directions(run: xr.Dataset, scene: Scene, cable: Cable) -> np.ndarray:
    """Errors of the magnitude of the force on the V pulleys, with the tensions of the run."""
    at, sections, found = section_spans(run, "upper"), run.sizes["section"], []
    alone = pulley_forces(run, "upper").sel(node="V").transpose("section", "time", "component")

    def place(name: str) -> np.ndarray:
        return run["position"].sel(point=name).transpose("time", "axis").values

    for k in range(sections):
        behind = (k + 1) % sections if scene.structure.closed else k + 1
        joint = place(f"upper V-joint {k + 1}")
        pins = [place(f"upper corner {c + 1} pin {k + 1}") for c in (k, behind)]
        bisector = sum(_unit(joint - pin) for pin in pins)
        pulley = joint + cable.block_offset * _unit(bisector)
        pulls = (_unit(pin - pulley) for pin in pins)
        tensions = at.entry[k], at.behind[k]
        exact = sum(t[:, None] * pull for t, pull in zip(tensions, pulls, strict=True))
        sizes = [np.linalg.norm(each, axis=1) for each in (alone.values[k], exact)]
        found.append(sizes[0] / sizes[1] - 1.0)
    return np.array(found)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def row(name: str, part: str, found: Compared) -> str:
    """A row of the table."""
    first, share = PARTS[part]
    end = found.times[-1]
    own = (found.times > (first or 0.5 * end)) & (found.times < share * end)
    forces, path, off = (
        float(np.abs(each[..., own]).max())
        for each in (found.forces, found.path, found.alone - found.tension)
    )
    least, most = found.tension[own].min(), found.tension[own].max()
    return (
        f"| `{name}`, {part} | {forces:.0e} | {1e3 * path:.2g} mm "
        f"| {least:.2g} to {most:.2g} N | {off:.2g} N |"
    )


def main() -> None:
    """Print the rows of every run."""
    for name in sys.argv[1:]:
        with xr.open_dataset(name) as run:
            found = compared(run)
            title = scene_from_toml(str(run.attrs["scene"]), source=name).name
        for part in PARTS:
            print(row(title, part, found))


if __name__ == "__main__":
    main()
