"""Labels of values in campaigns: equal ones for equal values, others for others."""

from __future__ import annotations

import json
from itertools import combinations
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from loops import for_each

from ringsim.sampling.distributions import label_of

SCALARS = st.one_of(
    st.booleans(), st.integers(-9, 9), st.floats(-9.0, 9.0),
    st.sampled_from(["none", "true", "1", "1.0", "a", "a, b", "a(b=1)", "[a]", "", " a", '"a"']),
    st.text(max_size=4),
)  # fmt: skip
TABLES = st.dictionaries(st.sampled_from(["kind", "a", "b", "a=1, b"]), SCALARS, max_size=3)
VALUES = st.recursive(
    st.one_of(SCALARS, TABLES),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.sampled_from("ab"), inner)
    ),
)


def one_thing(value: Any) -> Any:
    """A list of one table is that table; an empty list is "none"."""
    if value == [] and isinstance(value, list):
        return "none"
    single = isinstance(value, list) and len(value) == 1 and isinstance(value[0], dict)
    return value[0] if single else value


@given(VALUES, VALUES)
def test_two_values_share_a_label_only_if_they_are_equal(one: Any, other: Any) -> None:
    texts = [json.dumps(one_thing(each), sort_keys=True) for each in (one, other)]
    assert (label_of(one) == label_of(other)) == (texts[0] == texts[1])


ALIKE = [
    1, 1.0, "1", "1.0", [1], [[1]], [1, 2], [[1], [2]], [[1, 2]], "1, 2", ["1", "2"], ["1, 2"],
    True, "true", "none", {"kind": "none"}, {}, {"a": 1}, {"a": "1"}, {"kind": "a"}, "a", "a()",
    {"kind": "a", "b": [1, 2]}, {"kind": "a", "b": "1, 2"}, {"kind": "a", "b": [[1], [2]]},
    [{"kind": "a"}, {"kind": "b"}], [[{"kind": "a"}, {"kind": "b"}]], "a(), b()",
]  # fmt: skip


def test_values_that_read_alike_have_their_own_labels() -> None:
    for one, other in combinations(ALIKE, 2):
        assert label_of(one) != label_of(other), (one, other)


@for_each(
    ("value", "label"),
    [
        ([{"time": 0.2, "kind": "stuck-vjoint", "section": 2}],
         "stuck-vjoint(section=2, time=0.2)"),
        ([{"kind": "a"}, {"kind": "b"}], "a(), b()"),
        ([], "none"),
        ("section 6 V", "section 6 V"),
        ([1, 2.5], "[1, 2.5]"),
        ({"kind": "table", "points": [[0.0, 1.0]]}, "table(points=[[0.0, 1.0]])"),
    ],
)  # fmt: skip
def test_labels_are_short(value: Any, label: str) -> None:
    assert label_of(value) == label
