"""What every dataset of ringsim can be asked as ``dataset.ring``.

``ringsim.simulate`` and other words that give datasets bring it along; so does
``xarray.open_dataset``, which loads the entry points of all packages (``Opening``).
"""

import contextlib
import functools
import html
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import xarray as xr
from xarray.backends import BackendEntrypoint

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from ringsim.measured import Measurement


class Figures(dict[str, "Figure"]):
    """Figures by name; a notebook shows them below each other."""

    def __repr__(self) -> str:
        """Their names, and what to do with one."""
        if not self:
            return "no figures: nothing that they show is recorded"
        return f'figures: {", ".join(self)}: figures["NAME"].savefig("NAME.png")'

    def _repr_html_(self) -> str:
        from ringsim.plots.figures import Inline

        drawn = (
            f"<p>{name}</p>{Inline(figure, name, name).element()}" for name, figure in self.items()
        )
        return f'<div style="background: white">{"".join(drawn)}</div>'


class Opening(BackendEntrypoint):
    """No reader of its own: xarray loads it before it opens a file, and with it ``.ring``, also
    where ringsim was imported first or not at all.

    ``engine="ringsim"`` reads as ``engine="netcdf4"`` does.
    """

    description = "Results of ringsim, by netCDF4"

    def open_dataset(
        self, filename_or_obj: Any, *, drop_variables: str | Iterable[str] | None = None
    ) -> xr.Dataset:
        """What netCDF4 reads."""
        return xr.open_dataset(filename_or_obj, engine="netcdf4", drop_variables=drop_variables)

    def guess_can_open(self, filename_or_obj: Any) -> bool:
        """False: where nobody asks for it, xarray chooses among its own."""
        return False


@xr.register_dataset_accessor("ring")  # type: ignore[no-untyped-call]
class Ring:
    """Questions to a run or a campaign: ``dataset.ring.outcomes()`` and others.

    Imports stand in the methods: to have it costs nothing.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    def __repr__(self) -> str:
        """What it is of, and what it can be asked."""
        kind = "campaign" if "sample" in self._dataset.dims else "run"
        asked = [f"{n}()" for n, word in vars(Ring).items() if n[0] != "_" and callable(word)]
        return f"ring of a {kind}: ask {', '.join(asked)}"

    def _repr_html_(self) -> str:
        """The same with what each question is answered by."""
        rows = [
            f"<tr><td><code>.ring.{name}()</code></td>"
            f"<td>{html.escape((word.__doc__ or '').split(chr(10))[0])}</td></tr>"
            for name, word in vars(Ring).items()
            if name[0] != "_" and callable(word)
        ]
        return f"<p>{html.escape(repr(self).split(':')[0])}</p><table>{''.join(rows)}</table>"

    @overload
    def plot(self, name: str) -> "Figure": ...
    @overload
    def plot(self, name: None = None) -> Figures: ...
    def plot(self, name: str | None = None) -> "Figure | Figures":
        """The figure of that name, or all that apply, by name; as ``ringsim plot`` writes them.

        They are matplotlib's: ``savefig`` writes one, and a notebook shows it.

        InputError if there is no such figure, or its numbers are not recorded.
        """
        from ringsim.plots import figures
        from ringsim.refusal import InputError, known_or_nearest

        dataset = self._whole()
        if name is not None and name not in (known := figures.names_for(dataset)):
            hint = known_or_nearest(name, known)
            raise InputError(f"plot({name!r}): this dataset has no such figure ({hint})")
        drawn = Figures()
        for each, figure in figures.figures_of(dataset, name):
            # A notebook shows it so also where pyplot has not told it how.
            vars(figure)["_repr_png_"] = functools.partial(figures.as_png, figure)
            drawn[each.name] = figure
        return drawn if name is None else drawn[name]

    def residuals(self, measured: str | Path) -> xr.Dataset:
        """Measured data less this run, or the median of these samples, by ``sensor``, of the TOML
        file that describes them, as ``ringsim compare RUN FILE`` lists them: in the units of each
        variable, and over the standard deviation of a reading.

        InputError if the file is refused, or the run lacks what a sensor measures.
        """
        from ringsim.analysis.residuals import residual_statistics, residuals
        from ringsim.measured import load_measured

        return residual_statistics(residuals(self._known(), load_measured(measured)))

    def leader(self) -> xr.Dataset:
        """Which V-joint is most open and which least.

        Of a run over time: ``leader`` and ``laggard`` as words ("upper 3"), and how far they are
        apart (degree).  Of a campaign ``leads`` and ``lags``, (plane, section): in how many of the
        samples whose numbers hold the joint was the one when they were farthest apart.

        InputError if opening angles are not there.
        """
        from ringsim.analysis import influence

        found = influence.often if "sample" in self._dataset.dims else influence.over_time
        return found(self._whole()).assign_attrs(self._losses())

    def outcomes(self) -> "pd.DataFrame":
        """What became of the samples of a campaign: a row for each kind of outcome and of loss.

        ``samples`` are of the kind, ``of`` all that ran, of which ``lost`` ones may be, too;
        ``share`` with its exact interval of 95 %, ``lower`` and ``upper``, from none to all of
        these, as the design allows it, else NaN; see ``ringsim.analyse``.  Where which runs are
        lost goes with inputs, ``attrs`` say so as ``lost_runs``.

        InputError if it is no campaign.
        """
        from ringsim.analysis.design import placement
        from ringsim.analysis.study import outcomes

        self._require_samples("outcomes")
        dataset = self._known()
        found = outcomes(dataset, placement(dataset))
        columns = ("samples", "of", "lost", "share")
        known = found[[f"outcome_{name}" for name in columns]]
        rows = known.to_dataframe().set_axis(columns, axis=1)
        rows[["lower", "upper"]] = found["outcome_share_interval"].to_numpy()
        rows.attrs |= self._losses()
        return rows

    def tables(self, *, full: bool = False) -> "dict[str, pd.DataFrame]":
        """What ``ringsim analyse`` and the report tell of a campaign, or of an analysis of it: the
        same tables, cells as text, by their titles or else the heads of their first columns; what
        stands below them is ``notes`` among their ``attrs``.

        So "output" has a row an output, and where there are such "output, reweighted" those for
        other distributions.  ``full`` has every statistic with its interval, as "every statistic",
        and every measure of what matters.  Of tables that are called alike the second one is
        "NAME (2)".
        InputError if it is no campaign, or its requirements cannot be judged.
        """
        import pandas as pd

        from ringsim.analysis.study import analyse
        from ringsim.analysis.study_text import sections
        from ringsim.dataset import with_plain_attributes

        own = with_plain_attributes(self._whole())
        analysis = own if "statistic" in own.dims else analyse(own)
        found, times = dict[str, pd.DataFrame](), Counter[str]()
        for each in sections(analysis, self._folder(), full=full).values():
            for table in each.more or each.tables:
                if table.rows:
                    rows = pd.DataFrame(table.rows, columns=table.head)
                    rows.attrs["notes"] = list(table.notes)
                    name = table.title or table.head[0]
                    times[name] += 1
                    found[name if times[name] == 1 else f"{name} ({times[name]})"] = rows
        return found

    def dossier(self, test: "Measurement | None" = None) -> "dict[str, pd.DataFrame]":
        """What ``ringsim dossier`` tells of a campaign, by standard: a row a clause, with what it
        asks, whether it is analysed, the result and its evidence; how the standard is known is
        ``notes`` among the ``attrs``.  Readings of a ``test`` (``ringsim.measured``) stand beside
        the samples.

        InputError if it is no campaign, or its requirements cannot be judged.
        """
        import pandas as pd

        from ringsim.report.dossier import dossier

        self._require_samples("a dossier")
        found = {}
        for table in dossier(self._whole(), test=test):
            found[table.title] = pd.DataFrame(table.rows, columns=table.head)
            found[table.title].attrs["notes"] = list(table.notes)
        return found

    def worst(self) -> "pd.DataFrame":
        """The worst samples of each failure of a campaign, the worst first: of requirements of its
        file that are violated, of outcomes that fall short, of runs that were lost.

        ``failure`` in words, ``failed`` samples ``of`` so many, then ``sample``, what was
        ``found``, what is unusual in its ``inputs``, and the command that runs it again,
        ``replay``, in the folder that the dataset was opened from, by default runs/NAME; empty
        without failures.

        InputError if it is no campaign, or its requirements cannot be judged.
        """
        import pandas as pd

        from ringsim.analysis.design import placement, population_of
        from ringsim.analysis.influence import influence
        from ringsim.analysis.requirements import required_by
        from ringsim.analysis.worst import COLUMNS, command, worst

        self._require_samples("worst samples")
        dataset = self._whole()
        stand, wanted = population_of(dataset), required_by(dataset.attrs)
        found = worst(stand, wanted, influence(stand, wanted, placement(dataset)))
        columns: dict[str, Any] = {
            name: found[f"worst_{name}"].to_numpy() if found else [] for name in COLUMNS
        }
        again = [command(self._folder(), sample) for sample in columns["sample"]]
        return pd.DataFrame(columns | {"replay": again})

    def _known(self) -> xr.Dataset:
        """The dataset, samples by their numbers; its own outputs mean what they mean in it, though
        another campaign is open that has others.
        """
        from ringsim.analysis.derived import known_from
        from ringsim.dataset import in_order
        from ringsim.refusal import InputError

        with contextlib.suppress(InputError):  # told by what needs a module that is not there
            known_from(self._dataset.attrs)
        return in_order(self._dataset)

    def _whole(self) -> xr.Dataset:
        """The same with all planes, sections and others of its scene; InputError if some are not
        there.
        """
        from ringsim.dataset import as_in_scene

        return as_in_scene(self._known())

    def _folder(self) -> str:
        """The folder that the dataset was opened from, by default runs/NAME."""
        source = str(self._dataset.encoding.get("source", ""))
        name = self._dataset.attrs.get("campaign_name", "")
        return str(Path(source).parent) if source else f"runs/{name}"

    def fan(self, quantiles: tuple[float, ...] = (0.0, 0.05, 0.5, 0.95, 1.0)) -> xr.DataArray:
        """Quantiles over the samples of each V-joint's deviation from the mean opening angle.

        Along (quantile, plane, section, time), degree, of one time each: where samples lag in turn
        their median is nearly zero, which no sample has; figures show a sample.  After its end a
        run that deployed counts as in step, any other with the deviation of its last record.

        InputError if it is no campaign, or no sample has recorded opening angles.
        """
        from ringsim.analysis.courses import courses
        from ringsim.refusal import InputError

        self._require_samples("a fan")
        dataset = self._whole()
        if "opening_angle" not in dataset:
            raise InputError("a fan needs opening_angle, which this campaign has left out")
        found = courses(dataset, quantiles)
        if not len(found.samples):
            raise InputError("a fan needs a sample that has run, and none has")
        return found.bands.assign_attrs(self._losses())

    def _losses(self) -> dict[str, str]:
        """The attributes that mark what lost runs bend or may be off; none for a run."""
        from ringsim.analysis.campaign_notes import attributes

        dataset = self._known()
        campaign = "sample" in dataset.dims and "status" in dataset
        return {k: v for k, v in attributes(dataset).items() if v} if campaign else {}

    def _require_samples(self, what: str) -> None:
        from ringsim.refusal import InputError

        if "sample" not in self._dataset.dims or "status" not in self._dataset:
            raise InputError(
                f"{what}: only a campaign has them, and this holds no samples: open one with "
                "ringsim.open_campaign"
            )
