"""What designs share that move whole groups of inputs: which input belongs to which group."""

import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

from pydantic import Field

from ringsim.choice import kind_of
from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.correlation import Correlation
from ringsim.sampling.designs.family import Design, Factors
from ringsim.sampling.values import Values
from ringsim.units import ListIn

MOST_RUNS = 10_000_000
_STRETCH = re.compile(r"(.*)\[(\d{1,6})(?:\.\.(\d{1,6}))?\]", re.DOTALL)


def stretches(places: int, parts: int) -> Iterator[tuple[int, int]]:
    """Where stretches of places of about equal length begin, and where they end.

    >>> list(stretches(17, 4))
    [(0, 4), (4, 8), (8, 13), (13, 17)]
    """
    return itertools.pairwise(round(k * places / parts) for k in range(parts + 1))


class Grouped(Design):
    """A design made of blocks of runs, in which whole groups of inputs change at once.

    An input that no group names is a group of its own, with all its places if it has many.
    """

    groups: dict[str, Annotated[tuple[str, ...], ListIn]] = Field(default_factory=dict)
    """Inputs by the name of their group: paths as under [inputs], and for inputs of many places
    also single ones, ``PATH[3]``, or stretches of them, ``PATH[1..13]``."""
    stretches: dict[str, Annotated[int, Field(ge=2, le=100_000)]] = Field(default_factory=dict)
    """Into how many stretches of places, each a group, an input of many places is divided."""

    def block(self, groups: int) -> int:
        """Runs of a block with so many groups."""
        raise NotImplementedError

    def rows(self, factors: Factors, seed: int) -> list[str]:
        """What each run of the design is within its block."""
        raise NotImplementedError

    def members(self, factors: Factors) -> dict[str, list[int]]:
        """The axes of every group, in the order of the factors within it.

        InputError if a group names what is not drawn, or something is in two groups.
        """
        axes: dict[str, list[int]] = {}
        for number, (path, distribution) in enumerate(factors.items()):
            name = path.rpartition("[")[0] if distribution.each_section else path
            axes.setdefault(name, []).append(number)
        found: dict[str, list[int]] = {}
        taken: dict[int, str] = {}
        for group, paths in self.groups.items():
            if not paths:
                raise InputError(f'design.groups."{group}" is empty: name an input in it')
            if group in axes and group not in paths:
                raise InputError(
                    f'design.groups."{group}" has the name of an input that is not in it: choose '
                    "another name"
                )
            for path in paths:
                for axis in (chosen := self._chosen(group, path, axes)):
                    if axis in taken:
                        raise InputError(
                            f'design.groups."{group}": {path} is in the group "{taken[axis]}", '
                            "too: leave it out of one of the two"
                        )
                taken |= dict.fromkeys(chosen, group)
                found.setdefault(group, []).extend(chosen)
        for name in self.stretches:
            if name not in axes:
                hint = known_or_nearest(name, axes)
                raise InputError(f'design.stretches."{name}" is not an input ({hint})')
        for name, own in axes.items():
            left = [axis for axis in own if axis not in taken]
            if name in self.stretches:
                found |= self._stretches_of(name, own, left)
            elif left:
                found[name if len(left) == len(own) else f"rest of {name}"] = left
        runs = getattr(self, "samples", 1) * self.block(len(found))
        if runs > MOST_RUNS:
            raise InputError(
                f"design.samples = {runs // self.block(len(found))}: blocks of "
                f"{self.block(len(found))} runs for {len(found)} groups make {runs} runs, must be "
                f"at most {MOST_RUNS}: give fewer samples, or join inputs in groups"
            )
        return found

    def _chosen(self, group: str, path: str, axes: dict[str, list[int]]) -> list[int]:
        if path in axes:
            return axes[path]
        where = f'design.groups."{group}"'
        matched = _STRETCH.fullmatch(path)
        if matched is None or matched[1] not in axes:
            inner = matched[1] if matched else path
            raise InputError(f"{where} names {path}, which is not an input "
                             f"({known_or_nearest(inner, axes)})")  # fmt: skip
        own, first = axes[matched[1]], int(matched[2])
        last = int(matched[3] or first)
        if not 1 <= first <= last <= len(own):
            raise InputError(
                f"{where} names {path}, but {matched[1]} has the places 1 to {len(own)}: write for "
                f"example {matched[1]}[1..{max(1, len(own) // 4)}]"
            )
        return own[first - 1 : last]

    def _stretches_of(self, name: str, own: list[int], left: list[int]) -> dict[str, list[int]]:
        parts = self.stretches[name]
        if len(left) < len(own):
            raise InputError(
                f'design.stretches."{name}" is in design.groups, too: leave it out of one'
            )
        if parts > len(own):
            raise InputError(
                f'design.stretches."{name}" = {parts} must be at most its {len(own)} places'
            )
        return {
            f"{name}[{low + 1}..{high}]": own[low:high] for low, high in stretches(len(own), parts)
        }

    def runs_told(self, runs: int) -> str:
        """How many runs the design has, in words, of so many in all."""
        raise NotImplementedError

    def table(
        self, factors: Factors, correlations: Sequence[Correlation], *, seed: int, folder: Path
    ) -> dict[str, Values]:
        """As of every design; InputError without inputs, which leave nothing to move."""
        if not factors:
            raise InputError(
                f"design.kind = {kind_of(self)} moves inputs, and there are none: give [inputs]"
            )
        return super().table(factors, correlations, seed=seed, folder=folder)
