"""The campaign file: which scene, which inputs, which design, which limits."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, ValidationError

from ringsim.execution.work import Limits
from ringsim.files import parse_toml, read_text
from ringsim.refusal import InputError, explain
from ringsim.sampling.columns import Table
from ringsim.sampling.correlation import Correlation
from ringsim.sampling.table import AnyDesign, AnyDistribution, draw
from ringsim.scene import Scene, load_scene
from ringsim.storage.netcdf import OutputTable
from ringsim.units import Model

SOLVERS = {"full": "ringsim.simulation:run", "ideal": "ringsim.simulation:run_ideal"}
"""What maps a scene to its outcome, by fidelity."""


def flat(table: Any, whole: str | None = None, prefix: str = "") -> Any:
    """Join nested tables to dotted paths, down to values; with ``whole`` down to tables that have
    this key, or would need it, since not all that they hold are tables.
    """
    if not isinstance(table, dict):
        return {prefix: table} if prefix else table
    if prefix and whole and not all(isinstance(inner, dict) for inner in table.values()):
        return {prefix: table} if prefix else table
    found: dict[str, Any] = {}
    for name, inner in table.items():
        found |= flat(inner, whole, f"{prefix}.{name}" if prefix else name)
    return found


class Specification(Model):
    """Content of a campaign file."""

    gone: ClassVar[dict[str, str]] = {
        "workers": "ringsim campaign FILE --workers N says how many: leave it out",
        "retry": "runs that fail start anew by themselves, see solver.restarts; leave it out",
    }

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=80)]
    title: Annotated[str, Field(max_length=300)] = ""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    scene: str
    """Built-in scene, or scene file looked up beside the campaign file."""
    set: Annotated[dict[str, Any], BeforeValidator(flat)] = Field(default_factory=dict)
    """Values by scene path that all samples share."""
    inputs: Annotated[
        dict[str, AnyDistribution], BeforeValidator(lambda table: flat(table, "kind"))
    ] = Field(default_factory=dict)
    """Distribution by scene path."""
    correlations: list[Correlation] = Field(default_factory=list)
    design: AnyDesign
    limits: Limits = Limits()
    fidelity: Literal["full", "ideal"] = "full"
    """full: the flexible multibody model; ideal: rigid rods."""
    error_bars_every: Annotated[int, Field(ge=0)] = 0
    """One sample in so many states its error bars (``solver.error_bars``); 0 for none."""
    max_failed: Annotated[int, Field(ge=0)] | None = None
    """The campaign stops when more samples than this have failed."""
    output: OutputTable = OutputTable()


@dataclass(frozen=True)
class Campaign:
    """A campaign file, its text and content, and the scene that its samples vary."""

    file: Path
    text: str
    specification: Specification
    scene: Scene

    def draw(self) -> Table:
        """All inputs of all samples; InputError if the scene refuses one."""
        wanted = self.specification
        try:
            return draw(
                self.scene, wanted.inputs, wanted.correlations, wanted.design, seed=wanted.seed,
                folder=self.file.parent, error_bars_every=wanted.error_bars_every,
            )  # fmt: skip
        except InputError as error:
            raise InputError(f"{self.file.name}: {error}") from None


def load_campaign(path: Path) -> Campaign:
    """Read a campaign file; InputError if it, its content or its scene is refused."""
    text = read_text(path)
    table = parse_toml(text, path.name)
    if "structure" in table and not {"scene", "design"} & set(table):
        raise InputError(
            f"{path.name}: structure: this is a scene, not a campaign file: run it with ringsim "
            f'run, or name it in a campaign file, as scene = "{path.name}"'
        )
    try:
        specification = Specification.model_validate(table)
    except ValidationError as error:
        raise InputError(explain(error, Specification, path.name)) from None
    key = "scene"
    try:
        base = load_scene(specification.scene, beside=path)
        key = "set"
        scene = base.with_values(specification.set)
    except InputError as error:
        raise InputError(f"{path.name}: {key}: {error}") from None
    return Campaign(path, text, specification, scene)
