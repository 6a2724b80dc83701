"""Numerical settings of a scene."""

from __future__ import annotations

from typing import Annotated, Literal

from iceslide_fem.scene.table import Table
from iceslide_fem.scene.units import Quantity

REFINEMENTS = (0.25, 8.0)  # allowed of meshes


class Numerics(Table):
    """Accuracy: the target relative error of mu(t), and optional overrides.

    `refinement` divides mesh sizes. `penalty` (Pa/m), `shear_ramp_pressure` (Pa) and `max_step` (s)
    are chosen by the program if they are not given. `time_limit` (s) limits the wall-clock time of
    a run. Without it a run is stopped only if its remaining time keeps growing.
    """

    tolerance: Annotated[float, Quantity("", "1e-6", "0.1")] = 1e-3
    refinement: Annotated[float, Quantity("", *map("{:g}".format, REFINEMENTS))] = 1.0
    penalty: Annotated[float, Quantity("Pa/m", "0.001 MPa/mm", "1e6 MPa/mm")] | None = None
    shear_ramp_pressure: Annotated[float, Quantity("Pa", "1 Pa", "10 bar")] | None = None
    film_integrator: Literal["sdirk2", "sdirk3", "implicit-euler", "explicit-euler"] = "sdirk2"
    max_step: Annotated[float, Quantity("s", "1 ns", "100 s")] | None = None
    time_limit: Annotated[float, Quantity("s", "1 s", "1e8 s")] | None = None
