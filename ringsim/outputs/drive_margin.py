"""Drive and resistance by kind along a run, and the margin between them by a standard."""

from ringsim.outputs.family import Output, Run, Series, Values, Variable

LAST_LOCK = "deployment_time"
"""What is open needs no drive any more."""


class DriveMargins(Output):
    """Generalised forces on the mean opening angle of the ideal ring at that of the run.

    See ``ringsim.theory.drive_margin``.
    """

    rank = 46
    needs = ("margin",)
    coordinates = (
        Variable("resistance", ("resistance",), "1", "kind of resistance to opening", "str"),
    )
    variables = (
        Variable(
            "drive_available", ("time",), "N m",
            "what winches and loads could drive without friction in the pulleys",
            until=LAST_LOCK,
        ),
        Variable(
            "drive_resistance", ("resistance", "time"), "N m", "resistance to opening by its kind",
            until=LAST_LOCK,
        ),
        Variable(
            "drive_margin", ("time",), "1", "margin of the drive with the factors of the standard",
            until=LAST_LOCK,
        ),
        Variable(
            "least_drive_margin", (), "1", "smallest margin of the drive at any output time",
            summary=("least drive margin", "10.3f"),
        ),
        Variable("least_drive_margin_time", (), "s", "time of the smallest margin of the drive"),
        Variable("least_drive_margin_angle", (), "degree", "mean opening angle then"),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """Nothing: ``ringsim.theory.drive_margin`` knows them."""
        return {}
