"""Separate heat conduction below each contact point: `column` ice.

Every ice model has the same three methods for the time integrator (see `IceHeat`): the initial heat
state, one implicit stage of film and conduction together, and the surface temperature. Below a
point the stage takes three lines: the ice's response to a flux, the film above it, and the heat
state after its heat.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.materials import BOTTOMLESS, ICE, Ground, Solid
from iceslide_fem.scene.thermal_layers import (
    FIRST_LAYER,
    HEATED_LAYERS,
    LAYER_RATIO,
    node_depths,
    stacked_layers,
)

# Fractions of the slowest mode's time, see `Column.condensed`.
EARLY = 0.02


class IceHeat(Protocol):
    """Conduction in the ice as the time integrator sees it.

    The heat state is an array whose first axis belongs to the model. Heat states form a linear
    space, as Runge-Kutta stages require.
    """

    def initial(self, n_points: int) -> Array:
        """Heat state of ice at its initial temperature."""

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """Solve heat state = start + dt * rate(heat state) together with the film."""

    def surface_temperature(self, heat_state: Array) -> Array:
        """Surface temperature at the contact points (K), shape (n_points,)."""


class PointIce(IceHeat, Protocol):
    """Ice of points that do not heat each other."""

    def take(self, index: Index) -> Self:
        """The ice at the points of `index`."""


class _OfStage(NamedTuple):
    """Factors of a stage that depend on `dt` (s) only.

    They are the decay of each mode, and the surface temperature per flux (K m2/W).
    """

    dt: Array | float
    decay: Array
    resistance: Array


class Column:
    """1-D conduction below every point, in the modes of a graded quadratic element mesh.

    With the modes orthonormal in the heat capacity and phi_j their values at the surface, the
    amplitudes are phi_j theta_j with d theta_j / dt = -lambda_j theta_j + q, where the flux q
    (W/m2) enters at the surface. The surface temperature is T_s + sum phi_j^2 theta_j. An implicit
    stage costs one division per mode, for any step and any number of points. If the solid differs
    between points, each point has the mesh scaled to its thermal layers. The rates are then equal,
    and phi_j^2 scales with 1 / effusivity, the `gain`. Heat state: theta_j in J/m2, shape (n_modes,
    n_points): the heat given to a mode that does not decay. depths: of the nodes, from 0 downwards,
    m.

    T_s is the steady temperature without flux: that of a held base. For an insulated or unreached
    base T_s is the initial temperature T_0, and a mode of rate 0 keeps all heat. A held base has
    its temperature from t = 0 on. Ice and layers are at T_0 at t = 0, as an L2 projection on the
    modes.
    """

    _stage: _OfStage | None = None  # a cache, not state

    def __init__(
        self,
        temperature: float | Array,
        duration: float | Array,
        first_layer: float = FIRST_LAYER,
        ratio: float = LAYER_RATIO,
        depth: float = HEATED_LAYERS,
        solid: Solid = ICE,
        ground: Ground = BOTTOMLESS,
    ) -> None:
        """Column at `temperature` (K) for runs of `duration` (s); both scalar or per point.

        `first_layer` and `depth` are in thermal layers sqrt(alpha * duration) of the shortest and
        the longest run. A column for two durations has the layers for the shorter one, and more
        below. Raises ValueError if solids differ between points on a `ground` that heat may reach.
        """
        self.temperature = np.asarray(temperature, dtype=float)
        self.solid, solid = solid, Solid(*(np.ravel(part)[0] for part in solid))
        self._gain = np.asarray(solid.effusivity / self.solid.effusivity)
        if self._gain.ndim and ground != BOTTOMLESS:
            raise ValueError("points with solids of their own take the ice as a half-space")
        stack, held = ground.stack(solid), ground.held
        warmed = held is not None and bool((self.temperature != held).any())
        elements = stacked_layers(stack, duration, first_layer, ratio, depth, warmed)
        solids = [stack[place].solid for place in elements.layer]
        capacity, conduction = _quadratic_elements(elements.thickness, solids)
        if held is not None and elements.base:
            self.rates, modes = eigh(conduction[:-1, :-1], capacity[:-1, :-1])
            modes = np.vstack([modes, np.zeros(len(modes))])
            self._steady = np.full_like(self.temperature, held)
        else:
            self.rates, modes = eigh(conduction, capacity)
            self.rates[0] = 0.0  # exactly zero: a uniform temperature does not decay
            self._steady = self.temperature
        self.surface, self.modes, self._capacity = modes[0], modes, capacity
        self.depths = node_depths(elements.thickness)
        self._storage = capacity.sum(axis=0) @ modes

    def condensed(self, error: float, shortest: float = 1.0) -> Self:
        """The column with fewer modes, and an `error` of its surface rise under constant flux.

        The error is relative to the rise near the time of the slowest mode. At earlier times t the
        limit is 1 + t_1 / t times larger, with t_1 = `EARLY` of the slowest mode's time. Before
        `error` of that time there is no limit. Both times are multiplied by `shortest`, the
        shortest heating over the longest. The modes follow from a Galerkin projection on a rational
        Krylov space. Its basis is the uniform temperature (so heat is conserved) and the responses
        to fluxes exp(s t), with rates s in even ratios. It is symmetric and stable as the column
        is. A third of the modes is as accurate as the mesh. A column with a held base is returned
        unchanged: this basis does not contain the base's response.
        """
        if self.rates[0] > 0.0:
            return self
        rates, surface = self.rates, self.surface
        counts = error * shortest
        slowest, fastest = rates[1], min(rates[-1], rates[1] / counts) if counts else rates[-1]
        times = 1.0 / np.geomspace(slowest, fastest, 60)
        exact = _warming(rates, surface, times)
        allowed = error * (1.0 + EARLY * shortest / (slowest * times)) * exact
        for count in range(6, rates.size):
            shifts = np.geomspace(slowest, fastest, count - 1)
            answers = surface[:, None] / (rates[:, None] + shifts)
            answers = np.insert(answers / np.linalg.norm(answers, axis=0), 0, 0.0, axis=1)
            answers[0, 0] = 1.0
            basis = np.linalg.qr(answers)[0]
            fewer, modes = eigh(basis.T * rates @ basis)
            fewer[0] = 0.0
            modes = basis @ modes
            warming = _warming(fewer, surface @ modes, times)
            if (np.abs(warming - exact) <= allowed).all():
                part = copy(self)
                part._stage = None
                part.rates, part.surface = fewer, surface @ modes
                part.modes, part._storage = self.modes @ modes, self._storage @ modes
                return part
        return self

    def take(self, index: Index) -> Self:
        """The column below the points at `index` only (its mesh stays as it is)."""
        part = copy(self)
        part._stage = None
        part.temperature, part._steady = (
            kelvin[index] if kelvin.ndim else kelvin for kelvin in (self.temperature, self._steady)
        )
        part.solid = self.solid.at(index)
        part._gain = self._gain[index] if self._gain.ndim else self._gain
        return part

    def initial(self, n_points: int) -> Array:
        """Heat state of ice at its initial temperature, for any temperature of the base."""
        heat_state = np.zeros((self.rates.size, n_points))
        if self.rates[0] > 0.0:  # its base is held
            of_each = (self._storage / self.surface)[:, None]
            heat_state += of_each * (self.temperature - self._steady)
        return heat_state

    def decay(self, dt: Array | float) -> Array:
        """Decay factor of each mode in an implicit stage of `dt`, (n_modes, 1 or n_points)."""
        factor = self.rates[:, None] * dt
        factor += 1.0
        return np.divide(1.0, factor, out=factor)

    def response(self, start: Array, dt: Array | float) -> Surface:
        """Linear response of the surface at the end of a stage to an unknown flux."""
        offset = self._per_heat(start * self._of_stage(dt).decay)
        offset += self._steady
        resistance = self.resistance(dt)
        if resistance.shape != offset.shape:
            resistance = np.broadcast_to(resistance, offset.shape)
        return Surface.of(offset, resistance, self.solid)

    def resistance(self, dt: Array | float) -> Array:
        """Surface temperature per flux at the end of a stage (K m2/W), for each `dt`."""
        return self._of_stage(dt).resistance

    def heated(self, start: Array, dt: Array | float, heat: Array) -> Array:
        """Heat state at the end of the stage in which the surface took `heat` (J/m2, per point)."""
        heat_state = start + heat
        heat_state *= self._of_stage(dt).decay
        return heat_state

    def cooled(self, start: Array, time: ArrayLike) -> Array:
        """Exact heat state after a `time` (s) without flux, one time per point."""
        return np.asarray(start * np.exp(np.multiply.outer(-self.rates, time)))

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """One implicit stage of all amplitudes with the film at the surface."""
        result = film.solve(self.response(start, dt))
        return self.heated(start, dt, dt * result.ice_flux), result

    def _of_stage(self, dt: Array | float) -> _OfStage:
        """Factors that depend on `dt` only; cached for the next stage, which has the same dt."""
        if self._stage is None or self._stage.dt is not dt:
            decay = self.decay(dt)
            self._stage = _OfStage(dt, decay, self._per_heat(decay) * dt)
        return self._stage

    def _per_heat(self, heat_state: Array) -> Array:
        """Surface temperature rise of `heat_state` (K), shape (n_points,)."""
        if not self._gain.ndim:
            return np.asarray((self._gain * self.surface**2) @ heat_state)
        return np.asarray(self._gain * (self.surface**2 @ heat_state))

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature of the surface (K), shape (n_points,)."""
        return self._steady + self._per_heat(heat_state)

    def at_depths(self, heat_state: Array) -> Array:
        """Temperature (K) at the `depths` of the first point's solid, (n_depths, n_points)."""
        return self._steady + self._above(heat_state)

    def rise(self, heat_state: Array) -> Array:
        """The same above the initial temperature."""
        return self._above(heat_state) + (self._steady - self.temperature)

    def _above(self, heat_state: Array) -> Array:
        """Temperature (K) at the `depths` above that of a zero heat state."""
        return np.asarray(self._gain * ((self.modes * self.surface) @ heat_state))

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """Checkpoint arrays: temperatures (..., n_points), independent of the modes."""
        return {"rise": self.rise(heat_state)}

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state from `saved` arrays; ice below a shallower saved column is cold."""
        rise = np.zeros((self.depths.size, saved["rise"].shape[-1]))
        rise[: len(saved["rise"])] = saved["rise"]
        rise -= self._steady - self.temperature
        amplitudes = self.modes.T @ (self._capacity @ rise)
        return np.asarray(amplitudes / self.surface[:, None] / self._gain)

    def heat(self, heat_state: Array) -> Array:
        """Heat above the initial temperature (J/m2), shape (n_points,)."""
        steady = self._capacity.sum() * (self._steady - self.temperature)
        return np.asarray((self._storage * self.surface) @ heat_state + steady)


def _warming(rates: Array, surface: Array, times: Array) -> Array:
    """Surface rise of a column of gain 1 under the flux 1, at the `times` (s)."""
    passed = -np.expm1(-rates[1:] * times[:, None]) / rates[1:]
    return np.asarray(surface[0] ** 2 * times + passed @ surface[1:] ** 2)


def _quadratic_elements(thickness: Array, solids: Sequence[Solid]) -> tuple[Array, Array]:
    """Heat capacity (J/(m2 K)) and conduction (W/(m2 K)) matrices; node 0 is the surface.

    thickness: of the elements, m; solids: of the elements.
    """
    n = 2 * thickness.size + 1
    capacity, conduction = np.zeros((n, n)), np.zeros((n, n))
    mass = np.array([[4.0, 2.0, -1.0], [2.0, 16.0, 2.0], [-1.0, 2.0, 4.0]]) / 30.0
    stiffness = np.array([[7.0, -8.0, 1.0], [-8.0, 16.0, -8.0], [1.0, -8.0, 7.0]]) / 3.0
    for element, (size, solid) in enumerate(zip(thickness, solids, strict=True)):
        nodes = slice(2 * element, 2 * element + 3)
        capacity[nodes, nodes] += solid.density * solid.heat_capacity * size * mass
        conduction[nodes, nodes] += solid.conductivity / size * stiffness
    return capacity, conduction
