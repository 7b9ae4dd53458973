"""Lists every text that ringsim prints, stores or draws, to be read aloud.

    python docs/printed_texts.py > texts.md

Texts are literals, values in them by their expressions, and what docstrings are printed: the help
of verbs, and what ``ringsim explain`` says of keys.  Literals of one word or two are listed if they
are a head or a label; patterns, parts of file formats and what is between code is left out.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "ringsim"
_WORDS = 3
"""Fewer are keys, units and heads."""
_HEADS = re.compile(r"head|title|label|columns|legend|Table|Section|suptitle|set_[xy]label")
"""What names or calls literals that are heads."""
_NO_TEXT = re.compile(r"\(\?|\\[dswb]|^\^|[\])][*+?]|<[a-zA-Z!?/]|^outside |\w\.\w+\(.*\)$")
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9 .,%*'-]+")


def texts(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of every literal of a module, in the order of the file."""
    tree = ast.parse(source)
    above = {id(part): node for node in ast.walk(tree) for part in ast.iter_child_nodes(node)}
    printed = {id(node) for node in _printed(tree)}
    bare = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)} - printed
    unread = bare | {id(node) for node in _unread(tree)}
    found = []
    for node in ast.walk(tree):
        if id(node) in unread or not isinstance(node, ast.JoinedStr | ast.Constant):
            continue
        if isinstance(node, ast.Constant) and not isinstance(node.value, str):
            continue
        text = " ".join(_written(node).split())
        long = len(text.split()) >= _WORDS and any(letter.islower() for letter in text)
        if id(node) in printed or (
            (long or _is_head(node, text, above)) and not _NO_TEXT.search(text)
        ):
            found.append((node.lineno, text))
    yield from sorted(found)


def _unread(tree: ast.AST) -> Iterator[ast.AST]:
    """What is no text of its own: parts of f-strings, types, and patterns."""
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield from (part for part in ast.walk(node) if part is not node)
        elif isinstance(node, ast.AnnAssign | ast.arg) and node.annotation is not None:
            yield from ast.walk(node.annotation)
        elif isinstance(node, ast.FunctionDef) and node.returns is not None:
            yield from ast.walk(node.returns)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).startswith(("re.", "cast")):
            yield from (part for each in node.args[:1] for part in ast.walk(each))


def _printed(tree: ast.AST) -> Iterator[ast.AST]:
    """Docstrings of verbs, of records and of their keys."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name.endswith("_command"):
            yield from (each.value for each in node.body[:1] if _is_text(each))
        elif isinstance(node, ast.ClassDef) and node.bases and _is_record(node):
            keyed = [each for each in node.body if isinstance(each, ast.AnnAssign)]
            yield from (each.value for each in node.body[:1] if keyed and _is_text(each))
            yield from (
                behind.value
                for each, behind in zip(node.body, node.body[1:], strict=False)
                if each in keyed and _is_text(behind)
            )


def _is_record(node: ast.ClassDef) -> bool:
    """Whether files may have it: what code keeps to itself is of the kinds of Python."""
    return not {"NamedTuple", "Protocol", "Enum"} & {ast.unparse(base) for base in node.bases}


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _is_head(node: ast.AST, text: str, above: dict[int, ast.AST]) -> bool:
    """Whether a literal of a word or two stands where heads stand."""
    if not _WORD.fullmatch(text):
        return False
    for _ in range(4):
        node = above.get(id(node), node)
        if isinstance(node, ast.Call):
            return bool(_HEADS.search(ast.unparse(node.func)))
        if isinstance(node, ast.Assign):
            return bool(_HEADS.search(ast.unparse(node.targets[0])))
        if isinstance(node, ast.keyword) and _HEADS.search(str(node.arg)):
            return True
    return False


def _written(node: ast.JoinedStr | ast.Constant) -> str:
    """A literal, values in it as {expression}."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    return "".join(
        str(part.value) if isinstance(part, ast.Constant) else "{" + ast.unparse(part.value) + "}"
        for part in node.values
    )


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
