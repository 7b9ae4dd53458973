"""The laws of ``ringsim.parts`` as exudyn's expressions."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from types import SimpleNamespace
from typing import Any

import exudyn as exu
from exudyn.advancedUtilities import CreateSymbolicUserFunction

from ringsim.engine.assembly import Assembly

SYMBOLIC = SimpleNamespace(
    minimum=exu.symbolic.min,
    maximum=exu.symbolic.max,
    where=exu.symbolic.IfThenElse,
    tanh=exu.symbolic.tanh,
    exp=exu.symbolic.exp,
    sqrt=exu.symbolic.sqrt,
    abs=exu.symbolic.abs,
    sign=exu.symbolic.sign,
)
"""What a law takes as its ``xp``: numpy's names for exudyn's functions."""

TORSION = "ObjectConnectorTorsionalSpringDamper"


def symbolic_law(
    assembly: Assembly, kind: str, key: Hashable, law: Callable[[Any, Any, Any], Any]
) -> dict[str, Any]:
    """The setting that gives a spring-damper connector its law; equal keys share one.

    Parameters
    ----------
    kind
        Type of the connector in exudyn.
    law
        Force or torque from displacement (angle), rate, and the connector's last parameter.
    """

    def function(
        mbs: Any, t: Any, item: Any, place: Any, rate: Any, stiffness: Any, damping: Any, last: Any
    ) -> Any:
        return law(place, rate, last)

    argument = "springTorqueUserFunction" if kind == TORSION else "springForceUserFunction"
    if key not in assembly.laws:
        assembly.laws[key] = CreateSymbolicUserFunction(
            assembly.system, function, argument, itemTypeName=kind
        )
    return {argument: assembly.laws[key]}
