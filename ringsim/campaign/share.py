"""Shares of a campaign, for jobs that know nothing of each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ringsim.refusal import InputError


@dataclass(frozen=True)
class Share:
    """Every ``count``-th sample of a campaign, starting at ``number`` - 1."""

    number: int = 1
    count: int = 1

    @classmethod
    def parse(cls, text: str) -> Share:
        """The share that ``i/n`` names.

        >>> Share.parse("2/8")
        Share(number=2, count=8)

        Raises
        ------
        InputError
            If there is no such share.
        """
        number, _, count = text.partition("/")
        if not (number.isdigit() and count.isdigit() and 1 <= int(number) <= int(count)):
            raise InputError(f"--part {text}: must read i/n with 1 <= i <= n, for example 2/8")
        return cls(int(number), int(count))

    @property
    def whole(self) -> bool:
        """Whether it is all samples."""
        return self.count == 1

    @property
    def writer(self) -> str:
        """Start of the names of files that belong to this share alone."""
        return "all" if self.whole else f"part{self.number}of{self.count}"

    def holds(self, samples: Any) -> Any:
        """Which of the samples belong to the share."""
        return samples % self.count == self.number - 1


WHOLE = Share()
