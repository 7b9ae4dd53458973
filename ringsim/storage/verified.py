"""What was verified of the journals, so that nobody computes their checksums again.

A journal only grows.  As long as one has the size and the time of change that it had, what was
read of it holds; if it is longer, what was read before holds and the rest is read.
"""

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ringsim.files import whole

NAME = "journals-verified.npz"
RECORD = np.dtype(
    [
        ("place", "i8"), ("sample", "i8"), ("status", "i1"), ("fate", "i1"), ("seconds", "f8"),
        ("finished", "f8"), ("form", "U16"), ("run_with", "U16"),
    ]
)  # fmt: skip
"""What is remembered of a whole record; its form is one of ``ringsim.storage.result.pack``."""


@dataclass(frozen=True)
class Verified:
    """The records of one journal, up to the byte ``end``."""

    records: NDArray[np.void] = field(default_factory=lambda: np.empty(0, RECORD))
    size: int = 0
    changed: int = -1
    """When the journal was changed last, ns since 1970."""
    end: int = 0
    damaged: int = 0
    """Gaps between records that are no records."""


def recall(folder: Path) -> dict[str, Verified]:
    """What was verified in a campaign's folder, by name of journal."""
    # Lost or damaged it costs the time to read the journals, so that no fault of it counts.
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, BadZipFile):
        with (folder / NAME).open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            if file["records"].dtype != RECORD:
                return {}
            names, numbers = file["names"].tolist(), file["numbers"]
            parts = np.split(file["records"], np.cumsum(numbers[:, 4])[:-1])
        rows = zip(names, numbers[:, :4].tolist(), parts, strict=True)
        return {name: Verified(part, *row) for name, row, part in rows}
    return {}


def remember(folder: Path, found: dict[str, Verified]) -> None:
    """Write it; never fail because of it, since folders may be read-only."""
    numbers = [(v.size, v.changed, v.end, v.damaged, len(v.records)) for v in found.values()]
    records = np.concatenate([np.empty(0, RECORD), *(v.records for v in found.values())])
    with (
        contextlib.suppress(OSError),
        whole(folder / NAME, lasting=False) as draft,
        draft.open("wb") as file,
    ):
        np.savez(file, names=list(found), numbers=numbers, records=records)


def forget(folder: Path) -> None:
    """Let the next look at the journals read all of them again."""
    with contextlib.suppress(OSError):
        (folder / NAME).unlink(missing_ok=True)
