"""A film in one implicit stage: its unknowns, nested."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, Self

import numpy as np

from iceslide_fem.film.carrying import Beside, Carried, Sharing
from iceslide_fem.film.hysteresis import Rough
from iceslide_fem.film.law import FilmForcing, FilmHistory, FilmStage, Surface
from iceslide_fem.film.limiting_shear import LimitingShear
from iceslide_fem.film.phase import Phase, Refreeze
from iceslide_fem.film.viscosity import VariableViscosity, consistent_viscosity
from iceslide_fem.runtime.arrays import Array


class StageLoads(FilmForcing, Protocol):
    """Loads of a film in a stage, with the components of the law (`loads.FilmLoads`)."""

    @property
    def variable_viscosity(self) -> VariableViscosity | None:
        """Viscosity over temperature."""

    @property
    def limit(self) -> LimitingShear | None:
        """Limit of the shear."""

    @property
    def carried(self) -> Carried | None:
        """Voids that carry."""

    @property
    def refreeze(self) -> Refreeze:
        """Which water freezes."""

    @property
    def viscosity_row(self) -> int:
        """Number of the internal variable ln(eta / eta_0)."""

    def height(self, log_height: Array) -> Array:
        """h (m) from the height variable."""

    @property
    def rough(self) -> Rough | None:
        """Hysteresis on rough ice."""

    def share(self, end: FilmHistory | FilmStage) -> Array | float:
        """p_c / p, (n,)."""

    def stress_of(self, shearing: Array, end: FilmHistory | FilmStage) -> Array:
        """tau (Pa) of films of the `shearing` (1/m), and of water in voids that carry, (n,)."""

    def at_viscosity(self, ratio: Array) -> Self:
        """The loads with a viscosity of `ratio` times the reference, (n,)."""

    def beside(self, shared: Sharing, phase: Phase | None) -> Self:
        """The film's loads under a load sharing; phase: what freezes."""


class FilmOnIce(NamedTuple):
    """A film in one stage, with its start values and loads.

    law: of the film's height, such as `implicit_stage`. The other fields are its arguments, and the
    internal variables at the start. The unknowns are nested: the viscosity (`viscosity`), the water
    in load-bearing voids (`carrying`), the height and the strength (`law`).
    """

    law: Callable[..., FilmStage]
    log_height: Array
    squeezed_height: Array
    dt: Array | float
    loads: StageLoads
    internal: Array = np.zeros((0, 1))

    def height(self, log_height: Array) -> Array:
        """h (m) from the height variable of the stage."""
        return self.loads.height(log_height)

    def solve(self, ice: Surface, near: Array | None = None) -> FilmStage:
        """The stage above `ice`, with the viscosity at its end; `near` is not needed."""
        found = self._film(ice)
        if self.loads.rough is None:
            return found
        return found._replace(hysteresis=self.loads.rough.borne(self.loads.share(found))[1])

    def _film(self, ice: Surface) -> FilmStage:
        loads, variable_viscosity = self.loads, self.loads.variable_viscosity
        if variable_viscosity is None:
            return self._beside_voids(loads, ice)

        def stage(log_viscosity: Array) -> tuple[Array, FilmStage]:
            """Temperature and stage of films of ln(eta / eta_0)."""
            found = self._beside_voids(loads.at_viscosity(np.exp(log_viscosity)), ice)
            warm = ice.offset + ice.resistance * found.friction_power
            T_m = ice.solid.melting_temperature
            return np.where(found.melting, T_m, np.minimum(warm, T_m)), found

        log_viscosity, temperature, found = consistent_viscosity(
            stage, variable_viscosity, self.internal[loads.viscosity_row]
        )
        # Without melting, warmer ice lowers the friction power.
        less = ice.resistance * found.friction_power * variable_viscosity.fall(temperature)
        of_film = found.internal
        if len(of_film):
            of_film = np.vstack([of_film[:1] + log_viscosity, of_film[1:]])
        else:
            of_film = log_viscosity[None]
        return found._replace(
            ice_slope=np.where(found.melting, found.ice_slope, less / (1.0 + less)),
            internal=np.vstack([of_film, log_viscosity]),
            shearing=np.exp(log_viscosity) * found.shearing,
        )

    def _beside_voids(self, loads: StageLoads, ice: Surface) -> FilmStage:
        if loads.carried is None:
            return self._alone(loads, self.squeezed_height, ice)

        def film_of(
            shared: Sharing, water: Array, below: Surface, phase: Phase | None
        ) -> FilmStage:
            return self._alone(loads.beside(shared, phase), water, below)

        kinds = loads.refreeze == "area", loads.limit is not None
        start = loads.speed, *kinds, self.squeezed_height, self.dt
        found = Beside(loads.carried, *start, film_of).solve(ice)
        if len(found.internal):
            return found
        return found._replace(internal=np.zeros((1, self.log_height.size)))

    def _alone(self, loads: StageLoads, water: Array, ice: Surface) -> FilmStage:
        start = self.log_height, water, self.dt, loads, ice
        return self.law(*start) if loads.limit is None else self.law(loads.limit, *start)
