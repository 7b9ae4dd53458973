"""A multibody system in exudyn: rotations, dampers, and the step that predicts the next."""

from collections.abc import Callable, Hashable, Sequence
from types import SimpleNamespace
from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
import scipy
from exudyn.advancedUtilities import CreateSymbolicUserFunction
from numpy.typing import NDArray

from ringsim.core.chain import Turning
from ringsim.hermite import extrapolated
from ringsim.layout.bodies import Pose
from ringsim.parts.joints import JointFriction
from ringsim.stepping.instant import Passing, lost_between

# Rotations of many bodies at once: unit quaternions (w, v), shape (n, 4), and vectors, (n, 3).
#
# Euler parameters are unit quaternions with the scalar first; scipy's Rotation puts it last.  What
# Rotation offers is taken from there.  Its rotation matrices cost as much as the two columns alone
# by hand (10.8 us against 10.9 us for 36 nodes), and a third of np.stack.  What stays by hand is
# called in every residual: numpy's cross product takes 2.8 times as long on such small arrays.


Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def axes_of(turns: Array) -> Array:
    """Rotation matrices, shape (n, 3, 3), of quaternions, shape (n, 4), brought to unit length."""
    return np.asarray(
        scipy.spatial.transform.Rotation.from_quat(turns[:, [1, 2, 3, 0]]).as_matrix()
    )


def turn_of(axes: Array) -> Array:
    """Unit quaternion, shape (4,), of a rotation matrix, shape (3, 3)."""
    return np.roll(scipy.spatial.transform.Rotation.from_matrix(axes).as_quat(), 1)


def gyration(turns: Array) -> Array:
    """G = 2 [-v, w I + skew(v)] of quaternions (w, v), shape (n, 3, 4): spin = G q_dot."""
    found = np.empty((len(turns), 3, 4))
    found[:, :, 0] = -2.0 * turns[:, 1:]
    found[:, :, 1:] = 2.0 * skew(turns[:, 1:])
    found[:, range(3), range(1, 4)] += 2.0 * turns[:, :1]
    return found


def spin(turns: Array, rates: Array) -> Array:
    """Angular velocity G q_dot in global axes, rad/s, of quaternions and their rates (1/s)."""
    vector, by_vector = turns[:, 1:], rates[:, 1:]
    return 2.0 * (turns[:, :1] * by_vector - rates[:, :1] * vector + cross(vector, by_vector))


def turn_rates(turns: Array, spins: Array) -> Array:
    """Rates q_dot = G^T spin / 4 of unit quaternions, 1/s, shape (n, 4); the inverse of ``spin``.
    Angular accelerations of bodies at rest give the second derivatives.
    """
    return np.asarray(0.25 * np.einsum("nij,ni->nj", gyration(turns), spins))


def cross(a: Array, b: Array) -> Array:
    """Cross products row by row."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    found = np.empty((3, len(b)))
    found[0] = ay * bz - az * by
    found[1] = az * bx - ax * bz
    found[2] = ax * by - ay * bx
    return found.T


def skew(vectors: Array) -> Array:
    """Matrices of the cross product, shape (n, 3, 3)."""
    found = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    found[:, 0, 1], found[:, 0, 2], found[:, 1, 2] = -z, y, -x
    found[:, 1, 0], found[:, 2, 0], found[:, 2, 1] = z, -y, x
    return found


# Friction of joints that is no plain damper, in exudyn's torsional dampers.
#
# exudyn's damper gives the torque d w + m at a rate w.  Before every residual its d and m are set
# so that this line goes through the law at Newton's iterate: the residual is the law's, and d is
# the slope that Newton's tangent has.  So the slope may be the secant to the other side of zero
# rate where a joint turns round within a step (``ringsim.core.chain``), which no user function
# of exudyn's allows: it differentiates those by itself.


_RATE = exu.OutputVariableType.AngularVelocityLocal


class DryJoints:
    """The joints of a model whose friction is not proportional to their rates.

    ``families`` are the laws, each with its dampers' numbers in exudyn and the lines through it.
    """

    def __init__(self, system: Any) -> None:
        self._system = system
        self.families: list[tuple[JointFriction, list[Any], Turning]] = []

    def add(self, law: JointFriction, markers: Sequence[tuple[Any, Any]]) -> None:
        """Joints between pairs of markers about their common z axis; ``law`` has values for all of
        them, or arrays with one for each.
        """
        add, damper = self._system.AddObject, item.ObjectConnectorTorsionalSpringDamper
        dampers = [add(damper(markerNumbers=list(pair))) for pair in markers]
        self.families.append((law, dampers, Turning()))

    def begin(self) -> None:
        """Begin an attempt at a step."""
        for *_, turning in self.families:
            turning.forget()

    def follow(self) -> None:
        """Take the lines of all laws at the current state; due before every residual."""
        system = self._system
        for law, dampers, turning in self.families:
            rates = np.array([system.GetObjectOutput(damper, _RATE) for damper in dampers])
            turning.note(law, rates)
            slopes = turning.tangents(law, rates, law.torque)
            rest = law.torque(rates) - slopes * rates
            for damper, slope, torque in zip(dampers, slopes, rest, strict=True):
                system.SetObjectParameter(damper, "damping", slope)
                system.SetObjectParameter(damper, "torque", torque)


# Kelvin-Voigt damping of geometrically exact rods, from how their strains change over a step.
#
# The strain of an element is the displacement e (six components) between the frames of its ends,
# both moved to its middle: exudyn's intrinsic measure, the logarithm of their relative motion,
# taken and applied half-way between them.  Taken in the first frame, it would lack how that frame
# turns, and a bent rod that turns would lose energy that nobody books.  Damping is the force C
# de/dt, C = tau K / L, with
#
#     de/dt at t2 = a0 e2 + a1 e1 + a2 e0,   r = (t2 - t1) / (t1 - t0),
#     a0 = (1 + 2 r) / (h (1 + r)),  a1 = -(1 + r) / h,  a2 = r^2 / (h (1 + r)),  h = t2 - t1,
#
# the backward difference of second order (BDF2; of first order in a run's first step).  It depends
# on positions alone, so that a rod that turns without being strained is not damped, whatever the
# step. The integrator's own velocities would not do: they follow the positions to second order in
# the step only, and of a turning rod that error points along its axis, where C is largest.  With
# steps of a twentieth of a second it was a force as large as those that drive a ring.
#
# exudyn evaluates the force itself: it is a spring of stiffness a0 C whose unstretched length is
# -(a1 e1 + a2 e0) / a0, both set before each attempt at a step.  In steps below tau / 4 such a
# spring
# would be several times as stiff as the rod, and round-off of the positions would keep Newton from
# converging.  There the velocities are good (their error is that of a step of tau / 4 at most) and
# the force is C de/dt with them, in the first frame: there exudyn's velocities are those that its
# damper works against, and in the intrinsic measure they are not.


_KIND = exu.OutputVariableType
_SHORT = 0.25
"""Steps below this share of tau take velocities: the spring is 1.5 / 0.25 times as stiff as the rod
there, which ``STIFFENING`` allows for."""
STIFFENING = 1.0 + 1.5 / _SHORT
"""Largest stiffness of a rod with its damper over that of the rod alone; 3/2 is a0 h of BDF2."""


class RodDampers:
    """The dampers of all elements of all rods of a model, in their order.

    ``latest`` are their forces and moments in the elements' middles, tension positive, N and N m,
    and the rates of strain that they resist, shape (dampers, 6), when they were read last.
    """

    def __init__(self, system: Any) -> None:
        self._system = system
        none = np.zeros((0, 6))
        self.latest, self._strains = Passing(-1.0, none, none), none
        self._dampers: list[Any] = []
        self._matrices: list[Array] = []
        self._short = 0.0
        self._past: list[tuple[float, Array]] = []
        self._prepared = (-1.0, -1.0)
        self._lead, self._offsets, self._by_velocity = 0.0, np.zeros(6), False
        self._kept: Passing | None = None

    def add(self, markers: list[Any], damping: Array, relaxation: float) -> None:
        """A damper C, shape (6, 6), N s/m and N m s, between two markers that coincide, of a rod's
        element with tau = ``relaxation``, s.
        """
        kind = item.ObjectConnectorRigidBodySpringDamper
        damper = kind(markerNumbers=markers, useIntrinsicFormulation=True)
        self._dampers.append(self._system.AddObject(damper))
        self._matrices.append(damping)
        self._short = max(self._short, _SHORT * relaxation)

    def prepare(self, system: Any, time: float, newton: int, discontinuous: int) -> None:
        """Called by exudyn before every residual; acts before the first of each attempt."""
        if not self._dampers or newton != 0 or discontinuous != 0:
            return
        start = system.systemData.GetTime(exu.ConfigurationType.StartOfStep)
        if time <= start or (start, time) == self._prepared:
            return
        self._prepared = start, time
        if not self._past or start > self._past[-1][0]:
            # By now exudyn has moved the current state on: only a reading knows the start's.
            if self.latest.time != start:
                raise RuntimeError(f"the rods' dampers were not read at {start:.9g} s")
            self._past = [*self._past[-1:], (start, self._strains)]
        matrices, by_velocity = np.array(self._matrices), time - start < self._short
        if by_velocity != self._by_velocity:
            self._by_velocity = by_velocity
            self._intrinsic(wanted=not by_velocity)
            self._set("stiffness", np.zeros_like(matrices))
            self._set("damping", by_velocity * matrices)
        if not by_velocity:
            self._lead, self._offsets = _difference(time, self._past)
            self._set("stiffness", self._lead * matrices)
            self._set("offset", self._offsets)

    def lost(self, time: float) -> float:
        """Energy taken since the reading that was kept last, J; see ``lost_between``.

        ``time`` is that of the current state, s, which ends the step that was prepared last.
        """
        if not self._dampers:
            return 0.0
        if self._by_velocity:
            rates = self._outputs(_KIND.VelocityLocal, _KIND.AngularVelocityLocal)
            self._intrinsic(wanted=True)
        strains = self._outputs(_KIND.DisplacementLocal, _KIND.Rotation)
        if self._by_velocity:
            self._intrinsic(wanted=False)
        else:
            rates = self._lead * (strains - self._offsets)
        forces = np.einsum("nij,nj->ni", np.array(self._matrices), rates)
        # The rates that the forces are made of balance an impact twice as well as the strains.
        places = None if self._by_velocity else strains
        self.latest, self._strains = Passing(time, forces, rates, places), strains
        return 0.0 if self._kept is None else lost_between(self._kept, self.latest)

    def keep(self) -> None:
        """Count what is lost from the last reading on."""
        self._kept = self.latest

    def _intrinsic(self, *, wanted: bool) -> None:
        self._set("useIntrinsicFormulation", [wanted] * len(self._dampers))

    def _set(self, name: str, values: Sequence[Any] | Array) -> None:
        for damper, value in zip(self._dampers, values, strict=True):
            self._system.SetObjectParameter(damper, name, value)

    def _outputs(self, shift: Any, turn: Any) -> Array:
        output = self._system.GetObjectOutput
        return np.array([[*output(d, shift), *output(d, turn)] for d in self._dampers])


def _difference(time: float, past: list[tuple[float, Array]]) -> tuple[float, Array]:
    """Of a0 e2 + a1 e1 + a2 e0: a0 in 1/s, and the e2 at which it vanishes, shape (dampers, 6)."""
    now, last = past[-1]
    h = time - now
    if len(past) == 1:
        return 1.0 / h, last
    before, first = past[0]
    r = h / (now - before)
    lead = (1.0 + 2.0 * r) / (h * (1.0 + r))
    return lead, ((1.0 + r) * last - r**2 / (1.0 + r) * first) / (h * lead)


# The growing model: nodes with their initial accelerations, bodies, markers.


_SAME, _ORIGIN = np.eye(3), np.zeros(3)
exu.config.printToConsole = False

SYMBOLIC = SimpleNamespace(
    minimum=exu.symbolic.min,
    maximum=exu.symbolic.max,
    where=exu.symbolic.IfThenElse,
    **{name: getattr(exu.symbolic, name) for name in ("tanh", "exp", "sqrt", "abs", "sign")},
)
"""What a law of ``ringsim.parts`` takes as its ``xp``: numpy's names for exudyn's functions."""

TORSION = "ObjectConnectorTorsionalSpringDamper"


class Assembly:
    """An exudyn system under construction.

    Attributes
    ----------
    size
        Number of coordinates of the nodes so far.
    starts
        Accelerations (m/s^2, 1/s^2) at which coordinates start, by node, in the nodes' order.
    bodies
        Objects with kinetic energy.
    beams
        Elements with potential energy that are no rods'.
    rigid_nodes, dampers, dry_joints
        Nodes with Euler parameters, dampers of the rods, and joints with dry friction.
    """

    def __init__(self) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.starts: dict[int, Array] = {}
        self.bodies: list[Any] = []
        self.beams: list[Any] = []
        self.rigid_nodes: list[Any] = []
        self.dampers = RodDampers(self.system)
        self.dry_joints = DryJoints(self.system)
        self._laws: dict[Hashable, Any] = {}
        self._places: dict[int, Indices] = {}
        self.size = 0

    def add_node(self, node: Any, acceleration: Array) -> Any:
        """A node whose coordinates have an initial acceleration, shape (coordinates,)."""
        number = self.system.AddNode(node)
        self.starts[int(number)] = acceleration
        self._places[int(number)] = np.arange(self.size, self.size + len(acceleration))
        self.size += len(acceleration)
        return number

    def coordinates_of(self, node: Any) -> Indices:
        """Indices of a node's coordinates in the system vector: exudyn keeps the nodes' order."""
        return self._places[int(node)]

    def add_rigid_node(self, pose: Pose, natural: Pose | None = None) -> Any:
        """A node with Euler parameters, of a body at rest: the pose's rates are accelerations.

        Elements are free of strain where their nodes are at their ``natural`` poses.
        """
        turn = turn_of(pose.axes)
        turning = turn_rates(turn[None], pose.turn[None])[0]
        made = item.NodeRigidBodyEP(referenceCoordinates=[*pose.place, *turn])
        if natural is not None:
            reference = np.concatenate([natural.place, turn_of(natural.axes)])
            # Of the two quaternions of a rotation the one that is near the reference.
            same = np.copysign(1.0, turn @ reference[3:])
            turning = same * turning
            made.referenceCoordinates = reference.tolist()
            made.initialCoordinates = [
                *(pose.place - reference[:3]),
                *(same * turn - reference[3:]),
            ]
        node = self.add_node(made, np.concatenate([pose.rate, turning]))
        self.rigid_nodes.append(node)
        return node

    def add_body(self, node: Any, mass: float, inertia: Array, centre: Array = _ORIGIN) -> Any:
        """A rigid body on a rigid node, in its axes.

        ``inertia`` is the tensor about the node, shape (3, 3), kg m^2, and ``centre`` the centre
        of mass, shape (3,), m.
        """
        terms = inertia[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
        body = self.system.AddObject(
            item.ObjectRigidBody(
                nodeNumber=node, mass=mass, inertia=list(terms), centerOfMass=list(centre)
            )
        )
        if mass > 0.0:
            self.bodies.append(body)
        return body

    def body_marker(self, body: Any, place: Array, axes: Array = _SAME) -> Any:
        """A marker with position and orientation on a body, in body coordinates."""
        frame = exu.HT(rotation=axes, translation=list(place))
        return self.system.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localHT=frame))

    def node_marker(self, node: Any, axes: Array = _SAME) -> Any:
        """A marker with position and orientation on a node."""
        frame = exu.HT(rotation=axes, translation=list(_ORIGIN))
        return self.system.AddMarker(item.MarkerNodeRigid(nodeNumber=node, localHT=frame))

    def symbolic_law(
        self, kind: str, key: Hashable, law: Callable[[Any, Any, Any], Any]
    ) -> dict[str, Any]:
        """The setting that gives a spring-damper connector (a type of exudyn's) its law, a force or
        torque from displacement (angle), rate and last parameter; equal keys share one.
        """

        def function(
            mbs: Any, t: Any, item: Any, x: Any, rate: Any, stiffness: Any, damping: Any, last: Any
        ) -> Any:
            return law(x, rate, last)

        argument = "springTorqueUserFunction" if kind == TORSION else "springForceUserFunction"
        if key not in self._laws:
            self._laws[key] = CreateSymbolicUserFunction(
                self.system, function, argument, itemTypeName=kind
            )
        return {argument: self._laws[key]}

    def finish(self) -> None:
        """Assemble the system and set its initial accelerations."""
        self.system.Assemble()
        data = self.system.systemData
        start = np.zeros(data.ODE2Size())
        start[: self.size] = np.concatenate([*self.starts.values()])
        data.SetODE2Coordinates_tt(start, exu.ConfigurationType.Initial)


# Where Newton's method begins a step in exudyn: the last steps' motion, extrapolated.


_EASY = 5
"""Most iterations of a step after which the next one begins with a cubic."""
_START = exu.ConfigurationType.StartOfStep


class Predictor:
    """Start Newton from a polynomial through the last places instead of zero acceleration.

    exudyn starts a step with zero acceleration at its end, which is off by h^2 beta a in the
    positions.  The squares of such errors stretch the stiff rods in the first iteration, and what a
    rod carries by mistake turns the next ones astray.  Moving the guess along the integrator's own
    update (a, h gamma a*, h^2 beta a*), a* = a (1 - alpha_f) / (1 - alpha_m), to the extrapolated
    places changes where Newton starts, not what it converges to.  Accelerations from differences of
    the velocities would miss the places by ten times as much: velocities are the rougher.  Euler
    parameters are brought back to unit length: their third-order growth would stretch the rods.

    It is a cubic where the last step was easy, else a parabola: where ropes swing within a step a
    cubic swings further.  Only nodes of the assembly are moved, not auxiliary unknowns.
    """

    def __init__(self, assembly: Assembly, solver: Any) -> None:
        self._data, self._solver = assembly.system.systemData, solver
        self._turns = np.array([assembly.coordinates_of(n)[3:7] for n in assembly.rigid_nodes])
        reference = np.array(self._data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        self._unturned = reference[self._turns]
        self._size = assembly.size
        self._time = -1.0
        self._last: tuple[float, Array] | None = None
        self._moves: list[tuple[float, Array]] = []
        self._iterations, self._easy = 0, False

    def apply(self, time: float, newton: int, discontinuous: int) -> None:
        """Due before every residual; acts once per attempt at a step, before the first."""
        if newton != 0 or discontinuous != 0 or time == self._time:
            return
        self._time = time
        solver, size = self._solver, self._size
        start = self._data.GetSystemStateDict(_START, reference=True)
        begun = np.array(start["ODE2Coords"][:size])
        self._note(self._data.GetTime(_START), begun)
        step = solver.it.currentStepSize
        smooth = (1.0 - solver.alphaF) / (1.0 - solver.alphaM)
        now = self._data.GetSystemStateDict(reference=True)
        place = now["ODE2Coords"]
        moved = step**2 * solver.newmarkBeta * smooth * np.array(start["ODE2Coords_tt"])
        if moves := self._moves[-3 if self._easy else -2 :]:
            moved[:size] = begun + extrapolated(moves, step) - place[:size]
            moved[size:] = 0.0
        turned = (place + moved)[self._turns] + self._unturned
        stretch = 1.0 / np.linalg.norm(turned, axis=1) - 1.0
        moved[self._turns] += stretch[:, None] * turned
        guess = moved / (step**2 * solver.newmarkBeta * smooth)
        place[:] += moved
        now["ODE2Coords_t"][:] += step * solver.newmarkGamma * smooth * guess
        now["ODE2Coords_tt"][:] += guess

    def _note(self, begin: float, begun: Array) -> None:
        """Remember a state from which a step starts."""
        last = self._last
        if last is not None and begin <= last[0]:
            return  # the step is repeated
        self._last = begin, begun
        before, self._iterations = self._iterations, self._solver.it.newtonStepsCount
        if last is not None:
            duration = begin - last[0]
            rate = (begun - last[1]) / duration
            # Before rest it came as it leaves: the even motion through the first state.
            self._moves = [*(self._moves[-2:] or [(duration, -rate)]), (duration, rate)]
            self._easy = self._iterations - before <= _EASY
