"""Small rings with cables, and what drives them."""

from __future__ import annotations

from typing import Any

from ringsim.scene import Scene, load_scene


def six(**values: Any) -> Scene:
    """Six sections of the driven ring, wound a third as fast: the same motion as with 18.

    Keywords name scene fields; two underscores stand for a dot.  Fields of both cables begin
    with ``cable``.
    """
    plain: dict[str, Any] = {
        "structure.sections": 6,
        "net.neutral_length": 0.24,
        "solver.tolerance": 3e-4,
        "solver.newton_tolerance": 1e-5,
        "cables.upper.winch.winding.speed": 0.04,
        "cables.lower.winch.winding.speed": 0.04,
    }
    for name, value in values.items():
        path = name.replace("__", ".")
        if path.startswith("cable."):
            for plane in ("upper", "lower"):
                plain[path.replace("cable.", f"cables.{plane}.")] = value
        else:
            plain[path] = value
    return load_scene("ring18-cable").with_values(plain)


def pulled(sections: int = 18, **values: Any) -> Scene:
    """The ring that forces open, without stress output."""
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    plain = {
        "structure.sections": sections,
        "record.stress": False,
        "solver.tolerance": 1e-4,
        "solver.newton_tolerance": 1e-5,
    }
    return load_scene("ring18").with_values(plain | chosen)
