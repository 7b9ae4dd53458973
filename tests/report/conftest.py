"""What the tests of pages share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from matplotlib.layout_engine import ConstrainedLayoutEngine

from ringsim.plots import style

LAID_OUT = ("test_comparison_page",)
"""Who looks at where the words of figures stand; else their layouts, which are tested in
tests/plots, cost more than all the rest of a page.
"""


@pytest.fixture(scope="module", autouse=True)
def _nothing_moves(request: pytest.FixtureRequest) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        if request.module.__name__ not in LAID_OUT:
            patch.setattr(style, "settle", lambda figure: None)
            patch.setattr(ConstrainedLayoutEngine, "execute", lambda engine, figure: None)
        yield
