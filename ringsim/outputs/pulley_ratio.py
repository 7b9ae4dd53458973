"""How much of the tension every pulley passes on."""

from itertools import pairwise

import numpy as np

from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable


class PulleyRatio(Output):
    """Tension behind each pulley over that before it, both seen from the cable's first winch.

    The decay factor of paper 000, eq. 9 (figs 6 and 7), as it acts: eta ** tanh(s / s_slip) of the
    rope's speed s over the pulley, see ``ringsim.cable.chain``.  It exceeds 1 where rope runs away
    from the winch; at a jammed pulley, where two ropes meet, it is the quotient of their tensions.
    """

    rank = 40
    needs = ("cables",)
    variables = (
        # Single precision is 1e-7: a file has as many ratios as tensions.
        Variable(
            "pulley_ratio", ("plane", "pulley", "time"), "1",
            "tension behind a pulley over that before it, from the winch on; missing while the "
            "rope before it is slack", "f4", gaps=True,
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Ratios, and 1 where the rope before the pulley is taut, else 0, shape (2, planes,
        pulleys); NaN where a plane has no cable or one of fewer pulleys.
        """
        chain = now.chain
        if chain is None:
            return None
        ropes = chain.ropes
        before, behind = chain.tensions[ropes.behind - 1], chain.tensions[ropes.behind]
        taut = ~chain.is_slack[ropes.of_span[ropes.behind - 1]]
        jammed = np.divide(behind, before, out=np.ones_like(before), where=taut)
        law = np.exp(chain.exponents * chain.log_decays)
        ratios = np.where(ropes.slips > 0.0, law, jammed)
        edges = np.cumsum([0, *(points - 2 for points in ropes.points_per_cable)]).tolist()
        found = np.full((2, len(now.angles), max(b - a for a, b in pairwise(edges))), np.nan)
        for planes, (first, last) in zip(now.planes, pairwise(edges), strict=True):
            for plane in planes:
                found[:, plane, : last - first] = ratios[first:last], taut[first:last]
        return found

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated; missing where the nearer step found the rope slack."""
        ratios, taut = series.on_grid()
        return {"pulley_ratio": np.where(taut > 0.5, ratios, np.nan)}
