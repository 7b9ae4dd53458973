"""Modules of the user's own, which scenes and campaigns name under ``imports``.

Importing one defines its records (structures, laws, faults, distributions, outputs), which from
then on are choices as all others.  A module is a file or a package beside the file that names it,
an installed module, or an entry point of the group ``ringsim``.
"""

import ast
import contextlib
import hashlib
import importlib
import importlib.util
import re
import sys
import tomllib
import traceback
from collections.abc import Collection, Iterable, Mapping, Sequence
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Any

from ringsim.refusal import InputError, known_or_nearest, show

_NAMES = re.compile(r"[A-Za-z_][\w-]*(?:\.[A-Za-z_]\w*)*|[^\0\n]+\.py")
GROUP = "ringsim"
"""Entry points of installed packages."""
LISTED = re.compile(r"^imports = \[[^\]]*\]\n", re.MULTILINE)
"""Where the text of a scene, as ringsim writes it, names modules."""
_LOADED: dict[str, str] = {}
"""Digest of each module's files when it was imported: Python reads them once."""


def located(names: Iterable[str], folder: Path) -> tuple[str, ...]:
    """Names as a file in ``folder`` gives them: of what lies beside it the whole path.

    So a result tells by itself where its modules are, and every process finds them.
    """
    return tuple(_beside(name, folder) or name for name in names)


def names_in(table: Mapping[str, Any]) -> tuple[str, ...]:
    """What a table of a scene or a campaign imports; what is no list of names is refused later."""
    named = table.get("imports", ())
    listed = isinstance(named, list | tuple) and all(isinstance(each, str) for each in named)
    return tuple(named) if listed else ()


def _beside(name: str, folder: Path) -> str:
    """The path of a module or package beside a file; empty if none is there."""
    if not _NAMES.fullmatch(name):
        raise InputError(
            f"imports = {show(name)}: must be the name of a module, such as my_laws, or of a file "
            "that ends with .py"
        )
    given = folder / name
    if given.suffix == ".py":
        return str(given.absolute())
    inside = folder.joinpath(*name.split("."))
    files = inside.with_name(f"{inside.name}.py"), inside / "__init__.py"
    return next((str(file.absolute()) for file in files if file.is_file()), "")


def names_of(scene: str) -> tuple[str, ...]:
    """What the TOML text of a scene imports."""
    found = LISTED.search(scene)
    return names_in(tomllib.loads(found[0])) if found else ()


def load(names: Sequence[str]) -> None:
    """Import modules by path or name; InputError if one is not there, or fails.

    What is imported already stays as it is.
    """
    for name in names:
        module = _module(name)
        _LOADED.setdefault(name, _digest(module))


def digest(names: Sequence[str]) -> str:
    """Digest of the files of modules that were loaded; empty of none.

    Of a package it is of all its files, of a module of its own and of those beside it that it
    imports.  InputError if a file has changed since it was loaded.
    """
    load(names)
    every = []
    for name in names:
        if (now := _digest(_module(name))) != _LOADED[name]:
            raise InputError(
                f"imports: {name} has changed since it was loaded, and Python reads it once: start "
                "Python anew"
            )
        every.append(now)
    return hashlib.blake2b("".join(every).encode(), digest_size=6).hexdigest() if every else ""


def files_of(names: Sequence[str]) -> set[str]:
    """The files of modules that were loaded, and of what they import beside them."""
    return {str(file) for name in names for file in _files(_module(name)).values()}


def line_in(files: Collection[str], error: BaseException) -> str:
    """The line of some files where an error came from, as " (my_laws.py, line 7)"; empty where it
    came from others.
    """
    own = [step for step in traceback.extract_tb(error.__traceback__) if step.filename in files]
    return f" ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else ""


def _digest(module: ModuleType) -> str:
    files = _files(module)
    found = hashlib.blake2b(digest_size=6)
    for place in sorted(files):
        content = files[place].read_bytes()
        found.update(f"{place} {len(content)} ".encode() + content)
    return found.hexdigest()


def _files(module: ModuleType) -> dict[str, Path]:
    """Those of its package, or its own and those beside it that it imports, by their places."""
    top = sys.modules[module.__name__.partition(".")[0]]
    if (paths := getattr(top, "__path__", None)) is None:
        return _with_helpers(Path(str(module.__file__)))
    folder = Path(next(iter(paths)))
    return {file.relative_to(folder).as_posix(): file for file in folder.rglob("*.py")}


def _with_helpers(file: Path) -> dict[str, Path]:
    """A file and those beside it that it imports, and so on, by their places."""
    found, left = {"": file}, [file]
    while left:
        try:
            tree = ast.parse(left.pop().read_bytes())
        except (SyntaxError, ValueError):
            continue
        names = [each.name for node in ast.walk(tree) if isinstance(node, ast.Import)
                 for each in node.names]  # fmt: skip
        names += [node.module for node in ast.walk(tree)
                  if isinstance(node, ast.ImportFrom) and node.module]  # fmt: skip
        for word in names:
            path = file.parent.joinpath(*word.split("."))
            inside = [path.with_name(f"{path.name}.py"), *sorted(path.rglob("*.py"))]
            for each in (each for each in inside if each.is_file()):
                place = each.relative_to(file.parent).as_posix()
                if place not in found and each != file:
                    found[place] = each
                    left.append(each)
    return found


def _module(name: str) -> ModuleType:
    path = Path(name)
    if not path.is_absolute():
        return _imported(name)
    package = path.name == "__init__.py"
    word, folder = (path.parent.name, path.parent.parent) if package else (path.stem, path.parent)
    while (folder / "__init__.py").is_file():  # a part of a package
        word, folder = f"{folder.name}.{word}", folder.parent
    if not all(each.isidentifier() for each in word.split(".")):
        raise InputError(
            f"imports = {show(name)}: {word} is no name of a module: rename the file, with "
            "letters, digits and underscores alone"
        )
    # Behind all others: a file of the user's must not hide what other modules import.
    if path.is_file() and str(folder) not in sys.path:
        sys.path.append(str(folder))
    if not path.is_file() and word not in sys.modules and importlib.util.find_spec(word) is None:
        raise InputError(
            f"imports = {show(name)}: there is no such file, and no module {word}: put it there, "
            "or add its folder to PYTHONPATH"
        )
    module = _imported(word, name)
    # A copy of the same content is the same module.
    if path.is_file() and path.read_bytes() != Path(str(module.__file__)).read_bytes():
        raise InputError(
            f"imports = {show(name)}: another module of this name is in use ({module.__file__}): "
            "rename the file"
        )
    return module


def _imported(word: str, name: str = "") -> ModuleType:
    """A module by its name, or that of an entry point."""
    given = f"imports = {show(name or word)}"
    known = entry_points(group=GROUP)
    target = word if name or word not in known.names else known[word].module
    if getattr(sys.modules.get(target), "__file__", None) is not None:
        return sys.modules[target]
    try:
        if importlib.util.find_spec(target) is None:
            raise ModuleNotFoundError(name=target)
    except (ImportError, ValueError):
        hint = f" ({known_or_nearest(word, sorted(known.names))})" if known.names else ""
        raise InputError(
            f"{given}: there is no module {target}, neither beside the file nor installed{hint}"
        ) from None
    try:
        # What it prints is not what the command prints.
        with contextlib.redirect_stdout(sys.stderr):
            found = importlib.import_module(target)
    except (Exception, SystemExit) as error:  # whatever a file of the user's does
        last = traceback.extract_tb(error.__traceback__)[-1]
        told = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(
            f"{given}: it cannot be imported: {told} ({last.filename}, line {last.lineno})"
        ) from error
    if getattr(found, "__file__", None) is None:
        raise InputError(f"{given}: it has no file: name a module of your own")
    return found
