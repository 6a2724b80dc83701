"""Numerical settings of a scene."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import field_validator

from iceslide_fem.scene.units import Name, Quantity, Table, key

Place = Annotated[float, Quantity("m", "-1 m", "1 m")]
FIELDS = Literal["rubber", "stress", "interface", "contact_points", "ice", "trail"]
MOST_TIMES = 10_000  # of fields, by their number


class Output(Table):
    """Output of a slice or block besides its histories. It does not change results."""

    times: int | float | tuple[float, ...] = key(
        25,
        "When fields are written: the number of parts of the run, an interval, or a list of times.",
    )
    fields: tuple[FIELDS, ...] = key(
        ("rubber", "stress", "interface", "ice", "trail"), "Which fields are written."
    )
    probes: dict[Name, tuple[Place, Place, Place]] = key(
        {},
        "Places for which `probes.csv` has values: a name and `[x, y, z]` each, under "
        "`[output.probes]`.",
    )

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
    """Accuracy: the target relative error of mu(t), and optional overrides."""

    tolerance: Annotated[float, Quantity("", "1e-6", "0.1")] = key(
        1e-3,
        "Relative error of mu(t) that steps, ice layers and penalty aim at. The one number to "
        "choose.",
    )
    refinement: Annotated[float, Quantity("", *map("{:g}".format, REFINEMENTS))] = key(
        1.0, "Divides all cell sizes of the built-in meshes."
    )
    penalty: Annotated[float, Quantity("Pa/m", "0.001 MPa/mm", "1e6 MPa/mm")] | None = key(
        None,
        "Stiffness of the contact penalty, at least 10 pressure / height. Without it 10 E / "
        "(height x tolerance), between 100 and 1000 E / height, with Young's modulus E.",
    )
    shear_ramp_pressure: Annotated[float, Quantity("Pa", "1 Pa", "10 bar")] | None = key(
        None,
        "Friction grows from 0 to its full value between pressure 0 and this pressure, at most "
        "the nominal one. Without it 5 % of the nominal pressure, or a tenth of the shear at "
        "the initial film height if that is more.",
    )
    film_integrator: Literal["sdirk2", "sdirk3", "implicit-euler", "explicit-euler"] = key(
        "sdirk2", "Time integration of the film. The Euler methods take fixed steps."
    )
    max_step: Annotated[float, Quantity("s", "1 ns", "100 s")] | None = key(
        None,
        "Longest step, or the step of the Euler methods. Without it, in a slice or block: 1/40 "
        "of the duration, and where ice slides at most the time to pass four of its cells. A "
        "point has no limit; with an Euler method its step is 1/2000 of the duration.",
    )
    time_limit: Annotated[float, Quantity("s", "1 s", "1e8 s")] | None = key(
        None,
        "Longest time that a slice or block may compute, by the clock. Then it stops with exit "
        "code 3, says at which stage, and leaves a checkpoint. Without it a run is stopped only"
        " where no end is in sight: if at the pace of its last 100 steps more than 100000 steps"
        " and an hour remain, and three times as many steps as at its best estimate before.",
    )
