"""Small vibrations of the deployed planar truss by Rayleigh and Ritz, without a multibody code.

Coordinates: the upper outer joint (x, y), the angle of the synchronising beam, how far the strut's
head slides along the upper beam by the beam's stretch, and the amplitudes of the sines
sin(i pi x / b), in which the two pinned beams bend.  The potential energy holds the cable, the
spring, bending and stretch (with the shortening of a bent beam, so the pull along it counts); all
masses are points of Gauss quadratures.  Equilibrium and frequencies come from derivatives by finite
differences and scipy's generalised eigenvalues.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import fsolve

MODES = 8
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)
NODES, WEIGHTS = 0.5 + 0.5 * NODES, 0.5 * WEIGHTS


class LinearisedTruss:
    """Stiffness and mass about the balance at the initial length of the cable."""

    def __init__(self, scene):
        self.scene, self.truss = scene, scene.structure
        rods, truss = scene.rods, scene.structure
        self.bending = float(np.max(rods.young_modulus)) * rods.bar.second_moment
        self.stretching = float(np.max(rods.young_modulus)) * rods.bar.area
        cable = scene.cables.upper
        self.rope = truss.cable_length + scene.cables.winch_distance + cable.initial_slack
        self.rope_stiffness = cable.axial_stiffness / self.rope
        self.foot = np.array([0.0, truss.axis_length - truss.strut_foot])
        self.joint = np.array([0.0, truss.axis_length])
        end = truss.geometry().points(truss.coordinate).upper_end[:2]
        self.scale = np.concatenate([[1e-3, 1e-3, 1e-3, 1e-5], np.full(2 * MODES, 1e-4)])
        straight = np.concatenate([end, [0.0, 0.0], np.zeros(2 * MODES)]) / self.scale
        self.place = fsolve(self.gradient, straight, xtol=1e-13) * self.scale

    def beams(self, q):
        """Joint, chord and amplitudes of the upper and of the lower beam."""
        down = self.truss.axis_length * np.array([np.sin(q[2]), -np.cos(q[2])])
        upper, lower = q[4 : 4 + MODES], q[4 + MODES :]
        return (self.joint, q[:2] - self.joint, upper), (np.zeros(2), q[:2] + down, lower)

    def at(self, beam, x, along=0.0):
        """Points of a beam, shape (points, 2), at distances x and slid by ``along``."""
        start, chord, bend = beam
        unit = chord / np.linalg.norm(chord)
        across = np.array([-unit[1], unit[0]])
        share, order = np.atleast_1d(x) / self.truss.beam_length, np.arange(1, MODES + 1)
        w = np.sin(np.pi * share[:, None] * order) @ bend
        slid = share * np.linalg.norm(chord) if along is None else np.atleast_1d(x) + along
        return start + slid[:, None] * unit + w[:, None] * across

    def head(self, q):
        return self.at(self.beams(q)[0], self.truss.strut_head, q[3])[0]

    def shortening(self, bend, low, high):
        """Integral of w'^2 / 2, which a bent beam is longer than its chord."""
        length, order = self.truss.beam_length, np.arange(1, MODES + 1)
        x = low + (high - low) * NODES
        slope = np.cos(np.pi * x[:, None] / length * order) @ (bend * order * np.pi / length)
        return 0.5 * (high - low) * WEIGHTS @ slope**2

    def potential(self, scaled):
        q, truss = scaled * self.scale, self.truss
        length, head, order = truss.beam_length, truss.strut_head, np.arange(1, MODES + 1)
        upper, lower = self.beams(q)
        strut = np.linalg.norm(self.head(q) - self.foot)
        path = np.linalg.norm(q[:2]) + self.scene.cables.winch_distance
        energy = 0.5 * self.rope_stiffness * (path - self.rope) ** 2
        energy += 0.5 * truss.spring.stiffness * (strut - truss.spring.free_length) ** 2
        curve = (order * np.pi / length) ** 4
        energy += 0.25 * self.bending * length * np.sum(curve * (upper[2] ** 2 + lower[2] ** 2))
        whole = np.linalg.norm(upper[1]) - length
        parts = (
            (head, q[3] + self.shortening(upper[2], 0.0, head)),
            (length - head, whole - q[3] + self.shortening(upper[2], head, length)),
            (length, np.linalg.norm(lower[1]) - length + self.shortening(lower[2], 0.0, length)),
        )
        return energy + sum(0.5 * self.stretching / own * e**2 for own, e in parts)

    def gradient(self, scaled):
        step = np.eye(len(scaled)) * 1e-2
        return np.array(
            [(self.potential(scaled + h) - self.potential(scaled - h)) / 2e-2 for h in step]
        )

    def masses(self, q):
        """Points (n, 2) of all masses."""
        truss = self.truss
        upper, lower = self.beams(q)
        x = truss.beam_length * NODES
        down = (lower[1] - q[:2]) / truss.axis_length
        head = self.head(q)
        unit = (head - self.foot) / np.linalg.norm(head - self.foot)
        tube = truss.strut_tube_length * NODES[:, None]
        bar = q[:2] + truss.axis_length * NODES[:, None] * down
        parts = (self.at(upper, x, None), self.at(lower, x, None), bar)
        return np.concatenate([*parts, self.foot + tube * unit, head - tube * unit])

    def weights(self):
        """Mass of each of those points, kg."""
        truss, rods = self.truss, self.scene.rods
        beam = rods.bar.area * truss.beam_length
        bar = truss.bar_width * truss.bar_depth * truss.axis_length
        tubes = [tube.area * truss.strut_tube_length for tube in (rods.diagonal, truss.strut_inner)]
        return rods.density * np.concatenate([v * WEIGHTS for v in (beam, beam, bar, *tubes)])

    def frequencies(self):
        """Natural frequencies in Hz, ascending."""
        place, n = self.place / self.scale, len(self.place)
        step = np.eye(n) * 1e-2
        stiffness = np.array(
            [(self.gradient(place + h) - self.gradient(place - h)) / 2e-2 for h in step]
        )
        rates = [
            (self.masses((place + h) * self.scale) - self.masses((place - h) * self.scale)) / 2e-2
            for h in step
        ]
        moved = np.array([r.ravel() for r in rates])
        mass = moved @ (np.repeat(self.weights(), 2)[:, None] * moved.T)
        squares = eigh(0.5 * (stiffness + stiffness.T), mass, eigvals_only=True)
        return np.sqrt(squares) / (2.0 * np.pi)
