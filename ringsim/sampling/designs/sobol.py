"""Scrambled Sobol samples."""

from typing import Literal

import numpy as np

from ringsim.refusal import InputError
from ringsim.sampling.designs.family import Design, Factors, Samples
from ringsim.sampling.distributions.family import Array, inside


class Sobol(Design):
    """Low-discrepancy sequence with linear matrix scrambling and a digital shift.

    Balanced at powers of two; fewer samples are the first ones of the next power of two.
    Source: Joe and Kuo (2008) directions, Matousek (1998) scrambling, as in scipy.
    """

    kind: Literal["sobol"] = "sobol"
    samples: Samples

    def points(self, factors: Factors, seed: int) -> Array:
        """The first points of the sequence that belongs to the seed."""
        from scipy.stats import qmc

        if len(factors) > qmc.Sobol.MAXDIM:
            raise InputError(
                f"design.kind = sobol has at most {qmc.Sobol.MAXDIM} inputs, not {len(factors)}: "
                'use kind = "random"'
            )
        engine = qmc.Sobol(d=len(factors), scramble=True, rng=np.random.default_rng(seed), bits=30)
        power = (self.samples - 1).bit_length()
        return inside(engine.random_base2(power)[: self.samples])
