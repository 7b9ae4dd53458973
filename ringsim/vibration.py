"""Natural frequencies and shapes along the opening: their dataset, and its tables."""

import math
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ringsim import build
from ringsim.choice import kind_of
from ringsim.frame.modes import ENERGY_PARTS, Modes, Standing
from ringsim.refusal import InputError, show
from ringsim.scene import Scene, load_scene
from ringsim.structures.pantograph_ring import LEAST_OPENING
from ringsim.tables import Table, counted
from ringsim.threads import one_thread

DEPLOYED = 180.0
_WORDS = ("stowed", "deployed")
_MOST_ANGLES, _MOST_MODES = 200, 100
_LETTERS = dict(zip(ENERGY_PARTS, ("b", "s", "v", "m", "n"), strict=True))


@one_thread()
def modes(
    scene: Scene | str | Path, at: Sequence[float | str] | None = None, *, points: int = 9,
    count: int = 6, latched: bool | None = None, tension: float = 0.0,
) -> xr.Dataset:  # fmt: skip
    """Natural frequencies and shapes of a ring that stands still, by opening angle.

    See docs/guide/modes.md for what acts in that state.

    Parameters
    ----------
    scene
        A scene, or what ``load_scene`` reads.
    at
        Opening angles, deg, from 1 to 180; "stowed" is the scene's own, "deployed" 180.  Left out,
        ``points`` angles, evenly from stowed to deployed.
    count
        Modes at each angle, beside those motions that nothing holds.
    latched
        Whether the stiffness of the stop holds all V-joints where they are; left out, it does at
        180 deg alone.
    tension
        Of ropes that winches hold, N; 0: slack ones.

    Returns
    -------
    xr.Dataset
        Over (angle, mode): ``frequency`` (Hz, missing where the structure leaves its state, then
        ``growth_rate``, 1/s), ``shape`` (point, axis) with the largest way 1, ``modal_mass`` of it
        (kg), ``energy_share`` (part), and ``effective_mass`` (axis, kg) where the base is fixed; by
        angle ``position`` (point, axis, m), ``latched``, ``rigid_body_modes``, ``mechanism_modes``.

    Raises
    ------
    InputError
        If an angle or number is refused, or the frame engine cannot represent the scene.

    Examples
    --------
    >>> ring = load_scene("ring18").with_values({"structure.sections": 6})
    >>> found = modes(ring, ["deployed"], count=2)
    >>> found["frequency"].dims, int(found["rigid_body_modes"][0])
    (('angle', 'mode'), 6)
    """
    chosen = load_scene(scene) if isinstance(scene, (str, Path)) else scene
    _require_whole("count", count, 1, _MOST_MODES)
    _require("tension", tension, 0.0, 1e6, " N")
    angles = angles_of(chosen, at, points)
    held = [angle == DEPLOYED if latched is None else latched for angle in angles]
    found = [
        Standing(chosen, angle, latched=holds, tension=tension).modes(count)
        for angle, holds in zip(angles, held, strict=True)
    ]
    return _dataset(chosen, angles, held, found, tension)


def angles_of(scene: Scene, at: Sequence[float | str] | None, points: int) -> list[float]:
    """Opening angles, deg, of words and numbers, or so many from stowed to deployed."""
    if "opening_angle" not in type(scene.structure).model_fields:
        raise InputError(
            f'structure.kind = "{kind_of(scene.structure)}" has no opening_angle: modes are those '
            "of rings that open by one"
        )
    words = {"stowed": float(scene.structure.opening_angle), "deployed": DEPLOYED}  # type: ignore[attr-defined]
    if at is None:
        _require_whole("points", points, 2, _MOST_ANGLES)
        return [float(x) for x in np.linspace(words["stowed"], DEPLOYED, points).round(6)]
    if isinstance(at, str) or not isinstance(at, Iterable):
        raise InputError(f"at = {show(at)} must be a list of opening angles: write [{show(at)}]")
    found = []
    for each in at:
        if isinstance(each, str) and (word := each.strip().lower()) in words:
            found.append(words[word])
            continue
        try:
            angle = float(each)
        except (TypeError, ValueError):
            raise InputError(
                f"at = {each!r} is no opening angle: give degrees from {LEAST_OPENING:g} to 180, "
                f"or one of {', '.join(_WORDS)}"
            ) from None
        if not angle >= LEAST_OPENING:
            raise InputError(f"at = {angle:g} deg must be at least {LEAST_OPENING:g} deg: angles "
                             "are in degrees, 180 fully open")  # fmt: skip
        if angle > DEPLOYED:
            raise InputError(f"at = {angle:g} deg must be at most 180 deg, where the ring is fully "
                             "open: write deployed")  # fmt: skip
        found.append(angle)
    found = list(dict.fromkeys(found))
    _require("number of angles", len(found), 1, _MOST_ANGLES)
    return found


def _require(name: str, value: float, least: float, most: float, unit: str = "") -> None:
    if not least <= value <= most:
        raise InputError(f"{name} = {value:g}{unit} must be from {least:g} to {most:g}{unit}")


def _require_whole(name: str, value: Any, least: int, most: int) -> None:
    if not isinstance(value, Integral):
        raise InputError(f"{name} = {show(value)} must be a whole number from {least} to {most}")
    _require(name, int(value), least, most)


def _dataset(
    scene: Scene, angles: list[float], held: list[bool], found: list[Modes], tension: float
) -> xr.Dataset:
    """Modes with their units and meaning."""
    squares = np.array([each.squares for each in found])
    stable = np.sqrt(np.where(squares > 0.0, squares, np.nan)) / (2.0 * np.pi)
    growing = np.sqrt(np.maximum(-squares, 0.0))
    each: dict[str, tuple[tuple[str, ...], object, str, str]] = {
        "frequency": (("angle", "mode"), stable, "Hz", "natural frequency, missing if unstable"),
        "growth_rate": (
            ("angle", "mode"), growing, "s-1",
            "rate at which an unstable shape grows, 0 of a stable one",
        ),
        "modal_mass": (
            ("angle", "mode"), [m.masses for m in found], "kg",
            "mass of a shape whose largest displacement is 1",
        ),
        "energy_share": (
            ("angle", "mode", "part"), [m.shares for m in found], "1",
            "share of a part in the energy of a shape; the sum is 1, of an unstable one -1",
        ),
        "shape": (
            ("angle", "mode", "point", "axis"), [m.shapes for m in found], "1",
            "displacement over the largest one of the shape",
        ),
        "position": (
            ("angle", "point", "axis"), [m.places for m in found], "m", "place of a point at rest"
        ),
        "latched": (("angle",), np.array(held, "i1"), "1", "whether V-joints are held (1) or free"),
        "rigid_body_modes": (
            ("angle",), np.array([m.rigid for m in found], "i4"), "1",
            "rigid-body motions, which nothing holds",
        ),
        "mechanism_modes": (
            ("angle",), np.array([m.mechanism for m in found], "i4"), "1",
            "motions of the mechanism, which nothing holds",
        ),
    }  # fmt: skip
    if scene.held:
        each["effective_mass"] = (
            ("angle", "mode", "axis"), [m.effective for m in found], "kg",
            "mass that a shape moves with when the base shakes along an axis",
        )  # fmt: skip
    words = {
        "angle": (angles, "degree", "opening angle of all V-joints"),
        "mode": (np.arange(1, squares.shape[1] + 1), "1", "number of a mode, from the lowest"),
        "part": (list(ENERGY_PARTS), "", "what stores the energy of a shape"),
        "point": (list(found[0].names), "", "point of the structure"),
        "axis": (["x", "y", "z"], "", "axis of space"),
    }
    coordinates = {
        name: (name, values, {"long_name": told} | ({"units": units} if units else {}))
        for name, (values, units, told) in words.items()
    }
    arrays = {
        name: (dims, np.asarray(values), {"long_name": told, "units": units})
        for name, (dims, values, units, told) in each.items()
    }
    now, made = datetime.now(UTC).isoformat(timespec="seconds"), f"ringsim {version('ringsim')}"
    attributes = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": f"Natural frequencies: {scene.title or scene.name}",
        "summary": f"Natural frequencies and shapes of the scene {scene.name} by opening angle.",
        "history": f"{now.replace('+00:00', 'Z')} computed by {made}",
        "source": f"{made}: tangent and masses of the frame engine",
        "tension": tension, **build.provenance(), "scene": scene.to_toml(),
    }  # fmt: skip
    return xr.Dataset(arrays, coordinates, attributes)


# What a terminal prints.


def modes_tables(found: xr.Dataset) -> list[Table]:
    """Frequencies by angle, and the shapes at the last one, of what :func:`modes` gives."""
    share = np.abs(found["energy_share"].values).argmax(axis=-1)
    letters = np.array([_LETTERS[str(part)] for part in found["part"].values])[share]
    rows = []
    for k, angle in enumerate(found["angle"].values.tolist()):
        row = found.isel(angle=k)
        cells = [
            f"unstable {letter}" if math.isnan(f) else f"{f:.4g} {letter}"
            for f, letter in zip(row["frequency"].values.tolist(), letters[k], strict=True)
        ]
        joints = "latched" if row["latched"] else "free"
        counts = [str(int(row[name])) for name in ("rigid_body_modes", "mechanism_modes")]
        rows.append([f"{angle:.4g}", joints, *counts, *cells])
    head = ["opening (deg)", "V-joints", "rigid", "mechanism"]
    head += [f"mode {k}" for k in found["mode"].values]
    parts = {str(found["part"].values[k]) for k in share.ravel()}
    used = sorted(parts, key=list(ENERGY_PARTS).index)
    notes = ["most energy in: " + ", ".join(f"{_LETTERS[part]} {part}" for part in used)]
    notes += list(_free(found)) + list(_unstable(found))
    title = "Natural frequencies (Hz), and motions that nothing holds:"
    return [Table(head, rows, notes, 2, title), _shapes(found.isel(angle=-1))]


def _free(found: xr.Dataset) -> list[str]:
    """What nothing holds, in words."""
    rigid, own = (found[name].values for name in ("rigid_body_modes", "mechanism_modes"))
    parts = [
        counted(int(number.max()), words)
        for number, words in ((rigid, "rigid-body mode"), (own, "mode"))
        if number.any()
    ]
    if own.any():
        parts[-1] += " of the mechanism"
    same = all((number == number[0]).all() for number in (rigid, own))
    told = f"{'' if same else 'up to '}{' and '.join(parts)}, which nothing holds: no frequencies"
    return [told] * bool(parts)


def _unstable(found: xr.Dataset) -> list[str]:
    """At which angles the structure leaves its state, and how fast."""
    fastest = found["growth_rate"].max("mode")
    return [
        f"unstable at {angle:.4g} deg: nothing leads back to this state, and a disturbance grows "
        f"by a factor e in {1.0 / rate:.3g} s"
        for angle, rate in zip(found["angle"].values.tolist(), fastest.values.tolist(), strict=True)
        if rate > 0.0
    ]  # fmt: skip


def _shapes(last: xr.Dataset) -> Table:
    """The modes at one angle."""
    hertz = [f"{f:.5g}" if f == f else "unstable" for f in last["frequency"].values.tolist()]
    rows = [["frequency (Hz)", *hertz]]
    for part, shares in zip(
        last["part"].values, last["energy_share"].transpose("part", "mode").values, strict=True
    ):
        rows.append([f"{part} (%)", *(f"{x:.1f}" for x in (100.0 * shares).round(1) + 0.0)])
    masses = {"modal mass (kg)": last["modal_mass"].values}
    if "effective_mass" in last:
        for axis, own in last["effective_mass"].groupby("axis"):
            masses[f"effective mass along {axis} (kg)"] = own.squeeze("axis").values
    rows += [[n, *(f"{mass:.3g}" for mass in own.round(9) + 0.0)] for n, own in masses.items()]
    title = (
        f"Shapes at {last['angle'].item():.4g} deg, and which part their stiffness has from what "
        "(below zero: what a force takes from it):"
    )
    return Table(["mode", *map(str, last["mode"].values)], rows, title=title)
