"""ringsim: how large deployable ring antennas open.

Its public words are loaded when they are used, so that importing ringsim costs nothing.

>>> import ringsim
>>> ring = ringsim.load_scene("ring18").with_values({"structure.sections": 6})
>>> run = ringsim.simulate(ring, fidelity="frame")
>>> run.attrs["reason"]
'all V-joints have reached 180 deg'
>>> run["opening_angle"].dims
('plane', 'section', 'time')
"""

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ringsim.analysis.comparison import compare
    from ringsim.analysis.study import analyse
    from ringsim.campaign.calibration import Calibration
    from ringsim.campaign.optimisation import Optimisation
    from ringsim.campaign.python import Campaign, CampaignError, open_campaign
    from ringsim.measured import load_measured
    from ringsim.refusal import InputError
    from ringsim.scene import Scene, load_scene
    from ringsim.simulation import simulate, steps
    from ringsim.stored_state import read_state
    from ringsim.vibration import modes

__all__ = [
    "Calibration", "Campaign", "CampaignError", "InputError", "Optimisation", "Scene", "analyse",
    "compare", "load_measured", "load_scene", "modes", "open_campaign", "read_state", "simulate",
    "steps",
]  # fmt: skip

_HOMES = {
    "analyse": "analysis.study", "compare": "analysis.comparison",
    "Calibration": "campaign.calibration", "Campaign": "campaign.python",
    "CampaignError": "campaign.python",
    "open_campaign": "campaign.python", "InputError": "refusal",
    "Optimisation": "campaign.optimisation", "load_measured": "measured", "Scene": "scene",
    "load_scene": "scene", "simulate": "simulation", "steps": "simulation",
    "read_state": "stored_state", "modes": "vibration",
}  # fmt: skip
_OF_DATASETS = (
    "analyse", "compare", "Calibration", "Campaign", "Optimisation", "modes", "open_campaign",
    "simulate", "steps",
)  # fmt: skip
"""Words that give datasets, or take them."""


def __getattr__(name: str) -> Any:
    """Load a public word on its first use."""
    if name == "__version__":
        metadata = importlib.import_module("importlib.metadata")
        try:
            return metadata.version(__name__)
        except metadata.PackageNotFoundError:  # run from its sources, without an installation
            return "unknown"
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    word = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    # xarray takes most of a second: not for a scene alone.
    if name in _OF_DATASETS or "xarray" in sys.modules:
        register()
    return word


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})


def register() -> None:
    """Let datasets have ``dataset.ring``; it takes xarray, and so the most of a second."""
    importlib.import_module(f"{__name__}.accessor")


if "xarray" in sys.modules:
    register()
