"""How far a run is, on a terminal."""

import sys
from collections.abc import Callable

import numpy as np
from tqdm import tqdm

from ringsim.scene import Scene
from ringsim.simulation import Watch
from ringsim.stepping.instant import Instant
from ringsim.variables import Outcome


def watched(run: Callable[[Scene, Watch | None], Outcome], scene: Scene) -> Outcome:
    """Run a scene by ``run``; where stderr is a terminal a bar counts its time up to
    ``solver.end_time``, and the V-joints that have locked.  A run that starts anew starts its bar
    anew.
    """
    most = 0
    with tqdm(
        total=scene.solver.end_time, desc=scene.name, leave=False,
        disable=not sys.stderr.isatty(),
        bar_format="{desc}: {n:.3g} of {total:g} s |{bar}| {elapsed}{postfix}",
    ) as bar:  # fmt: skip

        def show(now: Instant) -> None:
            nonlocal most
            most = 0 if now.time < bar.n else most
            if scene.structure.locks:
                most = max(most, int((now.angles >= np.pi).sum()))
                bar.set_postfix_str(f"{most} of {now.angles.size} V-joints locked", refresh=False)
            bar.update(now.time - bar.n)

        return run(scene, None if bar.disable else show)
