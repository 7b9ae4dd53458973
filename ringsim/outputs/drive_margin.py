"""Drive and resistance by kind along a run, and the static margin between them by a standard."""

import math

from ringsim.outputs.family import Output, Run, Series, SpanNames, Values, Variable

LAST_LOCK = "deployment_time"
"""What is open needs no drive any more."""


class DriveMargins(Output):
    """Static generalised forces on the opening angle of the ideal ring at the mean one of the run.

    See ``ringsim.theory.margin_along``.
    """

    rank = 46
    needs = ("margin",)
    coordinates = (
        Variable("resistance", ("resistance",), "1", "kind of resistance to opening", "str"),
    )
    variables = (
        Variable(
            "drive_available", ("time",), "N m",
            "what winches that stall, loads and springs drive without friction in the pulleys",
            until=LAST_LOCK,
        ),
        Variable(
            "drive_resistance", ("resistance", "time"), "N m",
            "static resistance to opening by its kind, without factors",
            until=LAST_LOCK,
        ),
        Variable(
            "drive_margin", ("time",), "1",
            "static margin of the drive by the standard on the ideal ring at the mean opening "
            "angle, with the faults so far, as check --margin tells it",
            until=LAST_LOCK,
        ),
        Variable(
            "least_drive_margin", (), "1",
            "smallest static margin of the drive at any angle that the run passed",
            summary=("least drive margin", "10.3f"), worse="smaller", least_of="drive_margin",
        ),
        Variable("least_drive_margin_time", (), "s", "time of least_drive_margin"),
        Variable("least_drive_margin_angle", (), "degree", "mean opening angle then"),
    )  # fmt: skip

    def told(self, values: Values, span_names: SpanNames) -> str:
        """As "at 20.5 deg and 0.1 s: NOT enough"."""
        names = [f"least_drive_margin{end}" for end in ("", "_angle", "_time")]
        margin, angle, time = (float(values.get(name, math.nan)) for name in names)
        word = "enough" if margin >= 0.0 else "NOT enough"
        return f"at {angle:.4g} deg and {time:.4g} s: {word}"

    def reduce(self, run: Run, series: Series) -> Values:
        """Nothing: ``ringsim.theory.margin_along`` knows them."""
        return {}
