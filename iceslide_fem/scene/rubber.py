"""The rubber block of a scene: material, shape, and physics."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, StrictBool, StrictInt, model_validator
from pydantic_core import PydanticCustomError

from iceslide_fem.relaxation.dma_fit import Characterised, measured_in
from iceslide_fem.relaxation.prony import Relaxation
from iceslide_fem.scene.compound import Compound
from iceslide_fem.scene.cuts import WIDEST, Cut, Groove, Sipe, Sipes, evenly_spaced
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.outline_file import read_outline
from iceslide_fem.scene.roughness import RubberRoughness
from iceslide_fem.scene.units import Name, Quantity, key

BREP = ".brep"  # says no unit
CAD_FILES = ".step", ".stp", ".iges", ".igs", BREP
Length = Annotated[float, Quantity("m", "10 um", "1 m")]
BODY = "rubber"  # name of the rubber that touches the ice, in a mesh


def _heat(given: Any) -> Any:
    """Validate `rubber.heat`: off, in columns, or on the mesh."""
    if isinstance(given, bool) or given == "mesh":
        return given
    raise PydanticCustomError("form", 'is not available; allowed: true, false or "mesh"')


class Layer(Compound):
    """Another compound above the rubber that touches the ice."""

    place: ClassVar[str] = "rubber.layers"

    name: Name
    above: Length | None = key(
        None,
        "Height above the ice where the layer begins. It ends at the next one, or at the plate.",
    )


class Rubber(Compound):
    """The rubber block: its material and its shape; SI units."""

    dma: InputFile | None = key(
        None,
        "Path of a table of storage and loss modulus over frequency and temperature. Arms are "
        "fitted to it, and the shift too if neither `rubber.wlf` nor `rubber.shift_factors` is "
        "given. Also relaxation modulus over time and temperature. Instead of `rubber.prony`; "
        "relative to the scene file.",
    )
    layers: tuple[Layer, ...] = key(
        (),
        "Other compounds above the rubber that touches the ice: tables with `name`, the keys of a "
        "compound, and `above`, the height where the layer begins. Without `above` a layer is the "
        "part of `rubber.mesh` or the solid of `rubber.step` with this name.",
    )
    roughness: RubberRoughness = RubberRoughness()

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
    mesh_tags: dict[Name, Annotated[StrictInt, Field(ge=0)]] = key(
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
        "auto",
        "Cells of a block: hexahedra if the solid is a sweep across the slide, or if its faces are "
        "flat or upright; else tetrahedra.",
    )

    @property
    def is_drawn(self) -> bool:
        """Whether a file has the shape, as a mesh or by CAD."""
        return self.mesh is not None or self.step is not None

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
    def _table_is_readable(self) -> Self:
        _ = self.measured  # reports what is wrong with the table
        return self

    @property
    def series(self) -> str:
        """The key that gives the relaxation; "" for elastic rubber."""
        return "dma" if self.dma is not None else super().series

    @property
    def measured(self) -> Characterised | None:
        """The compound of the DMA table; None without one."""
        return None if self.dma is None else measured_in(self.dma, "rubber.dma", self.given_shift)

    @property
    def relaxation(self) -> Relaxation | None:
        """Viscoelasticity of the rubber; None if it is elastic."""
        measured = self.measured
        return super().relaxation if measured is None else measured.relaxation

    @property
    def heights(self) -> tuple[float, ...]:
        """Heights above the ice where layers begin, m; none for those that a drawing has."""
        return tuple(layer.above for layer in self.layers if layer.above is not None)

    @property
    def compounds(self) -> dict[str, Compound]:
        """Compound of each region: "rubber", which touches the ice, and the layers by name."""
        return {BODY: self, **{layer.name: layer for layer in self.layers}}
