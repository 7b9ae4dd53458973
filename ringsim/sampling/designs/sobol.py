"""Scrambled Sobol samples."""

from typing import ClassVar, Literal

import numpy as np

from ringsim.refusal import InputError
from ringsim.sampling.designs.replicated import Replicated
from ringsim.sampling.distributions.family import Array


class Sobol(Replicated):
    """Low-discrepancy sequence with linear matrix scrambling and a digital shift.

    Balanced at powers of two; fewer samples are the first ones of the next power of two.
    Source: Joe and Kuo (2008) directions, Matousek (1998) scrambling, as in scipy.
    """

    extendable: ClassVar[bool] = True

    kind: Literal["sobol"] = "sobol"

    def replicate(self, samples: int, axes: int, stream: np.random.Generator) -> Array:
        """The first points of the sequence that belongs to the stream."""
        return sobol_points(samples, axes, stream, kind=self.kind)


def sobol_points(samples: int, axes: int, stream: np.random.Generator, *, kind: str) -> Array:
    """The first points of a scrambled sequence, shape (samples, axes).

    InputError, which names the kind of the design, above the dimensions of the directions.
    """
    from scipy.stats import qmc

    if axes > qmc.Sobol.MAXDIM:
        raise InputError(
            f"design.kind = {kind} needs {axes} dimensions and has at most {qmc.Sobol.MAXDIM}: "
            "draw fewer inputs"
        )
    engine = qmc.Sobol(d=axes, scramble=True, rng=stream, bits=30)
    points: Array = engine.random_base2((samples - 1).bit_length())[:samples]
    return points
