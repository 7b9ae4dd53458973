"""A scene in joint coordinates: residual and Newton's step at any state."""

import math
import sys
from typing import Any, NamedTuple

import numpy as np

from ringsim.choice import kind_of
from ringsim.core.chain import Seen
from ringsim.core.library import NOT_ASKED, ask, call, empty_of
from ringsim.core.winches import LAWS
from ringsim.frame.cables import Arms, FrameCables, PathPoints, PulleyLaws, Roped
from ringsim.frame.elimination import Border, Fronts
from ringsim.frame.laws import Acting, JointLaws, Openings
from ringsim.frame.mesh import CURE, NOT_HERE, Mesh, Skeleton, mesh_of
from ringsim.frame.springs import STIFFNESS, BeamSlide, Web
from ringsim.frame.state import (
    Coefficients,
    Followed,
    Hanging,
    Held,
    Pose,
    State,
    Strains,
    room_for_loads,
)
from ringsim.layout.bodies import Array
from ringsim.layout.layout import layout_of
from ringsim.refusal import InputError
from ringsim.rigid.assembling import assembled
from ringsim.rigid.statics import (
    OneCoordinate,
    RopeReach,
    coordinates,
    first_acceleration,
    residual_tolerance,
)
from ringsim.scene import Scene

# What newton.c asks for, and how it ends.
_WINCHES, _PARTS = 1, 2
_FORCES, _SLOPES = range(2)
_BALANCED, _UNBALANCED, _ENDLESS, _SMALL_PIVOT, _NO_TENSIONS, _RAISED = range(6)


def try_laws(scene: Scene) -> None:
    """Call all laws of a scene once: InputError if one has a slip; those of scenes that frames do
    not represent stay untried.
    """
    try:
        FrameModel(scene)
    except InputError as error:
        if NOT_HERE not in str(error):
            raise


class System(NamedTuple):
    """What the core sees of a model: its parts, and room for what it finds in a step: what elements
    keep, residual, changes since a tangent, and ``FrameModel.reaction``; ``lengths`` and their
    squares by which unknowns are compared.
    """

    mesh: Mesh
    paths: PathPoints
    held: Held
    joints: Acting
    rubbing: Seen
    web: Web
    coefficients: Coefficients
    laws: PulleyLaws
    arms: Arms
    fronts: Fronts
    loads: Array
    kept: Array
    lengths: Array
    weights: Array
    g: Array
    changes: Array
    reaction: Array
    hub: bool


class Balanced(NamedTuple):
    """Newton's iterations in a step and its tangents; why it has failed, or nothing."""

    iterations: int
    tangents: int
    why: str


class FrameModel:
    """All parts of a scene on their unknowns.

    Attributes
    ----------
    ideal
        The structure with rigid rods, at the start.
    moving
        Its acceleration then.
    masses
        Mass that every point carries, kg, (points,).
    prestress
        What putting the structure together has left in its rods, J.
    with_hub, size
        Whether a net has a hub; number of unknowns: those of the mesh and the hub's three.
    bent
        The slide along a flexible boom, or None.
    system, unroped
        Its tables; that of ropes where there are none.
    others
        What the core does not know: it adds itself to residual and tangent.
    reaction
        What was last out of balance on the unknowns that do not move, N and N m.
    """

    def __init__(self, scene: Scene) -> None:
        if not scene.rods.oriented:
            raise InputError(f"{NOT_HERE} rods.kind = {kind_of(scene.rods)!r}: {CURE}")
        drawn = layout_of(scene)
        self.scene = scene
        self.layout, self.prestress = assembled(drawn, scene.rods)
        self.ideal = OneCoordinate(scene, drawn)
        self.gravity = np.zeros(3) if self.layout.gravity is None else self.layout.gravity
        self.moving = first_acceleration(self.layout, self.ideal, scene.structure.coordinate)
        self.skeleton = skeleton = Skeleton(self.layout)
        if self.layout.contacts:
            raise InputError(f"{NOT_HERE} contacts of bodies: {CURE}")
        beam = self.layout.boom
        boom = [] if beam is None else skeleton.add_beam(beam)
        touching = [] if beam is None else [beam.low.body]
        self.mesh, parts = mesh_of(skeleton, scene.rods, boom, touching)
        mesh = self.mesh
        self.openings = Openings.of(skeleton)
        self.laws = JointLaws(skeleton, self.openings)
        self.with_hub = self.layout.hub is not None
        self.web = Web.of(self.layout, mesh)
        self.coefficients = Coefficients.of(scene.solver.spectral_radius)
        angle = np.array([one.start for one in skeleton.angles])
        self.openings.unwrapped(angle)
        pose = Pose(np.array(skeleton.places), np.array(skeleton.axes), angle)
        self.cables = None
        if scene.cables is not None:
            self.cables = FrameCables(scene.cables, skeleton, mesh, parts)
        self._stiffest = stiffest = float(mesh.stiffness[:, 0].max())
        self.bent = None
        self.others: list[BeamSlide | Hanging] = []
        if beam is not None:
            nodes = [(end.frame, end.axes) for end in skeleton.beam]
            self.bent = BeamSlide(mesh, nodes, boom[0].length, beam.low.body, STIFFNESS * stiffest)
            self.others.append(self.bent)
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
        self._coordinates, self._ropes = coordinates(scene), RopeReach(scene)
        self.masses = mesh.point_mass.copy()
        np.add.at(self.masses, mesh.point, mesh.mass.sum(axis=1)[:, None])
        self._heaviest = float(mesh.point_mass.max() + mesh.mass[:, 0].max())
        of_paths = 0 if self.cables is None else self.cables.points
        ends = self.web.ends
        hung = self.layout.hung
        lines_on = [] if hung is None else list(hung.bodies)
        sizes = (
            3 * len(mesh.point_mass),
            3 * of_paths,
            len(angle),
            3 * len(ends),
            3 * self.with_hub,
            3 * len(lines_on),
        )
        self._held = Held(
            cuts=np.cumsum([0, *sizes]),
            ends=ends,
            hung=np.array(lines_on, dtype=np.int64),
            top=np.array([top for top, *_ in skeleton.slides], dtype=np.int64),
            low=np.array([low for _, low, _ in skeleton.slides], dtype=np.int64),
            reach=scene.structure.reach * np.array([turns for *_, turns in skeleton.slides], float),
            stiffness=STIFFNESS * stiffest,
            damping=self.laws.damping,
            weighs=self.layout.gravity is not None,
            gravity=self.gravity,
        )
        self._kept = room_for_loads(mesh)
        self._string_spots = mesh.home[ends][:, None] + np.arange(3)
        self._paths = empty_of(PathPoints) if self.cables is None else self.cables.path_points
        self._arms = Arms.empty(of_paths)
        self.start = self._started(pose)
        self.hanging = None if hung is None else Hanging(hung, mesh, self.start.place.hung.copy())
        if self.hanging is not None:
            self.others.append(self.hanging)
        self.reaction = np.zeros(len(mesh.fixed))
        self._begun = self.start.place.points.copy()
        border = Border.empty(mesh.unknowns, 0, 0, self.with_hub)
        self.unroped = empty_of(Roped)._replace(border=border)
        self._fronts = Fronts.empty(mesh)
        self.begin_laws(self.laws)

    def begin_laws(self, laws: JointLaws) -> None:
        """Go on with the laws of joints as faults have left them."""
        self.laws = laws
        of_pulleys = empty_of(PulleyLaws) if self.cables is None else self.cables.laws
        self.system = System(
            self.mesh, self._paths, self._held, laws.acting, laws.rubbing, self.web,
            self.coefficients, of_pulleys, self._arms, self._fronts, self.loads, self._kept,
            self.lengths, self.lengths**2, np.zeros(self.size),
            np.zeros((call("most_iterations"), self.size)), self.reaction, self.with_hub,
        )  # fmt: skip

    def turn_loads(self) -> None:
        """Let the forces of ``Loads`` act the other way round."""
        self.loads *= -1.0
        self._loaded[2][...] *= -1.0

    def work(self, state: State) -> float:
        """Of loads and gravity since the start, as they act now, J."""
        at, start, forces = self._loaded
        done = float(np.vdot(forces, state.pose.place[at] - start)) if at.size else 0.0
        if self._held.weighs:
            moved = self.masses @ (state.place.points - self._begun)
            if self.with_hub:
                moved += self.web.hub_mass * (state.hub - self._hub)
            done += float(moved @ self.gravity)
        return done if self.hanging is None else done + self.hanging.work(state)

    def tolerance(self, step: float, lead: float = 0.0) -> float:
        """Residual norm at which Newton stops in a step (s) with a ``lead`` of strains (1/s), N, of
        torques over ``lengths``; not below what round-off leaves of coordinates: of inertia, of the
        rods with their damping, of slides; of ropes, whose strain it is that is rounded.
        """
        inertia = self._heaviest * self.coefficients.acceleration_by_place(step)
        rods = self._stiffest * (1.0 + self._tau * lead)
        slides = STIFFNESS * self._stiffest * bool(self.skeleton.slides or self.bent)
        reached = 4.0 * sys.float_info.epsilon * (math.sqrt(self.size) * (inertia + rods) + slides)
        reached *= self._coordinates
        ropes = self._ropes.at(self.coefficients.rate_by_place(step))
        return max(self._tolerance, reached, 4.0 * sys.float_info.epsilon * ropes)

    def balance(self, time: float, step: float, start: State, now: State) -> Balanced:
        """Bring a state into balance at a time (s), a step (s) after a start, in place."""
        told, places, rates = np.zeros(3), now.place.paths, now.rate.paths
        tolerance, why = self.tolerance(step, float(now.strains.lead[0])), ""
        given = start.table, now.table, tolerance, told
        try:
            how = self.core("balance_step", time, step, now, *given)
            if how == _NO_TENSIONS and self.cables is not None:
                self.cables.refuse(places, rates)
        except ValueError as error:  # the winches or the ropes have no answer
            how, why = _NO_TENSIONS, str(error)
        iterations, tangents, norm = int(told[0]), int(told[1]), float(told[2])
        if how == _BALANCED:
            return Balanced(iterations, tangents, "")
        words = {
            _UNBALANCED: f"Newton's residual is {norm:.3g} N after {iterations} iterations, "
            f"step {step:.3g} s",
            _ENDLESS: "forces or places are no finite numbers, as of a law outside of its domain",
            _SMALL_PIVOT: "a pivot of the tangent is too small",
            _NO_TENSIONS: why or "no tensions of the ropes go with their lengths",
        }
        return Balanced(iterations, tangents, words[how])

    def core(self, name: str, time: float, step: float, now: State, *given: Any) -> int:
        """Call a function of newton.c for a state at a time (s), a step (s) after another one;
        raises what Python refuses.
        """
        cables, others = self.cables, self.others
        roped, asks = self.unroped, bool(others) * _PARTS
        if cables is not None:
            cables.turn(time)
            roped, asks = cables.roped, asks | cables.winches.answering * _WINCHES
        if not asks:
            return int(call(name, self.system, roped, 0, NOT_ASKED, step, *given))
        inner, fronts = self.system.g[: self.mesh.unknowns], self.system.fronts.whole
        by_rate = self.coefficients.rate_by_place(step)
        by_place = self.coefficients.acceleration_by_place(step)

        def answer(what: int) -> None:
            if what >= LAWS and cables is not None:
                cables.winches.answer(what - LAWS)
                return
            for other in others:
                if what == _FORCES:
                    other.push(now, inner)
                elif what == _SLOPES:
                    other.add_tangent(now, by_rate, by_place, fronts)

        return ask(
            answer, lambda function: call(name, self.system, roped, asks, function, step, *given)
        )

    def place(self, state: State) -> None:
        """Places of all followed coordinates at the state's pose."""
        call(
            "put_in_place", self.mesh, self._paths, self._held, state.pose, state.hub, self._arms,
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
            pose, hub, Strains.resting(len(self.mesh.length)),
            Followed.at_rest(np.zeros(self._held.cuts[-1]), np.zeros(self._held.cuts[-1])),
            self._held,
        )  # fmt: skip
        self.place(state)
        if any(rod.nodes for rod in self.layout.rods):
            points, unloaded = state.place.points, np.zeros(self.mesh.unknowns)
            still = np.zeros_like(points)
            given = pose, points, still, state.strains, self._kept, unloaded
            call("add_forces", self.mesh, *given)
        # Accelerations of the points: differences of places along the motion.
        ahead, behind = state.copy(), state.copy()
        small = 1e-6 / max(float(np.abs(self.first).max()), 1e-300)
        call("move", self.mesh, ahead.pose, small * self.first[: self.mesh.unknowns])
        call("move", self.mesh, behind.pose, -small * self.first[: self.mesh.unknowns])
        if self.with_hub:
            self.first[-3:] = self.first[self._string_spots].mean(axis=0)
            ahead.hub += small * self.first[-3:]
            behind.hub -= small * self.first[-3:]
        self.place(ahead)
        self.place(behind)
        acceleration = (ahead.followed.place - behind.followed.place) / (2.0 * small)
        followed = Followed.at_rest(state.followed.place, acceleration)
        return State(pose, hub, state.strains, followed, self._held)
