"""Lists every text that ringsim prints, stores or draws, to be read aloud.

    python docs/printed_texts.py > texts.md

Texts are literals of more than two words, values in them by their expressions.  Docstrings are
none: the reference has them.
"""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "ringsim"
_WORDS = 3
"""Fewer are keys, heads and units."""


def texts(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of every literal of a module, in the order of the file."""
    tree = ast.parse(source)
    inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)
             for part in ast.walk(node) if part is not node}  # fmt: skip
    bare = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    found = []
    for node in ast.walk(tree):
        if id(node) in inner | bare:
            continue
        if isinstance(node, ast.JoinedStr) or (
            isinstance(node, ast.Constant) and isinstance(node.value, str)
        ):
            text = _written(node)
            if len(text.split()) >= _WORDS and any(letter.islower() for letter in text):
                found.append((node.lineno, " ".join(text.split())))
    yield from sorted(found)


def _written(node: ast.JoinedStr | ast.Constant) -> str:
    """A literal, values in it as {expression}."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    parts = []
    for part in node.values:
        if isinstance(part, ast.Constant):
            parts.append(str(part.value))
        elif isinstance(part, ast.FormattedValue):
            parts.append("{" + ast.unparse(part.value) + "}")
    return "".join(parts)


def main() -> None:
    """Print them as a page of Markdown, a section a file."""
    for path in sorted(PACKAGE.rglob("*.py")):
        found = list(texts(path.read_text(encoding="utf-8")))
        if found:
            print(f"\n## {path.relative_to(PACKAGE.parent)}\n")
            for line, text in found:
                print(f"- {line}: {text}")
    for path in sorted(PACKAGE.rglob("*.j2")):
        print(f"\n## {path.relative_to(PACKAGE.parent)}\n\n{path.read_text(encoding='utf-8')}")


if __name__ == "__main__":
    sys.exit(main())
