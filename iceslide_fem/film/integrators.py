"""Time integration of film and ice heat together: one Runge-Kutta step with an error estimate.

All methods are diagonally implicit with one diagonal coefficient (SDIRK), and stiffly accurate.
Each stage is one implicit Euler solve of film and heat (`IceHeat.stage`). The complementarities of
melting and saturation hold at the end of every step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, Self, TypeVar

import numpy as np

from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import IceHeat
from iceslide_fem.film.law import Film, FilmHistory, FilmStage, log_shearing
from iceslide_fem.film.rubber_heat import INSULATED, RubberHeat
from iceslide_fem.film.runge_kutta import Integrator
from iceslide_fem.runtime.arrays import Array, Index

End = TypeVar("End", contravariant=True)


class InterfaceState(NamedTuple):
    """State of the interface: ln h and H_s (m) per film, heat states of ice and rubber.

    internal: internal variables (m, n), see `film.law.FilmHistory`; age: history of the contact at
    the rubber's points, (rows, n_points), empty without contact age. The age is constant in a step
    of the integrator.
    """

    log_height: Array
    squeezed_height: Array
    ice: Array
    rubber: Array = np.zeros((0, 1))
    internal: Array = np.zeros((0, 1))
    age: Array = np.zeros((0, 1))

    def take(self, index: Index) -> InterfaceState:
        """The state at the points of `index`."""
        return InterfaceState(*(part.take(index, axis=-1, mode="clip") for part in self))


class Weights(NamedTuple):
    """Weights of local errors: of ln h where nothing melts, and of the water in the voids."""

    dry: float = 1.0
    water: float = 1.0


EVEN = Weights()


class InStage(Protocol):
    """Loads of the interface in a stage of a step."""

    def film(
        self,
        start: FilmHistory,
        before: FilmHistory,
        dt: Array | float,
        stage: Callable[..., FilmStage],
        near: Array | None,
        close: float,
    ) -> Film:
        """The law in an implicit stage of `dt` (s) from `start`, in a step that starts at `before`.

        `near` and `close` control the search of heights, see `film.height.log_height_of`.
        """

    def internal_after(self, before: Array, stage: FilmStage) -> Array:
        """Internal variables at the end of the `stage`, from those `before` it."""


class Begun(Protocol[End]):
    """A step with a given start."""

    def at(self, end: End, fraction: float) -> InStage:
        """Loads at `fraction` of a step that ends with the loads `end`."""


class Acting(Protocol):
    """Loads of the interface at one end of a step, as the integrator uses them."""

    def begun(
        self, dt: Array | float, state: InterfaceState, ice: IceHeat, rubber: RubberHeat
    ) -> Begun[Self]:
        """A step of `dt` (s) that starts with these loads, from `state`, between both bodies."""


class Loads(Acting, Protocol):
    """Loads of the interface at one end of a step, with the law that they act under.

    All methods may be collective, because a law may hold its history away from its points.
    """

    def take(self, index: Index) -> Self:
        """The loads at `index`."""

    def shear(self, state: InterfaceState, ice: IceHeat) -> Array:
        """tau (Pa), (n,), of points in `state` on this ice."""

    def force(self, step: Step) -> Array:
        """Magnitude of tau (Pa), (n,), at the end of a `step` with these loads at its end."""

    def shear_change(self, state: InterfaceState, other: InterfaceState, ice: IceHeat) -> Array:
        """Relative difference (n,) of the shear in the `other` state to the shear in `state`."""

    def local_error(
        self, step: Step, ice: IceHeat, rubber: RubberHeat, scale: Array, weights: Weights = EVEN
    ) -> Array:
        """Relative local errors (n,) of a `step` that ends here; `scale` of temperatures, K."""


class Step(NamedTuple):
    """A trial step. It is accepted by taking its `state` as the new one.

    dt: step length, s; stages: of the film; changes: of the state in each stage, and the stage
    length, s; integrator: that made the step.
    """

    state: InterfaceState
    dt: Array | float
    stages: list[FilmStage]
    changes: list[InterfaceState]
    stage_dt: Array | float
    integrator: Integrator

    @property
    def last(self) -> FilmStage:
        """The last stage, at the end of the step."""
        return self.stages[-1]

    @property
    def weights(self) -> tuple[float, ...]:
        """Weights of the stages, with the sum 1."""
        return self.integrator.weights

    @property
    def change(self) -> InterfaceState:
        """Change of the state in the last stage."""
        return self.changes[-1]

    @property
    def total(self) -> InterfaceState:
        """Change of the state over the step."""
        weights = [weight / self.integrator.diagonal for weight in self.weights]
        return InterfaceState(
            *(weighted(weights, list(p)) for p in zip(*self.changes, strict=True))
        )

    def error(self, part: Callable[[InterfaceState], Array]) -> Array:
        """Local error of a linear function of the state.

        The weights have the sum 0, so constants such as T_0 cancel.
        """
        weights = [weight / self.integrator.diagonal for weight in self.integrator.estimate]
        return weighted(weights, [part(change) for change in self.changes])

    @property
    def friction_work(self) -> Array:
        """Friction work over the step, J/m2: heat of ice and rubber, latent heat, hysteresis."""
        film = self.dt * weighted(self.weights, [s.friction_power for s in self.stages])
        return film + self.hysteresis_heat

    @property
    def hysteresis_heat(self) -> Array:
        """Heat of hysteresis inside the rubber over the step, J/m2."""
        made = self.dt * weighted(self.weights, [s.hysteresis for s in self.stages])
        return np.broadcast_to(made, self.last.ice_flux.shape)

    @property
    def ice_heat(self) -> Array:
        """Heat into the ice over the step, J/m2."""
        return self.dt * weighted(self.weights, [s.ice_flux for s in self.stages])

    @property
    def rubber_heat(self) -> Array:
        """Heat into the rubber over the step, J/m2."""
        return self.dt * weighted(self.weights, [s.rubber_flux for s in self.stages])

    @property
    def latent_heat(self) -> Array:
        """Latent heat of melting over the step, J/m2."""
        return self.dt * weighted(self.weights, [s.melt_power for s in self.stages])

    @property
    def squeezed(self) -> Array:
        """Height squeezed out over the step, minus the outflow of full voids, m."""
        weights = [weight / self.integrator.diagonal for weight in self.weights]
        return weighted(weights, [change.squeezed_height for change in self.changes])

    @property
    def flowed_out(self) -> Array:
        """Outflow of full voids over the step, m."""
        return self.dt * weighted(self.weights, [stage.outflow for stage in self.stages])

    @property
    def shearing_rate(self) -> Array:
        """Time derivative of `log_shearing` at the end of the step, 1/s."""
        return log_shearing(self.change) / self.stage_dt


def advance(
    state: InterfaceState,
    start: Acting,
    end: Acting,
    dt: Array | float,
    ice: IceHeat,
    integrator: Integrator,
    rubber: RubberHeat = INSULATED,
    rate: Array | None = None,
    close: float = CLOSE,
) -> Step:
    """One step of `dt` (s, scalar or one per point) under loads linear in time.

    The first guess of a film height uses `rate`, d ln h / dt (1/s) at the start if known, then the
    rate of the last stage. A height is found if its last change is at most `close`
    (`film.height.log_height_of`).
    """
    diagonal = integrator.diagonal
    stage_dt = diagonal * dt
    guess = None if rate is None else stage_dt * rate
    changes: list[InterfaceState] = []
    stages: list[FilmStage] = []
    begun = start.begun(dt, state, ice, rubber)
    for row, node in zip(integrator.rows, integrator.nodes, strict=True):
        begin = _combine(state, changes, row, diagonal)
        acting = begun.at(end, node)
        near = None if guess is None else begin.log_height + guess
        film = acting.film(begin, state, stage_dt, integrator.stage, near, close)
        new_ice, stage = ice.stage(begin.ice, stage_dt, rubber.over(film, begin.rubber))
        new = InterfaceState(
            stage.log_height,
            stage.squeezed_height,
            new_ice,
            rubber.heated(begin.rubber, stage_dt, stage.rubber_flux),
            acting.internal_after(begin.internal, stage),
            begin.age,
        )
        stages.append(stage)
        changes.append(InterfaceState(*(b - a for a, b in zip(begin, new, strict=True))))
        guess = changes[-1].log_height
    return Step(new, dt, stages, changes, stage_dt, integrator)


def error_norms(
    step: Step,
    ice: IceHeat,
    free_height: Array,
    temperature_scale: Array,
    rubber: RubberHeat = INSULATED,
    dry: float = 1.0,
) -> Array:
    """Largest relative local error at each point: of ln h, H_s / H_V, surface temperatures.

    Temperatures are relative to `temperature_scale` (K), see `film.viscosity`. Errors of ln h have
    the weight `dry` where nothing melts. Infinite if a value is not finite.
    """
    of_height = np.abs(step.error(lambda change: change.log_height))
    if dry != 1.0:
        of_height *= np.where(step.last.melting, 1.0, dry)
    of_volume = np.abs(step.error(lambda change: change.squeezed_height))
    of_volume /= free_height
    of_surfaces = surface_errors(step, ice, temperature_scale, rubber)
    error = np.maximum(np.maximum(of_height, of_volume, out=of_height), of_surfaces, out=of_height)
    error[~np.isfinite(step.state.log_height)] = np.inf
    return np.fmin(error, np.inf, out=error)


def surface_errors(step: Step, ice: IceHeat, temperature_scale: Array, rubber: RubberHeat) -> Array:
    """The larger local error of the surface temperatures of ice and rubber, over a scale (K)."""
    of_ice = step.error(lambda change: ice.surface_temperature(change.ice))
    of_rubber = step.error(lambda change: rubber.surface_temperature(change.rubber))
    return np.maximum(np.abs(of_ice), np.abs(of_rubber)) / temperature_scale


def _combine(
    state: InterfaceState,
    changes: list[InterfaceState],
    row: tuple[float, ...],
    diagonal: float,
) -> InterfaceState:
    """state + dt * sum(row * rates); the changes are diagonal * dt * rates."""
    if not row:
        return state
    weights = [weight / diagonal for weight in row]
    begin = []
    for i, part in enumerate(state):
        if part.size:
            more = weighted(weights, [one[i] for one in changes])
            begin.append(np.add(part, more, out=more))
        else:
            begin.append(part)
    return InterfaceState(*begin)


def weighted(weights: Sequence[float], parts: list[Array]) -> Array:
    """Sum of the weighted parts; zero without weights."""
    if not weights or not parts[0].size:
        return np.zeros_like(parts[0])
    total = weights[0] * parts[0]
    for weight, part in zip(weights[1:], parts[1:], strict=False):
        total += weight * part
    return total
