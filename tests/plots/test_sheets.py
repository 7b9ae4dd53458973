"""Words of figures are never cut, and are those that a reader needs beside an axis."""

from __future__ import annotations

import base64
import io
import json

import numpy as np
import pytest
import xarray as xr
from made_campaign import made_campaign
from matplotlib.figure import Figure
from PIL import Image
from sheets import cut_words

from ringsim.analysis.intervals import is_moment, quantities
from ringsim.outputs.base import DOUBT
from ringsim.plots import style
from ringsim.plots.campaign.numbers import convergence, distributions
from ringsim.plots.campaign.tornado import tornado
from ringsim.plots.figures import Inline
from ringsim.plots.run import energy


def told_at_length(count: int) -> xr.Dataset:
    """A campaign of the outputs with the longest labels, of each of which something is required."""
    every = [each for each in quantities().values() if each.dtype == "f8"]
    every = [each for each in every if not is_moment(each.name)]
    every.sort(key=lambda each: -len(style.meaning(each.long_name)))
    campaign = made_campaign(16)
    for k, each in enumerate(every[:count]):
        values = np.arange(16.0) * (1 + k % 3) + 100 * k
        about = {"units": each.units, "long_name": each.long_name}
        campaign[each.name] = "sample", values, about
    least = {"min": -1234.5, "max": 1234.5, "probability": 0.9, "confidence": 0.9}
    wanted = json.dumps({each.name: least for each in every[:count]})
    return campaign.assign_attrs(requirements=wanted)


@pytest.mark.usefixtures("settled")
@pytest.mark.parametrize("draw", [distributions, convergence, tornado])
def test_no_words_of_a_campaign_are_cut(draw) -> None:
    assert cut_words(draw(told_at_length(9))) == []


@pytest.mark.usefixtures("settled")
def test_words_stay_on_the_sheet_where_names_of_inputs_leave_panels_narrow() -> None:
    """At each resolution, whose letters have other widths, and with the mark behind titles."""
    random, names = np.random.default_rng(0), ("least_latch_rate", "peak_base_torque")
    campaign, held = made_campaign(60), random.random(60)
    campaign["rods_young_modulus"][:] = held
    says = campaign["rods_young_modulus"].attrs
    says["path"] = "difference of cables.upper/lower.winch.winding.speed"
    for name in names:
        about = {"units": quantities()[name].units, "long_name": quantities()[name].long_name}
        campaign[name] = "sample", held + 0.1 * random.random(60), about
    reason = f"done; steps of 3 ms are too long for shocks, so {', '.join(names)} may be off: x"
    campaign["reason"] = "sample", np.array([reason] * 60, dtype=object)
    campaign.attrs["requirements"] = "{}"
    figure = tornado(campaign)
    titles = [" ".join(axes.get_title("left").split()) for axes in figure.axes]
    assert "Largest torque at the base at any step ?" in titles
    for dpi in (72, 85, 100, 110, 150, 200):
        figure.set_dpi(dpi)
        assert cut_words(figure) == [], dpi


@pytest.mark.usefixtures("settled")
def test_the_names_of_energies_beside_each_other_stay_on_the_sheet(deployed: xr.Dataset) -> None:
    figure = energy(deployed)
    for dpi in (72, 100, 110, 150):
        figure.set_dpi(dpi)
        assert cut_words(figure) == [], dpi


@pytest.mark.usefixtures("settled")
def test_a_figure_of_a_page_has_the_layout_of_its_own_resolution() -> None:
    """Not that of the figure's, whose letters are of other widths: words ended beyond the sheet."""
    drawn = style.styled(Figure)(figsize=(6.0, 2.0))
    drawn.subplots().set_yticks([0.0], ["cables.upper/lower.winch.winding.speed" * 2], fontsize=8)
    engine, pad = drawn.get_layout_engine(), drawn.get_layout_engine().get()["w_pad"]
    shown = Inline(drawn, "one", "words").element(0)
    data = base64.b64decode(shown.partition("base64,")[2].partition('"')[0])
    ink = np.asarray(Image.open(io.BytesIO(data)).convert("L")) < 200
    first = float(np.flatnonzero(ink.any(axis=0))[0])
    assert first / ink.shape[1] * 6.0 == pytest.approx(pad, abs=0.02)
    assert drawn.get_layout_engine() is engine


@pytest.mark.quick
def test_labels_end_before_what_is_told_of_missing_values() -> None:
    words = "largest opening rate at a latch; missing if none did"
    rate = xr.DataArray(0.5, attrs={"long_name": words, "units": "rad/s"})
    assert style.label(rate) == "Largest opening rate at a latch (rad/s)"
    assert (
        style.label(rate, width=24, behind=", a") == "Largest opening rate at\na latch (rad/s), a"
    )


@pytest.mark.quick
def test_a_number_and_its_unit_are_one_word_of_a_label() -> None:
    time = xr.DataArray(0.0, attrs={"long_name": "time at which it had 180 deg", "units": "s"})
    assert style.label(time, "1", width=25) == "Time at which it had\n180 deg"


@pytest.mark.quick
def test_panels_of_outputs_that_may_be_off_are_marked_by_the_words_that_they_have() -> None:
    campaign = made_campaign(16)
    about = quantities()["peak_latch_rate"]
    assert ";" in about.long_name
    campaign["peak_latch_rate"] = (
        "sample", 0.2 + 0.01 * np.arange(16.0),
        {"units": about.units, "long_name": about.long_name},
    )  # fmt: skip
    reason = "done; steps of 3 ms are too long for shocks in rods, so peak_latch_rate may be off: x"
    campaign["reason"] = "sample", np.array([reason] * 16, dtype=object)
    labels = [" ".join(axes.get_xlabel().split()) for axes in distributions(campaign).axes]
    (own,) = (label for label in labels if label.startswith("Largest opening rate"))
    assert "missing" not in own
    assert own.endswith(DOUBT)
