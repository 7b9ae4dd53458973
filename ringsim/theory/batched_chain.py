"""The tension chain of ringsim.cable.chain for many samples and instants at once.

Equations and names are those of ``ringsim.cable.chain``; the geometry is that of an ideal ring
(``ringsim.theory.ideal_path``).  Every array starts with the axes (samples, instants); spans,
pulleys, ropes or cables come last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.cable import slack
from ringsim.cable.friction.family import PulleyFriction
from ringsim.cable.ropes import Ropes
from ringsim.theory.cable_batch import CableBatch
from ringsim.theory.ideal_path import PathShape

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ChainBatch:
    """The chain of all samples and instants.

    A rope of which more is wound than there is gives NaN.

    Attributes
    ----------
    tensions
        Shape (..., spans), N.
    stretch
        Path less natural length of each rope, shape (..., ropes), m.
    loss
        Power lost on pulleys and inside the ropes, shape (..., cables), W.
    winch_power
        Put in by the winches less the energy wound up with the rope, shape (..., cables), W.
    elastic
        Elastic energy, shape (..., cables), J.
    """

    tensions: Array
    stretch: Array
    loss: Array
    winch_power: Array
    elastic: Array


@dataclass(frozen=True)
class _Solved:
    """What the equations of ``ringsim.cable.chain`` give on the way to the tensions."""

    slopes: Array
    tensions: Array
    mean_tension: Array
    natural: Array
    strain: Array
    strain_rate: Array
    rope_speed: Array
    log_steps: Array


class BatchedChain:
    """Evaluates a batch whose samples have the same ropes.

    Parameters
    ----------
    shapes
        Paths of one sample's cables (which spans fold is the same for all samples).
    frictions
        One law per cable; only its kind counts.
    """

    def __init__(self, shapes: Sequence[PathShape], frictions: Sequence[PulleyFriction]) -> None:
        self._folding = np.concatenate([shape.folding for shape in shapes])
        self._kinds = [type(law) for law in frictions]
        spans = [len(shape.folding) for shape in shapes]
        self.points_per_cable = tuple(count + 1 for count in spans)
        self._cable_of_span = np.repeat(np.arange(len(spans)), spans)
        self._cable_of_pulley = np.repeat(np.arange(len(spans)), [count - 1 for count in spans])
        self._first_span = np.concatenate([[0], np.cumsum(spans)[:-1]])
        self._first_pulley = np.concatenate([[0], np.cumsum([n - 1 for n in spans])[:-1]])

    def lengths(self, batch: CableBatch, phi: Array) -> tuple[Array, Array, Array]:
        """Span lengths, their derivatives after phi, and cosines between the spans."""
        bar, offset = batch.half_bar[..., None], batch.offset
        sine, cosine = np.sin(phi)[..., None], np.cos(phi)[..., None]
        length = np.sqrt(bar**2 + offset**2 + 2.0 * bar * offset * sine)
        slope = bar * offset * cosine / length
        level, fall = bar * cosine / length, (bar * sine + offset) / length
        span, pulley = self._cable_of_span, self._cable_of_pulley
        a, b, c = (batch.cosines[:, None, k] for k in range(3))
        between = a * level[..., pulley] + b * fall[..., pulley]
        between = between + c * (level**2 - fall**2)[..., pulley]
        return (
            batch.fixed + self._folding * length[..., span],
            self._folding * slope[..., span],
            between,
        )

    def torque(
        self, batch: CableBatch, ropes: Ropes, phi: Array, rate: Array, wound: Array, speed: Array
    ) -> Array:
        """Generalised force -sum T dL/dphi of each cable, shape (..., cables), N m.

        Parameters
        ----------
        ropes
            Which spans form one rope; its own ``content`` and ``alive`` are not used.
        phi, rate
            Bar angles and their rates, rad and rad/s, shape (samples, instants).
        wound, speed
            Rope wound and its rate at both ends of each cable, shape (samples, instants,
            cables, 2), m and m/s.

        """
        found = self._solve(batch, ropes, phi, rate, wound, speed)
        pull = found.tensions * found.slopes
        return -np.asarray(np.add.reduceat(pull, self._first_span, axis=-1))

    def evaluate(
        self, batch: CableBatch, ropes: Ropes, phi: Array, rate: Array, wound: Array, speed: Array
    ) -> ChainBatch:
        """Everything that a result wants to know; parameters as for ``torque``."""
        found = self._solve(batch, ropes, phi, rate, wound, speed)
        spans, strain, natural = found.tensions, found.strain, found.natural
        stiffness = batch.axial_stiffness[..., ropes.cable]
        width = batch.slack_width[..., ropes.cable]
        elastic = stiffness * strain
        density = batch.alive * slack.energy(elastic, width) / stiffness
        resting = batch.alive * slack.tension(elastic, width)
        viscous = (found.mean_tension - resting) * found.strain_rate * natural
        ends = ropes.cable_starts
        edge = np.stack([spans[..., ends[:-1]], spans[..., ends[1:] - 1]], axis=-1)
        stretched = 1.0 + strain
        at_ends = np.stack([stretched[..., ropes.first], stretched[..., ropes.last]], axis=-1)
        lost = spans[..., ropes.behind - 1] * ropes.slips * -np.expm1(found.log_steps)
        lost = lost * found.rope_speed * stretched[..., ropes.of_pulley]
        return ChainBatch(
            tensions=spans,
            stretch=strain * natural,
            loss=np.add.reduceat(lost, self._first_pulley, axis=-1) + _by_cable(ropes, viscous),
            winch_power=np.sum(edge * at_ends * speed, axis=-1)
            - _by_cable(ropes, density * _per_rope(ropes, speed)),
            elastic=_by_cable(ropes, density * natural),
        )

    def _solve(
        self, batch: CableBatch, ropes: Ropes, phi: Array, rate: Array, wound: Array, speed: Array
    ) -> _Solved:
        lengths, slopes, between = self.lengths(batch, phi)
        rates = slopes * rate[..., None]
        starts, cable = ropes.starts, ropes.cable
        path, path_rate = (np.add.reduceat(x, starts, axis=-1) for x in (lengths, rates))
        natural = batch.content - _per_rope(ropes, wound)
        natural = np.where(natural > 0.0, natural, np.nan)
        winding = _per_rope(ropes, speed)
        rope_speed = _speeds(ropes, lengths, rates, path, path_rate, natural, winding, speed)
        exponents = np.tanh(rope_speed / batch.slip_speed[..., self._cable_of_pulley])
        log_steps = exponents * self._log_decays(batch, between) * ropes.slips
        steps = np.zeros_like(lengths)
        steps[..., ropes.behind] = log_steps
        logs = np.cumsum(steps, axis=-1)
        top = np.maximum.reduceat(logs, starts, axis=-1)
        weights = np.exp(logs - top[..., ropes.of_span])
        mean = np.add.reduceat(weights * lengths, starts, axis=-1) / path

        strain = path / natural - 1.0
        strain_rate = (path_rate + path / natural * winding) / natural
        force = strain + batch.damping_time[..., cable] * strain_rate
        force *= batch.axial_stiffness[..., cable]
        tension = batch.alive * slack.tension(force, batch.slack_width[..., cable])
        return _Solved(
            slopes=slopes,
            tensions=weights * (tension / mean)[..., ropes.of_span],
            mean_tension=tension,
            natural=natural,
            strain=strain,
            strain_rate=strain_rate,
            rope_speed=rope_speed,
            log_steps=log_steps,
        )

    def _log_decays(self, batch: CableBatch, between: Array) -> Array:
        angles = 2.0 * np.arctan2(
            np.sqrt(np.maximum(2.0 + 2.0 * between, 0.0)),
            np.sqrt(np.maximum(2.0 - 2.0 * between, 0.0)),
        )
        found = []
        for k, kind in enumerate(self._kinds):
            law: Any = kind.model_construct(None, **batch.coefficients[k])
            own = angles[..., self._cable_of_pulley == k]
            found.append(law.log_decay(own, batch.radius[..., k : k + 1]))
        return np.concatenate(found, axis=-1)


def _per_rope(ropes: Ropes, ends: Array) -> Array:
    """Sum over a rope's ends of a quantity of the winches; (..., cables, 2) -> (..., ropes)."""
    total = np.zeros((*ends.shape[:-2], len(ropes.starts)))
    total[..., ropes.first] += ends[..., 0]
    total[..., ropes.last] += ends[..., 1]
    return total


def _by_cable(ropes: Ropes, values: Array) -> Array:
    """Sum over the ropes of each cable."""
    return np.asarray(np.add.reduceat(values, ropes.first, axis=-1))


def _speeds(
    ropes: Ropes,
    lengths: Array,
    rates: Array,
    path: Array,
    path_rate: Array,
    natural: Array,
    winding: Array,
    speed: Array,
) -> Array:
    rope, last = ropes.of_pulley, ropes.ends[ropes.of_pulley] - 1
    total, total_rate = np.cumsum(lengths, axis=-1), np.cumsum(rates, axis=-1)
    beyond = (total[..., last] - total[..., ropes.behind - 1]) / path[..., rope]
    beyond_rate = total_rate[..., last] - total_rate[..., ropes.behind - 1]
    inflow = np.zeros_like(path)
    inflow[..., ropes.last] = -speed[..., 1]
    share = (beyond_rate - beyond * path_rate[..., rope]) * (natural / path)[..., rope]
    return np.asarray((inflow[..., rope] + winding[..., rope] * beyond - share) * ropes.slips)
