"""How a run ended and why, as codes."""

from ringsim.outputs.family import Output, Run, Series, Values, Variable
from ringsim.variables import Cause, Status


class Ending(Output):
    """Status and cause, which stand in every ``Outcome`` beside the values."""

    rank = 80
    variables = (
        Variable("status", (), "1", "how the run ended", "i1", flags=Status),
        Variable("cause", (), "1", "why the run did not end well", "i1", flags=Cause),
    )

    def reduce(self, run: Run, series: Series) -> Values:
        """Nothing: the engine knows them."""
        return {}
