"""What the base carries, and how it turns."""

import numpy as np

from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable


class BaseReaction(Output):
    """Force and torque of the ground, or of the spacecraft, on the structure.

    Together with loads and weight they are the rates of change of the structure's momentum and
    angular momentum; the base feels their negative.  Peaks count over the whole run: the shock of
    the last locks comes at its end.
    """

    rank = 46
    needs = ("reactions", "held base")
    variables = (
        Variable("base_force", ("axis", "time"), "N", "force of the base on the structure"),
        Variable(
            "base_torque", ("axis", "time"), "N m",
            "torque of the base on the structure, about the base's origin",
        ),
        Variable(
            "peak_base_force", (), "N", "largest force at the base at any step",
            summary=("largest base force", "10.3g"), worse="larger", largest_of="base_force",
        ),
        Variable(
            "peak_base_torque", (), "N m", "largest torque at the base at any step",
            summary=("largest base torque", "10.3g"), worse="larger", largest_of="base_torque",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (2, 3), N and N m."""
        return None if now.carried is None else now.carried.reaction

    def reduce(self, run: Run, series: Series) -> Values:
        """On the output grid; the peaks are those of all steps."""
        force, torque = series.on_grid()
        peaks = np.linalg.norm(series.values, axis=2).max(axis=0)
        return {
            "base_force": force,
            "base_torque": torque,
            "peak_base_force": peaks[0],
            "peak_base_torque": peaks[1],
        }


class BaseRotation(Output):
    """How the body at the boom's upper end has turned since the start."""

    rank = 47
    needs = ("reactions", "base")
    variables = (
        Variable(
            "base_rotation", ("axis", "time"), "degree",
            "rotation vector of the base since the start",
        ),
        Variable(
            "base_rotation_max", (), "degree", "largest rotation of the base at any step",
            summary=("largest base rotation", "10.3g"), worse="larger", largest_of="base_rotation",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (3,), rad."""
        from scipy.spatial.transform import Rotation  # here: most runs have no such base

        turn = None if now.carried is None else now.carried.turn
        return None if turn is None else np.asarray(Rotation.from_matrix(turn).as_rotvec())

    def reduce(self, run: Run, series: Series) -> Values:
        """In degrees."""
        return {
            "base_rotation": np.degrees(series.on_grid()),
            "base_rotation_max": np.degrees(np.linalg.norm(series.values, axis=1).max()),
        }
