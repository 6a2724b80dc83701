"""Numerical settings of a scene."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import field_validator

from iceslide_fem.scene.units import Name, Quantity, Table

Place = Annotated[float, Quantity("m", "-1 m", "1 m")]
FIELDS = Literal["rubber", "stress", "interface", "contact_points", "ice", "trail"]
MOST_TIMES = 10_000  # of fields, by their number


class Output(Table):
    """Output of a slice or block besides its histories. It does not change results.

    `times` of fields: a number of equal parts of the run, an interval (s), or a list (s). `fields`
    are those of docs/reference/columns.md. `probes`: named positions (x, y, z), m, in the
    undeformed rubber, on its contact surface (z = 0), or in the ice (z < 0).
    """

    times: int | float | tuple[float, ...] = 25
    fields: tuple[FIELDS, ...] = ("rubber", "stress", "interface", "ice", "trail")
    probes: dict[Name, tuple[Place, Place, Place]] = {}

    @field_validator("times", mode="before")
    @classmethod
    def _number_interval_or_list(cls, times: Any) -> int | float | tuple[float, ...]:
        if isinstance(times, int) and not isinstance(times, bool):
            if not 0 <= times <= MOST_TIMES:
                raise ValueError(
                    f"output.times = {times} is out of range; allowed: 0 to {MOST_TIMES} times, an "
                    'interval ("0.1 ms"), or a list of times'
                )
            return times
        if isinstance(times, list | tuple):
            return tuple(sorted({Quantity("s", "0 s", "100 s").validate(time) for time in times}))
        return Quantity("s", "1 ns", "100 s").validate(times)

    @property
    def latest(self) -> float:
        """The last of listed `times`, s; 0 without a list."""
        return max(self.times, default=0.0) if isinstance(self.times, tuple) else 0.0


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
