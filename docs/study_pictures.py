"""Draws the pictures of docs/evidence/studies whose campaigns are there.

    python docs/study_pictures.py runs

Those of ``OF_ONE`` are figures of one campaign.  Of others: ``winding_laws.png`` from
runs/winding-laws, ``sections.png`` from runs/sections-N;
``stalling_motor.png`` from runs/stalling-motor and runs/stalling-motor-ground: the margin of the
rigid ring without a standard's factors, against what the flexible one did, and ground over flight;
``rare_asynchrony.png`` from runs/rare-asynchrony and runs/plain, of which it prints the table, too.
"""

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from pictures import save
from scipy.interpolate import CubicSpline

from ringsim.analysis.design import endings
from ringsim.analysis.intervals import good, share_interval
from ringsim.analysis.tails import replicated_interval, subset_simulation
from ringsim.parts.margin import EcssMechanisms, MarginStandard
from ringsim.plots import style
from ringsim.plots.campaign.frame import LOOKS
from ringsim.plots.figures import figures_of
from ringsim.rigid.margin import DriveMargin, Margin
from ringsim.sampling.designs.levels import Repetition, levels
from ringsim.scene import scene_from_toml
from ringsim.variables import PLANES

NEVER = 66.0
"""Where rings stand that are not deployed at the end, s."""
COUNTS = (6, 9, 12, 18, 27, 36)
NUMBERS = {
    "asynchrony_max": "Largest asynchrony (deg)",
    "deployment_time": "Deployment time (s)",
    "peak_tension": "Largest tension (N)",
}


@style.styled
def sections(runs: Path) -> Figure:
    """A panel a number: all samples over the number of sections."""
    figure = Figure(figsize=(10.2, 3.4))
    panels = figure.subplots(1, len(NUMBERS))
    means: dict[str, list[float]] = {name: [] for name in NUMBERS}
    for count in COUNTS:
        with xr.open_dataset(runs / f"sections-{count}" / "campaign.nc") as campaign:
            for axes, name in zip(panels, NUMBERS, strict=True):
                values = campaign[name].to_numpy()
                axes.plot([count] * len(values), values, "o", color=style.BLUE, markersize=3.5)
                means[name].append(float(values.mean()))
    for axes, (name, words) in zip(panels, NUMBERS.items(), strict=True):
        axes.plot(COUNTS, means[name], color=style.BLUE, linewidth=1.0)
        axes.set(xlabel="Sections", ylabel=words, ylim=(0.0, None), xlim=(0, 38), xticks=COUNTS)
    return figure


LAWS = (
    "constant speed", "ramp of 0.2 s", "ramp of 1 s", "ramp of 5 s", "table, slow start",
    "tension feedback, 5 N", "stall at 10 N",
)  # fmt: skip
"""As the campaign lists them."""


@style.styled
def winding_laws(runs: Path) -> Figure:
    """Largest tension and slack of every law, a marker a friction of the joints."""
    with xr.open_dataset(runs / "winding-laws" / "campaign.nc") as campaign:
        grid = {
            "Largest tension (N)": campaign["peak_tension"].to_numpy(),
            "Slack at the winch, worse cable (s)": campaign["slack_duration"].max("plane"),
            "Largest asynchrony (deg)": campaign["asynchrony_max"].to_numpy(),
        }
        joints = campaign["joints_vjoint_viscous"].to_numpy().reshape(-1, len(LAWS))[:, 0]
    figure = Figure(figsize=(10.4, 3.9))
    panels = figure.subplots(1, len(grid), sharey=True)
    looks = ((style.BLUE, "o"), (style.ORANGE, "s"), (style.VERMILION, "^"))
    for axes, (words, values) in zip(panels, grid.items(), strict=True):
        rows = np.asarray(values).reshape(-1, len(LAWS))
        for row, friction, (colour, marker) in zip(rows, joints, looks, strict=True):
            axes.plot(row, range(len(LAWS)), marker, color=colour, markersize=6, alpha=0.85,
                      label=f"joints of {friction:g} N m s/rad")  # fmt: skip
        axes.set_xlabel(words)
    panels[0].set_xscale("log")
    style.plain_numbers(panels[0].xaxis)
    panels[0].set_yticks(range(len(LAWS)), LAWS)
    panels[0].set_ylim(len(LAWS) - 0.5, -0.5)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


PLAIN = EcssMechanisms(
    inertia=1.0, spring=1.0, friction=1.0, gravity=1.0, load=1.0, latch=1.0, driving_spring=1.0,
    motorisation=1.0,
)  # fmt: skip
"""What drives over what resists, less one, without factors."""


def static_margins(campaign: xr.Dataset, standard: MarginStandard = PLAIN) -> np.ndarray:
    """Of the rigid ring of every sample at its start; negative: it cannot open.

    What a cable drives is smooth in the friction of its pulleys and linear in its motor's torque,
    what joints resist in their friction; so a few rings tell of all.
    """
    scene = scene_from_toml(campaign.attrs["scene"], source="attribute scene")
    friction = [f"cables.{plane}.friction.coefficient" for plane in PLANES]
    torque = [f"cables.{plane}.winch.winding.derating" for plane in PLANES]

    def at_start(values: dict[str, float]) -> Margin:
        drive = DriveMargin(scene.with_values(values), standard)
        return drive.at(drive.start)

    own = campaign["cables_upper_friction_coefficient"].to_numpy()
    grid = np.linspace(own.min(), own.max(), 9)
    whole = [at_start(dict.fromkeys(friction, f) | dict.fromkeys(torque, 1.0)) for f in grid]
    cables = CubicSpline(grid, [each.pulls[1] for each in whole])(own)
    left = np.stack([campaign[path.replace(".", "_")].to_numpy() for path in torque], axis=1)
    dry = campaign["joints_vjoint_coulomb"].to_numpy()
    ends = [at_start({"joints.vjoint.coulomb": each}) for each in (dry.min(), dry.max())]
    required, springs = (
        np.interp(dry, [dry.min(), dry.max()], values)
        for values in zip(
            *((each.required, each.counted - each.pulls[1].sum()) for each in ends), strict=True
        )
    )
    return (np.sum(left * cables, axis=1) + springs) / required - 1.0


@style.styled
def stalling_motor(runs: Path) -> Figure:
    """Flight and ground: deployment time over the static margin; samples that never deploy at the
    top.  Then the pairs: time on the ground over that in flight, at the edges what did not deploy.
    """
    figure = Figure(figsize=(11.0, 4.2))
    panels = figure.subplots(1, 3, width_ratios=(3, 3, 3))
    found = []
    for axes, name in zip(panels, ("stalling-motor", "stalling-motor-ground"), strict=False):
        with xr.open_dataset(runs / name / "campaign.nc") as campaign:
            margins, words = static_margins(campaign), endings(campaign)
            times = campaign["deployment_time"].to_numpy()
        found.append(times)
        for word in sorted(set(words.tolist())):
            own = words == word
            colour, marker = LOOKS[word]
            axes.plot(margins[own], np.nan_to_num(times[own], nan=NEVER), marker, color=colour,
                      markersize=4.5, alpha=0.8, label=word)  # fmt: skip
        axes.axvline(0.0, color=style.VERMILION, linewidth=1.0, linestyle=(0, (4, 3)))
        axes.set_xlabel("Margin of the rigid ring, no factors")
        axes.set_title("On the ground" if "ground" in name else "In flight", fontsize=10)
    panels[0].set_ylabel("Deployment time (s); at the top: none")
    count = min(map(len, found))
    flight, ground = (np.nan_to_num(times[:count], nan=NEVER) for times in found)
    panels[2].plot(flight, ground, "o", color=style.INK, markersize=4.0, alpha=0.6)
    panels[2].axline((30.0, 30.0), slope=1.0, color=style.GREY, linewidth=0.8)
    panels[2].set(xlabel="In flight (s); at the edge: never", ylabel="On the ground (s)",
                  title="Pairs")  # fmt: skip
    panels[2].title.set_fontsize(10)
    handles = {
        label: handle for axes in panels[:2]
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }  # fmt: skip
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4)
    return figure


def repetitions(campaign: xr.Dataset, limit: float) -> list[Repetition]:
    """What each replicate of a campaign of subset simulation tells of a lower limit: the same runs
    come first, whatever the limit.
    """
    design = subset_simulation(campaign.attrs)
    assert design is not None
    known = design.responses(campaign[design.of].to_numpy(), ~good(campaign))
    of = design.levels(known).replicate[: len(known)]
    return [
        levels(known[of == k], design.samples, design.share, 1, limit, design.most_levels)
        .repetitions[0]
        for k in range(design.replicates)
    ]  # fmt: skip


def fitted(plain: xr.Dataset, limits: np.ndarray, most: int = 60) -> np.ndarray:
    """Probabilities of the asynchrony above limits by a fit to the plain samples: the larger of two
    functions of the friction of one cable's pulleys and of the other's, the same with both changed
    over, and linear; with normal scatter as large as what it leaves.
    """
    upper, lower = (
        plain[f"cables_{plane}_friction_coefficient"].to_numpy() / 4e-4 for plane in PLANES
    )
    values, rods = (
        plain["asynchrony_max"].to_numpy(),
        plain["rods_young_modulus"].to_numpy() / 12e10,
    )

    def columns(own: np.ndarray, other: np.ndarray, rods: np.ndarray) -> np.ndarray:
        return np.column_stack([np.ones(len(own)), own, other, rods])

    first = upper.sum(axis=1) > lower.sum(axis=1)
    for _ in range(20):
        own = np.where(first[:, None], columns(upper, lower, rods), columns(lower, upper, rods))
        factors = np.linalg.lstsq(own, values, rcond=None)[0]
        both = columns(upper, lower, rods) @ factors, columns(lower, upper, rods) @ factors
        first = both[0] > both[1]
    left = values - np.maximum(*both)
    print(f"fit: {1.0 - left.var() / values.var():.4f} of the variance, {left.std():.3f} deg left")
    rng, found, width = np.random.default_rng(0), np.zeros(len(limits)), np.log1p(0.25) ** 0.5
    for _ in range(most):
        upper, lower = np.exp(width * rng.standard_normal((2, 100_000, 8)) - width**2 / 2)
        rods = 1.0 + 0.05 * rng.standard_normal(100_000)
        own = np.maximum(
            columns(upper, lower, rods) @ factors, columns(lower, upper, rods) @ factors
        )
        own += left.std() * rng.standard_normal(len(own))
        found += (own[:, None] > limits).mean(axis=0) / most
    return found


def exceeded(values: np.ndarray, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Places where the number of values above changes, in order and up to a last one, and how many
    are above each: none from the largest value on.
    """
    places = np.append(np.sort(values), until)
    return places, (values > places[:, None]).sum(axis=1)


@style.styled
def rare_asynchrony(runs: Path) -> Figure:
    """Probability to be above a limit: plain samples with their exact band, a fit to them, and the
    replicates of subset simulation.
    """
    with xr.open_dataset(runs / "plain" / "campaign.nc") as file:
        plain = file.isel(sample=good(file)).load()  # a campaign that was ended early has gaps
    values = plain["asynchrony_max"].to_numpy()
    limits = np.array([3.2, 3.6, 3.9, 4.2, 4.6, 5.0, 5.3])
    figure = Figure(figsize=(8.0, 4.6))
    axes = figure.subplots()
    places, above = exceeded(values, 5.6)
    band = np.array([share_interval(count, len(values)) for count in above.tolist()])
    axes.fill_between(places, *band.T, step="post", color=style.BLUE, alpha=0.2, linewidth=0.0,
                      label=f"{len(values)} plain samples, 95 %, exact")  # fmt: skip
    axes.step(places, above / len(values), where="post", color=style.BLUE, linewidth=1.2)
    grid = np.linspace(2.5, 5.6, 32)
    fit = fitted(plain, np.append(grid, limits))
    axes.plot(grid, fit[: len(grid)], color=style.INK, linewidth=1.0, linestyle=(0, (4, 3)),
              label="fit to the plain samples")  # fmt: skip
    with xr.open_dataset(runs / "rare-asynchrony" / "campaign.nc") as file:
        rare = file.load()
    for number, one in enumerate(repetitions(rare, float(limits[-1]))):
        axes.plot(grid, [one.beyond(x)[0] for x in grid], color=style.VERMILION, linewidth=0.9,
                  label="" if number else "subset simulation, a line a replicate")  # fmt: skip
    for limit, fits in zip(limits.tolist(), fit[len(grid) :], strict=True):
        found = repetitions(rare, limit)
        each = np.array([one.probability for one in found])
        (low, high), _ = replicated_interval(each, np.array([one.variation for one in found]))
        count = int((values > limit).sum())
        exact = share_interval(count, len(values))
        print(
            f"| {limit:g} | {count} | {count / len(values):.2g} | {exact[0]:.2g} .. {exact[1]:.2g} "
            f"| {each.mean():.2g} | {low:.2g} .. {high:.2g} | {fits:.2g} | {each}"
        )
        label = "" if limit > limits[0] else "mean of the replicates, 95 %"
        axes.errorbar(limit, each.mean(), [[each.mean() - low], [high - each.mean()]], capsize=3,
                      color=style.VERMILION, marker="s", markersize=4, linestyle="none",
                      elinewidth=1.0, label=label)  # fmt: skip
    axes.set(yscale="log", xlabel="Largest asynchrony (deg)", ylabel="Probability of more")
    axes.set(xlim=(2.5, 5.6), ylim=(1e-6, 1.0))
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


OF_ONE = {
    "bad_bearing": ("bad-bearing", "one_by_one"),
    "second_motor": ("second-motor", "one_by_one"),
    "length_scatter": ("length-errors", "distributions"),
    "friction_scatter_fan": ("nonsync-friction", "fan"),
    "friction_scatter_matters": ("nonsync-friction", "tornado"),
    "stalling_motor_margin": ("stalling-motor", "margin"),
}
"""By picture its campaign and which of that one's figures it is."""
OF_MANY = {
    winding_laws: ["winding-laws"], sections: [f"sections-{n}" for n in COUNTS],
    stalling_motor: ["stalling-motor", "stalling-motor-ground"],
    rare_asynchrony: ["rare-asynchrony", "plain"],
}  # fmt: skip


def main() -> None:
    """Draw all of them for which there are runs."""
    runs = Path(sys.argv[1])
    for name, (campaign, figure) in OF_ONE.items():
        if (file := runs / campaign / "campaign.nc").exists():
            with xr.open_dataset(file) as found:
                for _, drawn in figures_of(found, figure):
                    save(drawn, f"{name}.png")
    for draw, needs in OF_MANY.items():
        if all((runs / campaign / "campaign.nc").exists() for campaign in needs):
            save(draw(runs), f"{draw.__name__}.png")


if __name__ == "__main__":
    main()
