"""Results as labelled arrays: columns with units become the variables of an `xarray.Dataset`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from iceslide_fem.runtime.column_names import attributes_of

Variables = dict[str, xr.Variable]


def variables(columns: Mapping[str, ArrayLike], dimensions: str | Sequence[str]) -> Variables:
    """A variable over `dimensions` for each of the `columns`."""
    found = {}
    for name, values in columns.items():
        array = np.asarray(values)
        if array.dtype.kind == "O":
            array = array.astype(str)
        found[name] = xr.Variable(dimensions, array, attributes_of(name))
    return found


def plain_attributes(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the `entries` of a summary that are numbers or texts; NaN for what did not happen.

    Warnings are one text. Files of `Dataset.to_netcdf` hold all of them.
    """
    found: dict[str, Any] = {}
    for name, value in entries.items():
        if value is None:
            found[name] = np.nan
        elif name == "warnings":
            found[name] = "; ".join(value)
        elif isinstance(value, int | float | str):
            found[name] = int(value) if isinstance(value, bool) else value
    return found
