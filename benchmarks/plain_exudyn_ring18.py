"""The ring of paper 002, case 1, as a plain exudyn script: no engine of ringsim.

Written the way exudyn is usually used: geometrically exact beams (one element per rod half),
its ready-made joints, a symbolic function for the one-sided net springs, sparse linear solver,
modified Newton, a constant step of 20 ms, tolerances just above the round-off of the residual,
and one sensor, at the V-joint of section 1.  Only points and directions come from
ringsim.structures.

Run: python benchmarks/plain_exudyn_ring18.py
"""

from __future__ import annotations

import contextlib
import math
import time

import exudyn as exu
import exudyn.itemInterface as item  # noqa: N813
import numpy as np
from exudyn.advancedUtilities import CreateSymbolicUserFunction
from scipy.spatial.transform import Rotation

from ringsim.structures.pantograph_ring import RingGeometry

SECTIONS, HALF_BAR, HALF_DIAGONAL, OFFSET = 18, 0.2889, 0.4275, 0.006554
OPENING, FORCE = math.radians(47.578), 0.015
CORNER_MASS = VJOINT_MASS = 0.0198
BOOM_LENGTH, BOOM_DIAMETERS = 0.9, (0.060, 0.058)
NET_RATE, NET_LENGTH, HUB_MASS = 0.001, 0.7116, 1e-5
YOUNG, DENSITY, POISSON = 120e9, 1800.0, 0.3
TUBES = {"diagonal": (0.010, 0.00915), "bar": (0.012, 0.01115)}
STEP, STEPS = 0.02, 880


def beam_section(outer: float, inner: float) -> exu.BeamSection:
    area = 0.25 * math.pi * (outer**2 - inner**2)
    second = math.pi / 64.0 * (outer**4 - inner**4)
    shear = 0.5 * YOUNG / (1.0 + POISSON)
    section = exu.BeamSection()
    section.stiffnessMatrix = np.diag(
        [
            *(YOUNG * area, 0.5 * shear * area, 0.5 * shear * area),
            *(2.0 * shear * second, YOUNG * second, YOUNG * second),
        ]
    )
    section.massPerLength = DENSITY * area
    section.inertia = DENSITY * np.diag([2.0 * second, second, second])
    return section


def build() -> tuple[exu.MainSystem, list[int]]:
    """The assembled ring and the two nodes at the upper V-joint of section 1."""
    ring = RingGeometry.of_polygon(
        SECTIONS,
        closed=True,
        polygon_sections=SECTIONS,
        aspect_ratio=3.2856 / 3.5184,
        half_bar=HALF_BAR,
        half_diagonal=HALF_DIAGONAL,
        hinge_offset=OFFSET,
    )
    fold = ring.fold(0.5 * (math.pi - OPENING))
    mbs = exu.SystemContainer().AddSystem()
    sections = {name: beam_section(*tube) for name, tube in TUBES.items()}

    def node(place: np.ndarray, axes: np.ndarray) -> int:
        x, y, z, w = Rotation.from_matrix(axes).as_quat()
        return mbs.AddNode(item.NodeRigidBodyEP(referenceCoordinates=[*place, w, x, y, z]))

    def body(number: int, mass: float, inertia: list[float], centre: list[float]) -> int:
        return mbs.AddObject(
            item.ObjectRigidBody(nodeNumber=number, mass=mass, inertia=inertia, centerOfMass=centre)
        )

    def rod(start: np.ndarray, end: np.ndarray, normal: np.ndarray, kind: str) -> list[int]:
        along = (end - start) / np.linalg.norm(end - start)
        axes = np.column_stack([along, np.cross(normal, along), normal])
        parts = 2 if kind == "diagonal" else 1
        nodes = [node(start + k / parts * (end - start), axes) for k in range(parts + 1)]
        for k in range(parts):
            mbs.AddObject(
                item.ObjectBeamGeometricallyExact(
                    nodeNumbers=nodes[k : k + 2],
                    length=float(np.linalg.norm(end - start)) / parts,
                    sectionData=sections[kind],
                )
            )
        return nodes

    def revolute(first: int, second: int) -> None:
        mbs.AddObject(item.ObjectJointRevoluteZ(markerNumbers=[first, second]))

    def node_marker(number: int) -> int:
        return mbs.AddMarker(item.MarkerNodeRigid(nodeNumber=number))

    cube = CORNER_MASS * 0.0112**2 / 6.0
    hinges: list[list[int]] = [[], []]
    tops = []
    for plane in range(2):
        for corner, place in enumerate(fold.corners[plane]):
            mass, terms, centre = CORNER_MASS, [cube, cube, cube, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
            if plane == corner == 0:
                outer, inner = BOOM_DIAMETERS
                boom = DENSITY * 0.25 * math.pi * (outer**2 - inner**2) * BOOM_LENGTH
                across = boom * (outer**2 + inner**2) / 8.0
                along = boom * BOOM_LENGTH**2 / 3.0 + 0.5 * across
                terms = [cube + along, cube + along, cube + across, 0.0, 0.0, 0.0]
                mass += boom
                centre = [0.0, 0.0, -0.5 * BOOM_LENGTH * boom / mass]
            number = node(place, np.eye(3))
            hinges[plane].append(body(number, mass, terms, centre))
            if plane == 0:
                tops.append(number)
    mbs.AddObject(
        item.ObjectJointGeneric(
            markerNumbers=[mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=h[0])) for h in hinges],
            constrainedAxes=[1, 1, 0, 0, 0, 0],
        )
    )

    watched: list[int] = []
    for k in range(SECTIONS):
        normal = ring.normals[k]

        def hinge(
            number: int, axes_of: tuple[np.ndarray, np.ndarray], plane: int, corner: int,
            pin: np.ndarray, normal: np.ndarray = normal,
        ) -> None:  # fmt: skip
            start, end = axes_of
            along = (end - start) / np.linalg.norm(end - start)
            axes = np.column_stack([along, np.cross(normal, along), normal])
            frame = exu.HT(rotation=axes, translation=list(pin - fold.corners[plane, corner]))
            marker = mbs.AddMarker(
                item.MarkerBodyRigid(bodyNumber=hinges[plane][corner], localHT=frame)
            )
            revolute(marker, node_marker(number))

        left, right, after = fold.left[:, k], fold.right[:, k], (k + 1) % SECTIONS
        middles = []
        for low in (1, 0):
            ends = left[low], right[1 - low]
            nodes = rod(*ends, normal, "diagonal")
            hinge(nodes[0], ends, low, k, left[low])
            hinge(nodes[2], ends, 1 - low, after, right[1 - low])
            middles.append(node_marker(nodes[1]))
        revolute(*middles)
        for plane in range(2):
            joint = fold.vjoints[plane, k]
            first = rod(left[plane], joint, normal, "bar")
            second = rod(joint, right[plane], normal, "bar")
            hinge(first[0], (left[plane], joint), plane, k, left[plane])
            hinge(second[1], (joint, right[plane]), plane, after, right[plane])
            pair = node_marker(first[1]), node_marker(second[0])
            revolute(*pair)
            body(first[1], VJOINT_MASS, [0.0] * 6, [0.0] * 3)
            up = FORCE if plane == 0 else -FORCE
            mbs.AddLoad(item.LoadForceVector(markerNumber=pair[0], loadVector=[0.0, 0.0, up]))
            watched = watched or [first[1], second[0]]

    def slack(mbs, t, itemNumber, deltaL, deltaL_t, stiffness, damping, force):  # noqa: N803
        return stiffness * exu.symbolic.max(deltaL, 0.0)

    hub = mbs.AddNode(item.NodePoint(referenceCoordinates=list(fold.corners[0].mean(axis=0))))
    mbs.AddObject(item.ObjectMassPoint(nodeNumber=hub, mass=HUB_MASS))
    law = CreateSymbolicUserFunction(
        mbs, slack, "springForceUserFunction", itemTypeName="ObjectConnectorSpringDamper"
    )
    middle = mbs.AddMarker(item.MarkerNodePosition(nodeNumber=hub))
    for number in tops:
        mbs.AddObject(
            item.ObjectConnectorSpringDamper(
                markerNumbers=[middle, mbs.AddMarker(item.MarkerNodePosition(nodeNumber=number))],
                referenceLength=NET_LENGTH,
                stiffness=NET_RATE,
                springForceUserFunction=law,
            )
        )
    mbs.Assemble()
    return mbs, watched


def settings() -> exu.SimulationSettings:
    chosen = exu.SimulationSettings()
    chosen.solution.file.write = False
    chosen.solution.sensors.writePeriod = STEP
    chosen.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    integration = chosen.timeIntegration
    integration.endTime, integration.numberOfSteps = STEP * STEPS, STEPS
    integration.verboseMode = 0
    integration.generalizedAlpha.spectralRadius = 0.8
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = 1e-6
    integration.newton.absoluteTolerance = 1e-7
    return chosen


def run() -> tuple[float, float]:
    """Deployment time of section 1 in s, and processor time in s."""
    begun = time.process_time()
    mbs, watched = build()
    sensors = [
        mbs.AddSensor(
            item.SensorNode(
                nodeNumber=number,
                outputVariableType=exu.OutputVariableType.RotationMatrix,
                storeInternal=True,
                writeToFile=False,
            )
        )
        for number in watched
    ]
    mbs.Assemble()
    # Without stops the bars may swing through at the end, which no such step survives.
    with contextlib.suppress(exu.ExudynError):
        mbs.SolveDynamic(settings())
    data = [np.array(mbs.GetSensorStoredData(sensor)) for sensor in sensors]
    times = data[0][:, 0]
    first, second = (d[:, 1:].reshape(-1, 3, 3) for d in data)
    sine = np.einsum("ni,ni->n", np.cross(first[:, :, 1], second[:, :, 1]), first[:, :, 2])
    folded = np.arctan2(sine, np.einsum("ni,ni->n", first[:, :, 1], second[:, :, 1]))
    passed = int(np.flatnonzero(folded <= 0.0)[0])
    before, after = folded[passed - 1], folded[passed]
    share = before / (before - after)
    deployed = times[passed - 1] + share * (times[passed] - times[passed - 1])
    return float(deployed), time.process_time() - begun


if __name__ == "__main__":
    print("deployment time {:.5f} s, processor time {:.2f} s".format(*run()))
