"""What outputs read of a state, as far as the scene records it."""

from contextlib import suppress
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.core.chain import work_between
from ringsim.core.library import call
from ringsim.frame.mesh import Indices, Mesh
from ringsim.frame.model import FrameModel
from ringsim.frame.state import State
from ringsim.layout.bodies import Array, OnBody, OnRod
from ringsim.layout.points import BOOM_TIP, HUB, Where, points_of
from ringsim.outputs.meters import Bodies, Meters, Places
from ringsim.parts.laws import Switches
from ringsim.refusal import InputError
from ringsim.rigid.statics import first_reaction
from ringsim.stepping.instant import Energies, Remembering

# What outputs read of a state, in joint coordinates.


CLOSE = 1e-9
"""How far a point may be off those with mass of its body, m."""


class FrameMeters(Meters):
    """Measures states of a model.

    The rates that are followed are those of points with mass: a point of a rigid body is the same
    mean of four others of it wherever it moves.
    """

    _state: State

    def __init__(self, model: FrameModel) -> None:
        super().__init__(model.scene, model.layout)
        self._model, self._mesh, rods = model, model.mesh, model.layout.rods
        self._first = np.cumsum([0, *(len(rod.lengths) for rod in rods)])
        self._stiffness: Array = model.mesh.stiffness[: self._first[-1]]  # behind: the boom
        self._known: dict[Places, Indices] = {}
        if model.scene.record.accelerations:
            for number in np.ravel(model.layout.corners):
                weights_of(model.mesh, OnBody(int(number)))  # may refuse
        if model.scene.record.positions:
            _ = self._of_points  # likewise

    def at(self, state: State) -> Self:
        """Measure this state from now on."""
        self._state = state
        return self

    @property
    def switches(self) -> Switches:
        """Those of the model."""
        return self._model.laws.switches

    def bodies(self) -> Bodies:
        """The first frames; velocities are NaN of bodies without mass around their origins, unless
        strings pull them.
        """
        state, count = self._state, len(self.layout.bodies)
        velocities = self._of_bodies @ state.rate.points
        velocities[self._model.web.ends] = state.rate.ends
        return Bodies(state.pose.place[:count].copy(), velocities, state.pose.axes[:count].copy())

    def accelerations(self) -> Array:
        """Those of points with mass, in the same means."""
        return np.asarray(self._of_bodies @ self._state.acceleration.points)

    def points(self) -> Array:
        """Means of points with mass; the hub is followed itself."""
        places = self._state.place, self._state.rate
        weights, hub = self._of_points
        found = np.stack([weights @ each.points for each in places], axis=1)
        if hub is not None:
            found[hub] = [each.hub[0] for each in places]
        return found

    def section_forces(self, places: Places, *, damped: bool) -> tuple[Array, Array]:
        """From the strains of elements."""
        own, mesh, strains = self._elements(places), self._mesh, self._state.strains
        now, before = strains.now[own], strains.before[own]
        felt = now
        if damped:
            felt = now + mesh.tau[own, None] * (strains.lead * now + before)
        carried = mesh.stiffness[own] * felt
        return carried[:, :3].T, carried[:, 3:].T

    def rod_energy(self) -> float:
        """From the strains."""
        strains = self._state.strains.now[: len(self._stiffness)]
        return 0.5 * float(np.sum(self._stiffness * strains**2))

    def reaction(self) -> Array | None:
        """The ground's is what is out of balance on the unknowns that it holds, a spacecraft's the
        inertia of its points.
        """
        model, state = self._model, self._state
        if self.now.time == 0.0:  # nothing has been out of balance yet
            return first_reaction(self.layout, model.moving)
        if self.layout.supports:
            return model.reaction.reshape(2, 3).copy()
        own, craft = model.mesh.craft, self.layout.spacecraft
        if craft is None or not len(own):
            return None
        pulled = 0.25 * craft.mass * (state.acceleration.points[own] - model.gravity)
        arms = state.place.points[own] - state.pose.place[self.layout.base]
        return -np.array([pulled.sum(axis=0), np.cross(arms, pulled).sum(axis=0)])

    def spin(self) -> Array:
        """That of the rigid motion of its four points, by least squares: the sum of r x v is J w,
        with J = sum(r^2 1 - r r^T), r and v from their means.
        """
        own, state = self._model.mesh.craft, self._state
        arms, rates = (each - each.mean(axis=0) for each in (
            state.place.points[own], state.rate.points[own]
        ))  # fmt: skip
        tensor = np.sum(arms**2) * np.eye(3) - arms.T @ arms
        return np.asarray(np.linalg.solve(tensor, np.cross(arms, rates).sum(axis=0)))

    def _elements(self, places: Places) -> Indices:
        if places not in self._known:
            self._known[places] = np.array([self._first[rod] + k for rod, k in places])
        return self._known[places]

    @cached_property
    def _of_bodies(self) -> Array:
        """Shares of all points with mass in the origins of bodies, shape (bodies, points)."""
        found = np.full((len(self.layout.bodies), len(self._mesh.point_mass)), np.nan)
        for number, row in enumerate(found):
            with suppress(InputError):
                row[:] = weights_of(self._mesh, OnBody(number))
        return found

    @cached_property
    def _of_points(self) -> tuple[Array, int | None]:
        """Shares in the points of a layout, shape (points, points with mass); which is the hub."""
        points = points_of(self.layout, self.scene.structure.planes)
        found = np.zeros((len(points.mounts), len(self._mesh.point_mass)))
        for row, where in zip(found, points.mounts, strict=True):
            self._weigh(row, where)
        return found, points.names.index(HUB) if HUB in points.names else None

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
    if np.abs(known @ row[own] - wanted).max() > CLOSE:
        raise InputError(
            f"record: body {where.body + 1} has no mass around its origin that tells where that is "
            "(positions and accelerations need it): give it an inertia, or choose fidelity = "
            '"full"'
        )
    return row


# Energies of a state, and what has passed since the state that was kept last (energies.c).


class Measured(NamedTuple):
    """What ``read_energies`` tells of a state: its energies, that of rods and slides alone, what
    was lost since the state that was kept last (J), and the largest distance of a body from the
    boom that it slides along (m).
    """

    kinetic: float
    elastic: float
    strained: float
    lost: float
    gap: float


class Passed(NamedTuple):
    """A reading: forces that take energy, places that they resist and their rates as ``rows``,
    shape (3, n), N and m or N m and rad; its time (s) and cables.
    """

    rows: Array
    time: float
    chain: ChainState | None


class EnergyMeter(Remembering):
    """Measures the energies of a model; ``strained`` is what the last reading has found in rods and
    boom, and in what holds bodies on it, J.

    What friction, dampers and stops take is ``lost_between``; of ropes and winches see
    ``work_between``.
    """

    changing = ("_done",)

    def __init__(self, model: FrameModel) -> None:
        self._model, mesh = model, model.mesh
        self._hung = 0 if model.hanging is None else model.start.place.hung.size
        damped = mesh.stiffness.size * bool(mesh.tau.any())
        count = self._hung + model.start.pose.angle.size + len(model.web.first) + damped
        self._rooms = np.zeros((3, count)), np.zeros((3, count))
        self._last = self._kept = Passed(np.zeros((3, 0)), 0.0, None)
        self._done = self.strained = 0.0

    def read(self, time: float, state: State) -> tuple[Energies, float]:
        """Energies of a state at a time (s) with, if there are cables, its chain;
        and the largest gap of a joint, m.

        Losses and what winches put in count from the state that was kept last.
        """
        model, hanging, kept = self._model, self._model.hanging, self._kept
        own = self._rooms[kept.rows is self._rooms[0]]
        hold = None
        if hanging is not None:
            hold = hanging.hold(state)
            each = -hold.friction.ravel(), state.place.hung.ravel(), state.rate.hung.ravel()
            own[:, : self._hung] = each
        told = np.zeros(len(Measured._fields))
        call(
            "read_energies", model.system, state.table, time - kept.time, own, kept.rows, told,
        )  # fmt: skip
        kinetic, elastic, strained, lost, gap = told.tolist()
        driven = 0.0
        if model.bent is not None:
            apart = model.bent.size(state.pose)
            stored = 0.5 * model.bent.stiffness * apart**2
            elastic, strained, gap = elastic + stored, strained + stored, max(gap, apart)
        if hanging is not None and hold is not None:
            kinetic, elastic = kinetic + hanging.kinetic(state), elastic + hold.stored
        chain = state.chain
        if chain is not None:
            elastic += float(chain.elastic_energy.sum())
            if kept.chain is not None:
                driven, rubbed = work_between(kept.chain, chain)
                lost += rubbed
        self._last, self.strained = Passed(own, time, chain), strained
        return Energies(kinetic, elastic, self._done + model.work(state), lost, driven), gap

    def go_on_from(self, work: float, state: State) -> None:
        """Let other forces act from this state on, up to which loads have done so much work, J."""
        self._done = work - self._model.work(state)

    def keep(self) -> None:
        """Count from the last reading on."""
        self._kept = self._last
