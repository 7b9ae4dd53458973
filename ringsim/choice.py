"""Families of choices: each kind is a model in its own file, picked by ``kind = "..."``."""

from __future__ import annotations

import importlib
import pkgutil
from typing import Annotated, Any, Union

from pydantic import Field

from ringsim.units import Model


def load_package(name: str) -> None:
    """Import every module of a package, so that all kinds that it holds are known."""
    package = importlib.import_module(name)
    for module in pkgutil.iter_modules(package.__path__, f"{name}."):
        importlib.import_module(module.name)


def one_of(family: type[Model]) -> Any:
    """The type "any leaf subclass of ``family``", told apart by its field ``kind``."""
    kinds = tuple(_leaves(family))
    if len(kinds) == 1:
        return kinds[0]
    return Annotated[Union[kinds], Field(discriminator="kind")]  # noqa: UP007


def kinds_of(family: type[Model]) -> dict[str, type[Model]]:
    """All kinds of a family by name."""
    return {str(leaf.model_fields["kind"].default): leaf for leaf in _leaves(family)}


def kind_of(record: Model) -> str:
    """The word that picks the kind of ``record`` in a scene."""
    return str(type(record).model_fields["kind"].default)


def _leaves(family: type[Model]) -> list[type[Model]]:
    below = family.__subclasses__()
    if not below:
        return [family]
    return sorted((leaf for sub in below for leaf in _leaves(sub)), key=lambda c: c.__name__)
