"""The water film of a scene: initial state, parameters and frame."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, StrictBool, StrictFloat, StrictInt, StringConstraints, model_validator

from iceslide_fem.relaxation.shift import AnyShift, Shift, arrhenius
from iceslide_fem.runtime.files import is_regular
from iceslide_fem.runtime.tables.columns import Wanted, read_columns
from iceslide_fem.runtime.units import ZERO_CELSIUS, readable
from iceslide_fem.scene.contact_table import read_contact_table
from iceslide_fem.scene.ice import ICE_TEMPERATURE
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.relaxation import TEMPERATURE
from iceslide_fem.scene.rows import RowsOf, check_falls
from iceslide_fem.scene.units import Quantity, Table, key

if TYPE_CHECKING:  # takes long to import, and only tables need it
    from scipy.interpolate import RegularGridInterpolator


COLUMNS = (
    Wanted("temperature", "K", ("T",)),
    Wanted("speed", "m/s", ("v", "speed_m_s")),
    Wanted("mu", ""),
)
LARGEST = 10.0  # mu


def read_table(path: Path) -> RegularGridInterpolator:
    """mu from a table with the columns temperature_C, speed_m_per_s and mu.

    The table has all combinations of temperatures and speeds. Raises SceneError.
    """
    from scipy.interpolate import RegularGridInterpolator

    table, found = read_columns(path, "friction.table", COLUMNS, [each.name for each in COLUMNS])
    values = np.column_stack([found[column.name] for column in COLUMNS])
    allowed = np.isfinite(values)
    allowed[:, 2] &= (values[:, 2] >= 0.0) & (values[:, 2] <= LARGEST)
    if not allowed.all():
        row, i = np.argwhere(~allowed)[0]
        table.refuse(
            f"row {row + 1} (line {table.lines[row].number}): {COLUMNS[i].heading} = "
            f"{values[row, i]:g}; needs finite numbers, and mu of 0 to {LARGEST:g}"
        )
    values[:, 0] -= ZERO_CELSIUS
    axes = [np.unique(values[:, i]) for i in (0, 1)]
    order = np.lexsort((values[:, 1], values[:, 0]))
    full = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    if not np.array_equal(values[order][:, :2], full):
        table.refuse("needs every combination of its temperatures and speeds once")
    # An axis with one value gets a second point, because interpolation needs two.
    mu = values[order][:, 2].reshape([axis.size for axis in axes])
    for i, axis in enumerate(axes):
        if axis.size == 1:
            axes[i], mu = np.array([axis[0], axis[0] + 1.0]), np.repeat(mu, 2, axis=i)
    return RegularGridInterpolator(axes, mu)


Parameter = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,99}$", strict=True)]


class Friction(Table):
    """The law of friction: the water film's, Coulomb's, or a class in a file of your own."""

    law: Annotated[str, StringConstraints(strict=True, max_length=1000)] = key(
        "film",
        "The friction law: the water film, Coulomb's friction, or a law of your own (a file and"
        " a class).",
    )
    mu: Annotated[float, Quantity("", "0", "2")] | None = key(
        None, "Friction coefficient of Coulomb's friction."
    )
    table: InputFile | None = key(
        None,
        "Friction coefficient over temperature and speed, for Coulomb's friction, instead of "
        "`friction.mu`.",
    )
    parameters: dict[Parameter, Annotated[StrictFloat, Field(allow_inf_nan=False)] | StrictInt] = (
        key({}, "Arguments of the class of a law of your own.")
    )

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        path, name = self.law_file
        if self.law not in ("film", "coulomb"):
            if not name.isidentifier() or path.suffix != ".py":
                raise ValueError(
                    f'friction.law = "{self.law}" is not known; allowed: "film", "coulomb", or the '
                    'class of a file, as in "my_law.py:MyLaw"'
                )
            if not is_regular(path):
                raise ValueError(f'friction.law = "{self.law}": there is no file {path}')
            object.__setattr__(self, "law", f"{path.resolve()}:{name}")
        elif self.parameters:
            raise ValueError("friction.parameters are of a law in a file of your own only")
        given = [key for key in ("mu", "table") if getattr(self, key) is not None]
        if self.law == "coulomb" and len(given) != 1:
            raise ValueError('friction.law = "coulomb" needs one of friction.mu and friction.table')
        if self.law != "coulomb" and given:
            raise ValueError(
                f'friction.{given[0]} is of friction.law = "coulomb"; here it is "{self.law}"'
            )
        if self.table is not None:
            read_table(self.table)
        return self

    @property
    def law_file(self) -> tuple[Path, str]:
        """File and class of a user law."""
        path, _, name = self.law.rpartition(":")
        return Path(path), name


HEIGHT = RowsOf("ice temperature", ICE_TEMPERATURE, Quantity("m", "0 nm", "10 um"), "0 nm")
DRY_STRESS = RowsOf("ice temperature", ICE_TEMPERATURE, Quantity("Pa", "1 Pa", "1 GPa"), "0 Pa")
DRY_RATES = RowsOf("decades of speed", Quantity("", "-50", "50"), Quantity("", "0", "10"), "0")
RESIDUAL = 0.5  # K
SCALE = Quantity("", "0.01", "100")
THINNEST = 1e-9  # m, initial height of water films


class DryShift(Table):
    """log a_T of slip speeds: an activation energy (J/mol), or C1 (of log10) and C2 (K) of WLF."""

    reference: Annotated[float, TEMPERATURE]
    activation_energy: Annotated[float, Quantity("J/mol", "0.1 kJ/mol", "2000 kJ/mol")] | None = (
        None
    )
    C1: Annotated[float, Quantity("", "0", "1000")] | None = None
    C2: Annotated[float, Quantity("K", "0.1 K", "10000 K")] | None = None

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        wlf = [self.C1 is not None, self.C2 is not None]
        if (self.activation_energy is not None) == any(wlf) or any(wlf) != all(wlf):
            raise ValueError(
                "film.dry_shift needs activation_energy, or C1 and C2, beside its reference"
            )
        return self

    @property
    def shift(self) -> AnyShift:
        """As a function of the temperature."""
        if self.C1 is not None and self.C2 is not None:
            return Shift(self.C1, self.C2, self.reference)
        assert self.activation_energy is not None  # by validation
        return arrhenius(self.activation_energy, self.reference)


class Film(Table):
    """The water film and the dry contact below it; SI units."""

    carrier: Literal["ice", "rubber"] = key(
        "ice",
        "What the films belong to when ice slides: the `ice` or the `rubber`. The same for the "
        "history of a law of your own. No effect with attached ice.",
    )
    pressure: Literal["local", "nominal"] = key(
        "local",
        "Pressure that sets k, D, H_V and the squeeze-out: that of the contact point (`local`),"
        " or the nominal one (`nominal`).",
    )
    k: Annotated[float, Quantity("", "1e-6", "1")] | None = key(
        None, "Fraction of the area in which asperities touch, instead of the compound's table."
    )
    D: Annotated[float, Quantity("m", "0.01 um", "10 mm")] | None = key(
        None, "Diameter of the contact patches, instead of the compound's table."
    )
    H_V: Annotated[float, Quantity("m", "1 nm", "10 mm")] | None = key(
        None, "Free volume between the asperities per area, instead of the compound's table."
    )
    contact: InputFile | None = key(
        None,
        "Path of a table of k, D and H_V over pressure, instead of the compound's. Relative to "
        "the scene file. If it states its rubber's modulus, it is scaled to this rubber's.",
    )
    contact_age: StrictBool = key(
        False, "k, D and H_V follow the age of the contact, by the creep of `rubber.prony`."
    )
    contact_modulus: Annotated[float, Quantity("Pa", "1 kPa", "100 GPa")] | None = key(
        None,
        "Young's modulus of the rubber of `film.contact`, if its file has no column "
        "`youngs_modulus_Pa`.",
    )
    k_scale: Annotated[float, SCALE] = key(1.0, "Factor on k of the table or the constant.")
    D_scale: Annotated[float, SCALE] = key(1.0, "Factor on D of the table or the constant.")
    H_V_scale: Annotated[float, SCALE] = key(1.0, "Factor on H_V of the table or the constant.")
    initial_height: Annotated[Any, HEIGHT] = key(
        70e-9,
        "Height of the film at the start; at least 1 nm unless `film.dry_stress` is given. A "
        "number, or rows of ice temperatures and heights (or the path of a CSV file of them). "
        "Between rows it is linear, outside it is constant.",
    )
    conductance: Annotated[float, Quantity("W/m^2/K", "10 W/m^2/K", "1e9 W/m^2/K")] | None = key(
        None,
        "Heat conductance from the film to the ice and to the rubber, with `rubber.heat`. "
        "Without it 2 k_w / h, with the conductivity k_w of water.",
    )
    water_speed: Annotated[float, Quantity("", "0", "1")] | None = key(
        None,
        "Speed of squeezed-out water relative to the rubber, over the sliding speed. 1: it "
        "moves with the ice. 0.5: Couette flow. 0: it moves with the rubber. For sliding ice that "
        "carries the films. Without it 0.5 where `film.voids` carry, whose water is sheared so, "
        "else 1.",
    )
    dry_stress: Annotated[Any, DRY_STRESS] | None = key(
        None,
        "Shear stress of dry contact where asperities touch. It limits the shear of thin films."
        " A number, or rows of surface temperatures and stresses (or the path of a CSV file of "
        "them). Values must not rise with temperature. Between rows it is linear, outside it is"
        " constant.",
    )
    dry_softening: Annotated[float, Quantity("K", "0.01 K", "200 K")] | None = key(
        None,
        "If `film.dry_stress` is a number: the temperature range in which it falls, in "
        "proportion, to 0. Without it the stress does not depend on temperature.",
    )
    dry_residual: Annotated[float, Quantity("K", "0 K", "200 K")] = key(
        RESIDUAL,
        "If `film.dry_stress` is a number: how far above the melting point it would reach 0. "
        "With 0 the ice never melts. With `film.dry_softening`.",
    )
    dry_speed: Annotated[float, Quantity("m/s", "1e-12 m/s", "1e12 m/s")] | None = key(
        None,
        "Slip speed v_0 at which the stress of dry contact has its full value, and away from which "
        "it falls by `film.dry_width` or `film.dry_rows`. A slice or a block takes the load's "
        "speed.",
    )
    dry_width: Annotated[float, Quantity("", "0.1", "100")] | None = key(
        None,
        "Decades of speed from v_0 at which the stress of dry contact has fallen to 1/e: it is "
        "multiplied by exp(-(x / w)^2), x = log10(v a_T / v_0).",
    )
    dry_rows: Annotated[Any, DRY_RATES] | None = key(
        None, "Rows of x and a factor on the stress of dry contact, instead of `film.dry_width`."
    )
    dry_shift: DryShift | None = key(
        None,
        "Shift a_T of the speed with the temperature of the ice's surface: `reference` and "
        "`activation_energy`, or `reference`, `C1` and `C2` of WLF. Without it there is none.",
    )
    refreeze: Literal["nothing", "film", "all", "area"] | None = key(
        None,
        "Which water freezes where friction does not hold the surface at the melting point: "
        "`nothing`, the `film`, or `all` water, also that which has been squeezed out, with "
        "`film.dry_stress`; by `area` films and the water of voids that carry, each by its part of "
        "the area. Without it `area` with `ice.water` where films belong to the ice, else "
        "`nothing`.",
    )
    between: Literal["freeze", "drain", "keep"] = key(
        "freeze",
        "What happens to water between passes: it freezes as far as the time allows, it is "
        "gone, or it stays, and freezes as `film.refreeze` says (without it: all). With "
        "`load.passes`.",
    )
    voids: Literal["stop", "carry"] = key(
        "stop",
        "What happens when voids are full: squeeze-out ends, as published (`stop`), or their "
        "water bears a part of the pressure (`carry`).",
    )

    @model_validator(mode="after")
    def _all_or_none(self) -> Self:
        given = [name for name in ("k", "D", "H_V") if getattr(self, name) is not None]
        if len(given) in (1, 2):
            raise ValueError(
                f"film has {' and '.join(given)} only; give k, D and H_V together, or none of them"
            )
        if self.contact is not None:
            read_contact_table(self.contact, "film.contact")
        return self

    @model_validator(mode="after")
    def _contact_has_one_modulus(self) -> Self:
        if self.contact is None:
            if self.contact_modulus is not None:
                raise ValueError(
                    "film.contact_modulus is that of film.contact, which is missing; leave it out: "
                    "the compound's own table has its modulus"
                )
            return self
        given = read_contact_table(self.contact, "film.contact").youngs_modulus
        if given is not None and self.contact_modulus is not None:
            raise ValueError(
                "film.contact has one Young's modulus of its rubber; given: both of the file's "
                "column youngs_modulus_Pa and film.contact_modulus"
            )
        if self.contact_age and given is None and self.contact_modulus is None:
            raise ValueError(
                "film.contact_age needs one Young's modulus of the rubber that film.contact is of; "
                "given: none of the file's column youngs_modulus_Pa and film.contact_modulus"
            )
        return self

    @property
    def contact_scales(self) -> tuple[float, float, float]:
        """Factors on k, D and H_V."""
        return self.k_scale, self.D_scale, self.H_V_scale

    @property
    def dry_softens(self) -> bool:
        """Whether the stress of dry contact depends on temperature."""
        if isinstance(self.dry_stress, tuple):
            return bool(self.dry_stress[-1][1] < self.dry_stress[0][1])
        return self.dry_softening is not None and self.dry_residual < self.dry_softening

    @model_validator(mode="after")
    def _dry_shear_is_whole(self) -> Self:
        stops = self.refreeze in ("film", "all")
        if stops and self.dry_stress is None:
            raise ValueError(
                f'film.refreeze = "{self.refreeze}" and no film.dry_stress contradict each other: '
                'frozen contact has dry friction; allowed: refreeze = "nothing", or film.dry_stress'
            )
        heights = self.initial_height
        if stops and (isinstance(heights, tuple) or heights > 0.0):
            raise ValueError(
                f'film.refreeze = "{self.refreeze}" and film.initial_height contradict each other: '
                "water on ice below its melting point freezes before anything slides; allowed: "
                "film.initial_height = 0"
            )
        self._check_dry_stress()
        least = min(value for _, value in heights) if isinstance(heights, tuple) else heights
        if least < THINNEST and self.dry_stress is None:
            raise ValueError(
                f"film.initial_height = {readable(least, 'm')} is out of range; allowed: 1 nm to "
                "10 um, or from 0 on with film.dry_stress, which limits the shear of thin films"
            )
        return self

    @model_validator(mode="after")
    def _speed_is_whole(self) -> Self:
        falls = [name for name in ("dry_width", "dry_rows") if getattr(self, name) is not None]
        if self.dry_speed is None:
            given = [*falls, *(["dry_shift"] if self.dry_shift is not None else [])]
            if given:
                raise ValueError(f"film.{given[0]} needs film.dry_speed, the speed that it is of")
            return self
        if self.dry_stress is None:
            raise ValueError("film.dry_speed needs film.dry_stress, the stress that depends on it")
        if len(falls) != 1:
            said = " and ".join(f"film.{name}" for name in falls) or "none of them"
            raise ValueError(
                f"film.dry_speed needs one of film.dry_width and film.dry_rows; given: {said}"
            )
        if self.dry_rows is not None and not isinstance(self.dry_rows, tuple):
            raise ValueError("film.dry_rows is a number; allowed: rows of x and a factor")
        return self

    def _check_dry_stress(self) -> None:
        """Raise ValueError if the keys of dry contact contradict each other."""
        stress, rows = self.dry_stress, isinstance(self.dry_stress, tuple)
        given = self.dry_softening is not None, self.dry_residual != RESIDUAL
        for name, is_given in zip(("dry_softening", "dry_residual"), given, strict=True):
            if is_given and (rows or stress is None):
                what = "rows of" if rows else "no"
                raise ValueError(
                    f"film.{name} and {what} film.dry_stress contradict each other: it says how a "
                    "number of dry_stress falls; allowed: film.dry_stress as a number"
                )
        if not isinstance(stress, tuple):
            return
        why = "ice gets softer as it gets warmer; allowed: stresses"
        check_falls(stress, "film.dry_stress", why)
        if stress[0][1] == 0.0:
            raise ValueError(
                "film.dry_stress is 0 in all rows; allowed: more than 0 where ice is coldest"
            )
