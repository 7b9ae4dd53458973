"""Outputs that grow as the two planes part: their inputs' difference is told, and chance is not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from made import campaign
from ringsim.analysis.design import drawn, planes_apart
from ringsim.analysis.influence_text import influence_tables, what_matters
from ringsim.analysis.study import analyse
from ringsim.analysis.worst import unusual

SPEED = "cables.upper.winch.winding.speed", "cables.lower.winch.winding.speed"
APART = "difference of cables.upper/lower.winch.winding.speed"
OTHERS = 12
Output = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], object]


def made(output: Output, seed: int, samples: int = 80, shift: float = 0.0) -> xr.Dataset:
    """Both motors' speeds of 500 rad/s and 15 rad/s of standard deviation, the upper one ``shift``
    faster, and inputs without effect.  ``output`` takes both and standard normal noise.
    """
    random = np.random.default_rng(seed)
    upper, lower = 500.0 + 15.0 * random.normal(size=(2, samples))
    found = campaign(output(upper + shift, lower, random.normal(size=samples)))
    inputs = {SPEED[0]: upper + shift, SPEED[1]: lower}
    inputs |= {f"joints.x{k}": random.random(samples) for k in range(OTHERS)}
    says = {path: {"role": "input", "path": path, "units": "rad/s"} for path in inputs}
    return found.assign({
        path.replace(".", "_"): ("sample", values, says[path]) for path, values in inputs.items()
    })  # fmt: skip


def named(found: xr.Dataset) -> list[str]:
    return [row[1] for row in what_matters(analyse(found)).rows]


@pytest.mark.parametrize("seed", range(5))
def test_an_output_of_the_difference_goes_with_it(seed: int) -> None:
    """The noise has a third of the variance of |a - b|, which is (1 - 2 / pi) 450."""
    one = made(lambda a, b, noise: np.abs(a - b) + 7.0 * noise, seed)
    table = what_matters(analyse(one))
    assert table.rows[0][1] == APART
    assert float(table.rows[0][2]) > 0.3
    assert not {row[1] for row in table.rows} & {*SPEED}
    (note,) = (note for note in table.notes if note.startswith("difference: "))
    assert "planes" in note
    assert not any("correlated" in note for note in table.notes)
    at_length = influence_tables(analyse(one))[0]
    assert at_length.rows[0][0] == f"asynchrony_max with {APART}"


def test_each_speed_alone_does_not_show_it() -> None:
    """Which is why there is the difference: its rank correlations with the parts are about 0."""
    one = made(lambda a, b, _: np.abs(a - b), 0, samples=4000)
    found = analyse(one).asynchrony_max_rank_correlation
    # Three standard errors of a correlation of 4000 samples.
    assert (np.abs(found.sel(input=[*SPEED])) < 3.0 / 4000**0.5).all()
    assert found.sel(input=APART) == pytest.approx(1.0)


@pytest.mark.slow  # of inputs as such test_chance.py says it
def test_without_any_dependence_chance_names_inputs_as_seldom_as_it_is_told() -> None:
    """One output in 10 at most, by its index or its rank correlation; 100 campaigns have a standard
    error of 3 %.
    """
    told = [bool(named(made(lambda a, b, noise: noise, seed))) for seed in range(100)]
    assert np.mean(told) <= 0.1 + 3 * 0.03


@pytest.mark.parametrize("shift", [0.0, 20.0, 200.0])
def test_an_output_of_one_plane_alone_names_that(shift: float) -> None:
    """Also where one motor is nearly always, or always, the faster."""
    for seed in range(5):
        names = named(made(lambda a, b, noise: a + 7.0 * noise, seed, shift=shift))
        assert names[0] == SPEED[0]
        assert APART not in names
    names = named(made(lambda a, b, noise: a - b + 7.0 * noise, seed, shift=shift))
    assert {*SPEED} <= {*names}


def test_the_difference_is_of_numbers_that_both_planes_have_and_that_cross() -> None:
    one = made(lambda a, b, _: a, 1)
    upper, lower = (one[path.replace(".", "_")].to_numpy() for path in SPEED)
    columns = drawn(one)
    at = columns.names.index(APART)
    np.testing.assert_array_equal(columns.values[:, at], np.abs(upper - lower))
    assert columns.level[at] == "difference"
    assert [*planes_apart(one)] == [APART]
    assert not planes_apart(made(lambda a, b, _: a, 1, shift=200.0))
    name = SPEED[1].replace(".", "_")
    assert not planes_apart(one.drop_vars(name))
    assert not planes_apart(one.assign({name: one[name].assign_attrs(units="m")}))
    assert not planes_apart(one.assign({name: one[name].astype(str).assign_attrs(one[name].attrs)}))
    still = one[name].copy(data=np.full(len(lower), 500.0))
    assert not planes_apart(one.assign({name: still}))


def test_of_many_places_the_means_differ_and_own_names_stay() -> None:
    random = np.random.default_rng(2)
    one = campaign(random.random(30))
    frictions = random.random((2, 30, 5))
    for plane, values in zip(("upper", "lower"), frictions, strict=True):
        says = {"role": "input", "path": f"cables.{plane}.friction", "input": f"{plane} one"}
        one[plane] = ("sample", "pulley"), values, says
    (name,) = planes_apart(one)
    assert name == "difference of the means of upper/lower one"
    expected = np.abs(frictions[0].mean(axis=1) - frictions[1].mean(axis=1))
    np.testing.assert_allclose(planes_apart(one)[name][1], expected, rtol=1e-12)
    one["lower"].attrs["input"] = "another"
    assert [*planes_apart(one)] == ["difference of the means of upper one and another"]


def test_worst_samples_name_motors_that_are_apart() -> None:
    one = made(lambda a, b, _: np.abs(a - b), 3, samples=100)
    far = int(np.argmax(one.asynchrony_max.to_numpy()))
    ratio = one.asynchrony_max.max().item() / one.asynchrony_max.median().item()
    apart = one.asynchrony_max.max().item()
    words = f"{APART} {apart:.4g} rad/s ({ratio:.2g} times the median, the highest)"
    assert words in unusual(one, [far])[0]
    near = int(np.argmin(one.asynchrony_max.to_numpy()))
    assert APART not in unusual(one, [near])[0]
    assert unusual(one, [far], [{APART: True}])[0].startswith(words)
    for path in SPEED:  # a difference of 40 K is not -233 C
        one[path.replace(".", "_")].attrs["units"] = "K"
    assert words.replace("rad/s", "K") in unusual(one, [far])[0]
