"""Finite element simulation of a rubber tread block sliding on ice."""

__version__ = "0.1.0"

from iceslide_fem.film import point

__all__ = ["point"]
