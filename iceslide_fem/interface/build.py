"""The interface that a scene asks for: who carries the film, on which ice, where the points lie."""

from __future__ import annotations

import math

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.conditions import half_film, rubber_columns
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.rubber_heat import INSULATED, Insulated, RubberColumns
from iceslide_fem.heat.elements import LayeredElements, QuadraticElements
from iceslide_fem.heat.equation import HeatEquation, of_regions, uniform
from iceslide_fem.heat.tabulated import Rows, TabulatedHeat
from iceslide_fem.interface.ice_columns import GridColumns, GridColumnsUnderPoints, OwnColumns
from iceslide_fem.interface.ice_continuum import Continuum
from iceslide_fem.interface.ice_mesh import MeshedIce, Settings
from iceslide_fem.interface.on_ice import OnIce
from iceslide_fem.interface.on_rubber import Attached, AttachedBetween, OnRubber, Rubbing
from iceslide_fem.interface.passing_mesh import PassingMeshedIce, PassingMeshedIceAndRubber
from iceslide_fem.interface.rubber_columns import RubberOverGrid
from iceslide_fem.interface.rubber_mesh import MeshedIceAndRubber, MeshedRubber
from iceslide_fem.interface.surface_grid import Placement, SurfaceGrid, own_points
from iceslide_fem.interface.user_law_on_ice import UserLawOnIce
from iceslide_fem.laws.film import FilmLaw
from iceslide_fem.laws.user_law import UserLaw
from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.grid import Lines
from iceslide_fem.mesh.ice import heating_times, passing_time, patch_lines, window_lines
from iceslide_fem.mesh.ice_body import ice_body
from iceslide_fem.mesh.rubber import block_shape
from iceslide_fem.rubber.block import Block
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from iceslide_fem.scene.thermal_layers import HEATED_LAYERS

# Of continuum ice, relative to the tolerance: the error of fewer modes than its mesh has; what is
# between its points and it, of the resistance of the layers that the shortest heating reaches. 25
# times that moves mu(t) by eight times the tolerance where points saturate (docs/accuracy.md).
CONDENSED, INTERFACE_RESISTANCE = 0.005, 3e-4
# How far (K) its points and it may disagree, relative to the tolerance. Much less closely found,
# what single points give would be arbitrary: temperatures differ by as little over the resistance.
# The stiffer that is, the more of them is rounding, by so much (K) over the tolerance.
AGREEMENT, ROUNDING = 1e-2, 1e-11


def film_frame_of(block: Block, layers_for: float | None = None) -> Attached | OnRubber | OnIce:
    """Carrier of the films below the block at its present displacements. Collective.

    layers_for (s): what conducts heat has the layers of a run of that duration, and more below them
    as the scene's duration wants; by default that is the same.
    """
    duration = block.scene.load.duration
    first = duration if layers_for is None else layers_for
    build = _attached if block.scene.ice.motion == "attached" else _sliding
    return build(block, np.array([first, duration]))


def _attached(block: Block, duration: Array) -> Attached:
    scene, solid = block.scene, block.scene.ice.solid
    temperature = scene.ice.temperature
    rubber = INSULATED if scene.rubber.heat == "mesh" else rubber_columns(scene, duration)
    if scene.ice.heat == "column":
        columns = OwnColumns(Column(temperature, duration, solid=solid, ground=scene.ice.ground))
        return Attached(block.law, columns, own_points(block.surface.n_points), rubber)
    if scene.ice.heat == "half-space":
        half_spaces = OwnColumns(HalfSpace(temperature, duration, solid))
        return Attached(block.law, half_spaces, own_points(block.surface.n_points))
    points, footprint = _footprint(block)
    if scene.ice.heat == "mesh":
        equation = _equation(block, patch_lines(scene, footprint), duration)
        settings = _settings(block, duration)
        if scene.rubber.heat == "mesh":
            both = MeshedIceAndRubber(equation, _meshed_rubber(block), settings)
            return AttachedBetween(block.law, both, both.place(points))
        meshed = MeshedIce(equation, settings)
        return _on_shared(block, meshed, meshed.place(points), rubber)
    ice = _continuum(block, patch_lines(scene, footprint), duration)
    # The ice stays under the point of the rubber that it lies under at t = 0.
    return _on_shared(block, ice, ice.grid.place(points), rubber)


def _on_shared(
    block: Block, ice: Continuum | MeshedIce, at: Placement, rubber: RubberColumns | Insulated
) -> Attached:
    """Films on the rubber's points, which lie `at` places of ice that they share."""
    if block.law.columns or not block.law.viscous or rubber is not INSULATED:
        return Attached(block.law, ice, at, rubber)
    return Rubbing(block.law, ice, at)


def _sliding(block: Block, duration: Array) -> OnRubber | OnIce:
    scene, comm = block.scene, block.surface.comm
    temperature, solid = scene.ice.temperature, scene.ice.solid
    _, footprint = _footprint(block)
    lines = window_lines(scene, footprint)
    law = block.law
    frame = law.frame(scene.film.carrier)
    heated = heating_times(scene, float(np.ptp(lines[0])), duration)
    ice: Continuum | GridColumns | PassingMeshedIce
    if scene.ice.heat == "mesh":
        grid, settings = SurfaceGrid.shared(lines, comm), _settings(block, heated)
        equation = _equation(block, lines, heated)
        if scene.rubber.heat == "mesh":
            above = _meshed_rubber(block)
            return OnRubber(law, PassingMeshedIceAndRubber(equation, above, grid, settings))
        ice = PassingMeshedIce(equation, grid, settings)
    elif scene.ice.heat == "continuum":
        ice = _continuum(block, lines, heated)
    else:
        nodal = frame == "ice" and isinstance(law, FilmLaw)
        columns = GridColumns if nodal else GridColumnsUnderPoints
        grid = SurfaceGrid.shared(lines, comm)
        ice = columns(grid, temperature, heated, solid, scene.ice.ground)
    if frame == "ice" and isinstance(law, FilmLaw):
        rubber = _rubber_over_grid(scene, ice.grid, duration)
        return OnIce(law, ice, scene.initial_height, rubber, scene.film.water_speed)
    columns_above = rubber_columns(scene, duration)
    if frame == "ice" and isinstance(law, UserLaw):
        return UserLawOnIce(law, ice, columns_above)
    return OnRubber(law, ice, columns_above)


def _rubber_over_grid(scene: Scene, grid: SurfaceGrid, duration: Array) -> RubberOverGrid | None:
    """Rubber that takes heat from films on nodes of the ice, None where it takes none."""
    if not scene.rubber.heat:
        return None
    ice, solid = scene.ice, scene.rubber.solid
    settings = duration, solid, half_film(scene), ice.melting_temperature
    return RubberOverGrid(grid, ice.temperature, *settings)


def _equation(block: Block, surface: list[Lines], heated: Array) -> HeatEquation:
    """Heat equation of ice that is `heated` (s) below these lines (m) of its surface, or of the
    mesh of the user's own. Collective.
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


def _meshed_rubber(block: Block) -> MeshedRubber:
    """The block as it conducts heat in its own mesh. Collective."""
    rubber, body = block.scene.rubber, block.rubber.block
    plate = ("plate", 0.0) if rubber.plate == "held" else None
    properties = uniform(body.mesh, rubber.solid)
    equation = HeatEquation(body, QuadraticElements(body.mesh), properties, plate)
    return MeshedRubber(equation, block.surface, half_film(block.scene))


def _settings(block: Block, heated: Array) -> Settings:
    """Of meshed ice that is `heated` (s)."""
    scene, solid = block.scene, block.scene.ice.solid
    tolerance, longest = scene.numerics.tolerance, float(np.max(heated))
    deep = HEATED_LAYERS * math.sqrt(solid.diffusivity * longest)
    fraction = _shortest(scene, heated) / longest
    interface_resistance = (
        INTERFACE_RESISTANCE * tolerance * fraction**0.5 * deep / solid.conductivity
    )
    return Settings(solid, scene.ice.temperature, interface_resistance, agreement(tolerance))


def _shortest(scene: Scene, heated: Array) -> float:
    """How long (s) some of the ice is heated, at least."""
    shortest = float(np.min(heated))
    if scene.ice.motion == "sliding":
        (low, high), *_ = block_shape(scene).ranges
        longest = float(np.max(heated))
        shortest = min(shortest, passing_time(high - low, scene.load.speeds.largest, longest))
    return shortest


def _continuum(block: Block, surface: list[Lines], heated: Array) -> Continuum:
    """Ice that is `heated` (s) below those lines of its surface."""
    scene, comm = block.scene, block.surface.comm
    column = Column(scene.ice.temperature, heated, solid=scene.ice.solid)
    fraction, tolerance = _shortest(scene, heated) / float(np.max(heated)), scene.numerics.tolerance
    column = column.condensed(CONDENSED * tolerance, fraction)
    interface_resistance = INTERFACE_RESISTANCE * tolerance * fraction**0.5
    return Continuum(surface, comm, column, interface_resistance, agreement(tolerance))


def agreement(tolerance: float) -> float:
    """How far (K) points and continuum ice may disagree at a tolerance."""
    return max(AGREEMENT * tolerance, ROUNDING / tolerance)


def _footprint(block: Block) -> tuple[Array, list[tuple[float, float]]]:
    """Horizontal positions of the points (n, d-1) and the ranges of what is in contact, m.

    Points do not reach the edges: the facets' nodes count, too.
    """
    surface, displacements = block.surface, block.rubber.displacements
    positions = surface.positions(displacements)
    dim = positions.shape[-1]
    points = positions.reshape(surface.n_points, dim)[:, :-1]
    nodes = (surface.nodes + displacements[surface.dofs]).reshape(-1, dim)
    touching = np.concatenate(
        [points[block.contact.pressure.ravel() > 0.0], nodes[nodes[:, -1] < 0.0, :-1]]
    )
    low, high = touching.min(axis=0, initial=np.inf), touching.max(axis=0, initial=-np.inf)
    comm = block.surface.comm
    comm.Allreduce(MPI.IN_PLACE, low, op=MPI.MIN)
    comm.Allreduce(MPI.IN_PLACE, high, op=MPI.MAX)
    if "symmetry" in block.rubber.block.tags:
        low[1] = 0.0
    return points, list(zip(low.tolist(), high.tolist(), strict=True))
