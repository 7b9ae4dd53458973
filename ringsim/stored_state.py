"""Stored states in files: which there are, and whether a scene can go on from one."""

import hashlib
import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ringsim.layout.layout import layout_of
from ringsim.outputs.recorder import FORMAT, StoredState
from ringsim.refusal import InputError, show
from ringsim.scene import Scene, scene_from_toml
from ringsim.scene.substituted import substituted

if TYPE_CHECKING:
    import xarray as xr

_SAME = 1e-6
"""Relative difference of two times that count as the same: more digits are seldom typed."""


def layout_fingerprint(scene: Scene) -> str:
    """Of the bodies, rods, joints and paths of a scene at its start, and so of its unknowns.

    Masses, stiffnesses and laws are left out.  Lengths count to 1e-9 m: a state of other lengths
    would begin with strained rods.
    """
    layout = layout_of(substituted(scene))
    parts: list[Any] = [
        [(body.pose.place, body.pose.axes) for body in layout.bodies],
        [(rod.name, rod.section, rod.start.place, rod.end.place, rod.stations, rod.strain)
         for rod in layout.rods],
        [(joint.kind, joint.first, joint.second, joint.error) for joint in layout.joints],
        layout.openings, layout.paths, layout.base,
        [law.bodies for law in layout.pair_laws],
        None if layout.hung is None else layout.hung.bodies,
        None if (boom := layout.boom) is None else (boom.top, boom.low, boom.lump.centre),
        scene.rods.elements, layout.gravity is None,
    ]  # fmt: skip
    return hashlib.sha256(json.dumps(_plain(parts)).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """Numbers and texts of nested records, without the last digits."""
    if isinstance(value, np.ndarray):
        return (np.round(value, 9) + 0.0).tolist()
    if isinstance(value, float):
        return round(value, 9) + 0.0
    if isinstance(value, (list, tuple)):
        return [type(value).__name__, *(_plain(one) for one in value)]
    if hasattr(value, "__dataclass_fields__"):
        return [type(value).__name__, *(_plain(one) for one in vars(value).values())]
    return value.item() if isinstance(value, np.generic) else value


def read_state(path: str | Path, at: float | None = None) -> StoredState:
    """The state that a run's file holds at a time (s), or its last one.

    A run stores states where its scene has ``record.state_interval``; see
    :func:`ringsim.simulate` for how to go on from one.

    Raises
    ------
    InputError
        If the file has no such state, or is of another version of ringsim.
    """
    import xarray as xr  # takes half a second, which runs without states need not wait

    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file (--from takes the netCDF file of a run)")
    try:
        with warnings.catch_warnings():
            # Of a damaged file, which is refused below.
            warnings.filterwarnings("ignore", "Duplicate dimension", UserWarning)
            with xr.open_dataset(path, engine="netcdf4") as opened:
                data = opened.load()
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(f"{path}: cannot be read as netCDF: {error}") from None
    if "state" not in data:
        raise InputError(
            f"{path}: has no stored states: run its scene again with --set "
            "record.state_interval=1 (or another number of seconds)"
        )
    try:
        return _chosen(data, path, at)
    except InputError:
        raise
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise InputError(
            f"{path}: its states cannot be read: {type(error).__name__}: {error}: the file is "
            "damaged or changed: run its scene again"
        ) from None


def _chosen(data: "xr.Dataset", path: Path, at: float | None) -> StoredState:
    """The state of a time in a run's dataset, unpacked once to see that it can be."""
    state, times = data["state"], data["state_time"].to_numpy()
    if int(state.attrs["format"]) != FORMAT:
        raise InputError(
            f"{path}: its states have format {state.attrs['format']}, this version of ringsim "
            f"reads {FORMAT}: run its scene again"
        )
    scene = scene_from_toml(data.attrs["scene"], source=str(path))
    if state.attrs["layout"] != layout_fingerprint(scene):
        raise InputError(
            f"{path}: was written by another version of ringsim, whose states cannot be used: "
            "run its scene again"
        )
    number = len(times) - 1 if at is None else int(np.argmin(np.abs(times - at)))
    if at is not None and not abs(times[number] - at) <= _SAME * max(at, 1.0):
        raise InputError(
            f"--at {at:g}: {path} holds no state at that time; it has {_told(times)}: take --at "
            f"{times[number]:.6g}"
        )
    numbers = state.to_numpy()
    cuts = [0, *data["state_begin"].to_numpy().tolist(), len(numbers)]
    form, own = str(data["state_form"].to_numpy()[number]), slice(*cuts[number + 1 : number + 3])
    found = StoredState(
        source=str(path), time=float(times[number]), engine=str(state.attrs["engine"]),
        scene=scene, packed=(form, numbers[own]),
        packed_history=(str(state.attrs["history"]), numbers[: cuts[1]]),
    )  # fmt: skip
    _ = found.memory, found.history
    return found


def _told(times: np.ndarray[Any, Any]) -> str:
    """The times of states, the middle ones left out where there are many."""
    words = [f"{time:.6g}" for time in times]
    words = words if len(words) <= 12 else [*words[:6], "...", *words[-5:]]
    return f"{', '.join(words)} s"


_CANNOT = {
    "full": "the internal state of exudyn's integrator, dampers and connectors cannot be stored"
}
"""Why fidelities store no states."""


def require_fit(start: StoredState | None, scene: Scene, fidelity: str) -> None:
    """Refuse (InputError) an engine that cannot store what a scene asks for, and a scene or an
    engine that cannot go on from a state.
    """
    if scene.record.state_interval is not None and fidelity in _CANNOT:
        raise InputError(
            f'record.state_interval = {scene.record.state_interval:g} s: fidelity = "{fidelity}" '
            f'stores no states ({_CANNOT[fidelity]}): choose fidelity = "frame", or leave it out'
        )
    if start is None:
        return
    if fidelity != start.engine:
        raise InputError(
            f'fidelity = "{fidelity}": {start.name} is of the engine "{start.engine}", and no '
            f'other can continue from it: choose fidelity = "{start.engine}"'
        )
    if scene.solver.error_bars:
        raise InputError(
            "solver.error_bars = true: error bars are not available for a run that continues "
            "from a stored state: set it to false, and compare with a run with smaller steps"
        )
    changes = start.changes_in(scene)
    for path, (before, now) in changes.items():
        if path.endswith(".initial_slack"):
            raise InputError(
                f"{path} = {show(now)}: this value is for the start of a run, which {start.name} "
                f"has passed: keep {show(before)}, or start without --from"
            )
    wanted = layout_fingerprint(start.scene)
    if layout_fingerprint(scene) == wanted:
        return
    told = {path.split(".")[0]: path for path in reversed(changes)}
    culprit = next((part for part in told if _moves_layout(start.scene, scene, part)), None)
    path = told[culprit] if culprit else ", ".join(told.values())
    before, now = changes[path] if culprit else (None, None)
    words = f"{path} = {_shown(now)}" if culprit else path
    raise InputError(
        f"{words}: {start.name} has another structure ({path} was {_shown(before)}), so its "
        "state does not fit: keep that value, or start without --from"
    )


def _moves_layout(before: Scene, now: Scene, part: str) -> bool:
    """Whether the layout of a scene depends on one part of another scene."""
    try:
        mixed = before.model_copy(update={part: getattr(now, part)})
        return layout_fingerprint(mixed) != layout_fingerprint(before)
    except (ValueError, IndexError, KeyError):
        return True


def _shown(value: Any) -> str:
    return "left out" if value is None else show(value)
