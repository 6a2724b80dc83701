"""Types of the arrays that the package passes around, and plain values of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]


def some_of(part: Array | float, index: Index) -> Array | float:
    """The values at `index` of an array (n,); a number is that of all."""
    return part.take(index, mode="clip") if isinstance(part, np.ndarray) else part


def plain(value: Any) -> Any:
    """`value` with Python's own numbers and lists in place of NumPy's."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    return [plain(part) for part in value] if isinstance(value, list | tuple) else value
