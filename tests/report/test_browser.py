"""A browser opens the report, offline: it plays, and nothing complains."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from made_campaign import made_campaign, with_positions

from read_page import Page
from ringsim.analysis.intervals import quantities
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import sections
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.outputs.family import VARIABLES
from ringsim.plots import figures
from ringsim.report.page import page
from ringsim.shapes import COMPUTED, FROM_ANGLES

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
HEAD = """<head><script>
window.faults = [];
window.addEventListener("error", (event) => window.faults.push(String(event.message)));
document.addEventListener("securitypolicyviolation", (e) => window.faults.push(e.blockedURI));
</script>"""
TAIL = """<script>
const seen = {backwards: false};
const canvas = document.getElementById("scene"), told = document.getElementById("told");
const shot = () => canvas.toDataURL();
const choose = (id, value) => {
  const box = document.getElementById(id);
  box.value = value;
  box.dispatchEvent(new Event("change"));
};
const drag = (word, x) => canvas.dispatchEvent(
  new PointerEvent(word, {clientX: x, clientY: 50, pointerId: 1, bubbles: true}));
seen.first = told.textContent;
let before = shot();
canvas.setPointerCapture = () => {};
drag("pointerdown", 50); drag("pointermove", 90); drag("pointerup", 90);
seen.turned = before !== shot();
before = shot();
const diamonds = () => {
  const all = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  const rows = [];
  for (let k = 0; k < all.length; k += 4) {
    const vermilion = all[k] === 213 && all[k + 1] === 94 && all[k + 2] === 0;
    if (vermilion) rows.push(Math.floor(k / 4 / canvas.width));
  }
  return rows.length ? [rows[0] / canvas.height, rows[rows.length - 1] / canvas.height] : [];
};
choose("view", "lag"); seen.viewed = before !== shot(); seen.diamond = diamonds();
choose("view", "ring");
choose("sample", "2"); seen.failed = told.textContent; choose("sample", "0");
const slider = document.getElementById("moment"), play = document.getElementById("play");
slider.value = 0;
slider.dispatchEvent(new Event("input"));
seen.start = told.textContent;
play.click();
seen.button = play.textContent;
const waiting = setInterval(() => {
  // Virtual time runs as fast as timers do, frames come in real time: the picture takes some of it.
  seen.backwards ||= told.textContent.startsWith("-");
  if (!(parseFloat(told.textContent) > 0)) { shot(); return; }
  clearInterval(waiting);
  seen.later = told.textContent;
  play.click();
  seen.stopped = play.textContent;
  seen.wide = document.documentElement.scrollWidth - window.innerWidth;
  seen.resources = performance.getEntriesByType("resource").length;
  seen.faults = window.faults;
  document.body.dataset.seen = JSON.stringify(seen);
}, 20);
</script></body>"""


@pytest.mark.skipif(BROWSER is None, reason="there is no chromium or chrome")
@pytest.mark.parametrize(
    ("width", "computed"), [(1000, False), pytest.param(500, True, marks=pytest.mark.slow)]
)
def test_the_page_plays_offline(
    tmp_path: Path, width: int, computed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not computed:  # all figures stand on the narrow page
        monkeypatch.setattr(figures, "PICTURES", figures.PICTURES[:1])
    campaign = made_campaign(8, failed=(2, 5))
    text = page(with_positions(campaign) if computed else campaign, "runs/made")
    # An encoder at the V-joint upper 2, far ahead of the mean: the view by section takes it in.
    encoder = {"joint": 1, "times": [0.0, 10.0], "angles": [40.0, 200.0]}
    text = text.replace('"measured": []', f'"measured": [{json.dumps(encoder)}]', 1)
    assert '"angles": [40.0' in text
    assert f"Drawn: {COMPUTED if computed else FROM_ANGLES}." in text
    text = text.replace("<head>", HEAD, 1).replace("</body>", TAIL, 1)
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr",
         f"--user-data-dir={tmp_path / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND",
         f"--window-size={width},900", "--virtual-time-budget=6000", "--dump-dom",
         (tmp_path / "page.html").as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    assert "CONSOLE" not in done.stderr
    held = re.search(r'data-seen="([^"]*)"', done.stdout)
    assert held is not None
    seen = json.loads(held[1].replace("&quot;", '"'))
    assert seen["faults"] == []
    assert seen["resources"] == 0
    assert seen["turned"]
    assert seen["viewed"]
    # Ahead of all V-joints, above the middle of the axis; it stays on the sheet.
    assert 0.02 < seen["diamond"][0] < seen["diamond"][1] < 0.4
    assert " s of 10.00 s" in seen["first"]
    assert " s of 4.00 s" in seen["failed"]
    assert (seen["button"], seen["stopped"]) == ("Pause", "Play")
    assert seen["start"].startswith("0.00 s of 10.00 s")
    assert not seen["later"].startswith("0.00 s")
    assert not seen["backwards"]  # a frame may have begun before the click
    assert seen["wide"] <= 0  # only tables and figures scroll sideways, within themselves


PRINT = """<script>
dispatchEvent(new Event("beforeprint"));
document.body.dataset.folded = [...document.querySelectorAll("details:not([open])")]
  .map(each => each.firstElementChild.textContent).join("|");
document.body.dataset.told = document.getElementById("told").textContent;
dispatchEvent(new Event("afterprint"));
document.body.dataset.after = document.getElementById("told").textContent;
</script></body>"""


@pytest.mark.skipif(BROWSER is None, reason="there is no chromium or chrome")
def test_a_print_has_three_moments_for_the_player(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "PICTURES", figures.PICTURES[:1])
    campaign = made_campaign(8)
    campaign["opening_angle"][..., -3:] = np.nan  # the last record is before the last locks
    text = page(campaign, "runs/made").replace("</body>", PRINT, 1)
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         f"--user-data-dir={tmp_path / 'profile'}", (tmp_path / "page.html").as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    told = re.search(r'data-told="([^"]*)"', done.stdout)
    assert told is not None
    folded = re.search(r'data-folded="([^"]*)"', done.stdout)
    assert folded is not None
    assert set(folded[1].split("|")) == {"At length"}  # as the page says
    assert re.match(r"sample \d+: .* at 0\.00 s, .* at \d.* s, 180\.0 deg at 10\.00 s\.$", told[1])
    after = re.search(r'data-after="([^"]*)"', done.stdout)
    assert after is not None
    assert " s of 10.00 s, " in after[1]


@pytest.mark.skipif(BROWSER is None, reason="there is no chromium or chrome")
def test_the_page_is_printed_with_what_it_folds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "PICTURES", figures.PICTURES[:1])
    save(made_campaign(8), tmp_path / "campaign.nc")
    out = tmp_path / "made.html"
    words = ["report", str(tmp_path / "campaign.nc"), "--out", str(out), "--pdf"]
    done = CliRunner().invoke(cli, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    printed = out.with_suffix(".pdf").read_bytes()
    assert printed.startswith(b"%PDF")
    # The answer; failures and inputs; the values; where they are from.  None is begun for a figure.
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) == 4
    assert sorted(each.name for each in tmp_path.iterdir()) == [
        "campaign.nc", "made.html", "made.pdf",
    ]  # fmt: skip


MEASURE = """<script>
const seen = {boxes: {}, cells: [], room: 0, rows: [], drawn: []};
for (const row of document.querySelectorAll("main tbody tr")) {
  const words = Math.max(...[...row.cells].map(cell => cell.textContent.length));
  if (row.closest("#requirements")) seen.verdict = row.cells[1].getBoundingClientRect().right;
  else if (words < 30) seen.rows.push(row.offsetHeight);
}
const figure = document.querySelector("figure");
for (const _ of figure ? [1, 2, 3] : []) {  // as it is, enlarged, and as it was
  seen.drawn.push(figure.firstElementChild.getBoundingClientRect().width);
  figure.click();
}
for (const box of document.querySelectorAll(".wide")) {
  const name = box.querySelector("table").id;
  seen.boxes[name] = box.scrollWidth - box.clientWidth;
  seen.room = Math.max(seen.room, box.clientWidth);
}
for (const cell of document.querySelectorAll("#failures td")) {
  if (cell.textContent.length > 60) seen.cells.push(cell.clientWidth);
}
seen.wide = document.documentElement.scrollWidth - window.innerWidth;
document.body.dataset.seen = JSON.stringify(seen);
</script></body>"""


@pytest.mark.skipif(BROWSER is None, reason="there is no chromium or chrome")
@pytest.mark.parametrize("width", [1400, 500])
def test_tables_are_whole_on_a_wide_page_and_scroll_in_their_box_on_a_narrow_one(
    tmp_path: Path, width: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = [each for each in figures.PICTURES if each.name == "lock_order"]
    monkeypatch.setattr(figures, "PICTURES", drawn)
    campaign = made_campaign(24, failed=(2, 5))
    campaign["reason"] = campaign["reason"].astype(object)
    campaign["reason"][2] = "the step fell below its bound at 4 s: " + "set a smaller one, " * 5
    text = page(campaign, "runs/made").replace("</body>", MEASURE, 1)
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         f"--window-size={width},900", f"--user-data-dir={tmp_path / 'profile'}",
         (tmp_path / "page.html").as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    held = re.search(r'data-seen="([^"]*)"', done.stdout)
    assert held is not None
    seen = json.loads(held[1].replace("&quot;", '"'))
    assert seen["wide"] <= 0
    assert (seen["boxes"]["statistics-table"] <= 0) == (width == 1400)
    assert width == 500 or seen["room"] >= 1200  # px: numbers with error bars take 1100
    assert min(seen["cells"]) >= 200  # px: some words a line
    # On a narrow page no row is high for words that are off the screen, and figures fit it.
    assert width == 1400 or max(seen["rows"]) <= 30
    assert seen["verdict"] <= min(width, 420)  # with all of its words
    first, large, again = seen["drawn"]
    assert first == again < width
    assert (large >= 640) == (width == 500 or first >= 640)


@pytest.mark.skipif(BROWSER is None, reason="there is no chromium or chrome")
def test_a_table_of_many_columns_is_parted_and_says_where_there_is_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Single changes with 18 outputs: on 1200 px, and by its widest part on the width of paper."""
    monkeypatch.setattr(figures, "PICTURES", [])
    campaign = made_campaign(6, stalled=(3,))
    campaign.attrs["design"] = '{"kind": "one-at-a-time"}'
    names = [n for n, v in VARIABLES.items() if v.summary and v.dtype == "f8" and n in quantities()]
    for k, name in enumerate(n for n in names if n not in campaign):
        told = {"units": VARIABLES[name].units, "long_name": name}
        campaign[name] = "sample", 1.23456 * 10.0**-k * (1.0 + np.arange(6)), told
    text = page(campaign, "runs/made").replace("</body>", MEASURE, 1)
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         "--window-size=1200,900", f"--user-data-dir={tmp_path / 'profile'}",
         (tmp_path / "page.html").as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    held = re.search(r'data-seen="([^"]*)"', done.stdout)
    assert held is not None
    boxes = json.loads(held[1].replace("&quot;", '"'))["boxes"]
    parts = {name: more for name, more in boxes.items() if name.startswith("matters-table")}
    assert len(parts) >= 2
    assert max(parts.values()) <= 0
    cells = Page(text).cells
    (case,) = sections(analyse(campaign), "runs/made")["matters"].tables
    assert len(case.head) > 12
    assert cells.count(case.head[1]) == len(parts)
    for row in case.rows:
        assert set(row) <= set(cells)


def test_without_a_browser_nothing_is_begun(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save(made_campaign(2), tmp_path / "campaign.nc")
    monkeypatch.setenv("PATH", str(tmp_path))
    out = tmp_path / "made.html"
    words = ["report", str(tmp_path / "campaign.nc"), "--out", str(out), "--pdf"]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 2
    assert "needs a browser" in done.output
    assert not out.exists()
