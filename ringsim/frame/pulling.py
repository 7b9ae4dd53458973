"""What cables do to the residual and its tangent, in one call each: numba takes longer to receive
these tables than to go through them.
"""

from ringsim.frame.chain import Drums, RopeTable, Spans, pull_tight
from ringsim.frame.chain_tangent import border
from ringsim.frame.lines import Arms, Lines, add_line_tangent, pull_lines, pull_spans
from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Indices
from ringsim.frame.tape import Tape, play
from ringsim.frame.vectors import compiled
from ringsim.layout.pose import Array


@compiled
def pull_cables(
    lines: Lines, mesh: Mesh, arms: Arms, table: RopeTable, behind: Indices, drums: Drums,
    decays: Tape, places: Array, rates: Array, spans: Spans, g: Array,
) -> float:  # fmt: skip
    """Tighten the spans at places and rates of the points, and add what resists their pull to the
    residual, shape (unknowns,); returns the least length of a span, m.
    """
    least = pull_tight(table, behind, drums, decays, places, rates, spans)
    pull_spans(lines, mesh, arms, spans, g)
    return least


@compiled
def add_cables(
    lines: Lines, mesh: Mesh, arms: Arms, table: RopeTable, drums: Drums, decays: Tape,
    log_slopes: Tape, slopes: Array, spans: Spans, rates: Array, left: Array, rate_by_place: float,
    factors: Array, fronts: Array, columns: Array, rows: Array, first: int,
) -> None:  # fmt: skip
    """Add how spans turn to the fronts, and how tensions change to the border's columns and rows,
    from the ``first`` on.

    ``decays`` and ``log_slopes`` are the laws of the pulleys' friction, played last for the spans,
    and to be played; ``slopes`` those of its exponents after the ropes' speeds (s/m), ``rates`` of
    the points (m/s), ``left`` the share of a change of path that stretches each rope,
    ``rate_by_place`` the derivative of rates after places (1/s), ``factors`` zeros, shape
    (2, k, points, 3).
    """
    for j in range(len(spans.angle)):
        log_slopes.rows[0, j] = spans.angle[j]
    play(log_slopes)
    border(
        table, drums, decays.rows[1], log_slopes.rows[1], slopes, spans, rates, left, rate_by_place,
        factors,
    )  # fmt: skip
    add_line_tangent(lines, arms, spans, fronts)
    pull_lines(lines, mesh, arms, factors[0], columns, first)
    pull_lines(lines, mesh, arms, factors[1], rows, first)
