"""How a run ended and why, as codes."""

from ringsim.outputs.family import Output, Run, Series, Values, Variable
from ringsim.variables import Cause, Fate, Status


class Ending(Output):
    """Status and cause, which stand in every ``Outcome``, and what the antenna did."""

    rank = 80
    variables = (
        Variable("status", (), "1", "whether the numbers of the run hold", "i1", flags=Status),
        Variable("cause", (), "1", "why the numbers do not hold", "i1", flags=Cause),
        Variable("outcome", (), "1", "what the antenna did", "i1", flags=Fate),
    )

    def reduce(self, run: Run, series: Series) -> Values:
        """Nothing: the engine knows them."""
        return {}
