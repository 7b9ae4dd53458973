"""A finite set of values."""

import json
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ringsim.refusal import show
from ringsim.sampling.distributions.family import Array, Distribution
from ringsim.sampling.values import Values, array_of, label_of, labels_of, plain
from ringsim.units import ListIn


class Discrete(Distribution):
    """Each of the values with its probability; all alike if none are given.

    >>> rods = Discrete(values=("soft", "stiff"), probabilities=(0.3, 0.7))
    >>> rods.quantile(np.array([0.2, 0.4])).tolist()
    ['soft', 'stiff']
    """

    kind: Literal["discrete"] = "discrete"
    values: Annotated[tuple[Any, ...], ListIn]
    """Numbers, words, true and false, whole tables or lists of them, mixed as the field allows."""
    probabilities: Annotated[tuple[Annotated[float, Field(gt=0.0)], ...] | None, ListIn] = None
    """One for each value, which add up to 1; left out, all alike."""

    @model_validator(mode="after")
    def _fitting(self) -> Self:
        if not self.values:
            raise ValueError("values must hold at least one value")
        for number, value in enumerate(self.values, 1):
            try:
                json.dumps(value, allow_nan=False)  # as files will hold it
            except (TypeError, ValueError):
                raise ValueError(
                    f"values[{number}] = {show(value)} must be a finite number, text, true or "
                    "false, a table, or a list of these"
                ) from None
        if len(set(labels_of(array_of(self.values)).tolist())) < len(self.values):
            raise ValueError(f"values = {show(self.values)} must differ from each other")
        if self.probabilities is not None:
            if len(self.probabilities) != len(self.values):
                raise ValueError(
                    f"probabilities has {len(self.probabilities)} entries and must have "
                    f"{len(self.values)}, one for each of the values"
                )
            if abs(sum(self.probabilities) - 1.0) > 1e-9:
                raise ValueError(
                    f"probabilities add up to {sum(self.probabilities):g} and must add up to 1"
                )
        return self

    def _upper_ends(self) -> Array:
        shares = self.probabilities or (1.0 / len(self.values),) * len(self.values)
        upper: Array = np.cumsum(shares)
        return upper

    def quantile(self, probability: Array) -> Values:
        """The value whose interval of cumulative probability holds the given one."""
        chosen = np.searchsorted(self._upper_ends()[:-1], probability, side="right")
        values: Values = array_of(self.values)[chosen]
        return values

    def log_density(self, values: Values) -> Array:
        """Logarithm of the probability of each value; of words and tables also by their labels."""
        shares = self.probabilities or (1.0 / len(self.values),) * len(self.values)
        known: dict[Any, float] = {}
        for value, share in zip(self.values, shares, strict=True):
            number = type(value) in (int, float)
            known |= {label_of(value): share, str(value): share}
            known |= {float(value): share} if number else {}
        plainly = (plain(each) for each in np.ravel(values))
        keys = (float(v) if type(v) in (int, float) else v for v in plainly)
        found = [known.get(k if isinstance(k, (str, float)) else label_of(k), 0.0) for k in keys]
        with np.errstate(divide="ignore"):
            logarithms: Array = np.log(np.array(found)).reshape(np.shape(values))
        return logarithms

    def levels(self, count: int) -> Array:
        """One probability for each value, whatever ``count`` is: the middle of its interval."""
        upper = self._upper_ends()
        middle: Array = 0.5 * (upper + np.concatenate([[0.0], upper[:-1]]))
        return middle
