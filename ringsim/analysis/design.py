"""How the samples of a campaign were placed, as far as it decides which statistics they allow."""

import json
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.blocks import blocks_of
from ringsim.analysis.intervals import Array, standard_error
from ringsim.choice import kind_of, kinds_of
from ringsim.files import parse_toml
from ringsim.refusal import InputError
from ringsim.sampling.designs.family import Design
from ringsim.sampling.designs.grouped import Grouped


@dataclass(frozen=True)
class Placement:
    """What a design says about its samples."""

    kind: str
    population: bool
    """Whether the samples stand for the distributions of the inputs."""
    independent: bool
    """Whether each sample is drawn apart from the others."""
    replicates: int = 1
    """Independent replicates; sample, or block, i belongs to replicate i modulo this."""
    block: int = 1
    """Successive samples that belong together."""

    @property
    def has_intervals(self) -> bool:
        """Whether the scatter of independent parts tells how certain an estimate is."""
        return self.population and (self.independent or self.replicates > 1)

    def replicate_of(self, samples: NDArray[np.int64]) -> NDArray[np.int64] | None:
        """The replicate of each sample; None if all samples are independent."""
        return None if self.independent else samples // self.block % self.replicates

    def error_of_mean(self, values: Array, samples: NDArray[np.int64]) -> float:
        """Standard error of the mean of these samples' values, in their unit, shapes (n,); NaN
        where their scatter does not tell it.
        """
        if not self.has_intervals or not len(values):
            return float("nan")
        return float(standard_error(values, self.replicate_of(samples))[0])

    @property
    def told(self) -> str:
        """What the intervals are from, or why there are none and how to get some."""
        if not self.kind:
            return (
                "the file does not tell its design, so only extremes are given: analyse a campaign "
                "that ringsim campaign has run, or set the attribute design"
            )
        if not self.population:
            return (
                f"a design of kind {self.kind} stands for no population, so there are only "
                'extremes: draw samples with design = { kind = "random", samples = N } for means, '
                "quantiles and probabilities"
            )
        if self.independent:
            return (
                "intervals of 95 %: bootstrap (BCa) of means, bootstrap-t and Bonett's of standard "
                "deviations (approximate where tails are long: 80 to 88 % of a lognormal whose "
                "logarithm scatters by 1), order statistics of quantiles, Clopper-Pearson of shares"
            )
        of = "the samples A and B of its blocks alone stand for the population: " * (self.block > 1)
        if self.replicates > 1:
            return of + (
                f"intervals of 95 % from {self.replicates} independent replicates of the design "
                f"{self.kind}, with Student's t; shares of fewer than 10 samples have that of "
                "independent samples"
            )
        return of + (
            f"no intervals: the samples of one {self.kind} design depend on each other, so that "
            "their scatter does not tell the error; give design.replicates = 8 (independent "
            'replicates), or kind = "random"; bounds of requirements are those of independent '
            "samples"
        )


def placement_of(design: Design) -> Placement:
    """The placement of a design that no sample has been drawn from yet."""
    replicates = getattr(design, "replicates", 1)
    return Placement(kind_of(design), design.population, design.independent, replicates)


def placement(campaign: xr.Dataset) -> Placement:
    """The placement that a merged campaign tells, or one of no population."""
    if "design" in campaign.attrs:
        table = json.loads(campaign.attrs["design"])
    else:  # files that are older than the attribute have the text of the campaign
        try:
            text = parse_toml(str(campaign.attrs.get("campaign", "")), "campaign")
        except InputError:
            text = {}
        table = text.get("design", {})
    kind = kinds_of(Design).get(str(table.get("kind")))
    if kind is None or not issubclass(kind, Design):
        return Placement("", population=False, independent=False)
    given = table.get("replicates", getattr(kind.model_fields.get("replicates"), "default", 1))
    block = 1
    if issubclass(kind, Grouped) and (blocks := blocks_of(campaign)) is not None:
        block = blocks.size
    return Placement(str(table["kind"]), kind.population, kind.independent, int(given), block)
