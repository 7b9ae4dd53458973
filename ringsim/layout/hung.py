"""The lines that carry a structure in a ground test, and what each carries."""

from typing import TYPE_CHECKING

import numpy as np

from ringsim.layout.layout import Hung
from ringsim.parts.boom.rigid import RigidBoom
from ringsim.parts.persection import spread

if TYPE_CHECKING:
    from ringsim.layout.draft import Draft


def hang(draft: "Draft", gravity: np.ndarray, base: int | None) -> Hung | None:
    """The lines of a scene's offload; the base carries its own corner where it is held."""
    law = draft.scene.offload
    if law is None:
        return None
    planes = {"upper": (0,), "lower": (1,), "both": (0, 1)}[law.planes]
    draft.require_corners("offload", planes[-1] + 1)
    size, count = float(np.linalg.norm(gravity)), len(draft.corners[0])
    chosen = [number - 1 for number in law.corners] or range(count)
    carried = [(draft.corners[plane][k].number, k) for plane in planes for k in chosen]
    own = np.array([draft.bodies[body].mass for body, _ in carried])
    net, boom = draft.scene.net, draft.scene.boom
    whole = sum(body.mass for body in draft.bodies) + sum(
        rod.mass + sum(mass for _, mass, _ in rod.masses) for rod in draft.rods
    )
    whole += 0.0 if net is None else net.point_mass
    # A rigid boom is a lump of the body at its top.
    if boom is not None and not isinstance(boom, RigidBoom) and not draft.scene.held:
        whole += boom.mass
    held = draft.bodies[base] if base is not None and draft.scene.held else None
    if held is not None and base not in [body for body, _ in carried]:
        whole -= held.mass
    residual = spread(law.residual, count)[[k for _, k in carried]]
    lifts = (1.0 - residual) * size * (own + (whole - own.sum()) / len(carried))
    keep = [n for n, (body, _) in enumerate(carried) if held is None or body != base]
    return Hung(law, tuple(carried[n][0] for n in keep), lifts[keep], -gravity / size)
