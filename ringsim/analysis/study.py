"""What the samples of a campaign say about its population: estimates, intervals, verdicts."""

from collections.abc import Collection, Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from ringsim.analysis import intervals
from ringsim.analysis.accuracy import in_favour, settings_at
from ringsim.analysis.campaign_notes import (
    NOTE,
    OFF,
    RECORDED,
    attributes,
    off_counts,
    opened,
    records_line,
    remark_lines,
)
from ringsim.analysis.derived import known_from
from ringsim.analysis.design import (
    LOST,
    NUMERICAL,
    Placement,
    endings,
    kinds_of_ends,
    learnt_lines,
    placement,
    population_of,
    scalars,
)
from ringsim.analysis.engines import GROUPS, OUTPUTS
from ringsim.analysis.influence import influence
from ringsim.analysis.intervals import (
    CHECKED,
    NONE,
    TWIN,
    Interval,
    Twins,
    good,
    lost,
    numbers,
    of_both_engines,
    quantities,
    ran,
    same_within,
    share_interval,
    worst_sample,
)
from ringsim.analysis.requirements import (
    Requirement,
    badness_of,
    read_requirements,
    required_by,
    stopping_lines,
)
from ringsim.analysis.reweighting import read_distributions, reweight
from ringsim.analysis.sensitivity import rarer, sensitivity
from ringsim.analysis.tails import tail
from ringsim.analysis.verdicts import judge
from ringsim.analysis.worst import labels, margins, one_at_a_time, other_than_base, worst
from ringsim.choice import kind_of
from ringsim.dataset import in_order
from ringsim.files import parse_toml, read_text
from ringsim.parts.solver import NO_DEVIATIONS
from ringsim.refusal import InputError
from ringsim.scene import Scene, scene_from_toml
from ringsim.stepping.instant import Array
from ringsim.tables import unit_behind
from ringsim.units import ListIn, Model
from ringsim.variables import Status, about

QUANTILES = {"quantile_05": 0.05, "median": 0.5, "quantile_95": 0.95}
STATISTICS = ("mean", "standard_deviation", *QUANTILES, "minimum", "maximum")
PARTS = (0.25, 0.5, 0.75, 1.0)
"""Shares of the samples that have run, the first ones, after which estimates are told as well."""
COUNTED = ("used", "lost", "without_value", "not_run")
SOURCES = ("sampling", "numerical", "engines")
"""What makes a mean wrong: few samples, steps and elements, and the choice of the engine."""
_FEW = 10
"""Samples of a kind, and of other kinds, below which Student's t does not fit their share."""


def analyse(
    campaign: xr.Dataset,
    requirements: Mapping[str, Requirement | Mapping[str, Any]] | None = None,
    reweighted: Mapping[str, Mapping[str, Any]] | None = None,
) -> xr.Dataset:
    """Statistics of all outputs of a merged campaign, its outcomes, and verdicts on requirements.

    Parameters
    ----------
    campaign
        As ``ringsim campaign`` merges it: dimension ``sample``, variable ``status``.
    requirements
        By output, for example ``{"asynchrony_max": {"max": 10.0, "probability": 0.99,
        "confidence": 0.9}}``; those of the campaign file if None.
    reweighted
        Other distributions of inputs, by path, as campaign files give them; see ``reweight``.

    Returns
    -------
    xarray.Dataset
        For every output NAME ``NAME`` (statistic), ``NAME_interval`` (statistic, bound),
        ``NAME_convergence`` (part, statistic), ``NAME_error_of_mean`` (source), all in its unit,
        ``NAME_same_within`` (see ``intervals.same_within``), ``NAME_samples`` (counted) and
        ``NAME_worst_sample``; ``NAME_end_sample`` (bound) with the least and the largest value, and
        ``NAME_end_error``, what these state as their numerical error; ``NAME_error_samples``,
        ``NAME_largest_error`` and its sample along ``source``;
        ``balance_...``, errors of the solution; ``outcome_...`` along ``kind``; verdicts along
        ``requirement``; what matters along ``input`` and ``output``, see ``influence`` and
        ``sensitivity``; the worst samples along ``worst``; margins to the scene's limits along
        ``limit``.  NaN stands for what the samples do not
        tell; ``intervals`` among the attributes says what intervals are from, or why there are
        none.

    InputError if it is no campaign, or a requirement cannot be judged by it.
    """
    if "sample" not in campaign.dims or "status" not in campaign:
        raise InputError(
            "this is not a campaign: give the folder that ringsim campaign has written, or its "
            "campaign.nc"
        )
    own, campaign = known_from(campaign.attrs), in_order(campaign)
    placed = placement(campaign)
    if requirements is None:
        requirements = required_by(campaign.attrs)
    plain = {k: v for k, v in requirements.items() if not isinstance(v, Requirement)}
    wanted = {
        **{k: v for k, v in requirements.items() if isinstance(v, Requirement)},
        **read_requirements(plain, "requirements"),
    }
    found = xr.Dataset(
        coords={
            "statistic": list(STATISTICS), "bound": ["lower", "upper"], "part": list(PARTS),
            "counted": list(COUNTED), "source": list(SOURCES),
        },
        attrs={
            "title": campaign.attrs.get("title", ""),
            "campaign_name": campaign.attrs.get("campaign_name", ""),
            "campaign_identity": campaign.attrs.get("identity", ""),
            "samples": campaign.sizes["sample"], "samples_run": int(ran(campaign).sum()),
            "design": placed.kind, "intervals": placed.told,
            "learnt": "; ".join(learnt_lines(campaign)),
            "stopping": "".join(stopping_lines(campaign, placed)), **attributes(campaign),
            "remarks": "\n".join(remark_lines(campaign)),
            **({"outputs": campaign.attrs["outputs"]} if own else {}),
            RECORDED: records_line(campaign),
        },
    )  # fmt: skip
    found["part"].attrs = about("share of the completed samples, counted from the first")
    stand = population_of(campaign)
    found = found.assign(statistics(stand, placed, wanted=wanted)).assign(tail(campaign))
    found = found.assign(balance(campaign))
    single = one_at_a_time(campaign)  # what each change does is told case by case
    matter = xr.Dataset() if single else influence(stand, wanted, placed)
    more = [outcomes(stand, placed), matter, cases(campaign)]
    more += [worst(stand, wanted, matter), margins(campaign)]
    more += [judge(stand, wanted, placed)] if wanted else []
    more += [sensitivity(campaign, wanted, placed), rarer(stand, wanted, placed)]
    if reweighted:
        more += [reweight(stand, wanted, placed, read_distributions(reweighted))]
    for part in more:
        found = found.merge(part, combine_attrs="override")
    if note := found.attrs[NOTE]:
        for name in _bent(found):
            found[name].attrs[NOTE] = note
    for name, words in off_counts(found.attrs).items():
        if name in found:
            found[name].attrs[OFF] = words
    return found


def cases(campaign: xr.Dataset) -> xr.Dataset:
    """Of a design that changes one input at a time, or lists cases by name, along ``case``: the
    sample, what is other than in the base case, or its name, how it ended, and the main numbers,
    ``case_NAME``; of any other no variables.
    """
    held, says = np.flatnonzero(ran(campaign)), "what is other than in the base case"
    if one_at_a_time(campaign):
        names = [other_than_base(campaign, k) for k in held.tolist()]
    elif placement(campaign).kind == "list" and (own := labels(campaign)):
        names, says = [", ".join(str(v.values[k]) for v in own) for k in held.tolist()], "case"
    else:
        return xr.Dataset()
    named = scalars(campaign)
    about_cases = {
        "case_sample": (campaign["sample"].to_numpy()[held], "sample"),
        "case_change": (np.array(names, dtype=object), says),
        "case_outcome": (endings(campaign)[held].astype(object), "how the sample ended"),
    }
    found = {name: ("case", values, {"long_name": meant})
             for name, (values, meant) in about_cases.items()}  # fmt: skip
    ok = good(campaign)[held]
    for name in named:
        values = np.where(ok, numbers(campaign, name)[held], np.nan)
        found[f"case_{name}"] = ("case", values, dict(campaign[name].attrs))
    return xr.Dataset(found)


def _bent(found: xr.Dataset) -> list[str]:
    """The variables that lost runs bend if these go with inputs: those that the others alone tell,
    among them all of outputs, whatever these are called.

    Verdicts, their bounds and shares of outcomes count lost runs, and counts are what they are.
    """
    of_all = (
        "verdict", "outcome", "tail", "samples", "missing", "group", "index_used", "index_lost",
        "balance",
    )  # fmt: skip
    safe = ("_samples", "_lower", "_upper", "_required", "_bounds", "_verdict", "_text", "_units")
    own, heads = quantities(), tuple(f"{name}_" for name in quantities())
    return [
        name for name, each in ((str(n), v) for n, v in found.variables.items())
        if name not in found.coords and each.dtype.kind == "f"
        and (name in own or not name.endswith(safe))
        and (name in own or name.startswith(heads) or not name.startswith(of_all))
    ]  # fmt: skip


def statistics(
    campaign: xr.Dataset, placed: Placement, names: Collection[str] | None = None,
    wanted: Mapping[str, Requirement] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """All variables about outputs (by default all that have a value), see ``analyse``; what is
    ``wanted``, by default by the campaign, tells worst samples where the output does not.
    """
    wanted = required_by(campaign.attrs) if wanted is None else wanted
    found, twins = dict[str, Any](), Twins()
    for name in quantities() if names is None else names:
        values = numbers(campaign, name)[good(campaign)] if name in campaign else np.empty(0)
        if np.isfinite(values).any():
            found |= _output(campaign, name, placed, badness_of(name, wanted))
            if twin := twins.of(name, values):
                found[name][2][TWIN] = twin
    return found


def _output(campaign: xr.Dataset, name: str, placed: Placement, badness: int) -> dict[str, Any]:
    """All variables about one output."""
    values, ok = numbers(campaign, name), good(campaign)
    known = ok & np.isfinite(values)
    run = ran(campaign)
    place = np.cumsum(run)[known]
    used, index = values[known], campaign["sample"].to_numpy()[known]
    counts = [known.sum(), lost(campaign).sum(), (ok & ~known).sum()]
    parts = [used[place <= round(part * run.sum())] for part in PARTS]
    errors = _errors(campaign, name, known, placed)
    ends = [np.argmin(used), np.argmax(used)]
    bars = numbers(campaign, f"{name}_error")[known][ends]
    worst = worst_sample(campaign, quantities()[name], badness)
    rows: dict[str, tuple[Any, Any, str]] = {
        "": ("statistic", estimates(used, placed), "estimates"),
        "_interval": (
            ("statistic", "bound"), interval_of(used, index, placed), "95 % intervals",
        ),
        "_convergence": (
            ("part", "statistic"), [estimates(part, placed) for part in parts],
            "estimates from the first samples",
        ),
        "_samples": ("counted", [*counts, len(values) - sum(counts)], "samples"),
        "_end_sample": ("bound", index[ends], "samples with the least and the largest value"),
        "_end_error": ("bound", bars, "their numerical error bars"),
        "_error_of_mean": ("source", errors[:, 0], "error of the mean by source"),
        "_error_samples": ("source", errors[:, 1].astype("i8"), "samples that have it"),
        "_largest_error": ("source", errors[:, 2], "largest error of a sample"),
        "_largest_error_sample": ("source", errors[:, 3].astype("i8"), "sample with that error"),
        "_same_within": (
            (), same_within(campaign, name),
            "numerical error, if it explains all differences between samples",
        ),
        "_worst_sample": (
            (), worst, "sample with the worst value; -1 where neither end is the worse one",
        ),
    }  # fmt: skip
    meaning, units = campaign[name].attrs.get("long_name", name), quantities()[name].units
    found = {}
    for suffix, (dims, each, words) in rows.items():
        unit = units if np.asarray(each).dtype.kind == "f" else "1"  # samples have none
        found[f"{name}{suffix}"] = dims, np.asarray(each), about(f"{words} of: {meaning}", unit)
    return found


def estimates(values: Array, placed: Placement) -> Array:
    """All statistics of some values, in their order; NaN where a design or too few have none."""
    found = dict.fromkeys(STATISTICS, np.nan)
    if len(values):
        found |= {"minimum": values.min(), "maximum": values.max()}
        if placed.population:
            found |= {"mean": values.mean()}
            found |= dict(
                zip(QUANTILES, intervals.quantile(values, [*QUANTILES.values()]), strict=True)
            )
            found["standard_deviation"] = (
                float(intervals.spread(values)) if len(values) > 1 else np.nan
            )
    return np.array([*found.values()], dtype=float)


def interval_of(values: Array, samples: NDArray[np.int64], placed: Placement) -> Array:
    """Intervals of all statistics as the design allows them, shape (statistic, 2)."""
    of: dict[str, Any] = {"mean": np.mean, "standard_deviation": intervals.spread, **QUANTILES}
    return np.array([
        placed.interval(values, samples, of[name]) if name in of else NONE for name in STATISTICS
    ])  # fmt: skip


def _errors(
    campaign: xr.Dataset, name: str, known: NDArray[np.bool_], placed: Placement
) -> Array:  # fmt: skip
    """Standard error of the mean, error bars and difference of engines, shape (source, 4): the
    error, the samples that have it, the largest one (NaN of the mean) and its sample (-1).

    The latter two as root mean squares over the samples that have them: those of neighbouring
    samples are alike, so that they do not average out.
    """
    values, index = numbers(campaign, name), campaign["sample"].to_numpy()
    sampling = placed.error_of_mean(values[known], index[known])
    apart = np.full(len(values), np.nan)
    checked = f"status{CHECKED}" in campaign and f"{name}{CHECKED}" in campaign
    if checked and name not in of_both_engines():
        both = campaign[f"status{CHECKED}"].to_numpy() == Status.OK
        apart = np.where(both, np.abs(values - numbers(campaign, f"{name}{CHECKED}")), np.nan)
    return np.array([
        (sampling, known.sum(), np.nan, -1),
        *(root_mean_square(np.where(known, each, np.nan), index)
          for each in (numbers(campaign, f"{name}_error"), apart)),
    ])  # fmt: skip


def root_mean_square(values: Array, samples: NDArray[np.int64]) -> tuple[float, float, float, int]:
    """Of the finite values: root mean square, their number, the largest and its sample."""
    known = np.isfinite(values)
    if not known.any():
        return np.nan, 0, np.nan, -1
    largest = int(np.argmax(np.where(known, values, -np.inf)))
    mean = float(np.sqrt(np.mean(values[known] ** 2)))
    return mean, int(known.sum()), float(values[largest]), int(samples[largest])


def balance(campaign: xr.Dataset) -> dict[str, Any]:
    """Errors of the solution itself along ``balance``: ``balance_median`` and ``balance_largest``
    over the samples whose numbers hold, the sample with the largest, and how many tell it.
    """
    rows, names, samples = list[tuple[float, ...]](), list[str](), campaign["sample"].to_numpy()
    for name in NUMERICAL:
        values = np.where(good(campaign), numbers(campaign, name), np.nan)
        _, count, largest, sample = root_mean_square(values, samples)
        if count:
            says = campaign[name].attrs
            names.append(unit_behind(str(says.get("long_name", name)), str(says.get("units", "1"))))
            rows.append((float(np.nanmedian(values)), largest, sample, count))
    columns = np.array(rows).reshape(-1, 4).T
    words = ("median", "largest", "sample", "samples")
    found: dict[str, Any] = {
        f"balance_{word}": (
            "balance", each if word in words[:2] else each.astype("i8"),
            about(f"{word} of the balance errors"),
        )
        for word, each in zip(words, columns, strict=True)
    }  # fmt: skip
    return found | {"balance": np.array(names, dtype=object)} if names else {}


def outcomes(campaign: xr.Dataset, placed: Placement) -> xr.Dataset:
    """Counts and shares of what the antenna did, and of how runs were lost, along ``kind``.

    Shares are of all that ran.  What lost ones would have done nobody knows: they are told beside
    each outcome (``outcome_lost``), and its interval reaches from none of them to all.
    """
    ok, gone, index = good(campaign), lost(campaign), campaign["sample"].to_numpy()
    of, words = ok | gone, endings(campaign)
    rows = {
        word: (own, own if word.startswith(LOST) else own | gone)
        for word in kinds_of_ends(words) for own in [words == word]
    }  # fmt: skip
    shares = np.full((len(rows), len(PARTS)), np.nan)
    ends, run = np.full((len(rows), 2), np.nan), np.flatnonzero(ran(campaign))
    for k, (own, most) in enumerate(rows.values()):
        for part, share in enumerate(PARTS):
            first = run[: round(share * len(run))]
            if of[first].any():
                shares[k, part] = own[first].sum() / of[first].sum()
        ends[k] = [
            placed_share_interval(each[of], index[of], placed)[side]
            for side, each in enumerate((own, most))
        ]
    counts = [(own.sum(), most.sum() - own.sum()) for own, most in rows.values()]
    open_ = opened(campaign)
    population = placed.population
    return xr.Dataset(
        {
            "outcome_samples": (
                "kind", np.array([n for n, _ in counts], dtype="i8"), about("samples of the kind"),
            ),
            "outcome_of": (
                "kind", np.full(len(rows), of.sum(), dtype="i8"),
                about("number of samples that ran, to which the share refers"),
            ),
            "outcome_lost": (
                "kind", np.array([n for _, n in counts], dtype="i8"),
                about("failed runs, whose antennas may be of the kind, too"),
            ),
            **({
                "outcome_open": (
                    "kind", np.array([int((own & open_).sum()) for own, _ in rows.values()]),
                    about("samples of the kind in which all V-joints have locked and latched"),
                ),
            } if "deployment_time" in campaign else {}),
            "outcome_share": (
                "kind", shares[:, -1] if population else ends[:, 0], about("share of the kind"),
            ),
            "outcome_share_interval": (
                ("kind", "bound"), ends,
                about("95 % interval of the share, whatever failed runs would have done"),
            ),
            "outcome_share_convergence": (
                ("kind", "part"), shares if population else np.full_like(shares, np.nan),
                about("share among the first samples"),
            ),
        },
        coords={"kind": np.array([*rows], dtype=object)},
    )  # fmt: skip


def placed_share_interval(
    own: NDArray[np.bool_], samples: NDArray[np.int64], placed: Placement
) -> Interval:
    """Interval of a share as the design allows it."""
    if not placed.has_intervals or not len(own):
        return NONE
    replicate, count = placed.replicate_of(samples), int(own.sum())
    values = own.astype(float)
    if (
        replicate is None
        or min(count, len(own) - count) < _FEW
        or intervals.agree(values, replicate)
    ):
        return share_interval(count, len(own))
    low, high = intervals.of_replicates(values, replicate, np.mean)
    return max(0.0, float(low)), min(1.0, float(high))


# Settings that an accuracy study found worth their cost, and picking one for an accuracy.


JUDGED_BY = "motion"
"""The errors that a setting is picked by, unless others are named: deployment time and angle."""
CHOICES = (*GROUPS, *OUTPUTS, "energy")
"""What a setting may be picked by."""


class Setting(Model):
    """An engine and one setting by scene path, with measured errors and cost."""

    seconds: float
    """Processor time of a run, s."""
    fidelity: Literal["full", "frame"] = "full"
    values: dict[str, Any]
    errors: dict[str, float]
    """What the setting is good for, relative, by output and group of outputs."""


class Evidence(Model):
    """The settings of one scene and either engine that are worth their cost, cheapest first.

    The scene's own setting comes before others that are hardly cheaper.
    """

    scene: str
    kind: dict[str, Any]
    """See :func:`kind_of_scene`."""
    settings: Annotated[tuple[Setting, ...], ListIn, Field(min_length=1)]

    def pick(self, accuracy: float, of: str = JUDGED_BY, fidelity: str | None = None) -> Setting:
        """The cheapest setting of a fidelity, of any if None, that is good for a relative error of
        one of ``CHOICES``.

        Raises InputError if none is, or the scene has no such output.
        """
        settings = [s for s in self.settings if fidelity in (None, s.fidelity)]
        if not settings:
            raise InputError(
                f"--fidelity {fidelity}: no settings were measured for this fidelity with "
                f"{self.scene}: give --evidence from ringsim accuracy for a scene that this "
                "fidelity can run, or leave out --fidelity"
            )
        errors = [setting.errors.get(of, np.inf) for setting in settings]
        if min(errors) == np.inf:
            there = ", ".join(name for name in CHOICES if name in settings[0].errors)
            raise InputError(f"--of {of}: not measured with {self.scene}: choose from {there}")
        if min(errors) <= accuracy:
            return next(s for s, e in zip(settings, errors, strict=True) if e <= accuracy)
        best = float(f"{1.006 * min(errors):.2e}")  # rounded up, so that asking for it succeeds
        raise InputError(
            f"--accuracy {accuracy:g}: the best setting measured with {self.scene} has an "
            f"error of {best:.3g} in {of.replace('_', ' ')}: ask for that, or set solver.tolerance "
            "yourself"
        )

    def values_for(self, setting: Setting, scene: Scene) -> dict[str, Any]:
        """A setting's values for a scene: no fewer elements than it has, no step beyond its end."""
        return setting.values | {
            "solver.step": min(setting.values["solver.step"], scene.solver.end_time),
            "rods.elements": max(setting.values["rods.elements"], scene.rods.elements),
        }

    def require_like(self, scene: Scene) -> None:
        """Raise InputError, with what differs, if this is evidence of another kind of scene."""
        for name, value in kind_of_scene(scene).items():
            if value != self.kind.get(name):
                raise InputError(
                    f"--accuracy: its settings were measured with {self.scene}, {name} = "
                    f"{self.kind.get(name)}, and {scene.name} has {name} = {value}: give "
                    "--evidence from ringsim accuracy on a scene of its kind"
                )


def kind_of_scene(scene: Scene) -> dict[str, Any]:
    """What settings depend on most: structure, rods, drive, and how steps are chosen."""
    return {
        "structure": kind_of(scene.structure),
        "rods": kind_of(scene.rods),
        "cables": scene.cables is not None,
        "step_control": scene.solver.step_control,
    }


def evidence_of(found: xr.Dataset) -> Evidence:
    """The settings of a study that some accuracy picks: each is best so far in some output, among
    those of its engine.

    ``found`` is from :func:`ringsim.analysis.accuracy.judge`; its attribute ``scene`` is its scene.
    """
    scene = scene_from_toml(found.attrs["scene"], source="the study's scene")
    usable = found.eligible.values & np.isfinite(found.bound.values).any(axis=1)
    cost = np.where(usable, in_favour(found.cost.values, found.ladder.values), np.inf)
    settings: list[Setting] = []
    known: dict[str, dict[str, float]] = {}
    for rung in np.argsort(cost, kind="stable")[: usable.sum()].tolist():
        bounds = found.bound[rung].to_series().dropna().items()
        # Rounded up: a setting is good for no less.
        errors = {str(name): float(f"{1.0049 * e:.2e}") for name, e in bounds}
        best = known.setdefault(found.fidelity.values[rung], {})
        if better := {name: e for name, e in errors.items() if e < best.get(name, np.inf)}:
            best |= better
            values = settings_at(found, rung)
            del values["rods.kind"], values["solver.step_control"]
            if values["solver.deviation_tolerance"] >= NO_DEVIATIONS:
                del values["solver.deviation_tolerance"]  # another scene may follow them
            seconds = float(f"{found.cost.values[rung]:.3g}")
            fidelity = found.fidelity.values[rung]
            settings.append(
                Setting(seconds=seconds, fidelity=fidelity, values=values, errors=errors)
            )
    return Evidence(scene=scene.name, kind=kind_of_scene(scene), settings=tuple(settings))


def read_evidence(path: Path | Traversable) -> Evidence:
    """The settings.toml of a study; InputError if it cannot be read, or holds something else."""
    try:
        found = Evidence.model_validate(parse_toml(read_text(path), str(path)))
        if not all({"solver.step", "rods.elements"} <= set(s.values) for s in found.settings):
            raise ValueError("a setting without solver.step or rods.elements")
        return found
    except ValueError as error:  # also that of pydantic
        first = error.errors()[0] if isinstance(error, ValidationError) else None
        fault = f"{'.'.join(map(str, first['loc']))}: {first['msg']}" if first else error
        raise InputError(
            f"{path}: not the settings of an accuracy study ({fault}): make it with "
            "ringsim accuracy"
        ) from None


def evidence_for(scene: Scene) -> Evidence:
    """The evidence of the built-in scene with the same kind of structure and drive."""
    if scene.structure.gauge:
        name = "planar-truss"
    elif scene.cables is None:
        name = "ring18"
    else:
        name = "ring18-cable" if scene.structure.closed else "truss2"
    return read_evidence(resources.files("ringsim") / "scenes" / "evidence" / f"{name}.toml")
