"""Settings of the time integration, and the limits that end a run."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ringsim.units import Degree, MetreOrZero, Model, Ratio, Second, SecondOrZero, Stress, Tension

# Settings of the time integration.


_FINER = 0.25
"""Factor on the step from one start of a run to the next: two restarts reach a sixteenth."""
NO_DEVIATIONS = 1e6
"""``deviation_tolerance`` from which on the deviations choose no steps."""
TENSION_BEND = 15.0
"""Bend of a tension from step to step that is allowed, over its largest value and ``tolerance``.
At 3e-3, the tolerance of ``ring18-cable``, that is 0.045, and the peaks found are good to 2.5 %
(rings of 4 and 5 sections that lock slowly) or better, for at most a third more steps."""
_LEAST_STEP, LEAST_TOLERANCE, _LARGEST_TOLERANCE = 1e-9, 1e-8, 0.1
_LEAST_DEVIATION = 1e-6
MOST_STEPS = 10_000_000
"""Upper bound of ``step_limit``."""


class Solver(Model):
    """Generalised-alpha with a step that follows the motion.

    With ``step_control = "motion"`` the step keeps the local error of the mean opening angle,
    expressed as a relative error in time, near ``tolerance``, between step / 400 and ``step``;
    with "constant" every step is ``step``.
    """

    end_time: Second = 60.0
    """The run ends here at the latest."""
    settling_time: SecondOrZero = 0.05
    """Time simulated after the last V-joint has locked."""
    step: Second = 0.2
    """Largest step, or the step if it is constant."""
    step_control: Literal["motion", "constant"] = "motion"
    """Whether steps follow the motion, or all are equal."""
    tolerance: Annotated[float, Field(ge=LEAST_TOLERANCE, le=_LARGEST_TOLERANCE)] = 3e-4
    """Relative error in time per step that the step control aims at; errors of a run grow like
    it."""
    spectral_radius: Ratio = 0.8
    """High-frequency amplification per step: 1 keeps every vibration, lower damps it."""
    newton_tolerance: Annotated[float, Field(ge=1e-12, le=1e-2)] = 1e-4
    """Residual at which Newton stops, relative to the driving forces of the scene."""
    deviation_tolerance: Annotated[float, Field(ge=_LEAST_DEVIATION, le=NO_DEVIATIONS)] = 0.02
    """Error of the joints' deviations from their mean angle, over the largest so far, to which
    steps follow them where ``record.stress`` asks for them; 1e6: not
    followed."""
    step_limit: Annotated[int, Field(ge=1, le=MOST_STEPS)] = 20_000
    """A run that has not ended after so many steps is given up."""
    energy_tolerance: Annotated[float, Field(ge=1e-6, le=1e6)] = 0.1
    """Imbalance of energy over the largest energy exchanged at which a run counts as diverged."""
    restarts: Annotated[int, Field(ge=0, le=5)] = 2
    """How often a run that failed or diverged starts anew, each time with a quarter of the step
    and a sixteenth of the tolerance."""
    error_bars: bool = False
    """Run the scene a second time with steps half as long, and give error bars of the main
    outputs."""

    @model_validator(mode="after")
    def _usable(self) -> Self:
        if self.step > self.end_time:
            raise ValueError(f"step = {self.step} s must not exceed end_time = {self.end_time} s")
        if self.spectral_radius == 1.0:
            raise ValueError(
                "spectral_radius = 1.0 must be below 1: position constraints need some "
                "numerical damping (0.9 is nearly undamped)"
            )
        return self

    def refined(self, times: int) -> Self:
        """The settings of a restart: a quarter of every step, ``times`` times over."""
        return self.scaled(_FINER**times)

    def scaled(self, factor: float) -> Self:
        """Every step so many times as long, within the fields' bounds and ``end_time``.

        The largest step is scaled, and with it the smallest, or a run at one of them would hardly
        differ; steps go with the square root of the tolerances, which take the factor's square.
        Deviations that are not followed stay so.
        """
        step, tolerance = self.step * factor, self.tolerance * factor**2
        deviations = self.deviation_tolerance
        if deviations < NO_DEVIATIONS:
            deviations = max(deviations * factor**2, _LEAST_DEVIATION)
        return self.model_copy(
            update={
                "step": min(max(step, _LEAST_STEP), self.end_time),
                "tolerance": min(max(tolerance, LEAST_TOLERANCE), _LARGEST_TOLERANCE),
                "deviation_tolerance": deviations,
            }
        )


class Record(Model):
    """What a run writes down."""

    interval: Second = 0.1
    """Spacing of the output times."""
    stress: bool = False
    """Record axial + bending stress, elastic + viscous, at the ends of every rod.  Steps then
    follow how joints swing about their mean angle (``solver.deviation_tolerance``), which is more
    of them; the shocks of locks take shorter ones still (``reactions``)."""
    positions: bool = False
    """Record where corners, pins, joints and the hub are, so that drawings show what was computed;
    of 18 sections 4 kB an output time."""
    accelerations: bool = False
    """Record the largest acceleration of every corner.  Steps then follow the shocks of locks, some
    30 a lock."""
    state_interval: Second | None = None
    """Store the whole state at multiples of this and at the end, from which ``ringsim run --from``
    goes on; a step ends at each.  Left out, none is stored."""
    reactions: bool = False
    """Record force and torque at the base, how it turns, and the impulse of every lock.  Steps then
    follow the shocks of locks, some 30 a lock."""
    shape: bool = False
    """Record how far corners are at the end from the deployed design."""
    frequency: bool = False
    """Record the lowest natural frequency of the ring, deployed and latched, at rest with slack
    ropes: of runs that deploy.  It takes about as long as ``ringsim modes`` at one angle."""


# What the antenna must not be driven past.


class Limits(Model):
    """Bounds past which a run has the outcome "overloaded", or "slackened" by slack ropes.

    A V-joint past ``overrun`` or a rope past ``rope_strain`` ends the run: the model means nothing
    beyond.  The others are allowables: the run goes on and shows by how much they are passed.
    """

    overrun: Annotated[Degree, Field(gt=0.0, le=90.0)] = 3.0
    """Angle by which a V-joint may be past its stop: rings that open as they should go 0.1 to
    0.2 deg deep into the default stop, 10 N m hold it at 3 deg."""
    rope_strain: Annotated[float, Field(gt=0.0, le=1.0)] = 0.25
    """Largest strain of a rope: aramid breaks at 2 to 4 %, but models may have soft ropes.  It ends
    the run: a winch that pulls at a jammed pulley next to it would reach any tension."""
    tension: Tension | None = None
    """Largest tension of any span of a cable, at any time of the run."""
    rod_stress: Stress | None = None
    """Largest axial + bending stress of any rod; needs ``record.stress = true``."""
    slack_duration: SecondOrZero | None = None
    """Longest time for which any span may be slack without a break, before its plane has locked: a
    rope that is slack for longer may leave its pulleys, and the outcome is "slackened"."""
    slack_length: Annotated[MetreOrZero, Field(le=1.0)] = 1e-4
    """Free rope in a span, beyond its length, from which on that counts.  A span of L metres
    with s metres of free rope sags by sqrt(3 L s / 8): 4 mm, the depth of a small pulley's groove,
    for L = 0.4 m and s = 0.1 mm."""

    @property
    def farthest(self) -> float:
        """``overrun`` in rad."""
        return math.radians(self.overrun)
