"""Everything of many ideal rings but their cables: inertia, loads, net, joints, stops.

With the bar angle phi, the diagonals' angle theta (theta' = -2 l sin(phi) phi' / h) and N
sections, the generalised forces after phi are, per unit rate of each joint family,

    V-joints (2 N)   -4 sum_k f_k(2 phi')
    pivots (N)       -2 (dtheta/dphi) sum_k f_k(2 theta')
    hinges (8 N)     -4 sum_k (f_k(phi') + (dtheta/dphi) f_k(theta')),

f(w) = viscous w + coulomb tanh(w / rate): the hinge assemblies only translate.  Every array
starts with the axes (samples, instants).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from ringsim.parts.joints import JointFriction
from ringsim.parts.persection import spread
from ringsim.scene import Scene
from ringsim.theory.ideal_ring import IdealRing

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LOWEST, HIGHEST = -0.5, 0.5 * math.pi + 0.5
"""Bar angles in rad between which the inertia is known: both stops give way a little."""
_MIDDLE, _REACH = 0.5 * (HIGHEST + LOWEST), 0.5 * (HIGHEST - LOWEST)
_MOST_TERMS = 512
_STOP_ONSET, _NET_ONSET = 1e-3, 1e-4
"""Depth (rad) and stretch (m) over which the damping of stops and net comes in."""


def inertia_series(ring: IdealRing) -> Array:
    """Chebyshev coefficients of I(phi) between LOWEST and HIGHEST, to round-off.

    I(phi) is analytic, so the coefficients fall geometrically; their number is doubled until
    the last ones are below 1e-13 of the first.
    """

    def at(places: Any) -> Any:
        return np.array([ring.motion(_MIDDLE + _REACH * place).inertia for place in places])

    terms = 16
    while True:
        found = np.asarray(chebyshev.chebinterpolate(at, terms))
        if np.abs(found[-4:]).max() < 1e-13 * abs(found[0]) or terms >= _MOST_TERMS:
            kept = np.flatnonzero(np.abs(found) > 1e-15 * abs(found[0]))[-1]
            return np.asarray(found[: kept + 1])
        terms *= 2


@dataclass(frozen=True)
class RingBatch:
    """Constants of many rings; shapes (samples, 1, ...)."""

    half_bar: Array
    half_diagonal: Array
    chord_offset: Array
    inertia: Array
    """Chebyshev coefficients, shape (samples, 1, terms)."""
    inertia_rate: Array
    force: Array
    """Sum of the V-joints' forces over the sections, N."""
    net_radii: Array
    """Distance of each corner from the centre in chords, shape (samples, 1, corners)."""
    net_stiffness: Array
    net: Array
    """Damping, neutral length, whether two-sided; shape (samples, 1, 3)."""
    joints: Array
    """Viscous and Coulomb friction summed over the sections and the rate that regularises, for
    pivots, hinges and V-joints; shape (samples, 1, 3, 3)."""
    stop: Array
    """Stiffness and damping times the number of V-joints, stowed folding angle in rad, whether
    it latches; shape (samples, 1, 4)."""

    def take(self, samples: NDArray[np.intp]) -> RingBatch:
        """The same of some samples."""
        return RingBatch(**{f.name: getattr(self, f.name)[samples] for f in fields(self)})

    def inertias(self, phi: Array) -> tuple[Array, Array]:
        """I and dI/dphi, kg m^2; NaN outside LOWEST .. HIGHEST."""
        scaled = (phi - _MIDDLE) / _REACH
        scaled = np.where(np.abs(scaled) <= 1.0, scaled, np.nan)
        waves = np.cos(np.arccos(scaled)[..., None] * np.arange(self.inertia.shape[-1]))
        return (
            np.einsum("btk,bok->bt", waves, self.inertia),
            np.einsum("btk,bok->bt", waves, self.inertia_rate),
        )

    def torque(self, phi: Array, rate: Array, latched: Flags) -> Array:
        """Generalised force of everything but the cables, N m.

        Parameters
        ----------
        phi, rate
            Shape (samples, instants), rad and rad/s.
        latched
            Whether the latches hold, broadcast to the same shape.

        """
        _, lift, turn = self._fold(phi)
        total = self.force * lift
        total -= self._friction(rate, turn)
        spring, damper, stretch_rate = self._net(phi, rate)
        total -= np.sum((spring + damper) * stretch_rate, axis=-1)
        spring, damper = self._stops(phi, rate, latched)
        return np.asarray(total + spring + damper)

    def energies(self, phi: Array, rate: Array, latched: Flags) -> tuple[Array, Array, Array]:
        """Kinetic and elastic energy and work function of the loads, J."""
        raised, _, _ = self._fold(phi)
        kinetic = 0.5 * self.inertias(phi)[0] * rate**2
        spring, _, _ = self._net(phi, rate)
        stored = 0.5 * np.sum(spring * self._net_stretch(phi), axis=-1)
        stiffness, stowed = self.stop[..., 0], self.stop[..., 2]
        folded = 2.0 * phi
        ends = np.maximum(-folded, 0.0) + np.maximum(folded - stowed, 0.0)
        depth = np.where(latched, folded, ends)
        return kinetic, stored + 0.5 * stiffness * depth**2, self.force * raised

    def loss(self, phi: Array, rate: Array, latched: Flags) -> Array:
        """Power lost in joints, net and stops, W."""
        _, _, turn = self._fold(phi)
        _, net, stretch_rate = self._net(phi, rate)
        _, stop = self._stops(phi, rate, latched)
        lost = self._friction(rate, turn) * rate
        lost += np.sum(net * stretch_rate, axis=-1) * rate
        return np.asarray(lost - stop * rate)

    def _fold(self, phi: Array) -> tuple[Array, Array, Array]:
        """Height between the V-joints, its derivative, and dtheta/dphi."""
        bar = self.half_bar
        sine, cosine = np.sin(phi), np.cos(phi)
        height = np.sqrt(4.0 * self.half_diagonal**2 - (2.0 * bar * cosine) ** 2)
        height_rate = 4.0 * bar**2 * cosine * sine / height
        turn = -2.0 * bar * sine / height
        return height - 2.0 * bar * sine, height_rate - 2.0 * bar * cosine, turn

    def _friction(self, rate: Array, turn: Array) -> Array:
        """Friction of all joints, against phi', N m."""

        def law(family: int, speed: Array) -> Array:
            own = self.joints[:, :, family]
            dry = own[..., 1] * np.tanh(speed / own[..., 2])
            return np.asarray(own[..., 0] * speed + dry)

        pivot = 2.0 * turn * law(0, 2.0 * turn * rate)
        hinge = 4.0 * (law(1, rate) + turn * law(1, turn * rate))
        return np.asarray(pivot + hinge + 4.0 * law(2, 2.0 * rate))

    def _net_stretch(self, phi: Array) -> Array:
        chord = 2.0 * (self.half_bar * np.cos(phi) + self.chord_offset)
        stretch = chord[..., None] * self.net_radii - self.net[..., 1:2]
        return np.where(self.net[..., 2:3] > 0.0, stretch, np.maximum(stretch, 0.0))

    def _net(self, phi: Array, rate: Array) -> tuple[Array, Array, Array]:
        """Spring and damper force of each string, and its length's derivative after phi."""
        by_phi = (-2.0 * self.half_bar * np.sin(phi))[..., None] * self.net_radii
        stretch = self._net_stretch(phi)
        spring = self.net_stiffness * stretch
        damper = self.net[..., 0:1] * by_phi * rate[..., None]
        one_sided = np.maximum(damper * np.minimum(stretch / _NET_ONSET, 1.0), -spring)
        return spring, np.where(self.net[..., 2:3] > 0.0, damper, one_sided), by_phi

    def _stops(self, phi: Array, rate: Array, latched: Flags) -> tuple[Array, Array]:
        """Spring and damper part of the stops' generalised force, N m."""
        k, d, stowed = self.stop[..., 0], self.stop[..., 1], self.stop[..., 2]
        folded, turning = 2.0 * phi, 2.0 * rate
        deep, high = np.maximum(-folded, 0.0), np.maximum(folded - stowed, 0.0)

        def total(d: Array) -> Array:
            below = np.maximum(k * deep - d * turning * np.minimum(deep / _STOP_ONSET, 1.0), 0.0)
            above = np.maximum(k * high + d * turning * np.minimum(high / _STOP_ONSET, 1.0), 0.0)
            held = -(k * folded + d * turning)
            return np.asarray(2.0 * np.where(latched, held, below - above))

        spring = total(np.zeros_like(d))
        return spring, total(d) - spring


def stack_rings(scenes: list[Scene], rings: list[IdealRing], series: list[Array]) -> RingBatch:
    """Batch of rings; ``series`` are their ``inertia_series``."""
    terms = max(len(s) for s in series)
    rows: dict[str, list[Any]] = {f.name: [] for f in fields(RingBatch)}
    for scene, ring, coefficients in zip(scenes, rings, series, strict=True):
        structure, net, stop = scene.structure, scene.net, scene.stop
        sections = structure.sections
        padded = np.zeros(terms)
        padded[: len(coefficients)] = coefficients
        plan = ring.geometry.plan
        families = (scene.joints.pivot, scene.joints.hinge, scene.joints.vjoint)
        rows["half_bar"].append(structure.half_bar)
        rows["half_diagonal"].append(structure.half_diagonal)
        rows["chord_offset"].append(structure.hinge_offset)
        rows["inertia"].append(padded)
        rows["inertia_rate"].append(np.append(chebyshev.chebder(padded) / _REACH, 0.0))
        rows["force"].append(float(ring.force.sum()))
        rows["net_radii"].append(np.linalg.norm(plan - plan.mean(axis=0), axis=1))
        rows["net_stiffness"].append(spread(0.0 if net is None else net.stiffness, len(plan)))
        rows["net"].append(
            [0.0, 0.0, 1.0] if net is None else [net.damping, net.neutral_length, net.two_sided]
        )
        rows["joints"].append([_summed(law, sections) for law in families])
        rows["stop"].append(
            [0.0, 0.0, math.pi, 0.0]
            if stop is None
            else [
                2.0 * sections * stop.stiffness,
                2.0 * sections * stop.damping,
                math.pi - math.radians(stop.stowed_angle),
                stop.latch,
            ]
        )
    return RingBatch(**{name: np.array(row, float)[:, None] for name, row in rows.items()})


def _summed(law: JointFriction | None, sections: int) -> list[float]:
    if law is None:
        return [0.0, 0.0, 1.0]
    viscous, coulomb = (spread(value, sections).sum() for value in (law.viscous, law.coulomb))
    return [float(viscous), float(coulomb), law.rate]
