"""The model of a campaign: every value of its scene, and where it comes from."""

import re
import tomllib
from typing import Any, NamedTuple

import xarray as xr

from ringsim.analysis.campaign_samples import campaign_file, inputs, paths_of
from ringsim.campaign.specification import flat
from ringsim.refusal import show
from ringsim.scene import builtin_scenes


class Value(NamedTuple):
    """One value of the scene."""

    path: str
    value: str
    origin: str
    """drawn, drawn in part, campaign, inferred, scene or default."""
    comment: str


def values(campaign: xr.Dataset) -> tuple[list[Value], str]:
    """All values of the scene with their origin, and what the scene's file says at its head.

    Comments are known of built-in scenes only: of a scene of the user's own the dataset holds the
    values, and nothing tells which of them are defaults.
    """
    wanted = campaign_file(campaign)
    settings = flat(wanted.get("set", {}))
    called = str(campaign.attrs.get("campaign", ""))
    settings |= dict.fromkeys(re.findall(r"^# called with --set (\S+) =", called, re.MULTILINE))
    drawn = [path for name in inputs(campaign) for path in paths_of(campaign[name])]
    text = builtin_scenes().get(str(wanted.get("scene", "")), "")
    written, comments = flat(tomllib.loads(text)), _comments(text)
    rows = []
    for path, value in flat(tomllib.loads(str(campaign.attrs["scene"]))).items():
        comment, origin = comments.get(path, ""), "scene"
        if _under(path, drawn):
            origin = "drawn"
        elif _holds(path, drawn):
            origin = "drawn in part"
        elif _under(path, settings):
            origin, comment = "campaign", ""
        elif "inferred" in comment:
            origin = "inferred"
        elif text and path not in written:
            origin = "default"
        rows.append(Value(path, show(value), origin, comment))
    known = [row.path for row in rows]
    unset = [path for path in drawn if not _under(path, known) and not _holds(path, known)]
    rows += [Value(path, "-", "drawn", "") for path in unset]
    head = re.match(r"(?:#.*\n)+", text)
    return rows, " ".join(re.sub(r"^# ?", "", head[0], flags=re.MULTILINE).split()) if head else ""


def _under(path: str, others: Any) -> bool:
    return any(path == each or path.startswith((f"{each}.", f"{each}[")) for each in others)


def _holds(path: str, others: Any) -> bool:
    return any(_under(each, [path]) for each in others)


def _comments(text: str) -> dict[str, str]:
    """Comments behind values, by path; of a table on one line for each value in it."""
    found, table = dict[str, str](), ""
    for line in text.splitlines():
        if header := re.match(r"\[([^\]]+)\]", line):
            table = f"{header[1]}."
        elif match := re.match(r"([^#=]+?)\s*=\s*((?:\"[^\"]*\"|[^#\"])*)#\s*(.*)", line):
            inner = flat(tomllib.loads(f"{match[1]} = {match[2]}"))
            found |= {table + path: match[3] for path in inner}
    return found
