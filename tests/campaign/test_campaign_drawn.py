"""Figures and the report of campaigns that the command line ran."""

from __future__ import annotations

import xarray as xr

from ringsim.analysis.design import endings

FATED = "fake_solver:fated"
"""Deploys, stalls or fails, by the force that was drawn."""


def test_a_finished_campaign_is_drawn_and_reported(bench):
    file = bench.write(12)
    file.write_text(file.read_text().replace("high = 0.05", "high = 0.013"))
    call = ("campaign", file, "--workers", 0, "--out", "out", "--plot", "--plot-format", "svg")
    half = bench.run(*call, "--part", "1/2", solver=FATED)
    assert "fig" not in half  # half of the samples are left
    told = bench.run(*call, solver=FATED)
    names = {path.name for path in (bench.folder / "out").glob("*.svg")}
    assert names == {
        f"campaign-fig-{name}.svg"
        for name in ("distributions", "fan", "lag_map", "lock_order", "by_input", "convergence")
    }
    assert all(f"wrote out/{name}" in told for name in names)
    bench.run("report", "out", "--out", "page.html")
    page = (bench.folder / "page.html").read_text()
    with xr.open_dataset(bench.folder / "out" / "campaign.nc") as campaign:
        words = endings(campaign).tolist()
    assert set(words) == {"deployed", "stalled", "failed: solver failed"}
    # What ended alike shares a row, with the command that repeats the first of them.
    for word in set(words):
        own = [str(sample) for sample, each in enumerate(words) if each == word]
        named = "sample " if len(own) == 1 else "samples "
        told = f"<td>{named}{', '.join(own)}</td><td>{word}</td>" in page
        repeated = f"<code>ringsim replay out {own[0]}</code>" in page
        # What stalled is told with the worst samples, and not twice.
        assert (told, repeated) == (word.startswith("failed"), word != "deployed")


def test_formats_without_figures_are_refused(bench):
    told = bench.run("campaign", bench.write(2), "--plot-format", "svg", code=2)
    assert told.strip() == "--plot-format svg: has no effect without --plot; give both"
