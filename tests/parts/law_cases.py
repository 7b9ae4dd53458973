"""Records of any kind of a family, drawn from the bounds of their fields."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from ringsim.units import Model

LARGEST = 1e3
"""Of a drawn number: sums of terms far apart would say nothing but round-off."""


def records(kind: type[Model]) -> st.SearchStrategy[Any]:
    """Valid records of a kind whose fields are numbers, switches or one value per section."""
    fields = kind.model_json_schema()["properties"]
    drawn = {name: _values(schema) for name, schema in fields.items() if "const" not in schema}
    return st.builds(kind, **drawn)


def _values(schema: dict[str, Any]) -> st.SearchStrategy[Any]:
    if "oneOf" in schema:
        schema = schema["oneOf"][0]
    if "enum" in schema:
        return st.sampled_from(schema["enum"])
    if schema["type"] == "boolean":
        return st.booleans()
    low = schema.get("minimum", schema.get("exclusiveMinimum", -LARGEST))
    high = schema.get("maximum", schema.get("exclusiveMaximum", LARGEST))
    span = min(high, LARGEST) - low
    # Off the ends, which some fields exclude; and no denormal stiffness.
    return st.floats(low + 1e-6 * span, low + 0.999 * span)
