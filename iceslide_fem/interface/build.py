"""The interface of a scene: the film frame, the model of ice and rubber, the points' positions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.conditions import half_film, rubber_columns
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.rubber_heat import INSULATED
from iceslide_fem.heat.elements import LayeredElements, QuadraticElements
from iceslide_fem.heat.equation import HeatEquation, of_regions
from iceslide_fem.heat.tabulated import TabulatedHeat
from iceslide_fem.interface.ice_columns import GridColumns, GridColumnsUnderPoints, OwnColumns
from iceslide_fem.interface.ice_continuum import Continuum
from iceslide_fem.interface.ice_mesh import MeshedIce, Settings
from iceslide_fem.interface.on_ice import OnIce
from iceslide_fem.interface.on_rubber import Attached, AttachedBetween, OnRubber, Rubbing
from iceslide_fem.interface.passing_mesh import PassingMeshedIce, PassingMeshedIceAndRubber
from iceslide_fem.interface.rubber_mesh import (
    MeshedIceAndRubber,
    MeshedRubber,
    RubberInMesh,
    RubberOverGrid,
)
from iceslide_fem.interface.surface_grid import Placement, SurfaceGrid, own_points
from iceslide_fem.interface.user_law_on_ice import UserLawOnIce
from iceslide_fem.interface.window import PassingIce
from iceslide_fem.laws.film import FilmLaw
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.grid import Lines
from iceslide_fem.mesh.ice import heating_times, passing_time, patch_lines, window_lines
from iceslide_fem.mesh.ice_body import ice_body
from iceslide_fem.mesh.rubber import block_shape
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.scene import Scene

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
    rows = _over_temperature(ice.conductivity), _over_temperature(ice.heat_capacity)
    return TabulatedHeat(body, elements, solids, ice.temperature, rows, base)


def _over_temperature(given: Any) -> Curve:
    return Curve.of(given if isinstance(given, tuple) else [(0.0, given), (1.0, given)])


def meshed_rubber(block: Block) -> MeshedRubber:
    """The block as a body that conducts heat in its mesh. Collective."""
    scene, body = block.scene, block.rubber.block
    warmer = scene.rubber_temperature - scene.ice.temperature
    plate = ("plate", warmer) if scene.rubber.plate == "held" else None
    solids = {name: compound.solid for name, compound in scene.rubber.compounds.items()}
    properties = of_regions(body, solids)
    equation = HeatEquation(body, QuadraticElements(body.mesh), properties, plate, warmer)
    return MeshedRubber(equation, block.surface, half_film(scene))


def settings_of(block: Block, heated: Array) -> Settings:
    """Settings of meshed ice with these heating times `heated` (s)."""
    scene, solid = block.scene, block.scene.ice.solid
    tolerance, longest = scene.numerics.tolerance, float(np.max(heated))
    deep = solid.heated_depth(longest)
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


def film_frame_of(block: Block, layers_for: float | None = None) -> Attached | OnRubber | OnIce:
    """The film frame of the block at its present displacements. Collective.

    layers_for: duration (s) for which the layers of heat-conducting bodies are chosen. A longer
    duration of the scene adds layers below them. By default it is the scene's duration.
    """
    ice, duration = block.scene.ice, block.scene.load.duration
    whole = block.scene.load.heated_for
    times = np.array([duration if layers_for is None else layers_for, whole])
    if ice.motion == "attached":
        return ATTACHED[ice.heat](block, times)
    return _sliding(block, times)


def _attached_columns(block: Block, duration: Array) -> Attached:
    ice = block.scene.ice
    columns = Column(ice.temperature, duration, solid=ice.solid, ground=ice.ground)
    return _on_own_ice(block, columns, duration)


def _attached_half_spaces(block: Block, duration: Array) -> Attached:
    ice = block.scene.ice
    return _on_own_ice(block, HalfSpace(ice.temperature, duration, ice.solid), duration)


def _attached_continuum(block: Block, duration: Array) -> Attached:
    points, footprint = _footprint(block)
    ice = continuum_of(block, patch_lines(block.scene, footprint), duration)
    # Each piece of ice stays under the rubber point above it at t = 0.
    return _on_shared_ice(block, ice, ice.grid.place(points), duration)


def _attached_mesh(block: Block, duration: Array) -> Attached:
    points, footprint = _footprint(block)
    equation = equation_of(block, patch_lines(block.scene, footprint), duration)
    settings = settings_of(block, duration)
    if block.scene.rubber.heat == "mesh":
        both = MeshedIceAndRubber(equation, meshed_rubber(block), settings)
        return AttachedBetween(block.law, both, both.place(points), RubberInMesh())
    meshed = MeshedIce(equation, settings)
    return _on_shared_ice(block, meshed, meshed.place(points), duration)


def _on_own_ice(block: Block, below: Column | HalfSpace, duration: Array) -> Attached:
    """Films on the rubber's points, each with separate ice below it."""
    at, rubber = own_points(block.surface.n_points), rubber_columns(block.scene, duration)
    return Attached(block.law, OwnColumns(below), at, rubber)


def _on_shared_ice(
    block: Block, ice: Continuum | MeshedIce, at: Placement, duration: Array
) -> Attached:
    """Films on the rubber's points, placed `at` positions on one body of ice."""
    law, rubber = block.law, rubber_columns(block.scene, duration)
    remembers = bool(law.internal_at_start) or law.untouched(1).size > 0
    if remembers or not law.viscous or rubber is not INSULATED:
        return Attached(law, ice, at, rubber)
    return Rubbing(law, ice, at)


ATTACHED: dict[str, Callable[[Block, Array], Attached]] = {
    "column": _attached_columns,
    "half-space": _attached_half_spaces,
    "continuum": _attached_continuum,
    "mesh": _attached_mesh,
}


def _sliding(block: Block, duration: Array) -> OnRubber | OnIce:
    scene, law = block.scene, block.law
    _, footprint = _footprint(block)
    lines = window_lines(scene, footprint)
    heated = heating_times(scene, float(np.ptp(lines[0])), duration)
    if scene.load.passes > 1:  # heat spreads in the ice until the last of them
        heated = np.array([heated[0], duration[1]])
    if scene.rubber.heat == "mesh":
        grid, settings = SurfaceGrid.shared(lines, block.surface.comm), settings_of(block, heated)
        equation, above = equation_of(block, lines, heated), meshed_rubber(block)
        both = PassingMeshedIceAndRubber(equation, above, grid, settings)
        return OnRubber(law, both, RubberInMesh())
    on_ice = law.frame(scene.film.carrier) == "ice"
    ice = PASSING[scene.ice.heat](block, lines, heated, on_ice and law.has_film)
    if on_ice and law.has_film:
        over = _rubber_over_grid(scene, ice.grid, duration)
        films = cast(FilmLaw, law)  # the law that has films
        return OnIce(films, ice, scene.initial_height, over, scene.water_speed)
    frame = UserLawOnIce if on_ice else OnRubber
    return frame(law, ice, rubber_columns(scene, duration))


def _passing_columns(block: Block, lines: list[Lines], heated: Array, nodal: bool) -> GridColumns:
    columns, ice = GridColumns if nodal else GridColumnsUnderPoints, block.scene.ice
    grid = SurfaceGrid.shared(lines, block.surface.comm)
    return columns(grid, ice.temperature, heated, ice.solid, ice.ground)


def _passing_continuum(block: Block, lines: list[Lines], heated: Array, nodal: bool) -> Continuum:
    return continuum_of(block, lines, heated)


def _passing_mesh(block: Block, lines: list[Lines], heated: Array, nodal: bool) -> PassingMeshedIce:
    grid = SurfaceGrid.shared(lines, block.surface.comm)
    return PassingMeshedIce(equation_of(block, lines, heated), grid, settings_of(block, heated))


# Ice below a window with these grid lines (m), heated for `heated` (s); nodal: films on its nodes.
PASSING: dict[str, Callable[[Block, list[Lines], Array, bool], PassingIce]] = {
    "column": _passing_columns,
    "continuum": _passing_continuum,
    "mesh": _passing_mesh,
}


def _rubber_over_grid(scene: Scene, grid: SurfaceGrid, duration: Array) -> RubberOverGrid | None:
    """Rubber above films on nodes of the ice; None if the rubber takes no heat."""
    if not scene.rubber.heat:
        return None
    ice, solid = scene.ice, scene.rubber.solid
    settings = duration, solid, half_film(scene), ice.melting_temperature
    return RubberOverGrid(grid, scene.rubber_temperature, *settings)


def _footprint(block: Block) -> tuple[Array, list[tuple[float, float]]]:
    """Horizontal positions of the points (n, d-1), and the ranges of the contact area, m.

    The ranges include the facets' nodes, because the points do not reach the edges.
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
