"""What a run took: steps, iterations, starts, times, and the settings that it ended up with."""

from ringsim.outputs.family import Output, Run, Series, Values, Variable


def _number(name: str, long_name: str, summary: tuple[str, str] | None = None) -> Variable:
    return Variable(name, (), "1", long_name, "i4", summary=summary)


class Effort(Output):
    """Counts of the last attempt; ``ringsim.stepping.restarts`` adds those of all attempts."""

    rank = 70
    of_antenna = False
    variables = (
        _number("steps", "time steps of the last attempt", ("steps", "10d")),
        _number("repeated_steps", "steps that were repeated with a smaller one"),
        _number("newton_iterations", "Newton iterations of the last attempt"),
        _number("jacobians", "Jacobian factorisations of the last attempt"),
        _number("restarts", "restarts with smaller steps after a failed attempt"),
        _number(
            "total_steps", "time steps of all attempts of the run", ("steps of all attempts", "10d")
        ),
        _number("total_newton_iterations", "Newton iterations of all attempts"),
        _number("total_jacobians", "Jacobian factorisations of all attempts"),
        _number(
            "fidelity",
            "model: 0 full multibody, 2 rods in joint coordinates",
        ),
        Variable("step_used", (), "s", "largest step allowed, solver.step, of the last attempt"),
        Variable("tolerance_used", (), "1", "solver.tolerance of the last attempt"),
        Variable("final_time", (), "s", "time at which the run ended"),
        Variable("wall_time", (), "s", "elapsed time of the run", summary=("wall time", "10.2f")),
        Variable("cpu_time", (), "s", "processor time of the run"),
    )

    def reduce(self, run: Run, series: Series) -> Values:
        """As counted."""
        return {**run.counts, "final_time": series.times[-1]}
