"""The heat equation of ice with temperature-dependent conductivity and heat capacity.

    rho c(T) dT/dt = div(lambda(T) grad T)

The heat state is the heat of an unknown over the initial capacity c_0,

    w = int c(T) / c_0 dT  from the initial temperature,

The heat is C_0 w, and it is conserved because the capacity is diagonal. At the boundary to a layer
below, only the ice's fraction of the capacity varies. The conductivity in a stage is that at its
start.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from iceslide_fem.fenics.compat import PETSc, fem
from iceslide_fem.heat.elements import LayeredElements
from iceslide_fem.heat.equation import Conducting, HeatEquation, Properties, of_regions
from iceslide_fem.mesh.gmsh_model import DistributedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.scene.materials import Solid

PASSES, CLOSE = 30, 1e-12  # Newton iterations for a rise, and tolerance, K


def integral(curve: Curve, kelvin: Array) -> Array:
    """Integral of a curve of lines from its first row to temperatures (K), exact."""
    x, values = curve.arrays
    steps = np.diff(x) * 0.5 * (values[1:] + values[:-1])
    whole = np.append(0.0, np.cumsum(steps))
    inside = np.clip(kelvin, x[0], x[-1])
    row = np.clip(np.searchsorted(x, inside) - 1, 0, len(steps) - 1)
    part = 0.5 * (inside - x[row]) * (values[row] + curve(inside))
    outside = values[0] * np.minimum(kelvin - x[0], 0.0)
    outside += values[-1] * np.maximum(kelvin - x[-1], 0.0)
    return np.asarray(whole[row] + part + outside)


class TabulatedHeat(HeatEquation):
    """Layers whose region `ice` has temperature-dependent conductivity and heat capacity."""

    def __init__(
        self,
        body: DistributedMesh,
        elements: LayeredElements,
        solids: dict[str, Solid],
        temperature: float,
        rows: tuple[Curve, Curve],
        base: tuple[str, float] | None = None,
    ) -> None:
        """temperature: initial, of the ice, K; rows: of conductivity, W/(m K), and heat capacity,
        J/(kg K), of the ice. Collective.
        """
        self._T_0 = temperature
        self._conductivity, self._heat_capacity = rows
        at_first = of_regions(body, solids)
        nothing = Solid(0.0, 0.0, 0.0)
        ice = of_regions(body, {name: nothing for name in solids} | {"ice": Solid(1.0, 1.0, 1.0)})
        self._relative: Any = fem.Function(elements.space)
        self._relative.x.array[:] = 1.0
        varying = 1.0 + ice.conductivity * (self._relative - 1.0)
        properties = Properties(at_first.conductivity * varying, at_first.heat_capacity)
        super().__init__(body, elements, properties, base)
        of_ice = elements.capacity(ice.heat_capacity * at_first.heat_capacity)
        self._share = of_ice / self.capacity
        self._first = float(self._heat_capacity(np.array(temperature)))
        self._now: PETSc.Mat | None = None

    def heat_state(self, rise: Array) -> Array:
        """Heat state (K): the heat of a rise, over the initial capacity."""
        kelvin, first = self._T_0 + rise, np.array(self._T_0)
        heat = integral(self._heat_capacity, kelvin) - integral(self._heat_capacity, first)
        return np.asarray(self._share * heat / self._first + (1.0 - self._share) * rise)

    def steepness(self, rise: Array) -> Array:
        """Derivative of the heat state with the rise."""
        relative = self._heat_capacity(self._T_0 + rise) / self._first
        return np.asarray(self._share * relative + 1.0 - self._share)

    def rise(self, heat_state: Array) -> Array:
        """Rise (K) of a heat state, by Newton's method; capacities vary slowly."""
        rise = heat_state.copy()
        for _ in range(PASSES):
            change = (heat_state - self.heat_state(rise)) / self.steepness(rise)
            rise = rise + change
            if not np.abs(change).max(initial=0.0) > CLOSE:
                break
        return rise

    def conducting(self, rise: Array) -> Conducting:
        """Conduction at a rise. Collective."""
        first = self._conductivity(np.array(self._T_0))
        nodal = self.elements.values(rise).x.array
        self._relative.x.array[:] = self._conductivity(self._T_0 + np.real(nodal)) / first
        if self._now is not None:
            self._now.destroy()
        self._now = self._assembled()
        return Conducting(self._now, self._apart(self._now))
