"""Which number of a run tells the largest or the least of a variable that has many values."""

from ringsim.outputs.family import VARIABLES

SENSES = {"largest": "largest_of", "least": "least_of"}


def instead_of(name: str, *senses: str) -> str:
    """What to name in place of a variable with a value for each place or time, in words: the number
    that tells its largest or its least, whichever of ``SENSES`` decides, by default both.

    A limit from above is kept to by all values where the largest keeps to it, one from below where
    the least does; the other number would be far from every limit.
    """
    told, lacking = list[str](), list[str]()
    for sense in senses or SENSES:
        found = [n for n, v in VARIABLES.items() if getattr(v, SENSES[sense]) == name]
        if found:
            told.append(f"its {sense}, {found[0]}")
        else:
            lacking.append(sense)
    words = f"{name} has a value for each {' and '.join(VARIABLES[name].dims)}: give "
    if told:
        return words + " or ".join(told)
    near = [n for n in (f"{name}_joints", f"total_{name}") if n in VARIABLES]
    other = f"; {near[0]} is another number of it" if near else ""
    return f"{words}a number; no output tells its {' or its '.join(lacking)}{other}"
