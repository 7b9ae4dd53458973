"""A scene in joint coordinates: residual and Newton's step at any state."""

import math
import sys

import numpy as np

from ringsim.choice import kind_of
from ringsim.frame.cables import Arms, FrameCables, no_lines
from ringsim.frame.elimination import Border, Factored, Fronts
from ringsim.frame.kernels import Pose, Strains, add_forces, move, room_for_loads
from ringsim.frame.laws import JointLaws, Openings
from ringsim.frame.mesh import CURE, NOT_HERE, Skeleton, mesh_of
from ringsim.frame.springs import STIFFNESS, BeamSlide, RigidSlide, Slide, Web
from ringsim.frame.state import (
    Coefficients,
    Followed,
    Hanging,
    Held,
    State,
    balance,
    differentiate,
    put_in_place,
)
from ringsim.layout.bodies import Array
from ringsim.layout.layout import layout_of
from ringsim.parts.rods import GeometricallyExactRods
from ringsim.refusal import InputError
from ringsim.rigid.assembling import assembled
from ringsim.rigid.statics import (
    OneCoordinate,
    coordinates,
    first_acceleration,
    residual_tolerance,
    rope_reach,
)
from ringsim.scene import Scene


class FrameModel:
    """All parts of a scene on their unknowns.

    Attributes
    ----------
    ideal
        The structure with rigid rods, at the start.
    moving
        Its acceleration then.
    prestress
        What putting the structure together has left in its rods, J.
    with_hub, size
        Whether a net has a hub; number of unknowns: those of the mesh and the hub's three.
    reaction
        What was last out of balance on the unknowns that do not move, N and N m.
    """

    def __init__(self, scene: Scene) -> None:
        if not isinstance(scene.rods, GeometricallyExactRods):
            raise InputError(f"{NOT_HERE} rods.kind = {kind_of(scene.rods)!r}: {CURE}")
        drawn = layout_of(scene)
        self.scene = scene
        self.layout, self.prestress = assembled(drawn, scene.rods)
        self.ideal = OneCoordinate(scene, drawn)
        self.gravity = np.zeros(3) if self.layout.gravity is None else self.layout.gravity
        self.moving = first_acceleration(self.layout, self.ideal, scene.structure.coordinate)
        self.skeleton = skeleton = Skeleton(self.layout)
        beam = self.layout.boom
        boom = [] if beam is None else skeleton.add_beam(beam)
        touching = [] if beam is None else [beam.low.body]
        self.mesh, parts = mesh_of(skeleton, scene.rods, boom, touching)
        mesh = self.mesh
        self.openings = Openings.of(skeleton)
        self.laws = JointLaws(skeleton, self.openings)
        self.with_hub, self._strung = self.layout.hub is not None, False
        self.web = Web.of(self.layout, mesh)
        self.coefficients = Coefficients.of(scene.solver.spectral_radius)
        angle = np.array([one.start for one in skeleton.angles])
        self.openings.unwrapped(angle)
        pose = Pose(np.array(skeleton.places), np.array(skeleton.axes), angle)
        self.cables = None
        if scene.cables is not None:
            self.cables = FrameCables(scene.cables, skeleton, mesh, parts)
        self._stiffest = stiffest = float(mesh.stiffness[:, 0].max())
        slides = [
            RigidSlide(mesh, top, low, STIFFNESS * stiffest, turns * scene.structure.reach)
            for top, low, turns in skeleton.slides
        ]
        self._beam_slides: list[Slide] = []
        if beam is not None:
            nodes = [(end.frame, end.axes) for end in skeleton.beam]
            self._beam_slides.append(
                BeamSlide(mesh, nodes, boom[0].length, beam.low.body, STIFFNESS * stiffest)
            )
        self.slides: list[Slide] = [*slides, *self._beam_slides]
        self.size = mesh.unknowns + 3 * self.with_hub
        # Forces and torques, ways and turns are compared by a length of the structure: sums of
        # their squares as they are would depend on the unit of length.
        self.lengths = np.full(self.size, scene.structure.reach)
        self.lengths[mesh.home[:, None] + np.arange(3)] = 1.0
        if self.with_hub:
            self.lengths[-3:] = 1.0
        self.loads = np.zeros(self.size)
        at, forces = [], []
        for number, force in self.layout.forces:
            end = skeleton.end_of(self.layout.joints[number].first)
            if end.arm.any():
                raise InputError(f"{NOT_HERE} forces beside a frame's origin: {CURE}")
            self.loads[mesh.home[end.frame] : mesh.home[end.frame] + 3] += force
            at.append(end.frame)
            forces.append(force)
        loaded = np.array(at, dtype=np.int64)
        self._loaded = loaded, pose.place[loaded], np.array(forces).reshape(-1, 3)
        self._tau = float(mesh.tau.max())
        self._tolerance = residual_tolerance(scene, self.layout, 0.0)
        self._coordinates = coordinates(scene)
        self._masses = mesh.point_mass.copy()
        np.add.at(self._masses, mesh.point, mesh.mass.sum(axis=1)[:, None])
        self._heaviest = float(mesh.point_mass.max() + mesh.mass[:, 0].max())
        lines = 0 if self.cables is None else self.cables.points
        ends = self.web.ends
        hung = self.layout.hung
        lines_on = [] if hung is None else list(hung.bodies)
        sizes = (
            3 * len(mesh.point_mass),
            3 * lines,
            len(angle),
            3 * len(ends),
            3 * self.with_hub,
            3 * len(lines_on),
        )
        self._held = Held(
            cuts=np.cumsum([0, *sizes]),
            ends=ends,
            hung=np.array(lines_on, dtype=np.int64),
            top=np.array([slide.top for slide in slides], dtype=np.int64),
            low=np.array([slide.low for slide in slides], dtype=np.int64),
            reach=np.array([slide.reach for slide in slides]),
            stiffness=STIFFNESS * stiffest,
            damping=self.laws.damping,
            weighs=self.layout.gravity is not None,
            gravity=self.gravity,
        )
        self._held_loads = room_for_loads(mesh)
        self._string_spots = mesh.home[ends][:, None] + np.arange(3)
        self._lines = no_lines() if self.cables is None else self.cables.lines
        self._arms = Arms.empty(lines)
        self.start = self._started(pose)
        self.hanging = None if hung is None else Hanging(hung, mesh, self.start.place.hung.copy())
        self.reaction = np.zeros(len(mesh.fixed))
        self._begun = self.start.place.points.copy()
        self._fronts = Fronts.empty(mesh)

    def turn_loads(self) -> None:
        """Let the forces of ``Loads`` act the other way round."""
        self.loads *= -1.0
        self._loaded[2][...] *= -1.0

    def work(self, state: State) -> float:
        """Of loads and gravity since the start, as they act now, J."""
        at, start, forces = self._loaded
        done = float(np.vdot(forces, state.pose.place[at] - start))
        if self._held.weighs:
            moved = self._masses @ (state.place.points - self._begun)
            if self.with_hub:
                moved += self.web.hub_mass * (state.hub - self._hub)
            done += float(moved @ self.gravity)
        return done if self.hanging is None else done + self.hanging.work(state)

    def gap(self, pose: Pose) -> float:
        """Largest distance of a body from the boom that it slides along, m; revolutes cannot come
        apart.
        """
        return max((slide.size(pose) for slide in self.slides), default=0.0)

    def tolerance(self, step: float, strains: Strains) -> float:
        """Residual norm at which Newton stops in a step (s), N, of torques over ``lengths``; not
        below what round-off leaves of coordinates: of inertia, of the rods with their damping, of
        slides; of ropes, whose strain it is that is rounded.
        """
        inertia = self._heaviest * self.coefficients.acceleration_by_place(step)
        rods = self._stiffest * (1.0 + self._tau * strains.lead)
        slides = STIFFNESS * self._stiffest if self.slides else 0.0
        reached = 4.0 * sys.float_info.epsilon * (math.sqrt(self.size) * (inertia + rods) + slides)
        reached *= self._coordinates
        ropes = rope_reach(self.scene, self.coefficients.rate_by_place(step))
        return max(self._tolerance, reached, 4.0 * sys.float_info.epsilon * ropes)

    def residual(
        self, time: float, step: float, start: State, now: State, strains: Strains
    ) -> Array:
        """Forces out of balance on all unknowns, shape (size,); ValueError if the cables have no
        answer.
        """
        g = -self.loads
        inner = g[: self.mesh.unknowns]
        self._strung = balance(
            self.mesh, self._lines, self._held, self.laws.acting, self.web, self.coefficients,
            step, start.followed, now.pose, now.hub, self._arms, now.followed, strains,
            self._held_loads, g,
        )  # fmt: skip
        self.laws.note(now.rate.angles)
        for slide in self._beam_slides:
            slide.hold(now.pose, inner)
        if self.hanging is not None:
            self.hanging.push(now, inner)
        if self.cables is not None:
            self.cables.pull(time, self._arms, now.place.lines, now.rate.lines, inner)
        if len(self.mesh.fixed):
            self.reaction = inner[self.mesh.fixed]
            inner[self.mesh.fixed] = 0.0
        return g

    def tangent(self, time: float, step: float, now: State, strains: Strains) -> Factored:
        """The derivative of the last residual after the unknowns, factored."""
        mesh, cables, strung, fronts = self.mesh, self.cables, self._strung, self._fronts.whole
        by_rate = self.coefficients.rate_by_place(step)
        by_place = self.coefficients.acceleration_by_place(step)
        factors = 0 if cables is None else cables.factors(time)
        alone = self.with_hub and not strung
        hub_inertia = self.web.hub_mass * by_place if alone else math.nan
        border = Border.empty(mesh.unknowns, factors, strung, hub_inertia)
        differentiate(
            mesh, self._held, self.laws.acting, self.web, now.pose, now.followed, self._held_loads,
            strains.lead, by_rate, by_place, self._fronts, border,
        )  # fmt: skip
        for own, slopes in self.laws.dry_slopes(now.rate.angles):
            front, spot = mesh.angle_local[own].T
            fronts[front, spot, spot] += by_rate * slopes
        for slide in self._beam_slides:
            slide.add_tangent(now.pose, fronts)
        if self.hanging is not None:
            self.hanging.add_tangent(now, by_rate, by_place, fronts)
        if cables is not None:
            cables.add_tangent(self._arms, now.rate.lines, by_rate, factors, self._fronts, border)
        return Factored(mesh, self._fronts, border)

    def _place(self, state: State) -> None:
        """Places of all followed coordinates at the state's pose."""
        put_in_place(
            self.mesh, self._lines, self._held, state.pose, state.hub, self._arms,
            state.followed.place,
        )  # fmt: skip

    def _started(self, pose: Pose) -> State:
        """At rest with the accelerations of the structure with rigid rods, as of the full model."""
        skeleton, moving = self.skeleton, self.moving
        self.first = np.zeros(self.size)
        for f, (rate, turn) in enumerate(skeleton.rates):
            k = self.mesh.home[f]
            self.first[k : k + 3] = moving.at(skeleton.places[f], rate)
            self.first[k + 3 : k + 6] = moving.turning(turn)
        angular = moving.coordinate * np.array(skeleton.angle_rates)
        self.first[self.mesh.angle_home] = angular
        hub = np.zeros(3) if self.layout.hub is None else np.array(self.layout.hub.place)
        self._hub = hub.copy()
        state = State(
            pose, hub, np.zeros((len(self.mesh.length), 6)),
            Followed.at_rest(np.zeros(self._held.cuts[-1]), np.zeros(self._held.cuts[-1])),
            self._held,
        )  # fmt: skip
        self._place(state)
        if any(rod.nodes for rod in self.layout.rods):
            held = Strains(state.strains, np.zeros_like(state.strains), 0.0)
            points, unloaded = state.place.points, np.zeros(self.mesh.unknowns)
            still = np.zeros_like(points)
            add_forces(self.mesh, pose, points, still, held, self._held_loads, unloaded)
        # Accelerations of the points: differences of places along the motion.
        ahead, behind = state.copy(), state.copy()
        small = 1e-6 / max(float(np.abs(self.first).max()), 1e-300)
        move(self.mesh, ahead.pose, small * self.first[: self.mesh.unknowns])
        move(self.mesh, behind.pose, -small * self.first[: self.mesh.unknowns])
        if self.with_hub:
            self.first[-3:] = self.first[self._string_spots].mean(axis=0)
            ahead.hub += small * self.first[-3:]
            behind.hub -= small * self.first[-3:]
        self._place(ahead)
        self._place(behind)
        acceleration = (ahead.followed.place - behind.followed.place) / (2.0 * small)
        followed = Followed.at_rest(state.followed.place, acceleration)
        return State(pose, hub, state.strains, followed, self._held)
