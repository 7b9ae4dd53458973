"""Quantities that are one value for all sections, or a list with one value for each."""

from typing import Annotated, Any, TypeVar, Union

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Tag

from ringsim.units import ListIn, Model

Array = NDArray[np.float64]
_T = TypeVar("_T")
_Record = TypeVar("_Record", bound=Model)

ONE, EACH = "one value", "a value each"


def _one_or_each(value: Any) -> str:
    return EACH if isinstance(value, (list, tuple)) else ONE


PerSection = Annotated[
    Union[Annotated[_T, Tag(ONE)], Annotated[tuple[_T, ...], Tag(EACH)]],  # noqa: UP007
    Discriminator(_one_or_each),
    ListIn,
]
"""One value for all sections, or a list (TOML array) with one value for each."""


def at_section(record: _Record, where: int | NDArray[np.int64]) -> _Record:
    """A record whose lists hold the values of one section (floats), or of several (arrays)."""
    return record.model_copy(
        update={
            name: each[where] if isinstance(where, int) else np.asarray(each)[where]
            for name, each in record
            if isinstance(each, tuple)
        }
    )


def spread(value: float | tuple[float, ...], sections: int) -> Array:
    """One value per section, shape (sections,)."""
    return np.broadcast_to(np.asarray(value, dtype=float), (sections,)).copy()
