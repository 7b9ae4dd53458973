"""Codes and units of variables in words."""

import numpy as np
import xarray as xr


def in_words(variable: xr.DataArray) -> xr.DataArray:
    """The variable, with words instead of codes; what has none stays a number.

    >>> codes = {"flag_values": [-1, 0], "flag_meanings": "not_run ok"}
    >>> in_words(xr.DataArray([0, -1, 5], attrs=codes)).values.tolist()
    ['ok', 'not_run', '5']
    """
    if "flag_meanings" not in variable.attrs:
        return variable
    values = np.atleast_1d(variable.attrs["flag_values"]).tolist()
    words = dict(zip(values, str(variable.attrs["flag_meanings"]).split(), strict=True))
    told = [words.get(code, f"{code:g}") for code in variable.to_numpy().ravel().tolist()]
    return variable.copy(data=np.array(told, dtype=object).reshape(variable.shape))


def units_of(variable: xr.DataArray) -> str:
    """Unit of a variable; empty of words and of numbers without one."""
    units = str(variable.attrs.get("units", ""))
    return "" if units == "1" else units


def meaning_of(variable: xr.DataArray) -> str:
    """What it is: of an input its scene path, and its name if it has another one."""
    words, path = (str(variable.attrs.get(name, "")) for name in ("long_name", "path"))
    own = str(variable.attrs.get("input", path))
    return words if not path else path if own == path else f"{own}: {path}"
