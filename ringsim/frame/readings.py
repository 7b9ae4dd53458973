"""What outputs read of a state, as far as the scene records it."""

from typing import Self

import numpy as np

from ringsim.cable.chain import ChainState, work_between
from ringsim.frame.kernels import Strains, StressMeter, energies_of
from ringsim.frame.mesh import Mesh
from ringsim.frame.model import FrameModel
from ringsim.frame.springs import passing_pairs
from ringsim.frame.state import State
from ringsim.layout.bodies import Array, OnBody, OnRod
from ringsim.layout.points import BOOM_TIP, HUB, Where, points_of
from ringsim.outputs.family import Carried, Put, Reading
from ringsim.parts.laws import PairLaw
from ringsim.refusal import InputError
from ringsim.rigid.statics import first_reaction
from ringsim.scene.substituted import strained
from ringsim.stepping.instant import Energies, Instant, Passing, Remembering, lost_between

# Places and velocities of a structure's points in joint coordinates.


_CLOSE = 1e-9
"""How far a point may be off those with mass of its body, m."""


class PositionMeter:
    """Reads points as means of the points with mass, whose rates are followed.

    A point of a rigid body is the same mean of four others of it wherever it moves.
    """

    def __init__(self, model: FrameModel) -> None:
        points = points_of(model.layout, model.scene.structure.planes)
        self.coordinates = points.coordinates
        self._mesh, rods = model.mesh, model.layout.rods
        self._first = np.cumsum([0, *(len(rod.lengths) for rod in rods)])
        self._weights = np.zeros((len(points.mounts), len(model.mesh.point_mass)))
        self._hub = points.names.index(HUB) if HUB in points.names else None
        for row, where in zip(self._weights, points.mounts, strict=True):
            self._weigh(row, where)

    def read(self, state: State) -> Array:
        """Places (m) and velocities (m/s), shape (points, 2, 3)."""
        both = state.place, state.rate
        found = np.stack([self._weights @ each.points for each in both], axis=1)
        if self._hub is not None:
            found[self._hub] = [each.hub[0] for each in both]
        return found

    def _weigh(self, row: Array, where: Where) -> None:
        mesh = self._mesh
        if where == BOOM_TIP:  # its elements come last
            row[mesh.point[-1, 1]] = 1.0
        elif isinstance(where, OnRod):
            first, last = self._first[where.rod : where.rod + 2]
            element = min(first + where.station, last - 1)
            row[mesh.point[element, first + where.station - element]] = 1.0
        elif isinstance(where, OnBody):
            row[:] = weights_of(mesh, where)


def weights_of(mesh: Mesh, where: OnBody) -> Array:
    """Shares of all points with mass in a point of a body, shape (points,).

    Raises
    ------
    InputError
        If the body has no mass around that point.
    """
    row = np.zeros(len(mesh.point_mass))
    own = np.flatnonzero(mesh.point_frame == where.body)
    known = np.vstack([mesh.point_arm[own].T, np.ones(len(own))])
    wanted = np.append(where.arm, 1.0)
    row[own] = np.linalg.lstsq(known, wanted, rcond=None)[0]
    if np.abs(known @ row[own] - wanted).max() > _CLOSE:
        raise InputError(
            f"record: body {where.body + 1} has no mass around its origin that tells where that is "
            "(positions and accelerations need it): give it an inertia, or choose fidelity = "
            '"full"'
        )
    return row


# Accelerations of corners in joint coordinates.


class AccelerationMeter:
    """Reads the origins of corners as means of the points with mass of their bodies."""

    def __init__(self, model: FrameModel) -> None:
        corners = model.layout.corners
        self.coordinates = {"corner": np.arange(1, len(corners[0]) + 1)}
        self._weights = np.array(
            [[weights_of(model.mesh, OnBody(body)) for body in plane] for plane in corners]
        )

    def read(self, state: State) -> Array:
        """Shape (planes, corners, 3), m/s^2."""
        return np.asarray(self._weights @ state.acceleration.points)


# What the base carries and how it turns.


class BaseMeter:
    """Reads the base of a model.

    The ground's reaction is what is out of balance on the unknowns that it holds; a spacecraft's
    is the inertia of its points.
    """

    def __init__(self, model: FrameModel) -> None:
        self._model, self._base = model, model.layout.base
        self._first = first_reaction(model.layout, model.moving)
        craft = model.layout.spacecraft
        self._mass = 0.0 if craft is None else 0.25 * craft.mass

    def read(self, state: State) -> Carried:
        """At a state."""
        torques = self._model.laws.stop_torques(state.pose.angle, state.rate.angles)
        return Carried(self._reaction(state), self._turn(state), torques)

    def _reaction(self, state: State) -> Array | None:
        """Shape (2, 3), N and N m; None of a base that floats alone."""
        first, self._first = self._first, None
        if first is not None:  # nothing has been out of balance yet
            return first
        if self._model.layout.supports:
            return self._model.reaction.reshape(2, 3)
        own = self._model.mesh.craft
        if not len(own):
            return None
        pulled = self._mass * (state.acceleration.points[own] - self._model.gravity)
        arms = state.place.points[own] - state.pose.place[self._base]
        return -np.array([pulled.sum(axis=0), np.cross(arms, pulled).sum(axis=0)])

    def _turn(self, state: State) -> Array | None:
        """Rotation matrix since the start; None without a base."""
        if self._base is None:
            return None
        start = self._model.layout.bodies[self._base].pose.axes
        return np.asarray(state.pose.axes[self._base] @ start.T)


# Where corners are and what the rods store, in joint coordinates.


class ShapeMeter:
    """Reads corners and the elastic energy of the rods."""

    def __init__(self, model: FrameModel) -> None:
        self._corners = np.array(model.layout.corners)
        self.coordinates = {"corner": np.arange(1, self._corners.shape[1] + 1)}
        rods = sum(len(rod.lengths) for rod in model.layout.rods)
        self._stiffness: Array = model.mesh.stiffness[:rods]  # behind them stands the boom

    def read(self, state: State) -> Put:
        """At a state whose strains are known."""
        strains = state.strains[: len(self._stiffness)]
        energy = 0.5 * float(np.sum(self._stiffness * strains**2))
        return Put(state.pose.place[self._corners], energy)


# Tension of a net's cables in joint coordinates.


class NetMeter:
    """Reads the ends of a law that tells of each of its pairs."""

    def __init__(self, model: FrameModel, law: PairLaw) -> None:
        self._model, self._law = model, law
        self._shape = model.openings.angle.shape

    @classmethod
    def of(cls, model: FrameModel) -> Self | None:
        """None without such a law."""
        told = [law for law in model.layout.pair_laws if law.places]
        return cls(model, told[0]) if told else None

    def read(self, state: State) -> Array:
        """Shape (planes, sections), N; NaN in planes without."""
        velocities = np.zeros((len(self._model.layout.bodies), 3))
        velocities[self._model.web.ends] = state.rate.ends
        return self._law.tensions(state.pose.place, velocities, self._shape)


# What outputs read of a state, as far as the scene records it.


class Readings:
    """All meters that a model's scene asks for; ``coordinates`` are those of what they read."""

    def __init__(self, model: FrameModel) -> None:
        self._model, record = model, model.scene.record
        shaped = record.shape or strained(model.scene)
        self._stress = StressMeter(model.mesh, model.layout) if record.stress else None
        self._position = PositionMeter(model) if record.positions else None
        self._base = BaseMeter(model) if record.reactions else None
        self._shock = AccelerationMeter(model) if record.accelerations else None
        self._shape = ShapeMeter(model) if shaped else None
        self._net = NetMeter.of(model)
        self.coordinates = {"rod": np.array(list(model.layout.halves()))}
        for meter in (self._position, self._shock, self._shape):
            self.coordinates |= {} if meter is None else meter.coordinates

    def read(self, now: Instant, state: State, strains: Strains) -> Reading:
        """An instant with what there is to tell of its state."""
        cables = self._model.cables
        return Reading(
            **vars(now),
            chain=state.chain,
            planes=() if cables is None else tuple((plane,) for plane, _ in cables.present),
            stress=None if self._stress is None else self._stress.read(strains),
            places=None if self._position is None else self._position.read(state),
            carried=None if self._base is None else self._base.read(state),
            accelerations=None if self._shock is None else self._shock.read(state),
            put=None if self._shape is None else self._shape.read(state),
            net=None if self._net is None else self._net.read(state),
        )


# Energies of a state, and what has passed since the state that was kept last.


class EnergyMeter(Remembering):
    """Measures the energies of a model.

    What friction, dampers and stops take is ``lost_between``; of ropes and winches see
    ``work_between``.
    """

    changing = ("_done",)

    def __init__(self, model: FrameModel) -> None:
        self._model, self._damped = model, bool(model.mesh.tau.any())
        self._kept: tuple[Passing, ChainState | None] | None = None
        self._last: tuple[Passing, ChainState | None] | None = None
        self._done = 0.0

    def read(self, time: float, state: State, strains: Strains) -> Energies:
        """Energies of a state at a time (s) with its strains and, if there are cables, its chain.

        Losses and what winches put in count from the state that was kept last.
        """
        model, mesh = self._model, self._model.mesh
        pose = state.pose
        torques = model.laws.passing(pose.angle, state.rate.angles)
        kinetic, elastic = energies_of(mesh, state.rate.points, state.strains)
        elastic += torques.stored + sum(slide.stored(pose) for slide in model.slides)
        forces, places, rates = [torques.lost], [pose.angle], [state.rate.angles]
        if len(model.web.second):
            stored, resisting, lengths, along = passing_pairs(model.web, *state.net)
            elastic += stored
            forces.append(resisting)
            places.append(lengths)
            rates.append(along)
        if model.with_hub:
            moving = state.rate.hub[0]
            kinetic += 0.5 * model.web.hub_mass * float(moving @ moving)
        if model.hanging is not None:
            hold = model.hanging.hold(state)
            kinetic += model.hanging.kinetic(state)
            elastic += hold.stored
            forces.append(-hold.friction.ravel())
            places.append(state.place.hung.ravel())
            rates.append(state.rate.hung.ravel())
        if self._damped:
            straining = strains.lead * state.strains + strains.before
            forces.append((mesh.tau[:, None] * mesh.stiffness * straining).ravel())
            places.append(state.strains.ravel())
            rates.append(straining.ravel())
        if state.chain is not None:
            elastic += float(state.chain.elastic_energy.sum())
        passing = Passing(time, *(np.concatenate(each) for each in (forces, rates, places)))
        self._last = passing, state.chain
        lost = driven = 0.0
        if self._kept is not None:
            before, chain = self._kept
            lost = lost_between(before, passing)
            if chain is not None and state.chain is not None:
                driven, rubbed = work_between(chain, state.chain)
                lost += rubbed
        return Energies(kinetic, elastic, self._done + model.work(state), lost, driven)

    def go_on_from(self, work: float, state: State) -> None:
        """Let other forces act from this state on, up to which loads have done so much work, J."""
        self._done = work - self._model.work(state)

    def strain_energy(self, state: State) -> float:
        """Of rods and boom, and of what holds bodies on it, J."""
        elements = 0.5 * float(np.sum(self._model.mesh.stiffness * state.strains**2))
        return elements + sum(slide.stored(state.pose) for slide in self._model.slides)

    def keep(self) -> None:
        """Count from the last reading on."""
        self._kept = self._last
