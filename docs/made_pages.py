"""What pages of the documentation take from the code while they are built.

A page asks for it with a line such as ``<!-- made: keys scene -->``; nothing of it is stored.
"""

import ast
import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path

import click

import ringsim
from ringsim.cable.records import path_of, points_along, spans_of
from ringsim.cli import VERBS, command_of
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME
from ringsim.reference import WORDS
from ringsim.reference.keys import Key, keys_of, kind_in, words_of
from ringsim.reference.tree import common, facts, places
from ringsim.units import Model
from ringsim.variables import Variable

EXAMPLES = Path(__file__).parents[1] / "examples"
PICTURES = {
    "first_run": ("ring_opening.png", "A ring opens; this one has 18 sections and two cables"),
    "campaign": ("fan.png", "Fan of a larger campaign: how far each section is ahead or behind"),
    "analysis": ("friction_scatter_matters.png", "What matters in a larger campaign"),
}
"""Of the folder images, beside the example that leads to such a picture."""
MARK = re.compile(r"^<!-- made: ([a-z]+)(?: (\w+))? -->$", re.MULTILINE)


def fill(_app: object, _page: str, source: list[str]) -> None:
    """Sphinx's event ``source-read``: put what was made in the place of its mark."""
    source[0] = MARK.sub(lambda mark: MAKERS[mark[1]](*filter(None, [mark[2]])), source[0])


def keys(root: str) -> str:
    """Every key of a kind of file, table by table in the order of the file."""
    groups: dict[str, list[type[Model]]] = {}
    everywhere = places(root)
    for model, paths in everywhere.items():
        groups.setdefault(min(paths, key=len), []).append(model)
    parts = []
    for path, models in groups.items():
        where = sorted({each for model in models for each in everywhere[model]}, key=len)
        title = ", ".join(f"`{each}`" for each in where) if path else "Top of the file"
        parts.append(f"## {title}\n\n{_kinds(models, path)}")
    return "\n\n".join(parts)


def _kinds(models: list[type[Model]], path: str) -> str:
    if len(models) == 1 and not kind_in(models[0]):
        return f"{_markdown(words_of(models[0]))}\n\n{_table(keys_of(models[0]), path)}"
    shared = common(models) if len(models) > 1 else []
    parts = [f"Keys of all kinds:\n\n{_table(shared, path)}"] if shared else []
    for model in models:
        own = [key for key in keys_of(model) if key.name not in {each.name for each in shared}]
        text = f'### `kind = "{kind_in(model)}"`\n\n{_markdown(words_of(model))}'
        parts.append(f"{text}\n\n{_table(own, path)}" if own else text)
    return "\n\n".join(parts)


def _table(given: list[Key], path: str) -> str:
    rows = [
        (f"`{key.name}`", facts(key, f"{path}.{key.name}".lstrip(".")), key.meaning)
        for key in given
    ]
    return _rows(("key", "what it takes", "meaning"), rows)


def words() -> str:
    """What words of tables, verdicts and figures mean."""
    return _rows(("word", "meaning"), [(f"`{name}`", told) for name, told in WORDS.items()])


def variables() -> str:
    """Every variable of a result."""
    known = COORDINATES | {SPAN_NAME.name: SPAN_NAME} | VARIABLES
    rows = [
        (f"`{one.name}`", ", ".join(one.dims), one.units, _meaning(one), ", ".join(one.needs))
        for one in known.values()
    ]
    return _rows(("variable", "dimensions", "unit", "meaning", "only with"), rows)


def _meaning(variable: Variable) -> str:
    codes = [] if variable.flags is None else [f"{int(c)} {c.word}" for c in variable.flags]
    return variable.long_name + (f": {', '.join(codes)}" if codes else "")


def places_of_cables() -> str:
    """Numbers and names of pulleys and spans of two sections, by where the winches are."""
    parts = []
    for end, words in {
        "first": "one winch at section 1",
        "last": "one winch at the last section",
        "both": "a winch at either end",
    }.items():
        path = path_of(points_along(2), end)
        pulleys, spans = path[1:-1], spans_of(path)
        rows = [
            (str(k), name, pulleys[k - 1] if k <= len(pulleys) else "")
            for k, name in enumerate(spans, 1)
        ]
        parts.append(f'`end = "{end}"`, {words}:\n\n{_rows(("number", "span", "pulley"), rows)}')
    return "\n\n".join(parts)


def commands() -> str:
    """The help of every verb."""
    parts = []
    for verb in VERBS:
        command = command_of(verb)
        context = click.Context(command, info_name=f"ringsim {verb}", max_content_width=96)
        context.help_option_names = ["-h", "--help"]
        parts.append(f"## ringsim {verb}\n\n```text\n{command.get_help(context)}\n```")
    return "\n\n".join(parts)


def python() -> str:
    """The public names, by autodoc."""
    parts = []
    for name in ringsim.__all__:
        found = getattr(ringsim, name)
        where = f"ringsim.{name}"
        shown = f".. autofunction:: {where}"
        if isinstance(found, type):
            record = issubclass(found, Model)  # whose fields the reference of keys has
            shown = f".. autoclass:: {where}{'(**fields)' if record else ''}"
            shown += f"\n   :members: {', '.join(_own_members(found))}"
        parts.append(f"## ringsim.{name}\n\n```{{eval-rst}}\n{shown}\n```")
    return "\n\n".join(parts)


def _own_members(found: type) -> list[str]:
    """Public methods and properties that a class defines itself, without its fields."""
    fields = getattr(found, "model_fields", {})
    return [
        name for name, value in vars(found).items()
        if name[0] != "_" and name not in fields and not name.startswith("model_")
        and (callable(value) or isinstance(value, (property, classmethod)))
    ]  # fmt: skip


def gallery() -> str:
    """Every example with what it says of itself."""
    parts = []
    for path in sorted(EXAMPLES.glob("*.py")):
        text = path.read_text(encoding="utf-8")
        words = ast.get_docstring(ast.parse(text)) or ""
        title, _, rest = words.partition("\n\n")
        code = text.split('"""', 2)[2].strip()
        name, shows = PICTURES.get(path.stem, ("", ""))
        picture = f"![{shows}](images/{name})\n\n*{shows}.*\n\n" if name else ""
        parts.append(
            f"## `{path.stem}`\n\n{_markdown(title)}\n\n{_markdown(rest)}\n\n"
            f"{picture}```sh\npython examples/{path.name}\n```\n\n```python\n{code}\n```"
        )
    return "\n\n".join(parts)


def rest() -> str:
    """A list of the pages that no other list names."""
    here = Path(__file__).parent
    pages = {path.relative_to(here).with_suffix("") for path in here.rglob("*.md")}
    listed = {Path("index")}
    for path in here.rglob("*.md"):
        for names in re.findall(r"```\{toctree\}(.*?)```", path.read_text("utf-8"), re.DOTALL):
            for name in re.findall(r"^(?!:)\S+$", names, re.MULTILINE):
                listed.add(Path(os.path.normpath(path.relative_to(here).parent / name)))
    left = sorted(str(page) for page in pages - listed if page.parts[0] != "_build")
    if not left:
        return ""
    return "```{toctree}\n:caption: More\n:maxdepth: 1\n\n" + "\n".join(left) + "\n```"


def _markdown(words: str) -> str:
    """A docstring as Markdown: its code spans, and its equations as blocks."""
    return words.replace("``", "`")


def _rows(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(head), *map(list, rows)]
    lines.insert(1, ["---"] * len(lines[0]))
    escaped = [[_markdown(cell).replace("|", r"\|") for cell in line] for line in lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in escaped)


MAKERS: dict[str, Callable[..., str]] = {
    "keys": keys,
    "variables": variables,
    "words": words,
    "places": places_of_cables,
    "commands": commands,
    "python": python,
    "gallery": gallery,
    "rest": rest,
}
