"""Heat conduction below each contact point on its own: `column` ice.

Every ice model offers the same three calls to the time integrator (see `IceHeat`): the heat state
of heat at the start, one implicit stage in which the film is solved together with conduction, and
the surface temperature. Below a point the stage is three lines: the ice's answer to a flux, the
film above it, the heat state that has taken its heat.
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

# Of the slowest mode's time, for `Column.condensed`.
EARLY = 0.02


class IceHeat(Protocol):
    """Conduction in the ice as the time integrator sees it.

    The heat state is an array whose first axis belongs to the model; values of one heat state may
    be added and scaled, which is how Runge-Kutta stages are formed.
    """

    def initial(self, n_points: int) -> Array:
        """Heat state of ice at its initial temperature."""

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """Solve heat state = start + dt * rate(heat state) together with the film."""

    def surface_temperature(self, heat_state: Array) -> Array:
        """Surface temperature at the contact points (K), shape (n_points,)."""


class _OfStage(NamedTuple):
    """What the `dt` (s) of a stage decides in a column.

    What is left of each mode, and the surface's temperature per flux (K m2/W).
    """

    dt: Array | float
    decay: Array
    resistance: Array


class Column:
    """1-D conduction below every point, in the modes of a graded quadratic element mesh.

    With the modes orthonormal in the heat capacity and phi_j their values at the surface, the
    amplitudes are phi_j theta_j with d theta_j / dt = -lambda_j theta_j + q, where the flux q
    (W/m2) enters at the surface, and its temperature is T_s + sum phi_j^2 theta_j: an implicit
    stage costs one division per mode, for any step and any number of points. Where points have
    solids of their own, each has the mesh in thermal layers of its own: the rates are then the same
    for all, and phi_j^2 goes with 1 / effusivity, the `gain`. Heat state: the theta_j, shape
    (n_modes, n_points), in J/m2: what a mode would hold of the heat given to it, if it kept it all.
    depths: of the nodes, from 0 downwards, m.

    T_s, to which the column comes without a flux, is that at which its base is held. Where the base
    is insulated, or heat does not reach it, T_s is the initial temperature, T_0, and a mode of rate
    0 keeps all heat. A base held at another temperature than T_0 has it from t = 0 on; the ice and
    the layers below it are at T_0 then, in the mean over the column's modes (an L2 projection).
    """

    _stage: _OfStage | None = None  # no state

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

        `first_layer` and `depth` are in thermal layers sqrt(alpha * duration) of the shortest
        and of the longest run: a column for two durations has the layers of one for the shorter,
        and more below them. Raises ValueError where points have solids of their own on a `ground`
        that heat may reach.
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
            self.rates[0] = 0.0  # uniform warmth does not decay: exactly, so that heat is conserved
            self._steady = self.temperature
        self.surface, self.modes, self._capacity = modes[0], modes, capacity
        self.depths = node_depths(elements.thickness)
        self._storage = capacity.sum(axis=0) @ modes

    def condensed(self, error: float, shortest: float = 1.0) -> Self:
        """The column in fewer modes, whose surface warms under a constant flux within `error`.

        That is relative to the rise at times near that of the slowest mode. What is wrong for a
        short time counts by that time: at t the error may be 1 + t_1 / t times as large, with
        t_1 = `EARLY` of the slowest mode's time, and before `error` of that time nothing counts;
        both times are shorter by the fraction `shortest` where ice is heated no longer than that.
        The modes are those of the same equations in the span of uniform warmth (so that heat is
        conserved) and of the column's answers to fluxes that grow as exp(s t), for rates s in even
        ratios: a Galerkin projection on a rational Krylov space, symmetric and stable as the
        column itself. A third of the modes answers as well as the mesh is fine. A column whose base
        is held stays as it is: those modes do not answer to its base.
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
        """Heat state of ice at its initial temperature, whatever the base is held at."""
        heat_state = np.zeros((self.rates.size, n_points))
        if self.rates[0] > 0.0:  # its base is held
            of_each = (self._storage / self.surface)[:, None]
            heat_state += of_each * (self.temperature - self._steady)
        return heat_state

    def decay(self, dt: Array | float) -> Array:
        """What an implicit stage of `dt` leaves of each mode, (n_modes, 1 or n_points)."""
        factor = self.rates[:, None] * dt
        factor += 1.0
        return np.divide(1.0, factor, out=factor)

    def response(self, start: Array, dt: Array | float) -> Surface:
        """The surface at the end of a stage under a flux that is still to be found."""
        offset = self._per_heat(start * self._of_stage(dt).decay)
        offset += self._steady
        resistance = self.resistance(dt)
        if resistance.shape != offset.shape:
            resistance = np.broadcast_to(resistance, offset.shape)
        return Surface.of(offset, resistance, self.solid)

    def resistance(self, dt: Array | float) -> Array:
        """Temperature per flux at the end of a stage (K m2/W), one for each of `dt`."""
        return self._of_stage(dt).resistance

    def heated(self, start: Array, dt: Array | float, heat: Array) -> Array:
        """Heat state at the end of the stage in which the surface took `heat` (J/m2, per point)."""
        heat_state = start + heat
        heat_state *= self._of_stage(dt).decay
        return heat_state

    def cooled(self, start: Array, time: ArrayLike) -> Array:
        """Heat state after a `time` (s), one for each point, without flux: exactly."""
        return np.asarray(start * np.exp(np.multiply.outer(-self.rates, time)))

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """One implicit stage of all amplitudes with the film at the surface."""
        result = film.solve(self.response(start, dt))
        return self.heated(start, dt, dt * result.ice_flux), result

    def _of_stage(self, dt: Array | float) -> _OfStage:
        """What `dt` alone decides; kept for the step's next stage, which has the same."""
        if self._stage is None or self._stage.dt is not dt:
            decay = self.decay(dt)
            self._stage = _OfStage(dt, decay, self._per_heat(decay) * dt)
        return self._stage

    def _per_heat(self, heat_state: Array) -> Array:
        """What `heat_state` adds to the temperature of the surface (K), shape (n_points,)."""
        if not self._gain.ndim:
            return np.asarray((self._gain * self.surface**2) @ heat_state)
        return np.asarray(self._gain * (self.surface**2 @ heat_state))

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature of the surface (K), shape (n_points,)."""
        return self._steady + self._per_heat(heat_state)

    def at_depths(self, heat_state: Array) -> Array:
        """Temperature (K) at the `depths`, (n_depths, n_points), of the first point's solid."""
        return self._steady + self._above(heat_state)

    def rise(self, heat_state: Array) -> Array:
        """The same above the initial temperature."""
        return self._above(heat_state) + (self._steady - self.temperature)

    def _above(self, heat_state: Array) -> Array:
        """Temperature (K) at the `depths` above the one without any heat state."""
        return np.asarray(self._gain * ((self.modes * self.surface) @ heat_state))

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """What checkpoints keep of a heat state: temperatures (..., n_points), without modes."""
        return {"rise": self.rise(heat_state)}

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state of what was `saved`, also by a column that ends higher: below is cold ice."""
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
    """Rise of a column's surface under the flux 1 at the `times` (s), but for its gain."""
    passed = -np.expm1(-rates[1:] * times[:, None]) / rates[1:]
    return np.asarray(surface[0] ** 2 * times + passed @ surface[1:] ** 2)


def _quadratic_elements(thickness: Array, solids: Sequence[Solid]) -> tuple[Array, Array]:
    """Heat capacity (J/(m2 K)) and conduction (W/(m2 K)) matrices; node 0 is the surface.

    Of elements of that `thickness` (m), each of its solid.
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
