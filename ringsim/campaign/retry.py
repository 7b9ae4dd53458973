"""Which settings may differ when failed samples of a campaign are run again."""

from collections.abc import Mapping
from typing import Any

from ringsim.refusal import InputError, show
from ringsim.scene import Scene
from ringsim.variables import Status

FAILED = frozenset(status for status in Status if status.failed)
_TABLES = ("solver.", "record.")
_SHAPING = ("solver.end_time", "record.interval")


def check_settings(scene: Scene, settings: Mapping[str, Any]) -> None:
    """Refuse (InputError) settings that would make samples of another antenna, or of another shape.

    ``scene`` is the campaign's, ``settings`` are values by scene path.
    """
    for path, value in settings.items():
        given = f"--set {path} = {show(value)}"
        if not path.startswith(_TABLES):
            raise InputError(
                f"{given}: failed samples are run again with other solver.* or record.* settings "
                "only: another antenna is another campaign, change its file and choose another "
                "--out"
            )
        if path in (*_SHAPING, *scene.structure.shaping):
            raise InputError(
                f"{given}: it shapes the result, and the samples must fit into one file: change "
                "the campaign file and choose another --out"
            )
    scene.with_values(dict(settings))
