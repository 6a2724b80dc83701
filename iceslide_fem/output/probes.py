"""Values at chosen positions in rubber, contact and ice: rows of `probes.csv`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import AcceptedStep
from iceslide_fem.fenics import compat
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.stress import CellPoints, von_mises
from iceslide_fem.output.history import interface_fields
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import field_of
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS

ON_SURFACE = 1e-9  # of the block's height
INSIDE = 1e-8  # tolerance of a position beyond its cell, in reference coordinates
MOST_ITERATIONS = 20
# Column -> name in `interface_fields`.
CONTACT_VALUES = {
    column: field_of(column)
    for column in ("contact_pressure_Pa", "friction_stress_Pa", "film_height_m")
} | {"temperature_C": field_of("surface_temperature_C")}


class ProbeRow(NamedTuple):
    """A row of `probes.csv`: a probe at an accepted step; NaN for undefined values.

    Displacement and velocity are relative to the plate; the temperature is that of the ice.
    """

    time_s: float
    probe: str
    displacement_x_m: float = math.nan
    displacement_y_m: float = math.nan
    displacement_z_m: float = math.nan
    velocity_x_m_per_s: float = math.nan
    velocity_y_m_per_s: float = math.nan
    velocity_z_m_per_s: float = math.nan
    von_mises_Pa: float = math.nan
    hydrostatic_Pa: float = math.nan
    energy_density_J_per_m3: float = math.nan
    contact_pressure_Pa: float = math.nan
    friction_stress_Pa: float = math.nan
    film_height_m: float = math.nan
    temperature_C: float = math.nan


class Probe(NamedTuple):
    """A probe on this rank: position (d,), m, and 1 or -1 for the half of the block.

    rubber: the cell around it, None on other ranks and in the ice; contact: the contact point above
    or at it, None on other ranks and inside the rubber.
    """

    name: str
    place: Array
    side: float
    rubber: CellPoints | None
    contact: int | None


class Probes:
    """All probes of a scene; values do not depend on the number of ranks."""

    def __init__(self, block: Block) -> None:
        """Locate the probes. Collective; raises SceneError if one is outside."""
        self._block, self._comm = block, block.surface.comm
        probes = block.scene.output.probes
        self.places = [self._found(name, place) for name, place in probes.items()]
        self.touches_ice = any(probe.place[-1] < self._skin for probe in self.places)

    def __len__(self) -> int:
        return len(self.places)

    @property
    def _skin(self) -> float:
        return ON_SURFACE * self._block.height

    def rows(self, sliding: Sliding, accepted: AcceptedStep | None) -> list[ProbeRow]:
        """Rows at the present time on rank 0; empty on other ranks. Collective."""
        contact = interface_fields(sliding, accepted) if self.touches_ice else {}
        own = np.array([self._values(probe, sliding, contact) for probe in self.places])
        parts = self._comm.gather(own, root=0)
        if parts is None:
            return []
        values = np.full_like(own, np.nan)
        for part in parts:
            values = np.where(np.isnan(values), part, values)
        time = sliding.current.time
        return [
            ProbeRow(time, probe.name, *map(float, row))
            for probe, row in zip(self.places, values, strict=True)
        ]

    def _values(self, probe: Probe, sliding: Sliding, contact: dict[str, Array]) -> list[float]:
        """This rank's values of the columns after the first two. Collective."""
        values: dict[str, float] = {}
        if probe.rubber is not None:
            values |= self._in_rubber(probe, probe.rubber, sliding)
        if probe.place[-1] < -self._skin:
            values["temperature_C"] = self._in_ice(probe, sliding)
        elif probe.contact is not None:
            for column, name in CONTACT_VALUES.items():
                values[column] = float(contact[name].flat[probe.contact])
        return [values.get(column, math.nan) for column in ProbeRow._fields[2:]]

    def _in_rubber(self, probe: Probe, at: CellPoints, sliding: Sliding) -> dict[str, float]:
        u = self._block.rubber.displacements
        velocity = sliding.current.motion.velocity.reshape(u.shape)
        values: dict[str, float] = {}
        axes = ("x", "z") if u.shape[1] == 2 else ("x", "y", "z")
        for axis, moved, speed in zip(
            axes, *((at.shape @ nodal[at.dofs])[0, 0] for nodal in (u, velocity)), strict=True
        ):
            sign = probe.side if axis == "y" else 1.0
            values[f"displacement_{axis}_m"] = sign * moved
            values[f"velocity_{axis}_m_per_s"] = sign * speed
        relaxed = sliding.current.relaxed
        fallen = None if relaxed is None else relaxed.fallen
        *six, energy = at.stress_and_energy(u, fallen)[0, 0]
        values["von_mises_Pa"] = float(von_mises(np.array(six)))
        values["hydrostatic_Pa"] = float(np.mean(six[:3]))
        values["energy_density_J_per_m3"] = energy
        return values

    def _in_ice(self, probe: Probe, sliding: Sliding) -> float:
        """Temperature of the ice, degC. Collective."""
        current, ice = sliding.current, sliding.frame.ice
        if ice.equation is not None:
            return self._in_mesh(probe, ice.equation, sliding)
        profile = sliding.frame.ice.profile(current.interface.ice)
        assert profile is not None  # closed-form ice has no probes
        if profile.grid is None:  # attached ice is at the rubber's points
            if probe.contact is None:
                return math.nan
            nodes, weights = np.array([probe.contact]), np.ones(1)
        else:
            place = probe.place[None, :-1] + np.eye(1, probe.place.size - 1) * current.loads.offset
            lines = profile.grid.lines
            if not all(line[0] <= x <= line[-1] for line, x in zip(lines, place[0], strict=True)):
                return math.nan
            at = profile.grid.place(place)
            nodes, weights = at.node[0], at.weight[0]
        columns = profile.kelvin[:, nodes].T
        kelvin = [np.interp(-probe.place[-1], profile.depths, column) for column in columns]
        T_m = sliding.block.scene.ice.melting_temperature
        return min(float(weights @ kelvin), T_m) - ZERO_CELSIUS

    def _in_mesh(self, probe: Probe, equation: HeatEquation, sliding: Sliding) -> float:
        """The same in meshed ice, interpolated in its elements. Collective."""
        scene, current = sliding.block.scene, sliding.current
        rise = sliding.frame.ice.rises(current.interface.ice).ice
        place = probe.place + np.eye(1, probe.place.size)[0] * current.loads.offset
        found = cell_around(equation.elements.space, place)
        if found is None or rise is None:
            return math.nan
        cell, within = found
        element = compat.basix_lagrange(compat.cell_name(equation.body.mesh), 2)
        shape = np.array(element.tabulate(0, within[None]))[0, 0, :, 0]
        kelvin = scene.ice.temperature + float(
            shape @ rise[compat.cell_dofs(equation.elements.space)[cell]]
        )
        return min(kelvin, scene.ice.melting_temperature) - ZERO_CELSIUS

    def _found(self, name: str, place: Sequence[float]) -> Probe:
        """The probe at `place` (x, y, z), m. Collective."""
        rubber, surface = self._block.rubber, self._block.surface
        x, side = np.array(place), 1.0
        if rubber.mesh.geometry.dim == 2:
            x = x[[0, 2]]
        elif "symmetry" in rubber.block.tags and x[1] < 0.0:
            side, x[1] = -1.0, -x[1]
        found: tuple[int, Array] | None = None
        if x[-1] > -self._skin:
            found = cell_around(rubber.space, x)
            if self._first(0.0 if found else np.inf) is None:
                raise SceneError(
                    f"output.probes.{name} = {list(place)} (m) is neither in the undeformed rubber "
                    "nor below its contact surface"
                )
            if not self._first_is_here(0.0 if found else np.inf):
                found = None
        contact: int | None = None
        if x[-1] < self._skin:
            positions = surface.positions(np.zeros_like(rubber.displacements))
            positions = positions.reshape(surface.n_points, x.size)
            above = np.append(x[:-1], 0.0)
            distance = np.linalg.norm(positions - above, axis=1)
            if self._first_is_here(float(distance.min(initial=np.inf))):
                contact = int(distance.argmin())
        at = None if found is None else CellPoints(rubber, np.array([found[0]]), found[1][None])
        return Probe(name, x, side, at, contact)

    def _first(self, distance: float) -> int | None:
        """The first rank with the least `distance`; None if it is infinite everywhere."""
        distances = self._comm.allgather(distance)
        least = min(distances)
        return distances.index(least) if np.isfinite(least) else None

    def _first_is_here(self, distance: float) -> bool:
        return self._first(distance) == self._comm.rank


def cell_around(space: Any, x: Array) -> tuple[int, Array] | None:
    """This rank's first cell of a quadratic `space` around `x` (d,), m, and its coordinates there.

    Newton's method in reference coordinates; None if no cell of this rank contains it.
    """
    name, topology = compat.cell_name(space.mesh), space.mesh.topology
    vertex = compat.basix_lagrange(name, 1)
    owned = topology.index_map(topology.dim).size_local
    k = np.array(vertex.tabulate(0, np.zeros((1, x.size)))).shape[2]
    nodes = space.tabulate_dof_coordinates()[:, : x.size]
    corners = nodes[compat.cell_dofs(space)[:owned, :k]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    slack = INSIDE * (high - low)
    near = ((low - slack <= x) & (x <= high + slack)).all(axis=1)
    for cell in np.flatnonzero(near).tolist():
        place = np.full(x.size, 0.25)
        for _ in range(MOST_ITERATIONS):
            table = np.array(vertex.tabulate(1, place[None]))[:, 0, :, 0]
            missing = x - table[0] @ corners[cell]
            place = place + np.linalg.solve((table[1:] @ corners[cell]).T, missing)
        total = place.sum() if name in ("triangle", "tetrahedron") else place.max()
        if place.min() >= -INSIDE and total <= 1.0 + INSIDE:
            return cell, place
    return None
