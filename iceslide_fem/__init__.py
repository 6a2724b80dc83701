"""A rubber tread block sliding on ice: finite elements with a melting water film."""

__version__ = "0.1.0"

from iceslide_fem.film import point

__all__ = ["point"]
