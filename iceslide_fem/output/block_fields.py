"""Fields of a sliding block: rubber, interface, ice, and the trail on sliding ice."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import AcceptedStep
from iceslide_fem.heat.elements import LayeredElements
from iceslide_fem.interface.film_frame import Rises
from iceslide_fem.interface.surface_grid import Profile, SurfaceGrid
from iceslide_fem.output.grids import (
    FacetGrid,
    Grid,
    RubberGrid,
    mesh_grid,
    point_grid,
    tensor_grid,
)
from iceslide_fem.output.history import fields_on_nodes, interface_fields
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import TEMPERATURE
from iceslide_fem.runtime.units import ZERO_CELSIUS


class BlockFields:
    """Grids at the present time, for the available `names`; all methods are collective.

    rubber (with stress: also stresses), interface, contact_points, ice and trail, as in
    docs/reference/columns.md. Closed-form ice has no temperature below its surface, attached ice no
    trail.
    """

    def __init__(self, sliding: Sliding, names: Sequence[str]) -> None:
        self._sliding, self._stress = sliding, "stress" in names
        block, ice = sliding.block, sliding.frame.ice
        self._facets = FacetGrid(block.rubber, block.surface)
        profile = ice.profile(sliding.current.interface.ice)
        present: dict[str, Callable[[AcceptedStep | None], Grid | None]] = {}
        if self._stress or "rubber" in names:
            self._nodes = RubberGrid(block.rubber)
            present["rubber"] = self._rubber
        if "interface" in names:
            present["interface"] = self._interface
        if "contact_points" in names:
            present["contact_points"] = self._contact_points
        if "ice" in names and ice.equation is not None:
            present["ice"] = self._meshed_ice
        elif "ice" in names and profile is not None:
            present["ice"] = self._ice
        if "trail" in names and block.scene.ice.motion == "sliding":
            present["trail"] = self._trail
        self._present = present

    def grids(self, accepted: AcceptedStep | None) -> dict[str, Grid | None]:
        """This rank's parts of the grids by name, None without a part.

        Tensor grids of the ice are on the last rank. accepted: the last step, None at t = 0.
        """
        return {name: grid(accepted) for name, grid in self._present.items()}

    def _rubber(self, accepted: AcceptedStep | None) -> Grid | None:
        u = self._sliding.block.rubber.displacements
        velocity = self._sliding.current.motion.velocity.reshape(u.shape)
        rise = self._rises().rubber
        first = self._sliding.block.scene.ice.temperature - ZERO_CELSIUS
        warm = {} if rise is None else {TEMPERATURE.name: first + rise}
        relaxed = self._sliding.current.relaxed
        fallen = None if relaxed is None else relaxed.fallen
        return self._nodes.grid(u, velocity, self._stress, warm, fallen)

    def _interface(self, accepted: AcceptedStep | None) -> Grid | None:
        block, contact = self._sliding.block, self._sliding.current.contact
        values = interface_fields(self._sliding, accepted)
        force = np.zeros((*contact.area.shape, block.rubber.mesh.geometry.dim))
        force[..., 0] = -values["friction stress (Pa)"] * contact.area
        force[..., -1] = contact.pressure * contact.area
        return self._facets.grid(block.rubber.displacements, values, force.sum(axis=1))

    def _contact_points(self, accepted: AcceptedStep | None) -> Grid | None:
        block = self._sliding.block
        unit = "m" if block.scene.model == "slice" else "m^2"
        values = interface_fields(self._sliding, accepted)
        values[f"area ({unit})"] = self._sliding.current.contact.area
        positions = block.surface.positions(block.rubber.displacements)
        return point_grid(positions, values)

    def _ice(self, accepted: AcceptedStep | None) -> Grid | None:
        profile = self._profile()
        celsius = self._celsius(profile.kelvin)
        if profile.grid is None:
            return self._below_facets(profile.depths, celsius)
        if not _is_last(profile.grid):
            return None
        lines = [*self._lines(profile.grid), -profile.depths]
        return tensor_grid(lines, {TEMPERATURE.name: celsius.T})

    def _meshed_ice(self, accepted: AcceptedStep | None) -> Grid | None:
        """This rank's part of the ice's mesh, at the ice's position relative to the plate."""
        equation, rise = self._sliding.frame.ice.equation, self._rises().ice
        assert equation is not None and isinstance(equation.elements, LayeredElements)
        assert rise is not None
        current = self._sliding.current
        celsius = self._celsius(self._sliding.block.scene.ice.temperature + rise)
        return mesh_grid(equation.elements, {TEMPERATURE.name: celsius}, -current.loads.offset)

    def _below_facets(self, depths: Array, celsius: Array) -> Grid | None:
        """Attached ice below the rubber's points: means below each facet."""
        block, contact = self._sliding.block, self._sliding.current.contact
        below = celsius.T.reshape(*contact.pressure.shape, depths.size)
        touching = np.asarray((contact.pressure > 0.0).any(axis=1))
        means = self._facets.means(below)
        return self._facets.below(block.rubber.displacements, touching, depths, means)

    def _trail(self, accepted: AcceptedStep | None) -> Grid | None:
        """Film and heat at the nodes of the moving window of ice."""
        state, profile = self._sliding.current.interface, self._profile()
        grid = profile.grid
        assert grid is not None  # sliding ice has one
        values = {
            "surface temperature (degC)": self._celsius(profile.kelvin[0]),
            "heat (J/m^2)": profile.heat,
        }
        if self._sliding.frame.nodes is not None:
            values["film height (m)"] = grid.allgather(self._sliding.block.law.film_height(state))
            values["squeezed height (m)"] = grid.allgather(state.squeezed_height)
        if self._sliding.frame.internal_nodes is not None:
            for name, row in fields_on_nodes(self._sliding).items():
                values[name] = grid.allgather(row)
        return tensor_grid(self._lines(grid), values) if _is_last(grid) else None

    def _lines(self, grid: SurfaceGrid) -> list[Array]:
        """Lines of the ice's grid relative to the plate, m."""
        along, *across = grid.lines
        return [along - self._sliding.current.loads.offset, *across]

    def _rises(self) -> Rises:
        return self._sliding.frame.ice.rises(self._sliding.current.interface.ice)

    def _profile(self) -> Profile:
        profile = self._sliding.frame.ice.profile(self._sliding.current.interface.ice)
        assert profile is not None
        return profile

    def _celsius(self, kelvin: Array) -> Array:
        """Temperature in degC, limited to T_m."""
        T_m = self._sliding.block.scene.ice.melting_temperature
        return np.asarray(np.minimum(kelvin, T_m) - ZERO_CELSIUS)


def _is_last(grid: SurfaceGrid) -> bool:
    return bool(grid.comm.rank == grid.comm.size - 1)
