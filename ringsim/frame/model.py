"""A scene in joint coordinates: residual and Newton's step at any state."""

import math

import numpy as np

from ringsim.cable.state import ChainState
from ringsim.frame.cables import FrameCables
from ringsim.frame.elimination import factor, solve, solve_one
from ringsim.frame.following import Coefficients, Followed, follow
from ringsim.frame.kernels import Pose, Strains, add_forces, add_tangent, place_points
from ringsim.frame.laws import JointLaws, Openings
from ringsim.frame.mesh import Skeleton, mesh_of
from ringsim.frame.net import Strings
from ringsim.frame.slide import STIFFNESS, BeamSlide, RigidSlide, Slide
from ringsim.layout.layout import layout_of
from ringsim.layout.pose import Array, cross
from ringsim.scene import Scene
from ringsim.theory.one_coordinate import OneCoordinate
from ringsim.theory.scales import residual_tolerance


class State:
    """Where everything stands and how it moves.

    ``followed`` are the coordinates of points with mass, of the cables' points and the hub, and
    the joint angles, behind one another; the properties are views of these.
    """

    def __init__(self, pose: Pose, hub: Array, strains: Array, followed: Followed) -> None:
        self.pose, self.hub, self.strains, self.followed = pose, hub, strains, followed
        self.chain: ChainState | None = None

    def stand(self) -> tuple[Array, ...]:
        """Copies of all places."""
        return tuple(each.copy() for each in (*self.pose, self.hub))

    def take(self, places: tuple[Array, ...]) -> None:
        """Go back to places of ``stand``."""
        for each, place in zip((*self.pose, self.hub), places, strict=True):
            each[:] = place

    def copy(self) -> "State":
        """Arrays of its own."""
        pose = Pose(*(each.copy() for each in self.pose))
        return State(pose, self.hub.copy(), self.strains.copy(), self.followed.copy())


class FrameModel:
    """All parts of a scene on their unknowns.

    Attributes
    ----------
    size
        Number of unknowns: those of the mesh and the hub's three, if there is a net.
    tolerance
        Residual norm at which Newton stops, N.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.layout = scene, layout_of(scene)
        self.skeleton = skeleton = Skeleton(self.layout)
        beam = self.layout.boom
        boom = [] if beam is None else skeleton.add_beam(beam)
        touching = [] if beam is None else [beam.low.body]
        self.mesh = mesh = mesh_of(skeleton, scene.rods, boom, touching)
        self.openings = Openings.of(skeleton)
        self.laws = JointLaws(scene, skeleton, self.openings)
        self.strings = None if self.layout.net is None else Strings(self.layout.net)
        self.coefficients = Coefficients.of(scene.solver.spectral_radius)
        angle = np.array([one.start for one in skeleton.angles])
        self.openings.unwrapped(angle)
        pose = Pose(np.array(skeleton.places), np.array(skeleton.axes), angle)
        self.cables = None
        if scene.cables is not None:
            self.cables = FrameCables(scene.cables, skeleton, mesh, pose)
        stiffest = float(mesh.stiffness[:, 0].max())
        self.slides: list[Slide] = [
            RigidSlide(mesh, *pair, STIFFNESS * stiffest) for pair in skeleton.slides
        ]
        if beam is not None:
            nodes = [(end.frame, end.axes) for end in skeleton.beam]
            self.slides.append(
                BeamSlide(mesh, nodes, boom[0].length, beam.low.body, STIFFNESS * stiffest)
            )
        self.size = mesh.unknowns + (0 if self.strings is None else 3)
        self.loads = np.zeros(self.size)
        self.loaded: list[tuple[int, Array]] = []
        for number, force in self.layout.forces:
            end = skeleton.end_of(self.layout.joints[number].first)
            self.loads[mesh.home[end.frame] : mesh.home[end.frame] + 3] += force
            self.loaded.append((end.frame, force))
        self.tolerance = residual_tolerance(
            scene, self.layout, 4.0 * float(np.finfo(float).eps) * math.sqrt(self.size)
        )
        points, lines = 3 * len(mesh.point_mass), 0 if self.cables is None else self.cables.points
        ends = 0 if self.strings is None else len(self.strings.bodies)
        self._cuts = np.cumsum([0, points, 3 * lines, len(angle), 3 * ends, 3 * (ends > 0)])
        self.start = self._started(pose)
        self.forced = self.start.followed.place[:0]
        self._fronts = np.zeros((len(mesh.gone), mesh.spots.shape[1], mesh.spots.shape[1]))

    def reached(self, step: float, strains: Strains) -> float:
        """Residual norm (N) that round-off leaves at this step (s), of coordinates of order 1 m: of
        inertia, of the rods' damping and of the springs of slides.
        """
        mesh = self.mesh
        inertia = self.coefficients.acceleration_by_place(step) * (
            mesh.mass[:, 0].max() + mesh.point_mass.max()
        )
        rods = mesh.stiffness[:, 0].max() * (1.0 + mesh.tau * strains.lead)
        slides = STIFFNESS * mesh.stiffness[:, 0].max() if self.slides else 0.0
        small = 4.0 * float(np.finfo(float).eps)
        return float(small * (math.sqrt(self.size) * (inertia + rods) + slides))

    def part(self, values: Array, which: int) -> Array:
        """Of the followed coordinates: points 0, cables' points 1, angles 2, strings' ends 3, hub
        4; a view, shape (n, 3) or (angles,).
        """
        own = values[self._cuts[which] : self._cuts[which + 1]]
        return own if which == 2 else own.reshape(-1, 3)

    def place(self, state: State) -> None:
        """Places of all followed coordinates at the state's pose."""
        place, pose = state.followed.place, state.pose
        place_points(self.mesh, pose, self.part(place, 0))
        if self.cables is not None:
            self.cables.place(pose, self.part(place, 1))
        self.part(place, 2)[:] = pose.angle
        if self.strings is not None:
            self.part(place, 3)[:] = pose.place[self.strings.bodies]
            self.part(place, 4)[0] = state.hub

    def residual(
        self, time: float, step: float, start: State, now: State, strains: Strains
    ) -> Array:
        """Forces out of balance on all unknowns, shape (size,); ValueError if the cables have no
        answer.
        """
        self.place(now)
        follow(self.coefficients, step, start.followed, now.followed)
        place, rate, acceleration, _ = now.followed
        g = -self.loads
        inner = g[: self.mesh.unknowns]
        add_forces(
            self.mesh, now.pose, self.part(place, 0), self.part(acceleration, 0), strains, inner
        )
        torques = self.laws.torques(now.pose.angle, self.part(rate, 2))
        inner[self.mesh.angle_home] += torques.total
        for slide in self.slides:
            slide.hold(now.pose, inner)
        if self.strings is not None:
            pulls = self.strings.pulls(*self._net_at(now))[0]
            spots = self.mesh.home[self.strings.bodies][:, None] + np.arange(3)
            inner[spots] += pulls
            g[-3:] += self.strings.hub_mass * self.part(acceleration, 4)[0] - pulls.sum(axis=0)
        if self.cables is not None:
            self._pulled = self.cables.pull(
                time, now.pose, self.part(place, 1), self.part(rate, 1), inner
            )
        inner[self.mesh.fixed] = 0.0
        return g

    def _net_at(self, now: State) -> tuple[Array, Array, Array, Array]:
        place, rate = now.followed.place, now.followed.rate
        return (
            self.part(place, 3), self.part(rate, 3), self.part(place, 4)[0], self.part(rate, 4)[0]
        )  # fmt: skip

    def tangent(self, time: float, step: float, now: State, strains: Strains) -> "Factored":
        """The residual's derivative after the unknowns, factored."""
        mesh, (place, rate, acceleration, _) = self.mesh, now.followed
        by_rate = self.coefficients.rate_by_place(step)
        by_place = self.coefficients.acceleration_by_place(step)
        fronts = self._fronts
        fronts[:] = 0.0
        add_tangent(
            mesh, now.pose, self.part(place, 0), self.part(acceleration, 0), strains, by_place,
            fronts,
        )  # fmt: skip
        slopes = self.laws.slopes(now.pose.angle, self.part(rate, 2), by_rate)
        front, spot = mesh.angle_local.T
        fronts[front, spot, spot] += slopes
        for slide in self.slides:
            slide.add_tangent(now.pose, fronts)
        columns = rows = np.zeros((0, mesh.unknowns))
        if self.cables is not None:
            columns, rows = self.cables.add_tangent(
                time, now.pose, *self._pulled, self.part(rate, 1), by_rate, fronts
            )
        corner = -np.eye(len(columns))
        if self.strings is not None:
            blocks = self.strings.tangents(*self._net_at(now), by_rate)
            front, first = mesh.frame_local[self.strings.bodies].T
            reach = np.arange(3)
            spots = first[:, None] + reach
            fronts[front[:, None, None], spots[:, :, None], spots[:, None, :]] += blocks
            hub = np.zeros((3, mesh.unknowns))
            hub[:, mesh.home[self.strings.bodies][:, None] + reach] = -blocks.transpose(1, 0, 2)
            own = blocks.sum(axis=0) + self.strings.hub_mass * by_place * np.eye(3)
            whole = np.zeros((len(columns) + 3,) * 2)
            whole[:-3, :-3], whole[-3:, -3:] = corner, own
            columns, rows, corner = np.vstack([columns, hub]), np.vstack([rows, hub]), whole
        return Factored(self, fronts, columns, rows, corner)

    def _started(self, pose: Pose) -> State:
        """At rest with the accelerations of the structure with rigid rods, as of the full model."""
        skeleton, scene = self.skeleton, self.scene
        pull, velocity, rotation = 0.0, np.zeros(3), np.zeros(3)
        if not self.layout.springs:
            ideal, q = OneCoordinate(scene), scene.structure.coordinate
            motion = ideal.motion(q)
            pull = ideal.work_rate(q) / motion.inertia
            velocity, rotation = motion.velocity, motion.rotation
        self.first = np.zeros(self.size)
        rates = []
        for f, (rate, turn) in enumerate(skeleton.rates):
            moving = pull * (rate - velocity - cross(rotation, skeleton.places[f]))
            turning = pull * (turn - rotation)
            rates.append((moving, turning))
            k = self.mesh.home[f]
            self.first[k : k + 3], self.first[k + 3 : k + 6] = moving, turning
        angular = pull * np.array(skeleton.angle_rates)
        self.first[self.mesh.angle_home] = angular
        hub = np.zeros(3) if self.layout.net is None else np.array(self.layout.net.hub)
        state = State(
            pose, hub, np.zeros((len(self.mesh.length), 6)),
            Followed.at_rest(np.zeros(self._cuts[-1]), np.zeros(self._cuts[-1])),
        )  # fmt: skip
        self.place(state)
        # Accelerations of the points: differences of places along the motion.
        ahead, behind = state.copy(), state.copy()
        from ringsim.frame.kernels import move

        small = 1e-6 / max(float(np.abs(self.first).max()), 1e-300)
        move(self.mesh, ahead.pose, small * self.first[: self.mesh.unknowns])
        move(self.mesh, behind.pose, -small * self.first[: self.mesh.unknowns])
        if self.strings is not None:
            moving = self.first[self.mesh.home[self.strings.bodies][:, None] + np.arange(3)]
            self.first[-3:] = moving.mean(axis=0)
            ahead.hub += small * self.first[-3:]
            behind.hub -= small * self.first[-3:]
        self.place(ahead)
        self.place(behind)
        acceleration = (ahead.followed.place - behind.followed.place) / (2.0 * small)
        state.followed = Followed.at_rest(state.followed.place, acceleration)
        return state


class Factored:
    """The tangent K of the unknowns with its border:

    K x + columns^T z = r,   rows x + corner z = r_z.
    """

    def __init__(
        self, model: FrameModel, fronts: Array, columns: Array, rows: Array, corner: Array
    ) -> None:
        self._mesh, self._fronts, self._rows = model.mesh, fronts, rows
        self._hub = model.strings is not None
        self.sound = bool(factor(model.mesh, fronts))
        self._reached = columns.T.copy()
        if len(columns):
            solve(model.mesh, fronts, self._reached)
        self._corner = corner - rows @ self._reached

    def solve(self, g: Array) -> Array:
        """The change of all unknowns that takes a residual g to zero."""
        unknowns = self._mesh.unknowns
        x = -g[:unknowns]
        solve_one(self._mesh, self._fronts, x)
        if not len(self._corner):
            return np.asarray(x)
        right = np.zeros(len(self._corner))
        if self._hub:
            right[-3:] = -g[-3:]
        z = np.linalg.solve(self._corner, right - self._rows @ x)
        x -= self._reached @ z
        return np.concatenate([x, z[-3:]]) if self._hub else x
