"""The heat-conducting bodies below and above the films of a block: meshed, or in modes."""

from __future__ import annotations

import math

import numpy as np

from iceslide_fem.film.conditions import half_film
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.heat.elements import LayeredElements, QuadraticElements
from iceslide_fem.heat.equation import HeatEquation, of_regions, uniform
from iceslide_fem.heat.tabulated import Rows, TabulatedHeat
from iceslide_fem.interface.ice_continuum import Continuum
from iceslide_fem.interface.ice_mesh import Settings
from iceslide_fem.interface.rubber_mesh import MeshedRubber
from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.grid import Lines
from iceslide_fem.mesh.ice import passing_time
from iceslide_fem.mesh.ice_body import ice_body
from iceslide_fem.mesh.rubber import block_shape
from iceslide_fem.rubber.block import Block
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from iceslide_fem.scene.thermal_layers import HEATED_LAYERS

# Continuum ice, relative to the tolerance: the error of dropped modes; the interface resistance
# between points and ice, over the resistance of the layers that the shortest heating reaches. A 25
# times larger interface resistance changes mu(t) by eight times the tolerance where points saturate
# (docs/validation/accuracy.md).
CONDENSED, INTERFACE_RESISTANCE = 0.005, 3e-4
# Largest difference (K) between the temperatures of points and ice, relative to the tolerance. The
# heat of a point follows from a temperature difference of this order over the resistance, so a
# looser value makes it arbitrary. A smaller resistance raises the effect of rounding: this floor
# (K) is divided by the tolerance.
AGREEMENT, ROUNDING = 1e-2, 1e-11


def equation_of(block: Block, surface: list[Lines], heated: Array) -> HeatEquation:
    """Heat equation of ice below these grid lines (m), or of the user's mesh. Collective.

    heated: times for which the ice is heated, s.
    """
    ice, comm = block.scene.ice, block.surface.comm
    body = gmsh_model.distribute_made(lambda: ice_body(block.scene, surface, heated), comm)
    solids = {layer.name: layer.solid for layer in ice.stack}
    base = None if ice.held is None else ("base", ice.held - ice.temperature)
    elements = LayeredElements(body.mesh)
    if not ice.has_rows:
        return HeatEquation(body, elements, of_regions(body, solids), base)
    rows = Rows.of(ice.conductivity), Rows.of(ice.heat_capacity)
    return TabulatedHeat(body, elements, solids, ice.temperature, rows, base)


def meshed_rubber(block: Block) -> MeshedRubber:
    """The block as a body that conducts heat in its mesh. Collective."""
    rubber, body = block.scene.rubber, block.rubber.block
    plate = ("plate", 0.0) if rubber.plate == "held" else None
    properties = uniform(body.mesh, rubber.solid)
    equation = HeatEquation(body, QuadraticElements(body.mesh), properties, plate)
    return MeshedRubber(equation, block.surface, half_film(block.scene))


def settings_of(block: Block, heated: Array) -> Settings:
    """Settings of meshed ice with these heating times `heated` (s)."""
    scene, solid = block.scene, block.scene.ice.solid
    tolerance, longest = scene.numerics.tolerance, float(np.max(heated))
    deep = HEATED_LAYERS * math.sqrt(solid.diffusivity * longest)
    fraction = _shortest(scene, heated) / longest
    interface_resistance = (
        INTERFACE_RESISTANCE * tolerance * fraction**0.5 * deep / solid.conductivity
    )
    return Settings(solid, scene.ice.temperature, interface_resistance, agreement(tolerance))


def _shortest(scene: Scene, heated: Array) -> float:
    """Shortest time (s) for which ice is heated."""
    shortest = float(np.min(heated))
    if scene.ice.motion == "sliding":
        (low, high), *_ = block_shape(scene).ranges
        longest = float(np.max(heated))
        shortest = min(shortest, passing_time(high - low, scene.load.speeds.largest, longest))
    return shortest


def continuum_of(block: Block, surface: list[Lines], heated: Array) -> Continuum:
    """Continuum ice below these grid lines (m), heated for `heated` (s)."""
    scene, comm = block.scene, block.surface.comm
    column = Column(scene.ice.temperature, heated, solid=scene.ice.solid)
    fraction, tolerance = _shortest(scene, heated) / float(np.max(heated)), scene.numerics.tolerance
    column = column.condensed(CONDENSED * tolerance, fraction)
    interface_resistance = INTERFACE_RESISTANCE * tolerance * fraction**0.5
    return Continuum(surface, comm, column, interface_resistance, agreement(tolerance))


def agreement(tolerance: float) -> float:
    """Largest allowed temperature difference (K) of points and continuum ice."""
    return max(AGREEMENT * tolerance, ROUNDING / tolerance)
