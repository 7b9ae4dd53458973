"""Pictures of the documentation: what some are drawn from, and where they stand."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pages import ROOT


def test_no_sample_is_left_out_above_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from study_pictures import exceeded

    values = np.random.default_rng(2).exponential(1.0, 40).round(1)
    places, above = exceeded(values, 9.0)
    assert places.tolist() == [*sorted(values.tolist()), 9.0]
    for limit in np.linspace(values.min(), 9.0, 300):
        # A step as figures draw it: the count holds from its place to the next.
        drawn = above[np.searchsorted(places, limit, side="right") - 1]
        assert drawn == sum(value > limit for value in values.tolist())
    assert above[-3:].tolist() == [1, 0, 0]


def test_examples_stand_beside_pictures_that_exist(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from made_pages import gallery

    shown = re.findall(r"^## `(\w+)`|^!\[.+\]\((\S+)\)$", gallery(), re.MULTILINE)
    names = [picture for _, picture in shown if picture]
    assert len(names) == 3
    assert all((ROOT / "docs" / name).is_file() for name in names)
    before = [shown[k - 1][0] for k, (_, picture) in enumerate(shown) if picture]
    assert before == ["analysis", "campaign", "first_run"]
