"""The tables of a scene: their keys, ranges and contradictions.

Numbers are SI (temperatures in kelvin); a file may give strings with a unit instead ("1 bar").
"""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import (
    field_validator,
    model_validator,
)

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene.contact_file import read_contact_table
from iceslide_fem.scene.friction import Friction
from iceslide_fem.scene.ice import Ice, Water
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.load import Load
from iceslide_fem.scene.materials import (
    BAR,
    COMPOUNDS,
    CONTACT_TABLES,
    ConstantContact,
    ContactTable,
    MooneyRivlin,
)
from iceslide_fem.scene.rows import RowsOf
from iceslide_fem.scene.rubber import Rubber
from iceslide_fem.scene.shape import check_room_across
from iceslide_fem.scene.shear_strength import DRY_STRESS, ShearStrength, check_softens
from iceslide_fem.scene.table import Name, Table
from iceslide_fem.scene.thermal_layers import HEATED_LAYERS
from iceslide_fem.scene.units import Quantity

Place = Annotated[float, Quantity("m", "-1 m", "1 m")]

HEIGHT = RowsOf(
    "ice temperature",
    Quantity("K", "-80 degC", "0.01 degC"),
    Quantity("m", "0 nm", "10 um"),
    "0 nm",
)
THINNEST = 1e-9  # m, of films that begin with water
DEEPEST = 0.1  # that contact may sink in, of the height
REFINEMENTS = (0.25, 8.0)  # allowed of meshes
FILE_KEYS = (
    ("rubber", "mesh"),
    ("rubber", "outline"),
    ("ice", "mesh"),
    ("film", "contact"),
    ("friction", "table"),
)  # table and key of what names a file
# of what may name a file of rows
TABLE_KEYS = (
    ("load", "pressure"),
    ("load", "speed"),
    ("film", "initial_height"),
    ("film", "dry_stress"),
    ("ice", "conductivity"),
    ("ice", "heat_capacity"),
    ("water", "viscosity"),
)


class Film(Table):
    """The water film: who carries it, the pressure it follows, and constant k, D (m), H_V (m).

    k, D and H_V override the compound's table, all three together; `contact`, the path of a CSV
    file, is another table (`read_contact_table`). `initial_height` is h0, m, or rows of it
    over the ice's initial temperature (K).
    `conductance` is that from the film to either body with heat in the rubber, W/(m2 K).
    `water_speed` is that of squeezed-out water relative to the rubber, a share of the sliding
    speed: 1 with the ice, 0 with the rubber, 0.5 in Couette flow (docs/theory.md).

    dry_stress: tau_b (Pa) with which dry rubber and ice shear where they touch, a limit of the
    film's shear: rows of it over the temperature of the ice's surface (K), or a number, which it
    is on cold ice; it falls over the last `dry_softening` (K) before T_m + `dry_residual` (K).
    With it films may begin without water, initial_height 0.
    """

    carrier: Literal["ice", "rubber"] = "ice"
    pressure: Literal["local", "nominal"] = "local"
    k: Annotated[float, Quantity("", "1e-6", "1")] | None = None
    D: Annotated[float, Quantity("m", "0.01 um", "10 mm")] | None = None
    H_V: Annotated[float, Quantity("m", "1 nm", "10 mm")] | None = None
    contact: InputFile | None = None
    initial_height: Annotated[Any, HEIGHT] = 70e-9
    conductance: Annotated[float, Quantity("W/m^2/K", "10 W/m^2/K", "1e9 W/m^2/K")] | None = None
    water_speed: Annotated[float, Quantity("", "0", "1")] = 1.0
    dry_stress: Annotated[Any, DRY_STRESS] | None = None
    dry_softening: Annotated[float, Quantity("K", "0.01 K", "200 K")] | None = None
    dry_residual: Annotated[float, Quantity("K", "0 K", "200 K")] = 0.5

    @model_validator(mode="after")
    def _all_or_none(self) -> Self:
        given = [name for name in ("k", "D", "H_V") if getattr(self, name) is not None]
        if len(given) in (1, 2):
            raise ValueError(
                f"film has {' and '.join(given)} only; give k, D and H_V together, or none of them"
            )
        if self.contact is not None:
            if given:
                raise ValueError(
                    "film.contact and film.k contradict each other: one is a table over pressure, "
                    "the other holds at every pressure; give one of them"
                )
            read_contact_table(self.contact, "film.contact")
        return self

    @model_validator(mode="after")
    def _dry_shear_is_whole(self) -> Self:
        rows = self.dry_stress
        table = isinstance(rows, tuple)
        for key in ("dry_softening", "dry_residual"):
            given = getattr(self, key) != type(self).model_fields[key].default
            if given and (table or rows is None):
                reason = "rows of film.dry_stress" if table else "no film.dry_stress"
                raise ValueError(
                    f"film.{key} and {reason} contradict each other: it says how a number of "
                    "dry_stress falls; allowed: film.dry_stress as a number"
                )
        if isinstance(rows, tuple):
            check_softens(rows, "film.dry_stress")
        heights = self.initial_height
        least = min(value for _, value in heights) if isinstance(heights, tuple) else heights
        if least < THINNEST and self.dry_stress is None:
            raise ValueError(
                f"film.initial_height = {readable(least, 'm')} is out of range; allowed: 1 nm to "
                "10 um, or from 0 on with film.dry_stress, which limits the shear of thin films"
            )
        return self


class Numerics(Table):
    """Accuracy: the target relative error of mu(t), and overrides for those who need them.

    `refinement` divides mesh sizes. `penalty` (Pa/m), `shear_ramp_pressure` (Pa) and `max_step`
    (s) are chosen by the program if they are not given. `time_limit` (s, of the clock on the wall)
    is how long a run may take; without it a run is stopped only where its end recedes.
    """

    tolerance: Annotated[float, Quantity("", "1e-6", "0.1")] = 1e-3
    refinement: Annotated[float, Quantity("", *map("{:g}".format, REFINEMENTS))] = 1.0
    penalty: Annotated[float, Quantity("Pa/m", "0.001 MPa/mm", "1e6 MPa/mm")] | None = None
    shear_ramp_pressure: Annotated[float, Quantity("Pa", "1 Pa", "10 bar")] | None = None
    film_integrator: Literal["sdirk2", "sdirk3", "implicit-euler", "explicit-euler"] = "sdirk2"
    max_step: Annotated[float, Quantity("s", "1 ns", "100 s")] | None = None
    time_limit: Annotated[float, Quantity("s", "1 s", "1e8 s")] | None = None


FIELDS = Literal["rubber", "stress", "interface", "contact_points", "ice", "trail"]
MOST_TIMES = 10_000  # of fields, by their number


class Output(Table):
    """What a slice or block writes beside its histories. None of it changes a result.

    `times` of the fields: how many parts of the run end with one (a whole number), or an interval
    or a list (s). `fields` are those of docs/outputs.md. `probes`: places (x, y, z), m, by their
    names: of the undeformed rubber, of its contact surface (z = 0), or of the ice (z < 0).
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
        """The last of the `times` that are listed, s; 0 if none is."""
        return max(self.times, default=0.0) if isinstance(self.times, tuple) else 0.0


class Scene(Table):
    """A complete scene: the level of the model ladder and everything that it needs.

    With model "auto" a run takes the cheapest level that suffices (`level.resolved`).
    """

    name: Name
    model: Literal["point", "slice", "block", "auto"]
    rubber: Rubber
    load: Load
    ice: Ice = Ice()
    water: Water = Water()
    film: Film = Film()
    friction: Friction = Friction()
    numerics: Numerics = Numerics()
    output: Output = Output()

    @model_validator(mode="after")
    def _no_contradiction(self) -> Self:
        nothing = self.rubber.compound is None and self.film.k is None and self.film.contact is None
        if nothing and self.friction.law == "film":
            raise ValueError(
                "film.k, film.D and film.H_V are missing; without a compound give them, or "
                "film.contact"
            )
        if self.model == "point" and self.ice.mesh is not None:
            raise ValueError(
                'ice.mesh and model = "point" contradict each other: below a point the ice is a '
                'column, and nothing says how deep; allowed: model = "slice" or "block", or '
                "ice.depth and ice.layers instead of ice.mesh"
            )
        if self.model == "point" and self.ice.motion == "sliding":
            self._passes_below_a_point()
        if self.ice.heat == "half-space" and self.ice.motion == "sliding":
            raise ValueError(
                'ice.heat = "half-space" and ice.motion = "sliding" contradict each other: the '
                "closed form holds for ice that stays under the rubber; "
                "allowed with sliding: 'column', 'continuum' or 'mesh'"
            )
        if self.load.changes:
            self._loads_may_change()
        self._contact_is_stiff()
        if self.model in ("block", "auto"):
            check_room_across(self.rubber)
        below = [name for name, place in self.output.probes.items() if place[2] < 0.0]
        if below and self.ice.heat == "half-space":
            raise ValueError(
                f'output.probes.{below[0]} lies in the ice, and ice.heat = "half-space" has no '
                "temperature below its surface; allowed: 'column', 'continuum' or 'mesh'"
            )
        if (late := self.output.latest) > self.load.duration:
            raise ValueError(
                f"output.times has {1e3 * late:.4g} ms, after the end of the run; allowed: up to "
                f"load.duration = {1e3 * self.load.duration:.4g} ms"
            )
        if self.rubber.heat:
            self._rubber_can_take_heat()
        elif self.film.conductance is not None:
            raise ValueError(
                "film.conductance has a meaning only with heat in the rubber; "
                "leave it out, or set rubber.heat = true"
            )
        return self

    def _loads_may_change(self) -> None:
        """Raise ValueError where loads that go in time have no meaning in this scene."""
        changing = "speed" if self.load.pressures.is_constant else "pressure"
        if self.model == "point" and self.ice.motion == "sliding":
            raise ValueError(
                f'load.{changing} that changes in time and model = "point" contradict each other '
                "where ice slides: points that enter the contact one after the other see other "
                'loads; allowed: model = "slice" or "block", or ice.motion = "attached"'
            )
        if self.film.pressure == "nominal" and not self.load.pressures.is_constant:
            raise ValueError(
                'film.pressure = "nominal" and a load.pressure that changes in time contradict '
                "each other: k, D and H_V of one nominal pressure are held; "
                "allowed: 'local'"
            )

    def too_soft(self, height: float) -> str | None:
        """Why the user's penalty is no model of contact below a block of `height` (m), or None."""
        penalty, pressure = self.numerics.penalty, self.load.pressures.largest
        least = pressure / (DEEPEST * height)
        if not penalty or penalty >= least:
            return None
        return (
            f"numerics.penalty = {1e-9 * penalty:.3g} MPa/mm is too soft: the block would sink "
            f"{1e3 * pressure / penalty:.3g} mm into the ice; allowed: at least "
            f"{1e-9 * least:.3g} MPa/mm, with which it sinks in by a tenth of its height"
        )

    def _contact_is_stiff(self) -> None:
        """Raise ValueError where a penalty or a shear ramp of the user's is no model of contact."""
        fault = None if self.rubber.mesh is not None else self.too_soft(self.rubber.height)
        if fault is not None:
            raise ValueError(fault)
        ramp = self.numerics.shear_ramp_pressure
        pressure = self.load.pressures.smallest
        if ramp and ramp > pressure:
            raise ValueError(
                f"numerics.shear_ramp_pressure = {ramp / BAR:.3g} bar is above load.pressure = "
                f"{pressure / BAR:.3g} bar: friction would never be there in full"
            )

    def _passes_below_a_point(self) -> None:
        """Raise ValueError where the time below the block does not say what the ice has seen."""
        if self.film.carrier == "rubber" and self.friction.law != "coulomb":
            what = "films that stay" if self.friction.law == "film" else "a memory that stays"
            raise ValueError(
                'film.carrier = "rubber" and model = "point" contradict each other where ice '
                f"slides: {what} with the rubber, older than the ice below; "
                'allowed: model = "slice" or "block", or film.carrier = "ice"'
            )
        if self.rubber.heat:
            raise ValueError(
                'rubber.heat = true and model = "point" contradict each other where ice slides: '
                'the rubber is older than the ice below it; allowed: model = "slice" or "block"'
            )
        if self.film.water_speed < 1.0 and self.friction.law == "film":
            raise ValueError(
                f'film.water_speed = {self.film.water_speed:g} and model = "point" contradict each '
                "other where ice slides: water that lags behind the ice is older than the ice; "
                'allowed: model = "slice" or "block", or film.water_speed = 1'
            )

    def _rubber_can_take_heat(self) -> None:
        """Raise ValueError where heat in the rubber has no meaning in this scene."""
        if self.ice.heat == "half-space":
            raise ValueError(
                'ice.heat = "half-space" and rubber.heat = true contradict each other: the closed '
                "form gives the ice a flux that does not depend on the rubber; "
                "allowed with heat in the rubber: 'column', 'continuum' or 'mesh'"
            )
        if self.rubber.heat == "mesh":
            self._rubber_mesh_can_take_heat()
            return
        needed = HEATED_LAYERS * (self.rubber.solid.diffusivity * self.load.duration) ** 0.5
        if self.rubber.height < needed:
            raise ValueError(
                f"rubber.height = {1e3 * self.rubber.height:.3g} mm is too thin for rubber.heat = "
                f"true, which takes the rubber as a half-space: heat reaches {1e3 * needed:.3g} mm "
                "deep within load.duration"
            )

    def _rubber_mesh_can_take_heat(self) -> None:
        """Raise ValueError where heat on the rubber's own mesh has no meaning in this scene."""
        if self.model == "point":
            return  # a point has no mesh: its rubber is a column
        if self.ice.heat != "mesh":
            raise ValueError(
                f'rubber.heat = "mesh" and ice.heat = "{self.ice.heat}" contradict each other: '
                "both meshes are solved together; allowed: ice.heat = 'mesh', or rubber.heat = true"
            )
        if self.ice.has_rows:
            raise ValueError(
                'rubber.heat = "mesh" and rows of ice.conductivity or ice.heat_capacity contradict '
                "each other; allowed: numbers, or rubber.heat = true"
            )
        if self.ice.motion == "sliding" and self.film.carrier == "ice":
            raise ValueError(
                'rubber.heat = "mesh" and film.carrier = "ice" contradict each other: films that '
                "pass meet other points of the rubber in every step; allowed: "
                "film.carrier = 'rubber', ice.motion = 'attached', or rubber.heat = true"
            )
        if self.friction.law != "film":
            raise ValueError(
                f'rubber.heat = "mesh" and friction.law = "{self.friction.law}" contradict each '
                "other: only a film's heat is shared between meshes; allowed: rubber.heat = true"
            )

    @property
    def initial_height(self) -> float:
        """h0 (m) on ice of the scene's temperature."""
        return float(self.height_on(self.ice.temperature))

    def height_on(self, temperature: ArrayLike) -> Array:
        """h0 (m) on ice of temperatures (K) of any shape; of rows, straight, held outside."""
        given, here = self.film.initial_height, np.asarray(temperature, dtype=float)
        if not isinstance(given, tuple):
            return np.full_like(here, given)
        kelvin, heights = zip(*given, strict=True)
        return np.asarray(np.interp(here, kelvin, heights))

    @property
    def shear_strength(self) -> ShearStrength | None:
        """tau_b of dry rubber on this ice; None where nothing limits the film's shear."""
        film, T_m = self.film, self.ice.melting_temperature
        if film.dry_stress is None:
            return None
        if isinstance(film.dry_stress, tuple):
            return ShearStrength.of_rows(film.dry_stress, T_m)
        softening = np.inf if film.dry_softening is None else film.dry_softening
        return ShearStrength.softening(film.dry_stress, softening, film.dry_residual)

    @property
    def viscosity(self) -> float:
        """Of the film's water (Pa s) at the ice's initial temperature, with which it starts."""
        table = self.water.table
        return self.water.viscosity if table is None else float(table(self.ice.temperature))

    @property
    def mooney_rivlin(self) -> MooneyRivlin:
        """Constants of the rubber (SI), of the compound or as given."""
        rubber = self.rubber
        if rubber.compound is not None:
            C10, C01, D1 = astuple(COMPOUNDS[rubber.compound])
        else:
            assert rubber.C10 is not None and rubber.C01 is not None  # by Rubber's validation
            C10, C01, D1 = rubber.C10, rubber.C01, 0.0
        if rubber.nu is not None:
            return MooneyRivlin.from_nu(C10, C01, rubber.nu)
        return MooneyRivlin(C10, C01, D1 if rubber.D1 is None else rubber.D1)

    @property
    def contact_parameters(self) -> ContactTable | ConstantContact:
        """k, D and H_V over pressure (Pa): the film's constants or table, or the compound's.

        Of the film law only: under others there may be none.
        """
        film = self.film
        if film.contact is not None:
            return read_contact_table(film.contact, "film.contact")
        if film.k is not None and film.D is not None and film.H_V is not None:
            return ConstantContact(film.k, film.D, film.H_V)
        assert self.rubber.compound is not None  # by Scene's validation
        return CONTACT_TABLES[self.rubber.compound]

    def outside_table(self) -> str | None:
        """A sentence if the nominal pressure lies outside the table of k, D, H_V, else None."""
        if self.friction.law != "film":
            return None
        table, pressure = self.contact_parameters, self.load.pressures.mean
        if not isinstance(table, ContactTable) or not table.outside(pressure):
            return None
        low, high = table.pressure[0] / BAR, table.pressure[-1] / BAR
        return (
            f"k, D and H_V ({table.source}) are given from {low:g} to {high:g} bar; at the "
            f"nominal {pressure / BAR:g} bar the nearest end is taken"
        )

    @property
    def files(self) -> dict[tuple[str, str], Path]:
        """Table and key -> path of every file that the scene names."""
        named = {place: getattr(getattr(self, place[0]), place[1]) for place in FILE_KEYS}
        return {place: path for place, path in named.items() if path is not None}

    def as_dict(self) -> dict[str, Any]:
        """Everything, defaults included, in SI, as JSON can hold it; `scene_from_dict` reads it."""
        return self.model_dump(mode="json")
