"""A rubber compound in a scene: its elastic constants, its relaxation, its thermal properties."""

from __future__ import annotations

from dataclasses import astuple
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AliasChoices, field_validator, model_validator

from iceslide_fem.relaxation.prony import Prony, Relaxation
from iceslide_fem.relaxation.shift import NoShift, Shift, ShiftTable
from iceslide_fem.scene.materials import (
    COMPOUNDS,
    RUBBER_CONDUCTIVITY,
    RUBBER_HEAT_CAPACITY,
    YOUNGS_MODULUS_ONLY,
    MooneyRivlin,
    Solid,
)
from iceslide_fem.scene.relaxation import MOST_ARMS, Arms, Factors, Wlf
from iceslide_fem.scene.units import Quantity, Table, key

Modulus = Literal["instantaneous", "long-term"]
Stiffness = Annotated[float, Quantity("Pa", "0 MPa", "100000 MPa")]
LEAST_INSTANTANEOUS_NU = 0.3  # for viscoelastic rubber


class Compound(Table):
    """Material of the rubber or of one of its layers; SI units."""

    place: ClassVar[str] = "rubber"  # the table of its keys

    compound: str | None = key(None, "Rubber with published constants and contact parameters.")
    C10: Stiffness | None = key(None, "Mooney-Rivlin constant, instead of a compound.")
    C01: Stiffness | None = key(None, "Mooney-Rivlin constant, instead of a compound.")
    D1: Annotated[float, Quantity("1/Pa", "1e-6 1/MPa", "1000 1/MPa")] | None = key(
        None,
        "Compressibility, 2/K with the bulk modulus K. It replaces that of a compound. Give "
        "either `D1` or `nu`.",
    )
    nu: Annotated[float, Quantity("", "0", "0.4995")] | None = key(
        None,
        "Poisson's ratio at small strain; `rubber.poisson_ratio` is the same key. Give either "
        "`D1` or `nu`.",
        validation_alias=AliasChoices("nu", "poisson_ratio"),
    )
    prony: Arms = key(
        None,
        f"Relaxation: up to {MOST_ARMS} arms `[g, tau]`. g is a fraction of the instantaneous "
        "modulus, tau a time. The sum of all g is below 1.",
    )
    wlf: Wlf | None = key(
        None,
        "Shift of the times `tau` with temperature: `C1` (of log10), `C2` (K), `reference` (a "
        "temperature). Below `arrhenius_below` an `activation_energy` holds. `measured`, the "
        "coldest and warmest isotherm that they come from, lets a run say where they are "
        "extrapolated.",
    )
    shift_factors: Factors = key(
        None,
        "Shift of the times `tau` where no WLF equation holds: rows of temperature and log10 "
        'a_T, as `[["-20 degC", 2.1], ["20 degC", 0]]`. Between rows, and beyond them, an '
        "activation energy. Two rows are the Arrhenius law. Instead of `rubber.wlf`.",
    )
    modulus_is: Modulus | None = key(
        None,
        "Which modulus the elastic constants are. Needed with `rubber.prony` or `rubber.dma`, "
        "because these give ratios of moduli only.",
    )
    density: Annotated[float, Quantity("kg/m^3", "100 kg/m^3", "25000 kg/m^3")] = key(
        1100.0, "Density. For `rubber.inertia`, `rubber.heat` and `iceslide info`."
    )
    conductivity: Annotated[float, Quantity("W/m/K", "0.01 W/m/K", "1000 W/m/K")] = key(
        RUBBER_CONDUCTIVITY, "Heat conductivity. For `rubber.heat`."
    )
    heat_capacity: Annotated[float, Quantity("J/kg/K", "100 J/kg/K", "10000 J/kg/K")] = key(
        RUBBER_HEAT_CAPACITY, "Heat capacity. For `rubber.heat`."
    )

    @field_validator("compound")
    @classmethod
    def _published(cls, compound: str | None) -> str | None:
        if compound in YOUNGS_MODULUS_ONLY:
            raise ValueError(
                f'{cls.place}.compound = "{compound}" cannot be used: only its Young\'s modulus '
                f"({YOUNGS_MODULUS_ONLY[compound] / 1e6:.2f} MPa) is published; give "
                f"{cls.place}.C10, {cls.place}.C01 and {cls.place}.D1 (or nu), and film.k, film.D "
                "and film.H_V instead"
            )
        if compound is not None and compound not in COMPOUNDS:
            allowed = ", ".join(f'"{name}"' for name in COMPOUNDS)
            raise ValueError(
                f'{cls.place}.compound = "{compound}" is not known; allowed: {allowed}, or '
                f"{cls.place}.C10, {cls.place}.C01 and {cls.place}.D1 (or nu) instead"
            )
        return compound

    @model_validator(mode="after")
    def _one_description(self) -> Self:
        place = self.place
        given = [name for name in ("C10", "C01", "D1", "nu") if getattr(self, name) is not None]
        if self.compound is not None:
            return self
        if len(given) < 3:
            raise ValueError(
                f'{place} needs compound = "B", or C10, C01 and one of D1 and nu; '
                f"given: {', '.join(given) or 'none of them'}"
            )
        if self.C10 == self.C01 == 0.0:
            raise ValueError(
                f"{place}.C10 and {place}.C01 are both 0; one of them must be positive"
            )
        return self

    @model_validator(mode="after")
    def _relaxation_is_whole(self) -> Self:
        if not (series := self.series):
            for name in ("wlf", "shift_factors", "modulus_is"):
                if getattr(self, name) is not None:
                    raise ValueError(
                        f"{self.place}.{name} has a meaning only for rubber that relaxes; leave it "
                        f"out, or give {self.place}.prony or rubber.dma"
                    )
        elif self.modulus_is is None:
            raise ValueError(
                f"{self.place}.modulus_is is missing: {self.place}.{series} does not say which "
                'modulus the compound, or C10 and C01, are; allowed: "instantaneous", "long-term"'
            )
        return self

    @property
    def series(self) -> str:
        """The key that gives the relaxation; "" for elastic rubber."""
        return "" if self.prony is None else "prony"

    @property
    def relaxation(self) -> Relaxation | None:
        """Viscoelasticity of the rubber; None if it is elastic."""
        if self.prony is None:
            return None
        ends = None if self.wlf is None else self.wlf.measured
        if self.shift_factors is not None:
            ends = self.shift_factors[0][0], self.shift_factors[-1][0]
        arms = Prony(*zip(*self.prony, strict=True))
        return Relaxation(arms, self.given_shift or NoShift(), ends)

    @property
    def given_shift(self) -> Shift | ShiftTable | None:
        """The shift that the keys give, instead of a fitted one."""
        if self.shift_factors is not None:
            return ShiftTable(*zip(*self.shift_factors, strict=True))
        return None if self.wlf is None else self.wlf.shift

    @property
    def solid(self) -> Solid:
        """Thermal properties of the rubber."""
        return Solid(self.conductivity, self.density, self.heat_capacity)

    def constants(self, wanted: Modulus = "instantaneous") -> MooneyRivlin:
        """Mooney-Rivlin constants (SI) at this modulus; elastic rubber has one."""
        if self.compound is not None:
            C10, C01, D1 = astuple(COMPOUNDS[self.compound])
        else:
            assert self.C10 is not None and self.C01 is not None  # by validation
            C10, C01, D1 = self.C10, self.C01, 0.0
        if self.nu is not None:
            D1 = MooneyRivlin.from_nu(C10, C01, self.nu).D1
        given = MooneyRivlin(C10, C01, D1 if self.D1 is None else self.D1)
        relaxation = self.relaxation
        if relaxation is None or self.modulus_is == wanted:
            return given
        left = relaxation.prony.long_term
        return given.stiffer(left if wanted == "long-term" else 1.0 / left)

    def check_bulk(self) -> None:
        """Raise ValueError if Poisson's ratio at the instantaneous modulus is too small."""
        instantaneous = self.constants()
        nu = instantaneous.poissons_ratio
        if self.series and nu < LEAST_INSTANTANEOUS_NU:
            moduli = instantaneous.bulk_modulus, instantaneous.shear_modulus
            K, G = (f"{value / 1e6:.3g} MPa" for value in moduli)
            raise ValueError(
                f"{self.place} with a bulk modulus of {K} and an instantaneous shear modulus of "
                f"{G} has a Poisson's ratio of {nu:.2g} at once; allowed: "
                f"{LEAST_INSTANTANEOUS_NU} or more, by a smaller {self.place}.D1 (volume does not "
                "relax: 2/D1 is about 2.9 GPa of rubber)"
            )
