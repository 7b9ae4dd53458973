"""Energies of a state, and what has passed since the state that was kept last."""

import numpy as np

from ringsim.cable.state import ChainState, work_between
from ringsim.frame.kernels import Strains, energies_of
from ringsim.frame.model import FrameModel
from ringsim.frame.net import passing_strings
from ringsim.frame.state import State
from ringsim.stepping.instant import Energies
from ringsim.stepping.losses import Passing, lost_between
from ringsim.stepping.memory import Remembering


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
        if model.with_hub:
            stored, resisting, lengths, along = passing_strings(model.web, *state.net)
            moving = state.rate.hub[0]
            kinetic += 0.5 * model.web.hub_mass * float(moving @ moving)
            elastic += stored
            forces.append(resisting)
            places.append(lengths)
            rates.append(along)
        if model.edge is not None:
            elastic += model.edge.stored(pose.place)
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
