"""Outputs that a campaign file defines itself: expressions over what runs store, one number each.

The text is read by Python's own parser and never run by Python: what is not listed here is refused.
"""

from __future__ import annotations

import ast
import functools
import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field, TypeAdapter, ValidationInfo

from ringsim import extensions
from ringsim.outputs import COORDINATES, OUTPUTS, VARIABLES, Output
from ringsim.refusal import InputError, known_or_nearest, show
from ringsim.tables import unit_text
from ringsim.units import Model
from ringsim.variables import OF_CAMPAIGNS, Fate, Variable

if TYPE_CHECKING:
    import xarray as xr

LONGEST = 500
"""Letters of an expression: one for people to read, and too short to exhaust a parser."""
_LAST = 99
"""Rank among outputs: behind those of ringsim."""
_OF_FILES = (
    "sample", "sample_seed", "reason", "log", "overrides", "attempts", "block_row", "statistic",
    "bound",
)  # fmt: skip
"""What campaigns and their analyses hold beside inputs and outputs."""
_ENDINGS = ("_checked", "_error", "_interval", "_samples")
"""How names end that files make of those of outputs."""
_FAMILIES = {
    "balance": "largest median sample", "bound": "", "case": "change outcome sample",
    "chance": "level", "change": "input listed of ratio untold values",
    "changed": "outcome_first outcome_second sample_first sample_second",
    "confidence": "lower required upper", "counted": "", "effect": "deviation", "event": "",
    "factor": "", "failed": "", "first": "order_index", "given": "data_index", "group": "",
    "index": "lost used", "input": "is_place of span", "inputs": "held",
    "kept": "compared share share_difference verdict verdict_text",
    "kind": "compared share share_difference",
    "limit": "beyond margin of output sample text value", "mean": "absolute_effect effect",
    "missing": "by_inputs lost", "numerical": "", "other": "factor",
    "outcome": "lost of open share share_convergence",
    "output": "units", "pair": "correlation first second share", "part": "",
    "probability": "lower required upper", "requirement": "text",
    "reweighted": "bounds probability share share_decisive statistic to verdict",
    "samples": "close lost may_be_off short unsure used violating without_value",
    "second": "order_index", "separation": "chance", "setting": "first second", "side": "",
    "source": "", "statistic": "",
    "tail": "agreement checked checked_outside confirmed difference ended left_out levels lost "
            "missed nearest probability probability_moved reached_probability replicate "
            "replicate_probability unled variation variation_of_chains",
    "together": "confidence lost of probability_lower probability_upper", "total": "index",
    "verdict": "may_change of_used", "worst": "failed failure found inputs of sample",
}  # fmt: skip
"""What analyses and comparisons hold beside numbers of outputs: ``first`` and ``first_second``."""
_OF_ANALYSES = {*_FAMILIES} | {
    f"{first}_{second}" for first, words in _FAMILIES.items() for second in words.split()
}
_OF_OUTPUTS = (
    "convergence", "difference", "doubtful", "end_sample", "error_of_mean", "largest_difference",
    "largest_difference_sample", "largest_error_sample", "mean", "partial_rank_correlation",
    "rank_correlation", "reweighted", "same_within", "spread", "worst_sample",
)  # fmt: skip
"""What they hold of each output, behind its name."""
_DECLARED: dict[str, type[Output]] = {}
"""Derived outputs by name, each a kind of output that no run computes."""


class _Told(NamedTuple):
    """What is known of an expression before it has values."""

    dims: dict[str, Any]
    """Dimensions, each with the ends of a range of it, or None for all of it."""
    unit: dict[str, int]
    """Exponents of the units of variables, by symbol."""

    @property
    def symbol(self) -> str:
        """Its unit in a word, as UDUNITS reads it."""
        parts = [(f"({s})" if " " in s or "/" in s else s, n) for s, n in self.unit.items()]
        if len(parts) == 1 and parts[0][1] == 1:
            return next(iter(self.unit))
        return " ".join(f"{s}{n if n != 1 else ''}" for s, n in parts) or "1"


class Derived(Model):
    """One output of the user's own."""

    of: Annotated[str, Field(min_length=1, max_length=LONGEST)]
    """Expression over stored variables, for example max(latch_rate)."""
    unit: str | None = None
    """Its unit; where it is left out, that of the variables.  Nothing is converted: another one
    needs a factor in the expression, as max(rod_stress) / 1e6 for MPa."""
    meaning: Annotated[str, Field(max_length=300)] = ""
    """What it is, in words, for tables, figures and reports."""
    worse: Literal["larger", "smaller", "neither"] | None = None
    """Which of two values an engineer fears more; where it is left out, the one that a requirement
    forbids which bounds it on one side."""

    @cached_property
    def tree(self) -> ast.expr:
        """The parsed expression; InputError if it is none."""
        try:
            return ast.parse(self.of.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            why = getattr(error, "msg", None) or "it is nested too deeply"
            raise InputError(f"{show(self.of)} is no expression: {why}") from None

    @cached_property
    def names(self) -> list[str]:
        """Variables that it reads."""
        found = (node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name))
        return list(dict.fromkeys(name for name in found if name not in FUNCTIONS))

    def told(self) -> _Told:
        """Dimensions and unit; InputError if something in it is not allowed."""
        return _tell(self.tree)

    def variable(self, name: str) -> Variable:
        """What files and tables say of it."""
        unit = self.told().symbol if self.unit is None else self.unit
        return Variable(name, (), unit, self.meaning or f"{name} = {self.of}",
                        worse=self.worse or "")  # fmt: skip

    def values(self, known: Mapping[str, xr.DataArray]) -> Any:
        """Its values, NaN where there are none; ``known`` are the variables that it reads."""
        return _value(self.tree, known)


def _listed(table: Any) -> Any:
    """A plain text is the expression."""
    if not isinstance(table, dict):
        return table
    return {name: {"of": each} if isinstance(each, str) else each for name, each in table.items()}


def _of_analyses(outputs: Iterable[str]) -> set[str]:
    """Names that analyses and comparisons give to something else, also of these outputs."""
    own = {n for n, each in VARIABLES.items() if not each.dims and n not in _DECLARED} | {*outputs}
    found = {f"{name}_{word}" for name in own for word in _OF_OUTPUTS}
    return found | {f"case_{name}" for name in own} | _OF_ANALYSES | {each.word for each in Fate}


def _check(outputs: dict[str, Derived], info: ValidationInfo) -> dict[str, Derived]:
    """Refuse what cannot be computed, or means something already; make the rest known."""
    # What a file holds of an older version may still be read.
    taken = _of_analyses(outputs) if info.context is not _STORED else set[str]()
    for name, each in outputs.items():
        known = {*(VARIABLES.keys() - _DECLARED.keys()), *COORDINATES, *FUNCTIONS, *_OF_FILES}
        if name in known or name.endswith(_ENDINGS):
            raise ValueError(f"{name} means something already: choose another name")
        if name in taken:
            raise ValueError(f"{name} is what analyses call something else: choose another name")
        if not name.isidentifier() or not name.isascii() or name.startswith("_"):
            raise ValueError(
                f"{show(name)} must be a name of letters, digits and underscores, such as peak_rate"
            )
        try:
            told = each.told()
        except InputError as error:
            raise ValueError(f"{name}: {error}") from None
        if not each.names:
            raise ValueError(f"{name} = {show(each.of)} has no variable of a run in it")
        numbers = any(isinstance(node, ast.Constant) and not isinstance(node.value, str)
                      for node in ast.walk(each.tree))  # fmt: skip
        if each.unit not in (None, told.symbol) and not numbers:
            raise ValueError(
                f"{name}.unit = {show(each.unit)}: its values are in "
                f"{unit_text(told.symbol) or 'no unit'}: put a factor into the expression, or "
                "leave unit out"
            )
        if told.dims:
            raise ValueError(
                f"{name} = {show(each.of)} has a value for each {' and '.join(told.dims)}: take "
                f"one number of them, such as max({each.of})"
            )
    declare(outputs)
    return outputs


Outputs = Annotated[dict[str, Derived], BeforeValidator(_listed), AfterValidator(_check)]
"""Derived output by name; in files a text, or a table with ``of``."""
_ADAPTER = TypeAdapter(Outputs)
_STORED = {"stored": True}
"""Context of outputs that a file holds already."""


def declare(outputs: Mapping[str, Derived]) -> None:
    """Make derived outputs known wherever outputs are looked up; the last definition counts."""
    forget(outputs)
    for name, each in outputs.items():
        content = {"variables": (each.variable(name),), "needs": (OF_CAMPAIGNS,), "rank": _LAST,
                   "of_opening": all(map(of_opening, each.names))}  # fmt: skip
        _DECLARED[name] = type(f"Derived_{name}", (Output,), content)


def of_opening(name: str) -> bool:
    """Whether an output tells of the opening alone; a user's own one if all do that it reads."""
    own = (each for each in OUTPUTS if any(one.name == name for one in each.variables))
    return next((each.of_opening for each in own), False)


def forget(names: Iterable[str]) -> None:
    """The reverse, for those of these names that there are."""
    for name in [name for name in names if name in _DECLARED]:
        OUTPUTS.remove(_DECLARED.pop(name))
        VARIABLES.pop(name)


def declared() -> list[str]:
    """Names of the derived outputs that are known."""
    return [*_DECLARED]


def known_from(attributes: Mapping[Any, Any]) -> dict[str, Derived]:
    """The derived outputs of a design or a merged campaign; with those of the modules that its
    scene imports, they are made known.
    """
    extensions.load(extensions.names_of(str(attributes.get("scene", ""))))
    text = str(attributes.get("outputs", ""))
    return _ADAPTER.validate_json(text, context=_STORED) if text else {}


def of_records(outputs: Mapping[str, Derived]) -> list[str]:
    """Names of those that read series, which hold a run as often as it was recorded: a peak between
    two records is missed.
    """
    return [
        name for name, each in outputs.items()
        if any("time" in VARIABLES[one].dims for one in each.names)
    ]  # fmt: skip


def to_json(outputs: Mapping[str, Derived]) -> str:
    """The text that files hold."""
    return json.dumps({n: each.model_dump(exclude_none=True) for n, each in outputs.items()})


def over_samples(
    outputs: Mapping[str, Derived], arrays: Mapping[str, NDArray[Any]],
    axes: Mapping[str, NDArray[Any]],
) -> dict[str, NDArray[np.float64]]:  # fmt: skip
    """Values of all outputs, shape (samples,), from arrays of stored variables whose first axis are
    samples; NaN where a run lacks what they need, and none where nothing is stored.
    """
    arrays = {name: values for name, values in arrays.items() if name in VARIABLES}
    if not (outputs and arrays):
        return {}
    import xarray as xr  # here, since it takes most of a second

    known: dict[str, xr.DataArray] = {}
    for name in dict.fromkeys(name for each in outputs.values() for name in each.names):
        if name in arrays:
            dims = ("sample", *VARIABLES[name].dims)
            coordinates = {dim: axes[dim] for dim in dims[1:] if dim in axes}
            values = np.asarray(arrays[name], dtype=float)
            if VARIABLES[name].dtype.startswith("i"):  # missing counts are negative
                values = np.where(values < 0.0, np.nan, values)
            known[name] = xr.DataArray(values, dims=dims, coords=coordinates)
    count = len(next(iter(arrays.values())))
    found = {}
    for name, each in outputs.items():
        values = np.full(count, np.nan)
        if all(one in known for one in each.names):
            with np.errstate(all="ignore"):
                values = np.broadcast_to(each.values(known).to_numpy(), (count,)).copy()
        found[name] = np.where(np.isfinite(values), values, np.nan)
    return found


def of_run(
    outputs: Mapping[str, Derived], arrays: Mapping[str, NDArray[Any]]
) -> dict[str, NDArray[Any]]:
    """Arrays of stored variables and coordinates of one run, and the values of all outputs beside
    them, shape ().
    """
    found = over_samples(outputs, {name: v[None] for name, v in arrays.items()}, arrays)
    return {**arrays, **{name: values.reshape(()) for name, values in found.items()}}


# What an expression may be made of: the same walk tells dimensions and unit, and computes.


def _place_of_largest(values: xr.DataArray, dims: list[str]) -> xr.DataArray:
    """Coordinate of the largest value along one dimension, the others reduced first."""
    (dim,) = dims
    values = values.max([d for d in values.dims if d not in (dim, "sample")])
    return values.fillna(-np.inf).idxmax(dim).where(values.notnull().any(dim))


def _integral(values: xr.DataArray, dims: list[str]) -> xr.DataArray:
    """Trapezoids between records; NaN where a run has none."""
    (dim,) = dims
    along, following = values[dim], {dim: -1}
    each = 0.5 * (values + values.shift(following)) * (along.shift(following) - along)
    return each.sum(dim, min_count=1)


_REDUCTIONS: dict[str, Callable[[xr.DataArray, list[str]], xr.DataArray]] = {
    "max": lambda values, dims: values.max(dims),
    "min": lambda values, dims: values.min(dims),
    "mean": lambda values, dims: values.mean(dims),
    "sum": lambda values, dims: values.sum(dims, min_count=1),
    "difference": lambda values, dims: values.max(dims) - values.min(dims),
    "argmax": _place_of_largest,
    "argmin": lambda values, dims: _place_of_largest(-values, dims),
    "integral": _integral,
}
"""Functions that take one number of many, over all dimensions or those that ``over`` names."""
_PAIRED = {"max": np.fmax, "min": np.fmin}
"""What these do with several expressions: value by value, without those that are missing."""
_EACH = {"abs": np.abs, "sqrt": np.sqrt}
FUNCTIONS = (*_REDUCTIONS, *_EACH)
_ONE_DIM = ("argmax", "argmin", "integral")
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b, ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b, ast.Div: lambda a, b: a / b,
}  # fmt: skip
_COMPARED: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: lambda a, b: a < b, ast.LtE: lambda a, b: a <= b,
    ast.Gt: lambda a, b: a > b, ast.GtE: lambda a, b: a >= b,
}  # fmt: skip


def _refuse(node: ast.expr, why: str) -> InputError:
    return InputError(f"{show(ast.unparse(node))}: {why}")


def _number(node: ast.expr) -> float:
    """A number as it stands; InputError if it is none, or too large."""
    sign = 1.0
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        sign, node = -1.0, node.operand
    value = node.value if isinstance(node, ast.Constant) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _refuse(node, "must be a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _refuse(node, "must be a finite number")
    return float(sign * number)


def _tell(node: ast.expr) -> _Told:
    """Dimensions and unit; InputError if it is not allowed."""
    match node:
        case ast.Constant():
            _number(node)
            return _Told({}, {})
        case ast.Name(id=name):
            return _told_of(name)
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=inner):
            return _tell(inner)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            first, second = _tell(left), _tell(right)
            dims = _both(node, first, second)
            if isinstance(op, ast.Add | ast.Sub):
                return _Told(dims, _same(node, first, second))
            sign = -1 if isinstance(op, ast.Div) else 1
            both = Counter(first.unit)
            both.update({symbol: sign * n for symbol, n in second.unit.items()})
            return _Told(dims, {symbol: n for symbol, n in both.items() if n})
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARED:
            first, second = _tell(left), _tell(right)
            if first.unit and second.unit:  # a number alone is in the unit of the other
                _same(node, first, second)
            return _Told(_both(node, first, second), {})
        case ast.Call(func=ast.Name(id=name)) if name in FUNCTIONS:
            return _told_of_call(node, name)
        case ast.Call(func=ast.Name(id=name), args=[]):
            told = _told_of(name)
            ends = dict(_selection(node, told.dims))
            kept = {d: ends.get(d) for d in told.dims if isinstance(ends.get(d), tuple | None)}
            return _Told(kept, told.unit)
    raise _refuse(
        node, "is not allowed: an expression has variables, numbers, + - * / < >, parentheses, "
        f"{', '.join(FUNCTIONS)}, and selections such as cable_tension(plane='upper', time=(0, 2))"
    )  # fmt: skip


def _told_of(name: str) -> _Told:
    known = {n: v for n, v in VARIABLES.items() if v.dtype != "str" and v.flags is None}
    known = {n: v for n, v in known.items() if OF_CAMPAIGNS not in v.needs}
    if name not in known:
        raise InputError(f"{name} is no variable of a run ({known_or_nearest(name, known)})")
    units = known[name].units
    return _Told(dict.fromkeys(known[name].dims), {} if units == "1" else {units: 1})


def _both(node: ast.expr, first: _Told, second: _Told) -> dict[str, Any]:
    for dim in first.dims.keys() & second.dims.keys():
        if first.dims[dim] != second.dims[dim]:
            raise _refuse(
                node, f"both sides have another range of {dim}: select the same one, or one place"
            )
    return first.dims | second.dims


def _same(node: ast.expr, first: _Told, second: _Told) -> dict[str, int]:
    if first.unit != second.unit:
        a, b = (unit_text(each.symbol) or "a number" for each in (first, second))
        raise _refuse(node, f"{a} and {b} cannot be added or compared")
    return first.unit


def _over(node: ast.Call, told: _Told) -> list[str]:
    """Dimensions that a function reduces."""
    given = {k.arg: k.value for k in node.keywords}
    if given.keys() - {"over"} or len(node.keywords) > 1:
        raise _refuse(node, 'takes expressions, and over="time" or another dimension')
    if "over" not in given:
        if "time" in told.dims and ast.unparse(node.func) in _ONE_DIM:
            return ["time"]
        return [*told.dims]
    word = given["over"]
    if not isinstance(word, ast.Constant) or word.value not in told.dims:
        dims = " or ".join(show(dim) for dim in told.dims) or "nothing: leave it out"
        raise _refuse(node, f"over must be {dims}")
    return [str(word.value)]


def _told_of_call(node: ast.Call, name: str) -> _Told:
    if not node.args or (len(node.args) > 1 and (name not in _PAIRED or node.keywords)):
        raise _refuse(node, f"{name} takes one expression")
    told, *others = map(_tell, node.args)
    if others:
        for each in others:
            told = _Told(_both(node, told, each), _same(node, told, each))
        return told
    if name in _EACH:
        if node.keywords:
            raise _refuse(node, f"{name} takes one expression and nothing else")
        if name == "sqrt" and any(n % 2 for n in told.unit.values()):
            raise _refuse(node, f"{unit_text(told.symbol)} has no root: divide by a unit's value")
        return _Told(told.dims, told.unit if name == "abs" else
                     {symbol: n // 2 for symbol, n in told.unit.items()})  # fmt: skip
    if not told.dims:
        raise _refuse(node, "is of one number already: leave the function out")
    dims = _over(node, told)
    if name in _ONE_DIM and (len(dims) != 1 or (name == "integral" and dims != ["time"])):
        first = next(iter(told.dims))
        cure = "of what depends on time" if name == "integral" else f'say over="{first}"'
        raise _refuse(node, f"{name} is along one dimension: {cure}")
    if name in ("argmax", "argmin"):
        if dims[0] not in COORDINATES or COORDINATES[dims[0]].dtype == "str":
            raise _refuse(node, f"places along {dims[0]} are words: it gives numbers alone")
        return _Told({}, {"s": 1} if dims[0] == "time" else {})
    left = {dim: ends for dim, ends in told.dims.items() if dim not in dims}
    unit = dict(told.unit)
    if name == "integral":
        unit["s"] = unit.get("s", 0) + 1
    return _Told(left, unit)


def _selection(node: ast.Call, dims: Iterable[str]) -> list[tuple[str, Any]]:
    """Dimension with its value, or both ends of a range."""
    found: dict[str, Any] = {}
    for each in node.keywords:
        if each.arg is None or each.arg not in dims:
            known = ", ".join(dims) or "no dimensions"
            raise _refuse(node, f"{each.arg} is no dimension of it (it has {known})")
        if each.arg in found:
            raise _refuse(node, f"{each.arg} is given twice")
        text = COORDINATES[each.arg].dtype == "str"
        word = isinstance(each.value, ast.Constant) and isinstance(each.value.value, str)
        if text != word:
            what = "one of its words" if text else "a number, or (from, to)"
            raise _refuse(node, f"{each.arg} must be {what}")
        if isinstance(each.value, ast.Tuple):
            ends = tuple(_number(end) for end in each.value.elts)
            if len(ends) != 2 or ends[0] > ends[1]:
                raise _refuse(node, f"{each.arg} = (from, to) needs two numbers, the smaller first")
            found[each.arg] = ends
        elif isinstance(each.value, ast.Constant) and word:
            found[each.arg] = each.value.value
        else:
            found[each.arg] = _number(each.value)
    return [*found.items()]


def _value(node: ast.expr, known: Mapping[str, xr.DataArray]) -> Any:
    """The values of an expression that ``_tell`` has let pass."""
    match node:
        case ast.Constant():
            return np.float64(_number(node))  # whose quotient by 0 is no error
        case ast.Name(id=name):
            return known[name]
        case ast.UnaryOp(op=op, operand=inner):
            value = _value(inner, known)
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(left=left, op=op, right=right):
            return _BINARY[type(op)](_value(left, known), _value(right, known))
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            first, second = _value(left, known), _value(right, known)
            # What is missing on either side stays missing.
            return _COMPARED[type(op)](first, second) * 1.0 + 0.0 * first + 0.0 * second
        case ast.Call(func=ast.Name(id=name)) if name in _EACH:
            return _EACH[name](_value(node.args[0], known))
        case ast.Call(func=ast.Name(id=name)) if name in _REDUCTIONS:
            several = [_value(arg, known) for arg in node.args]
            if len(several) > 1:
                return functools.reduce(_PAIRED[name], several)
            (values,), dims = several, _over(node, _tell(node.args[0]))
            if not all(values.sizes[dim] for dim in dims):  # a place that this run does not have
                return values.sum(dims, min_count=1)
            found = _REDUCTIONS[name](values, dims)
            read = {n.id for n in ast.walk(node.args[0]) if isinstance(n, ast.Name)} & known.keys()
            # A joint without a value did not lock: what all of them would tell, it does not have.
            # Elsewhere a missing value is a place that there is not, or a time behind the end.
            of_joints = {*values.dims} <= {"sample", "plane", "section"} and any(
                VARIABLES[each].dims == ("plane", "section") for each in read
            )
            whole = values.notnull().all([each for each in values.dims if each not in found.dims])
            return found.where(whole) if of_joints else found
        case ast.Call(func=ast.Name(id=name)):
            values = known[name]
            for dim, wanted in _selection(node, VARIABLES[name].dims):
                values = _selected(values, dim, wanted)
            return values
    raise _refuse(node, "is not allowed")


def _selected(values: xr.DataArray, dim: str, wanted: Any) -> xr.DataArray:
    """The part of an array at a place, between two of them, or at times between records."""
    if dim == "time":
        if isinstance(wanted, tuple):
            along = values[dim].to_numpy()
            low, high = max(wanted[0], along[0]), min(wanted[1], along[-1])
            inside = along[(along > low) & (along < high)]
            wanted = np.unique([low, *inside, high])
        return values.interp(time=wanted)
    if isinstance(wanted, tuple):
        places = values[dim].to_numpy()
        return values.isel({dim: np.flatnonzero((places >= wanted[0]) & (places <= wanted[1]))})
    return values.sel({dim: wanted}, drop=True)


def require_places(
    outputs: Mapping[str, Derived], axes: Mapping[str, NDArray[Any]], source: str
) -> None:
    """Refuse (InputError) selections of places that a scene does not have."""
    for name, each in outputs.items():
        for node in ast.walk(each.tree):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
                continue
            if node.func.id in FUNCTIONS:
                continue
            for dim, wanted in _selection(node, VARIABLES[node.func.id].dims):
                places = axes.get(dim)
                if places is None:
                    continue
                low, high = wanted if isinstance(wanted, tuple) else (wanted, wanted)
                there = any(low <= place <= high for place in places.tolist())
                if dim == "time":
                    there = low <= places[-1] and high >= places[0]
                if not there:
                    shown = places.tolist() if len(places) < 6 else [places[0], "...", places[-1]]
                    given = f"({low}, {high})" if isinstance(wanted, tuple) else show(wanted)
                    raise InputError(
                        f"{source}: outputs.{name}: {dim} = {given} is no {dim} of this scene "
                        f"({', '.join(map(str, shown))})"
                    )
