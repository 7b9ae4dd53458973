"""What docstrings say of records and their fields."""

import ast
import functools
import inspect
import textwrap
from itertools import pairwise

from ringsim.units import Model


def words_of(model: type[Model]) -> str:
    """The docstring of a record without its examples; that of its family if it has none."""
    paragraphs = (inspect.getdoc(model) or "").split("\n\n")
    return "\n\n".join(text for text in paragraphs if not text.lstrip().startswith(">>>"))


@functools.cache
def field_words(model: type[Model]) -> dict[str, str]:
    """Docstrings below the fields of a record, by name; inherited fields have their family's."""
    found: dict[str, str] = {}
    for one in reversed(model.__mro__):
        if issubclass(one, Model) and one is not Model:
            found |= _in_body(one)
    return found


def _in_body(model: type[Model]) -> dict[str, str]:
    """Docstrings in the body of one class; none where a session has typed it, without a file."""
    try:
        source = inspect.getsource(model)
    except OSError:
        return {}
    (body,) = ast.parse(textwrap.dedent(source)).body
    assert isinstance(body, ast.ClassDef)
    return {
        field.target.id: inspect.cleandoc(below.value.value)
        for field, below in pairwise(body.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
        and isinstance(below.value.value, str)
    }
