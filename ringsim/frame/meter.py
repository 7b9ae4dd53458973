"""Energies of a state, and what has passed since the state that was kept last."""

import numpy as np

from ringsim.cable.state import ChainState, work_between
from ringsim.frame.kernels import Strains, kinetic_energy
from ringsim.frame.model import FrameModel
from ringsim.frame.state import State
from ringsim.layout.pose import Array
from ringsim.stepping.instant import Energies


class EnergyMeter:
    """Measures the energies of a model.

    What friction, dampers and stops take is their mean force times the displacement.
    """

    def __init__(self, model: FrameModel) -> None:
        self._model = model
        self._kept: tuple[Array, Array, ChainState | None] | None = None
        self._last: tuple[Array, Array, ChainState | None] | None = None

    def read(self, state: State, strains: Strains) -> Energies:
        """Energies of a state with its strains and, if there are cables, its chain."""
        model, mesh = self._model, self._model.mesh
        pose = state.pose
        torques = model.laws.passing(pose.angle, state.rate.angles)
        kinetic = kinetic_energy(mesh, state.rate.points)
        elastic = 0.5 * float(np.sum(mesh.stiffness * state.strains**2)) + torques.stored
        elastic += sum(slide.stored(pose) for slide in model.slides)
        forces, places = [torques.lost], [pose.angle]
        if model.strings is not None:
            stored, resisting, lengths = model.strings.passing(*state.net)
            moving = state.rate.hub[0]
            kinetic += 0.5 * model.strings.hub_mass * float(moving @ moving)
            elastic += stored
            forces.append(resisting)
            places.append(lengths)
        if model.edge is not None:
            elastic += model.edge.stored(pose.place)
        if model.hanging is not None:
            hold = model.hanging.hold(state)
            kinetic += model.hanging.kinetic(state)
            elastic += hold.stored
            forces.append(-hold.friction.ravel())
            places.append(state.place.hung.ravel())
        if mesh.tau.any():
            straining = strains.lead * state.strains + strains.before
            forces.append((mesh.tau[:, None] * mesh.stiffness * straining).ravel())
            places.append(state.strains.ravel())
        force, place = np.concatenate(forces), np.concatenate(places)
        lost = driven = 0.0
        chain = state.chain
        if chain is not None:
            elastic += float(chain.elastic_energy.sum())
        if self._kept is not None:
            before, at, chain_before = self._kept
            lost = 0.5 * float((force + before) @ (place - at))
            if chain is not None and chain_before is not None:
                driven, rubbed = work_between(chain_before, chain)
                lost += rubbed
        self._last = force, place, chain
        return Energies(kinetic, elastic, model.work(state), lost, driven)

    def keep(self) -> None:
        """Count from the last reading on."""
        self._kept = self._last
