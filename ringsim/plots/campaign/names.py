"""Names of inputs in the width that figures have for them."""

import textwrap

WIDE = 34
"""Letters of a line, about."""


def in_lines(name: str) -> str:
    """A name on two lines of bearable length, the path on one of its own; three would overlap."""
    if len(name) <= WIDE:
        return name
    mean, path = (
        ("mean of", name.removeprefix("mean of ")) if name.startswith("mean") else ("", name)
    )
    path, bracket, place = path.partition("[")
    if not mean:
        # Between the parts of a path rather than within a word.
        apart = textwrap.fill(path.replace(".", ". "), WIDE).replace(". ", ".")
        return (apart if len(path) > WIDE else path) + ("\n" if bracket else "") + bracket + place
    part = f" {bracket}{place} of" if bracket else ""
    return f"{mean}{part}\n{path}"
