"""Doing something when another package is imported, without importing it."""

import sys
from collections.abc import Callable, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType


def when_imported(name: str, action: Callable[[], object]) -> None:
    """Call ``action`` at once if a package is loaded, else right after somebody has loaded it.

    ``import ringsim`` is to cost nothing, and xarray takes half a second.
    """
    if name in sys.modules:
        action()
    else:
        sys.meta_path.insert(0, _Watcher(name, action))


class _Watcher(MetaPathFinder):
    """Lets the import system find a package as ever, and adds to what its loader does."""

    def __init__(self, name: str, action: Callable[[], object]) -> None:
        self._name, self._action = name, action

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """None for all other names, as the protocol wants it."""
        if fullname != self._name:
            return None
        sys.meta_path.remove(self)
        found = find_spec(fullname)
        if found is None or found.loader is None:
            return found
        loading, action = found.loader.exec_module, self._action

        def exec_module(module: ModuleType) -> None:
            loading(module)
            action()

        found.loader.exec_module = exec_module  # type: ignore[method-assign]
        return found
