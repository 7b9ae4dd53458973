"""Correlated inputs: a Gaussian copula over the axes of a design."""

from collections.abc import Iterator, Sequence
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.special import ndtr, ndtri

from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.distributions.family import Array, inside
from ringsim.units import ListIn, Model


class Correlation(Model):
    """Two inputs that depend on each other.

    The coefficient is the linear correlation of the underlying standard normal variables
    (Gaussian copula); between two normal inputs it is their own correlation.
    """

    between: Annotated[tuple[str, str], ListIn]
    """Scene paths, or names, of the two inputs."""
    coefficient: Annotated[float, Field(gt=-1.0, lt=1.0)]
    """Correlation of the underlying normal variables."""


def correlate(points: Array, paths: Sequence[str], correlations: Sequence[Correlation]) -> Array:
    """Make independent points of the unit cube, shape (samples, axes), depend on each other.

    There is one path per axis; ``a.b`` in a correlation also means every ``a.b[k]``, section by
    section.  InputError if a pair names what is not drawn, or if the pairs contradict each other.
    """
    matrix = np.eye(len(paths))
    for pair, first, second in pairs_of(paths, correlations):
        matrix[first, second] = matrix[second, first] = pair.coefficient
    moved = np.flatnonzero((matrix != np.eye(len(paths))).any(axis=0))
    if not moved.size:
        return points
    try:
        lower = np.linalg.cholesky(matrix[np.ix_(moved, moved)])
    except np.linalg.LinAlgError:
        raise InputError(
            "correlations: the coefficients contradict each other (their matrix is not positive "
            "definite): bring them nearer to 0"
        ) from None
    dependent = points.copy()
    dependent[:, moved] = inside(ndtr(ndtri(points[:, moved]) @ lower.T))
    return dependent


def pairs_of(
    paths: Sequence[str], correlations: Sequence[Correlation]
) -> Iterator[tuple[Correlation, int, int]]:
    """Every two axes that depend on each other; InputError as ``correlate`` raises it."""
    for pair in correlations:
        first, second = (_axes(paths, name) for name in pair.between)
        where = f"correlations.between = {list(pair.between)}"
        if set(first) & set(second):
            raise InputError(f"{where} must name two different inputs")
        if len(first) != len(second):
            raise InputError(
                f"{where}: one has {len(first)} values and the other {len(second)}: give both or "
                "neither each_section = true"
            )
        for one, other in zip(first, second, strict=True):
            yield pair, one, other


def _axes(paths: Sequence[str], name: str) -> list[int]:
    found = [k for k, path in enumerate(paths) if path == name or path.startswith(f"{name}[")]
    if not found:
        hint = known_or_nearest(name, dict.fromkeys(path.split("[")[0] for path in paths))
        raise InputError(f'correlations.between names "{name}", which is not an input ({hint})')
    return found
