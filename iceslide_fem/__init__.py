"""A rubber tread block sliding on ice: finite elements with a melting water film."""

import importlib
from typing import Any

__version__ = "0.2.0"


def __getattr__(name: str) -> Any:
    """`iceslide_fem.point`, the point level, loaded when it is asked for: NumPy takes its time."""
    if name == "point":
        return importlib.import_module("iceslide_fem.film.point")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
