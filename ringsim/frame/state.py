"""The state of a model: where everything stands and how it moves."""

from itertools import pairwise
from typing import NamedTuple

from ringsim.cable.state import ChainState
from ringsim.frame.balance import Held
from ringsim.frame.following import Followed
from ringsim.frame.kernels import Pose
from ringsim.layout.pose import Array
from ringsim.stepping.memory import Memory


class Groups(NamedTuple):
    """Followed coordinates by what they belong to: points with mass and points of the cables,
    shape (n, 3); joint angles, (a,); ends of the net's strings, (n, 3), and its hub, (1, 3); bodies
    that hang on lines, (n, 3).
    """

    points: Array
    lines: Array
    angles: Array
    ends: Array
    hub: Array
    hung: Array

    @classmethod
    def of(cls, values: Array, held: Held) -> "Groups":
        """Views of followed coordinates."""
        points, lines, angles, *rest = [
            values[first:last] for first, last in pairwise(held.cuts.tolist())
        ]
        ends, hub, hung = (each.reshape(-1, 3) for each in rest)
        return cls(points.reshape(-1, 3), lines.reshape(-1, 3), angles, ends, hub, hung)


class State:
    """A pose, the hub (m), strains of the elements and all followed coordinates; ``place``,
    ``rate`` and ``acceleration`` are views of these, ``chain`` the cables where a step has led.
    """

    def __init__(
        self, pose: Pose, hub: Array, strains: Array, followed: Followed, held: Held
    ) -> None:
        self.pose, self.hub, self.strains, self.followed = pose, hub, strains, followed
        self._held = held
        self.place = Groups.of(followed.place, held)
        self.rate = Groups.of(followed.rate, held)
        self.chain: ChainState | None = None

    @property
    def acceleration(self) -> Groups:
        """As ``place``."""
        return Groups.of(self.followed.acceleration, self._held)

    @property
    def net(self) -> tuple[Array, Array, Array, Array]:
        """Places and rates of the strings' ends, (n, 3), and of the hub, (3,)."""
        return self.place.ends, self.rate.ends, self.place.hub[0], self.rate.hub[0]

    def memory(self) -> Memory:
        """All but the cables, see ``ringsim.stepping.memory``."""
        return {"arrays": self._arrays()}

    def recall(self, memory: Memory) -> None:
        """Go on from a memory."""
        for own, value in zip(self._arrays(), memory["arrays"], strict=True):
            own[...] = value

    def _arrays(self) -> list[Array]:
        return [*self.pose, self.hub, self.strains, *self.followed]

    def copy(self) -> "State":
        """Arrays of its own."""
        pose, hub = Pose(*(each.copy() for each in self.pose)), self.hub.copy()
        strains, followed = self.strains.copy(), self.followed.copy()
        return State(pose, hub, strains, followed, self._held)
