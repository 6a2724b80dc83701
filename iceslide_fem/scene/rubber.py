"""The rubber block of a scene: material, shape, and physics."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import (
    AliasChoices,
    BeforeValidator,
    Field,
    StrictBool,
    StrictInt,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from iceslide_fem.relaxation.dma_fit import Characterised, measured_in
from iceslide_fem.relaxation.prony import Prony, Relaxation
from iceslide_fem.relaxation.shift import NoShift, Shift, ShiftTable
from iceslide_fem.scene.cuts import (
    WIDEST,
    Cut,
    Groove,
    Sipe,
    Sipes,
    evenly_spaced,
)
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import (
    COMPOUNDS,
    RUBBER_CONDUCTIVITY,
    RUBBER_HEAT_CAPACITY,
    YOUNGS_MODULUS_ONLY,
    MooneyRivlin,
    Solid,
)
from iceslide_fem.scene.outline_file import read_outline
from iceslide_fem.scene.relaxation import Arms, Factors, Wlf
from iceslide_fem.scene.roughness import RubberRoughness
from iceslide_fem.scene.units import Quantity, Table, key

BREP = ".brep"  # says no unit
CAD_FILES = ".step", ".stp", ".iges", ".igs", BREP
LEAST_INSTANTANEOUS_NU = 0.3  # for viscoelastic rubber
Length = Annotated[float, Quantity("m", "10 um", "1 m")]
Stiffness = Annotated[float, Quantity("Pa", "0 MPa", "10000 MPa")]


def _heat(given: Any) -> Any:
    """Validate `rubber.heat`: off, in columns, or on the mesh."""
    if isinstance(given, bool) or given == "mesh":
        return given
    raise PydanticCustomError("form", 'is not available; allowed: true, false or "mesh"')


MeshName = Literal["rubber", "contact", "plate", "symmetry", "walls"]


class Rubber(Table):
    """The rubber block: its material and its shape; SI units."""

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
        "Relaxation: up to 50 arms `[g, tau]`. g is a fraction of the instantaneous modulus, "
        "tau a time. The sum of all g is below 1.",
    )
    dma: InputFile | None = key(
        None,
        "Path of a table of storage and loss modulus over frequency and temperature. Arms are "
        "fitted to it, and the shift too if neither `rubber.wlf` nor `rubber.shift_factors` is "
        "given. Also relaxation modulus over time and temperature. Instead of `rubber.prony`; "
        "relative to the scene file.",
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
    roughness: RubberRoughness = RubberRoughness()

    modulus_is: Literal["instantaneous", "long-term"] | None = key(
        None,
        "Which modulus the elastic constants are. Needed with `rubber.prony` or `rubber.dma`, "
        "because these give ratios of moduli only.",
    )
    length: Length = key(1e-3, "Length of the block along the sliding direction x.")
    width: Length = key(
        1e-3,
        "Width of the block across the sliding direction. In a slice or a point it only scales "
        "forces.",
    )
    height: Length = key(1e-3, "Height of the block from the ice to the plate.")
    edge_radius: Cut = key(
        0.0,
        "Radius of all lower edges, also of those at sipes and grooves. 0, or from 1 µm to 0.2 "
        "of the shortest lug, of the height, and of the depths of sipes and grooves; in a block"
        " also of the width of lugs.",
    )
    chamfer: Cut = key(
        0.0,
        "Chamfer of the lower edges at 45° instead of a radius: the length that is cut off on "
        "either side.",
    )
    draft_angle: Annotated[float, Quantity("rad", "0 deg", "30 deg")] = key(
        0.0, "Angle of the sides to the vertical. The block is wider at the plate than at the ice."
    )
    sipes: Sipes = key(
        0,
        "Number of evenly spaced sipes, which are slots across the sliding direction. Or a list"
        " with one table for each sipe.",
    )
    sipe_width: Length = key(0.5e-3, "Width of each sipe, along the sliding direction.")
    sipe_depth: Length = key(4e-3, "Depth of each sipe, from the ice upwards.")
    grooves: tuple[Groove, ...] = key(
        (), "Slots along the sliding direction. No effect in a slice."
    )
    stores_water: StrictBool = key(
        False,
        "Sipes take only the water that their volume holds. Otherwise they take all water. With"
        ' `film.voids = "carry"`.',
    )
    wall_friction: Annotated[float, Quantity("", "0", "2")] = key(
        0.0, "Friction coefficient between walls of sipes and grooves that touch."
    )
    outline: InputFile | None = key(
        None,
        "Path of a file with polygons, the block seen from above, instead of the rectangle; "
        "relative to the scene file.",
    )
    density: Annotated[float, Quantity("kg/m^3", "100 kg/m^3", "10000 kg/m^3")] = key(
        1100.0, "Density. For `rubber.inertia`, `rubber.heat` and `iceslide info`."
    )
    conductivity: Annotated[float, Quantity("W/m/K", "0.01 W/m/K", "100 W/m/K")] = key(
        RUBBER_CONDUCTIVITY, "Heat conductivity. For `rubber.heat`."
    )
    heat_capacity: Annotated[float, Quantity("J/kg/K", "100 J/kg/K", "10000 J/kg/K")] = key(
        RUBBER_HEAT_CAPACITY, "Heat capacity. For `rubber.heat`."
    )
    heat: Annotated[bool | Literal["mesh"], BeforeValidator(_heat)] = key(
        False,
        "Heat conduction in the rubber: `true` in columns above the contact points, `mesh` on "
        "the mesh of the rubber.",
    )
    temperature: Annotated[float, Quantity("K", "-80 degC", "80 degC")] | None = key(
        None,
        "Temperature of the rubber when it touches the ice. It shifts relaxation, and with "
        "`rubber.heat` the rubber takes heat or gives it. Without it `ice.temperature`.",
    )
    plate: Literal["insulated", "held"] = key(
        "insulated",
        'The plate above the rubber, for `rubber.heat = "mesh"`: no heat leaves there '
        "(`insulated`), or it stays at `rubber.temperature` (`held`).",
    )
    inertia: StrictBool = key(
        False, "`true` gives the rubber its mass (implicit dynamics). `false` is quasi-static."
    )
    rows: Annotated[int, Field(ge=1, le=1000)] = key(
        1,
        "Number of blocks that pass over the same ice one behind the other. For a point with "
        "sliding ice.",
    )
    row_pitch: Length | None = key(
        None, "Distance from the leading edge of one block to that of the next."
    )
    mesh: InputFile | None = key(
        None, "Path of a mesh of your own, instead of the built-in one; relative to the scene file."
    )
    mesh_unit: Literal["m", "cm", "mm", "um", "inch"] = key(
        "m", "Unit of the coordinates of `rubber.mesh`."
    )
    mesh_tags: dict[MeshName, Annotated[StrictInt, Field(ge=0)]] = key(
        {},
        "Numbers that stand for names in `rubber.mesh`, for tags of DOLFINx in XDMF: `{ rubber "
        "= 1, contact = 2, plate = 3 }`.",
    )

    step: InputFile | None = key(
        None,
        "Path of a CAD file of the tread instead of its shape or a mesh: `.step`, `.stp`, `.iges`, "
        "`.igs` or `.brep`; relative to the scene file. Its parts are named by geometry "
        "(`iceslide info --picture`).",
    )
    step_unit: Annotated[float, Quantity("m", "1 um", "1 m")] = key(
        1e-3, "Unit of the lengths of a `.brep` file. Other files say theirs."
    )
    step_up: Literal["auto", "x", "-x", "y", "-y", "z", "-z"] = key(
        "auto",
        "Axis of the file that points from the ice to the plate. `auto` is the end with the "
        "largest surplus of flat area.",
    )
    step_along: Literal["x", "-x", "y", "-y", "z", "-z"] = key(
        "x", "Axis of the file that points where the rubber slides."
    )
    step_plane: Annotated[float, Quantity("m", "-1 m", "1 m")] | None = key(
        None, "Distance from the middle of the tread, across the slide, at which a slice is cut."
    )
    step_gap: Length | None = key(
        None, "Distance over which walls of sipes face each other; by default half of the height."
    )
    step_heal: Annotated[float, Quantity("m", "0 m", "0.1 mm")] = key(
        0.0, "Gaps between faces up to this width are closed."
    )
    step_cells: Literal["auto", "hexahedra", "tetrahedra"] = key(
        "auto", "Cells of a block: hexahedra if the solid is a sweep across the slide."
    )

    @property
    def is_drawn(self) -> bool:
        """Whether a file has the shape, as a mesh or by CAD."""
        return self.mesh is not None or self.step is not None

    @field_validator("compound")
    @classmethod
    def _published(cls, compound: str | None) -> str | None:
        if compound in YOUNGS_MODULUS_ONLY:
            raise ValueError(
                f'rubber.compound = "{compound}" cannot be used: only its Young\'s modulus '
                f"({YOUNGS_MODULUS_ONLY[compound] / 1e6:.2f} MPa) is published; give rubber.C10, "
                "rubber.C01 and rubber.D1 (or nu), and film.k, film.D and film.H_V instead"
            )
        if compound is not None and compound not in COMPOUNDS:
            allowed = ", ".join(f'"{name}"' for name in COMPOUNDS)
            raise ValueError(
                f'rubber.compound = "{compound}" is not known; allowed: {allowed}, '
                "or rubber.C10, rubber.C01 and rubber.D1 (or nu) instead"
            )
        return compound

    @model_validator(mode="after")
    def _cuts_fit(self) -> Self:
        if isinstance(self.sipes, int) and self.sipes:
            most = WIDEST * self.length / (self.sipes + 1)
            if self.sipe_width > most:
                cuts = "one sipe" if self.sipes == 1 else f"{self.sipes} sipes"
                raise ValueError(
                    f"rubber.sipe_width = {1e3 * self.sipe_width:.3g} mm is too wide for "
                    f"{cuts} in {1e3 * self.length:.3g} mm; allowed: up to "
                    f"{1e3 * most:.3g} mm, half of their distance"
                )
        if self.outline is not None:
            read_outline(self.outline, "rubber.outline")
        if self.step is not None and self.step.suffix.lower() not in CAD_FILES:
            raise ValueError(
                f"rubber.step = {self.step} has another suffix than those of CAD files; allowed: "
                f"{', '.join(CAD_FILES)}"
            )
        return self

    @property
    def cuts(self) -> tuple[Sipe, ...]:
        """The sipes one by one, along x."""
        if isinstance(self.sipes, int):
            return evenly_spaced(self.sipes, self.length, self.sipe_width, self.sipe_depth)
        return tuple(sorted(self.sipes, key=lambda sipe: sipe.position))

    @model_validator(mode="after")
    def _one_description(self) -> Self:
        given = [name for name in ("C10", "C01", "D1", "nu") if getattr(self, name) is not None]
        if self.compound is not None:
            return self
        if len(given) < 3:
            raise ValueError(
                'rubber needs compound = "B", or C10, C01 and one of D1 and nu; '
                f"given: {', '.join(given) or 'none of them'}"
            )
        if self.C10 == self.C01 == 0.0:
            raise ValueError("rubber.C10 and rubber.C01 are both 0; one of them must be positive")
        return self

    @model_validator(mode="after")
    def _relaxation_is_whole(self) -> Self:
        if self.prony is None and self.dma is None:
            for key in ("wlf", "shift_factors", "modulus_is"):
                if getattr(self, key) is not None:
                    raise ValueError(
                        f"rubber.{key} has a meaning only for rubber that relaxes; leave it out, "
                        "or give rubber.prony or rubber.dma"
                    )
        elif self.modulus_is is None:
            given = "prony" if self.dma is None else "dma"
            raise ValueError(
                f"rubber.modulus_is is missing: rubber.{given} does not say which modulus the "
                'compound, or C10 and C01, are; allowed: "instantaneous", "long-term"'
            )
        _ = self.measured  # reports what is wrong with the table
        return self

    @property
    def measured(self) -> Characterised | None:
        """The compound of the DMA table; None without one."""
        return None if self.dma is None else measured_in(self.dma, "rubber.dma", self.given_shift)

    @property
    def relaxation(self) -> Relaxation | None:
        """Viscoelasticity of the rubber; None if it is elastic."""
        if (measured := self.measured) is not None:
            return measured.relaxation
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


def check_bulk(instantaneous: MooneyRivlin, rubber: Rubber) -> None:
    """Raise ValueError if Poisson's ratio at the instantaneous modulus is too small."""
    nu = instantaneous.poissons_ratio
    moduli = instantaneous.bulk_modulus, instantaneous.shear_modulus
    if rubber.relaxation is not None and nu < LEAST_INSTANTANEOUS_NU:
        K, G = (f"{value / 1e6:.3g} MPa" for value in moduli)
        raise ValueError(
            f"rubber with a bulk modulus of {K} and an instantaneous shear modulus of {G} has a "
            f"Poisson's ratio of {nu:.2g} at once; allowed: {LEAST_INSTANTANEOUS_NU} or more, by a "
            "smaller rubber.D1 (volume does not relax: 2/D1 is about 2.9 GPa of rubber)"
        )
