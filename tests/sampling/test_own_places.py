"""One place of an input with a distribution of its own, beside those of all places."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from loops import for_each

from ringsim.campaign.calibration import calibration_of, unknowns_of
from ringsim.campaign.specification import campaign_of
from ringsim.refusal import InputError

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parents[2]
UPPER, LOWER = (f"cables.{plane}.friction.coefficient" for plane in ("upper", "lower"))
EACH = '{ kind = "lognormal", mean = 4e-4, standard_deviation = 8e-5, each_section = true }'
OWN = '{ kind = "uniform", low = 1e-3, high = 4e-3 }'
CALLED = '"section 1 V"'
FOLLOWS = '{ kind = "function", input = "lot", table = [[0.0, 1e-4], [1.0, 2e-4]] }'


def campaign(inputs: list[str], between: tuple[str, str] | None = None, samples: int = 400):
    lines = ['name = "own"', 'scene = "ring18-cable"', 'set = { "structure.sections" = 3 }',
             f'design = {{ kind = "random", samples = {samples} }}']  # fmt: skip
    if between is not None:
        lines += [f"correlations = [{{ between = ['{between[0]}', '{between[1]}'], "
                  "coefficient = 0.8 }]"]  # fmt: skip
    return campaign_of("\n".join([*lines, "[inputs]", *inputs]), Path("own.toml"))


@for_each("name", ["[2]", f"[{CALLED}]"])
@pytest.mark.parametrize("first", [True, False])
def test_a_place_has_its_own_distribution_and_all_others_theirs(name: str, first: bool) -> None:
    rows = [f"'{UPPER}{name}' = {OWN}", f"'{UPPER}' = {EACH}"]
    columns = campaign(rows if first else rows[::-1]).draw().columns
    assert len(columns) == 8
    assert columns[1].path == f"{UPPER}{name}"  # at its place, wherever it stands in the file
    for k, column in enumerate(columns):
        assert (column.values.min() >= 1e-3) == (k == 1)
        assert column.dim == ""


def test_correlations_of_all_places_stay_place_by_place() -> None:
    rows = [f"'{LOWER}' = {EACH}", f"'{UPPER}[2]' = {OWN}", f"'{UPPER}' = {EACH}"]
    lower, *upper = campaign(rows, (UPPER, LOWER), 4000).draw().columns
    for k, one in enumerate(upper):
        found = [np.corrcoef(one.values, other)[0, 1] for other in lower.values.T]
        assert found[k] > 0.7
        assert max(np.abs(np.delete(found, k))) < 0.1


@for_each("place, called", [("[2]", f"[{CALLED}]"), (f"[{CALLED}]", "[2]"), ("[2]", "[2]")])
def test_correlations_name_places_by_name_or_number(place: str, called: str) -> None:
    rows = [f"'{UPPER}{place}' = {OWN}", f"'{UPPER}' = {EACH}", f"'{LOWER}' = {EACH}"]
    columns = campaign(rows, (f"{UPPER}{called}", f"{LOWER}[{CALLED}]"), 4000).draw().columns
    (own,) = [each.values for each in columns if each.path == f"{UPPER}{place}"]
    (other,) = [each.values[:, 1] for each in columns if each.path == LOWER]
    assert np.corrcoef(own, other)[0, 1] > 0.7


@for_each("called", [("[2]", f"[{CALLED}]"), (f"[{CALLED}]", "[2]")])
def test_calibrations_take_such_correlations_too(called: tuple[str, str]) -> None:
    file = ROOT / "campaigns" / "stand" / "pulleys" / "pulleys.toml"
    pair = {"between": [f"{UPPER}{called[0]}", f"{LOWER}{called[1]}"], "coefficient": 0.5}
    text = tomli_w.dumps(tomllib.loads(file.read_text()) | {"correlations": [pair]})
    unknowns = unknowns_of(calibration_of(text, file))
    one, other = (unknowns.names.index(f"{name}[{CALLED}]") for name in (UPPER, LOWER))
    assert (unknowns.lower @ unknowns.lower.T)[one, other] == pytest.approx(0.5)


@for_each(
    "rows, words",
    [
        ([f"'{UPPER}' = {EACH}", f"'{UPPER}[2]' = {OWN}", f"'{UPPER}[{CALLED}]' = {OWN}"], "twice"),
        (
            [f"'{UPPER}' = {EACH}", f"'{UPPER}[2]' = {OWN}",
             f"'{LOWER}' = {FOLLOWS.replace('lot', UPPER)}"],
            "has a distribution of its own: let cables.lower.friction.coefficient follow one place",
        ),
        (
            [f"'{UPPER}' = {FOLLOWS[:-2]}, each_section = true }}", "lot = " + OWN,
             f"'{UPPER}[2]' = {OWN}"],
            "would overwrite",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_a_line(rows: list[str], words: str) -> None:
    with pytest.raises(InputError) as refused:
        campaign(rows).draw()
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
