"""Natural frequencies and shapes of a structure that stands still, from its tangent and masses."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from ringsim.cable.records import Cable, Cables, Winch
from ringsim.cable.winding import ConstantWinding
from ringsim.core.library import call
from ringsim.frame.cables import FrameCables, Roped
from ringsim.frame.laws import JointLaws
from ringsim.frame.mesh import CURE, NOT_HERE, Indices, Mesh
from ringsim.frame.model import FrameModel
from ringsim.frame.readings import FrameMeters
from ringsim.frame.springs import STIFFNESS
from ringsim.frame.state import Coefficients, State
from ringsim.layout.bodies import Array, skew
from ringsim.layout.points import points_of
from ringsim.parts.laws import AngleLaw, AngleRecord, Reaction, two_sided
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.scene.substituted import strained, substituted

# With small changes x of the unknowns about a state in balance, the tangent K of its forces and the
# masses M of its points,
#
#     M x'' + K x = 0,   K x_k = w_k^2 M x_k,   M = J^T m J,
#
# J how points move with the unknowns and m their masses, those of rods between their ends among
# them (ringsim.frame.mesh.inertia_of).  The core factors K + s M, which is the tangent of a step
# whose inertia is s = 1 / (beta h^2), so that T = (K + s M)^-1 M is at hand without a second
# assembly of K: its eigenvalues are 1 / (w^2 + s), the largest those of the lowest w^2, rigid ones
# (0) and unstable ones (negative) among them.  They are found on X, T X, T^2 X, ..., orthonormal in
# M, of a block X, which begins anew with what was found (block Lanczos method: Golub and Underwood,
# in Mathematical Software III, 1977); a block finds modes of one frequency together, as rings have.


ENERGY_PARTS = (
    "bending of rods",
    "stretch and twist of rods",
    "V-joints",
    "boom",
    "net, ropes and weight",
)
"""What stores the energy of a shape; the last is what the others leave of w^2 x^T M x / 2."""
_SHIFT, _MORE = (2.0 * np.pi * 0.05) ** 2, 100.0
"""Least s, 1/s^2, and by how much more where a pivot is too small with it: joints that turn freely
about rods without inertia of their own are held by inertia alone."""
_LARGEST_SHIFT = 1e12
_ROUNDED = 2e3 * np.finfo(float).eps
"""w^2 that is round-off, over the stiffest spring over a shape's mass."""
_UNSURE = 1e3
"""Over that round-off, up to where strains tell whether something holds a shape."""
_ALIKE, _DEPTH, _MOST = 1e-9, 4, 100
"""Relative change of w^2 at which the iteration ends, powers of T in a round, and most rounds."""
_SAME = 1e-14
"""Round-off of 1 / (w^2 + s) over the largest."""
_NEGATIVE = 1e-9
"""Share of the largest 1 / (w^2 + s) from which on one below zero is no round-off."""
_FARTHEST = 0.03
"""Largest entry (m, rad) of an iteration for a balance: whole ones of a ring under its weight lead
away (up to 1e24 N), and some of 0.2 to another state than that nearby."""
_SETTLED, _IDLE = 1e-5, 3
"""Relative change of w^2 at which the iteration ends, too, where it has not fallen for so many
rounds: the solves' own round-off, where small pivots ask for a large shift (arcs without boom)."""
_PATIENCE = 500
"""Iterations for a balance: slow ones where only inertia holds a part that is pulled."""
_TIGHT = 1e-6
"""Share of a rope's tension to which it is met."""
_SOFTEST = 1e-3
"""Stiffness of a rope on its structure over that between walls, at least: steps stay bounded."""
_SPARE = 8
"""Vectors of a block beside those that are wanted."""
_NUDGE = 1e-6
"""Largest way of a point (m) by which strains of a shape are measured."""
_STILL = 1e12
"""A step (s) in which nothing has inertia."""
_STRAINED_LAST = 150.0
"""Opening angle (deg) beyond which strained rods are led there by what holds the V-joints: with
errors of 0.1 mm on all rods none can be put together at 178 deg, where no angle gives way."""
_HOLDS = 200.0
"""Stiffness (N m/rad) by which free V-joints are held while the rest finds its balance."""


class Holding(AngleRecord):
    """Holds a V-joint from both sides at the angle by which it is folded: its ``setting``, rad."""

    stiffness: float
    """Torque over angle, N m/rad."""

    def reaction(self, folded: Array, rate: Array, setting: Array, xp: object = np) -> Reaction:
        """See ``AngleRecord``."""
        return two_sided(folded - setting, rate, self.stiffness, 0.0)


class Modes(NamedTuple):
    """What a structure does by itself about a state: n modes in the order of their w^2, (n,),
    rad^2/s^2, negative where it leaves that state; p points with their ``names`` and places, (p,
    3), m; shapes, (n, p, 3), whose largest way is 1, and their masses, (n,), kg; shares of
    ``ENERGY_PARTS`` in their energy, (n, parts); effective masses along the axes, (n, 3), kg, none
    of what floats free.

    ``rigid`` and ``mechanism`` are motions that nothing holds: of the whole, and of its parts.
    """

    rigid: int
    mechanism: int
    squares: Array
    names: tuple[str, ...]
    places: Array
    shapes: Array
    masses: Array
    shares: Array
    effective: Array


class Standing:
    """A scene at an opening angle (deg), at rest: rods are as its assembly, its net, its weight and
    its ropes leave them while V-joints are held; loads and faults do not act.

    ``latched``: V-joints stay held, by the stiffness of the scene's stop; else they turn freely,
    but for their springs, whose torque is met by what has held them.  Ropes have a ``tension`` (N)
    and winches that do not turn: pulleys at rest pass changes of tension on in full.

    Raises
    ------
    InputError
        If frames cannot represent the scene, there is no stop to hold its V-joints, there are no
        ropes for a tension, or nothing balances there.
    """

    def __init__(
        self, scene: Scene, opening: float, *, latched: bool, tension: float = 0.0
    ) -> None:  # fmt: skip
        if latched and scene.stop is None:
            raise InputError(
                'stop = "none": nothing latches the V-joints: give stop.stiffness, or choose --free'
            )
        self.opening, plain = opening, substituted(scene)
        cables = (
            None if plain.cables is None or tension == 0.0 else with_still_winches(plain.cables)
        )
        if tension > 0.0 and cables is None:
            raise InputError(f"tension = {tension:g} N: the scene has no cables: leave it out")
        # Strained rods cannot be put together where the mean angle hardly moves them.
        start = min(opening, _STRAINED_LAST) if strained(plain) else opening
        at = {"opening_angle": start, "angle_error": None}
        known = at.keys() & type(plain.structure).model_fields
        structure = plain.structure.model_copy(update={name: at[name] for name in known})
        others = {"loads": None, "cables": cables, "faults": (), "structure": structure}
        try:
            self.model = model = FrameModel(plain.model_copy(update=others))
        except InputError as error:
            if NOT_HERE not in str(error):
                raise InputError(f"at {opening:g} deg: {error}") from error
            why = str(error).removeprefix(f"{NOT_HERE} ").removesuffix(f": {CURE}")
            raise InputError(
                f"modes are those of the frame engine, which does not represent {why}: leave that "
                "out"
            ) from error
        except ValueError as error:
            raise InputError(f"at {opening:g} deg: {error}") from error
        # Rates follow places by nothing, so that no damper and no friction counts; the hub of a net
        # is as light as runs can bear, and here has no mass at all.
        model.coefficients = Coefficients(0.0, 0.0, 1.0, 0.0)
        model.web = model.web._replace(hub_mass=0.0)
        self.state: State = model.start.copy()
        for each in self.state.followed[1:]:
            each[:] = 0.0
        self._still = self.state.copy()
        stiffness = _HOLDS if scene.stop is None else scene.stop.stiffness
        self._hold(stiffness, math.radians(opening - start), ramps=not latched)
        self._shift = _SHIFT
        self._settle()
        if model.cables is not None:
            self._tighten(model.cables, tension)
        if not latched:
            switches = model.laws.switches
            switches.on[-1][:] = 0.0
            model.laws.follow()
        self._factor()
        self.moving = moving_points(model.mesh, self.state, model.size)
        self.mass = self._masses()

    def _hold(self, stiffness: float, further: float, *, ramps: bool) -> None:
        """Hold V-joints so much further open than they are (rad), in place of their stops; ramps of
        latches that are free.
        """
        model, layout = self.model, self.model.skeleton.layout
        folded = np.pi - model.openings.read(self.state.pose.angle, self.state.rate.angles)[0]
        kept = [law for law in layout.angle_laws if law.group == "springs"]
        kept += [law for law in layout.angle_laws if law.group == "latches" and ramps]
        # Fully open, stops and latches take all to one angle, whatever rods would have.
        folded = folded - further if self.opening < 180.0 else np.zeros_like(folded)
        places = tuple(np.ndindex(*folded.shape))
        hold = AngleLaw(
            "held", Holding(stiffness=stiffness), places, np.ones(len(places)), folded.ravel()
        )
        model.skeleton.layout = replace(layout, angle_laws=(*kept, hold))
        model.begin_laws(JointLaws(model.skeleton, model.openings))

    @property
    def _roped(self) -> Roped:
        """What the core sees of the ropes."""
        return self.model.unroped if self.model.cables is None else self.model.cables.roped

    @property
    def _step(self) -> float:
        """Of the step whose inertia is the shift, s."""
        return float(1.0 / np.sqrt(self._shift))

    def unbalance(self) -> Array:
        """Forces out of balance, N and N m."""
        given = self._still.table, self.state.table
        if self.model.cables is not None:
            self._roped.drawn.forget()  # the tangent is that of this very state
        # A step so long that what has moved has no acceleration.
        self.model.core("unbalance", 0.0, _STILL, self.state, *given)
        return self.model.system.g

    def _factor(self) -> None:
        """Factor K + s M, s as small as pivots allow."""
        self.unbalance()
        while self.model.core("stiffen", 0.0, self._step, self.state, self.state.table):
            self._shift *= _MORE
            if self._shift > _LARGEST_SHIFT:
                raise InputError(
                    f"at {self.opening:g} deg a part moves that has no mass: give it one"
                )
            self.unbalance()

    def _settle(self) -> None:
        """Newton's method for the state in balance."""
        model = self.model
        for taken in range(_PATIENCE):
            norm = float(np.linalg.norm(self.unbalance() / model.lengths))
            if norm <= model.tolerance(1.0):
                return
            try:
                self._factor()
            except InputError:
                if taken == 0:  # the state as it is put together
                    raise
                break
            change = -self._solve(self.unbalance()[:, None])[:, 0]
            change *= min(1.0, _FARTHEST / max(float(np.abs(change).max()), _FARTHEST))
            call("move", model.mesh, self.state.pose, change[: model.mesh.unknowns])
            if model.with_hub:
                self.state.hub += change[-3:]
        raise InputError(
            f"at {self.opening:g} deg nothing balances: {norm:.3g} N are left (gravity or the net "
            "takes the structure too far, or nothing carries it: stiffen or hold it, or leave them "
            "out)"
        )

    def _tighten(self, cables: FrameCables, tension: float) -> None:
        """Wind ropes until each has a tension, N: secants, as the structure gives."""
        content, last = cables.ropes.content, None
        for _ in range(_PATIENCE):
            chain = cables.state(0.0, self.state.place.paths, self.state.rate.paths)
            # By the force before slack, which goes straight where the tension bends.
            width = chain.material[2]
            off = chain.forces - tension - width * np.log1p(-np.exp(-tension / width))
            if np.all(np.abs(off) <= _TIGHT * tension):
                return
            # A rope gives less than it would between walls, but not next to nothing.
            most = chain.material[0] / content
            slope = most
            if last is not None:
                by = (last[1] - off) / np.where(content == last[0], np.inf, content - last[0])
                slope = np.clip(by, _SOFTEST * most, most)
            last, content = (content, off), content + off / slope
            cables.take(replace(cables.ropes, content=content))
            self._settle()
        raise InputError(
            f"tension = {tension:g} N: at {self.opening:g} deg no length of the ropes has that: "
            "lower it"
        )

    def _solve(self, columns: Array) -> Array:
        """(K + s M)^-1 times columns, shape (unknowns, n)."""
        found = np.ascontiguousarray(-columns.T)
        for row in found:
            call("relax", self.model.system, self._roped, row)
        if self.model.with_hub and not self._roped.border.used[1]:
            found[:, -3:] = 0.0  # no string pulls at the hub
        return found.T

    def _masses(self) -> "scipy.sparse.csr_array":
        """M, of all unknowns."""
        model, mesh = self.model, self.model.mesh
        count, (one, other) = len(mesh.point_mass), mesh.point.T
        own, shared = mesh.mass.T
        masses = np.concatenate([mesh.point_mass, own, own, shared, shared])
        rows = np.concatenate([np.arange(count), one, other, one, other])
        columns = np.concatenate([np.arange(count), one, other, other, one])
        of_points = scipy.sparse.coo_array((masses, (rows, columns)), shape=(count, count))
        each = scipy.sparse.kron(of_points, np.eye(3), format="csr")
        others, size = [], model.size
        if (hung := model.layout.hung) is not None:
            level = hung.law.trolley_mass * (np.eye(3) - np.outer(hung.up, hung.up))
            others += [(mesh.home[body] + np.arange(3), level) for body in hung.bodies]
        mass = self.moving.T @ each @ self.moving + placed(others, (size, size))
        free = np.ones(model.size)
        free[mesh.fixed] = 0.0
        held = scipy.sparse.diags_array(free)
        return (held @ mass @ held).tocsr()

    def modes(self, count: int) -> Modes:
        """The ``count`` lowest that something holds, or that leave the state.

        InputError if the structure has fewer.
        """
        size = self.model.size
        wanted, most = count + 7, size // 3
        if count > (fewest := size // 4):
            raise InputError(
                f"count = {count} must be at most {fewest}: the model of this structure has no "
                "more that mean something (ask for fewer, or raise rods.elements)"
            )
        while True:
            squares, shapes = self.lowest(min(wanted, most), count)
            floor = self._round_off(shapes)
            if self._unstrained:  # else K alone knows, to its round-off
                for k in np.flatnonzero(np.abs(squares) <= _UNSURE * floor):
                    squares[k] = 2.0 * sum(self.stored(shapes[:, k]))
            zero = np.abs(squares) <= floor
            if (~zero).sum() >= count or wanted >= most:
                break
            wanted *= 2
        chosen, free = np.flatnonzero(~zero)[:count], int(zero.sum())
        rigid = 0 if self._floats else self._rigid(shapes[:, zero])
        told = (6, free) if self._floats else (rigid, free - rigid)
        return self._told(squares[chosen], shapes[:, chosen], *told)

    @property
    def _unstrained(self) -> bool:
        """Whether nothing pulls in this state, so that rods and joints store all energy."""
        model = self.model
        pulls = model.web.tape.rows[2]
        return not (model.prestress or pulls.any() or model.cables or model.layout.hung) and (
            model.layout.gravity is None
        )

    @property
    def _floats(self) -> bool:
        """Whether nothing outside of the structure holds it, or pulls at it."""
        return not self.model.mesh.fixed.size and self.model.layout.gravity is None

    def _round_off(self, vectors: Array) -> Array:
        """w^2 that means nothing, of vectors with x^T M x = 1 in columns, rad^2/s^2; small pivots,
        which ask for a larger shift, leave more.
        """
        model, more = self.model, np.sqrt(self._shift / _SHIFT)
        stiffest = float(model.mesh.stiffness[:, 0].max())
        if model.skeleton.slides or model.bent is not None:
            stiffest *= STIFFNESS
        ways = (self.moving @ vectors).reshape(-1, 3, vectors.shape[1])
        return np.asarray(more * _ROUNDED * stiffest * np.sum(ways**2, axis=1).max(axis=0))

    def lowest(self, count: int, asked: int) -> tuple[Array, Array]:
        """So many w^2, in their order, and vectors with x^T M x = 1 in columns; of what floats
        freely those that are no rigid motions.  Those beyond the ``asked`` lowest that are not zero
        may be less exact.
        """
        rigid = self._orthonormal(self.rigid_motions()[:, : 6 * self._floats], [])
        size = self.model.size, count + _SPARE
        before, vectors = np.full(count, np.inf), np.random.default_rng(0).standard_normal(size)
        least, idle = np.inf, 0
        for _ in range(_MOST):
            basis, images = [self._orthonormal(vectors, [rigid])], list[Array]()
            while len(images) < _DEPTH and basis[-1].size:
                images.append(self._solve(self.mass @ basis[-1]))
                basis.append(self._orthonormal(images[-1], [rigid, *basis]))
            found = np.hstack(images)
            small = np.hstack(basis[: len(images)]).T @ (self.mass @ found)
            inverse, turn = np.linalg.eigh(0.5 * (small + small.T))
            if inverse[0] < -_NEGATIVE * inverse[-1]:  # it leaves its state faster than s holds it
                self._shift *= _MORE
                self._factor()
                continue
            inverse, turn = inverse[: -size[1] - 1 : -1], turn[:, : -size[1] - 1 : -1]
            # Once more through the inverse, which leaves nothing of what has no mass.
            vectors = found @ (turn / inverse)
            squares = 1.0 / inverse[:count] - self._shift
            floor = np.maximum(self._round_off(vectors[:, :count]), _ALIKE * np.abs(squares))
            floor += _SAME * inverse[0] / inverse[:count] ** 2
            off = np.abs(squares - before)
            zero = int(np.sum(np.abs(squares) <= _UNSURE * floor))
            worst = float(np.max((off / np.maximum(np.abs(squares), floor))[: zero + asked]))
            idle = 0 if worst < least else idle + 1
            least, before = min(worst, least), squares
            if np.all(off <= floor) or (worst <= _SETTLED and idle >= _IDLE):
                return squares, vectors[:, :count]
        raise InputError(
            f"at {self.opening:g} deg the lowest frequencies are not found in {_MOST} rounds: ask "
            "for more or fewer modes"
        )

    def _orthonormal(self, columns: Array, others: Sequence[Array]) -> Array:
        """A basis of what columns have beside others, both with x^T M x = 1."""
        whole = np.sum(columns * (self.mass @ columns), axis=0)
        for _ in range(2):  # the second time for what round-off has left
            for other in others:
                columns = columns - other @ (other.T @ (self.mass @ columns))
        columns = columns / np.sqrt(np.maximum(whole, np.finfo(float).tiny))
        sizes, turn = np.linalg.eigh(columns.T @ (self.mass @ columns))
        kept = sizes > _ALIKE
        return np.asarray(columns @ (turn[:, kept] / np.sqrt(sizes[kept])))

    def _rigid(self, free: Array) -> int:
        """How many of the motions that nothing holds, in columns, are rigid."""
        whole = self.rigid_motions()
        if self.model.mesh.fixed.size or not free.size:
            return 0
        gram = whole.T @ (self.mass @ whole)
        own = scipy.linalg.solve_triangular(
            np.linalg.cholesky(gram), whole.T @ (self.mass @ free), lower=True
        )
        return int((np.linalg.svd(own, compute_uv=False) > 0.7).sum())

    def rigid_motions(self) -> Array:
        """Along and about x, y and z, as changes of the unknowns, shape (unknowns, 6)."""
        mesh, pose = self.model.mesh, self.state.pose
        found = np.zeros((self.model.size, 6))
        middle = pose.place.mean(axis=0)
        for home, place in zip(mesh.home, pose.place, strict=True):
            found[home : home + 3, :3] = np.eye(3)
            found[home : home + 3, 3:] = -skew(place - middle)
            found[home + 3 : home + 6, 3:] = np.eye(3)
        if self.model.with_hub:
            found[-3:, :3], found[-3:, 3:] = np.eye(3), -skew(self.state.hub - middle)
        return found

    def _told(self, squares: Array, vectors: Array, rigid: int, mechanism: int) -> Modes:
        """Modes of w^2 and their vectors, in columns."""
        model = self.model
        readings, state = FrameMeters(model), self.state.copy()
        shapes, shares = [], []
        for square, vector in zip(squares, vectors.T, strict=True):
            state.rate.points[...] = (self.moving @ vector).reshape(-1, 3)
            state.rate.hub[...] = vector[-3:] if model.with_hub else 0.0
            shapes.append(readings.at(state).points()[:, 1])
            stored = self.stored(vector)
            shares.append([*stored, 0.5 * square - sum(stored)] / (0.5 * abs(square)))
        moved, places = np.array(shapes), readings.points()[:, 0]
        largest = np.linalg.norm(moved, axis=2).max(axis=1, initial=0.0)
        along = self.rigid_motions()[:, :3].T @ (self.mass @ vectors)
        return Modes(
            rigid, mechanism, squares, points_of(model.layout, model.scene.structure.planes).names,
            places, moved / largest[:, None, None], 1.0 / largest**2, np.array(shares), along.T**2,
        )  # fmt: skip

    def stored(self, vector: Array) -> list[float]:
        """Energy of a change of the unknowns in ``ENERGY_PARTS`` but the last, J: from the strains
        that it makes, and not from the tangent.
        """
        model, mesh = self.model, self.model.mesh
        by = _NUDGE / float(np.abs(self.moving @ vector).max())
        strains, angles = [], []
        for way in (by, -by):
            state = self.state.copy()
            call("move", mesh, state.pose, way * vector[: mesh.unknowns])
            strains.append(self._strained(state))
            angles.append(model.openings.read(state.pose.angle, state.rate.angles)[0])
        strain, angle = ((one - other) / (2.0 * by) for one, other in (strains, angles))
        each = 0.5 * mesh.stiffness * strain**2
        boom = len(each) - sum(len(rod.lengths) for rod in model.layout.rods)
        rods, beam = each[: len(each) - boom], each[len(each) - boom :]
        bent = rods[:, [1, 2, 4, 5]].sum()
        return [float(bent), float(rods.sum() - bent), self._in_joints(angle), float(beam.sum())]

    def _strained(self, state: State) -> Array:
        """Strains of all elements at the pose of a state."""
        model, mesh = self.model, self.model.mesh
        call("place_points", mesh, state.pose, state.place.points)
        room, still = np.zeros_like(model.system.kept), np.zeros_like(state.place.points)
        given = state.place.points, still, state.strains, room, np.zeros(mesh.unknowns)
        call("add_forces", mesh, state.pose, *given)
        return state.strains.now

    def _in_joints(self, turned: Array) -> float:
        """Energy in V-joints that turn by so much, (planes, sections), rad."""
        model, state = self.model, self.state
        folded = np.pi - model.openings.read(state.pose.angle, state.rate.angles)[0]
        rates, found = np.zeros_like(folded), 0.0
        for number, law in enumerate(model.laws.switches.laws):
            ahead, behind = (
                model.laws.switches.reaction(number, folded + way, rates).elastic
                for way in (_NUDGE, -_NUDGE)
            )
            own = turned[tuple(np.array(law.places).T)]
            found += float(0.5 * np.sum((ahead - behind) / (2.0 * _NUDGE) * own**2))
        return found


def first_frequency(scene: Scene) -> float:
    """Lowest natural frequency (Hz) of a ring that is open and latched, 0 if it is unstable."""
    square = Standing(scene, 180.0, latched=True).modes(1).squares[0]
    return float(np.sqrt(max(square, 0.0)) / (2.0 * np.pi))


def with_still_winches(cables: Cables) -> Cables:
    """Cables whose winches do not turn."""
    still = {"winch": Winch(winding=ConstantWinding(speed=0.0)), "far_winch": None}
    own = {name: cable for name, cable in cables if isinstance(cable, Cable)}
    return cables.model_copy(
        update={name: cable.model_copy(update=still) for name, cable in own.items()}
    )


def moving_points(mesh: Mesh, state: State, unknowns: int) -> "scipy.sparse.csr_array":
    """How points with mass move with the unknowns, shape (3 points, unknowns)."""
    arms = state.place.points - state.pose.place[mesh.point_frame]
    blocks = [
        (mesh.home[frame] + np.arange(6), np.hstack([np.eye(3), -skew(arm)]))
        for frame, arm in zip(mesh.point_frame, arms, strict=True)
    ]
    rows = np.arange(3 * len(arms)).reshape(-1, 3)
    return placed(blocks, (3 * len(arms), unknowns), rows)


def placed(
    blocks: Sequence[tuple[Indices, Array]], shape: tuple[int, int],
    rows: Sequence[Indices] | Indices = (),
) -> "scipy.sparse.csr_array":  # fmt: skip
    """Blocks at their columns, and at ``rows``, by default the same, of a matrix."""
    found = scipy.sparse.coo_array(shape)
    if blocks:
        values = np.concatenate([block.ravel() for _, block in blocks])
        at = [rows[k] if len(rows) else own for k, (own, _) in enumerate(blocks)]
        down = [np.repeat(own, block.shape[1]) for own, (_, block) in zip(at, blocks, strict=True)]
        along = [np.tile(own, block.shape[0]) for own, block in blocks]
        where = np.concatenate(down), np.concatenate(along)
        found = scipy.sparse.coo_array((values, where), shape=shape)
    return found.tocsr()
