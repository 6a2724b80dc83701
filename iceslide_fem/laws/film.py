"""The water film as a friction law: its loads and shear under a contact pressure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from iceslide_fem.film.contact_age import AnyContact
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.law import log_shearing
from iceslide_fem.film.loads import FilmLoads, film_loads
from iceslide_fem.film.viscosity import FILM_VISCOSITY, VariableViscosity
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.scene import Scene
from iceslide_fem.scene.materials import WATER_VISCOSITY

# Shear fades in up to this fraction of the nominal pressure. It fades in more slowly if its slope
# with pressure would exceed this friction coefficient: points that touch and lift under a
# coefficient of hundreds have several equilibria.
RAMP_SHARE, STEEPEST_RAMP = 0.05, 10.0


@dataclass(frozen=True, eq=False)
class FilmLaw:
    """The film law with the parameters that follow from the contact pressure.

    parameters: k, D, H_V over pressure; nominal: pressure (Pa) used for them and for squeeze-out
    instead of the local one, or None; ramp_pressure: pressure (Pa) over which shear fades in,
    because film shear does not vanish with p and would jump at touchdown; viscosity: eta of water
    (Pa s), with a `table` that at the ice's initial temperature.
    """

    parameters: AnyContact
    nominal: float | None
    ramp_pressure: float
    viscosity: float = WATER_VISCOSITY
    table: Curve | None = None
    name: ClassVar[str] = "film"
    has_film: ClassVar[bool] = True
    viscous: ClassVar[bool] = True
    fault: ClassVar[str | None] = None

    @property
    def freezes(self) -> bool:
        """Whether water freezes when friction heat is too low, also on uncovered ice."""
        return False

    @property
    def columns(self) -> tuple[str, ...]:
        """The viscosity, if it depends on temperature."""
        return () if self.table is None else (FILM_VISCOSITY,)

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """ln(eta / eta_0) = 0, if the viscosity depends on temperature."""
        return (0.0,) * len(self.columns)

    def frame(self, asked: str) -> str:
        """The frame that the scene has `asked` for."""
        return asked

    def loads(self, pressure: Array, speed: Array) -> FilmLoads:
        """Loads of the film at local `pressure` (Pa) and `speed` (m/s)."""
        p = self.read_at(pressure)
        k, D, H_V, _ = self.parameters(p)
        ramp, _ = self.ramp(pressure)
        p, k = np.where(pressure > 0.0, p, 0.0), ramp * k
        variable_viscosity = (
            None if self.table is None else VariableViscosity(self.table, self.viscosity)
        )
        return film_loads(p, speed, k, D, H_V, self.viscosity, variable_viscosity)

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """Films of the height (m) without squeezed-out water; with a table ln(eta / eta_0) = 0."""
        return np.full(n, np.log(film_height)), np.zeros(n), np.zeros((len(self.columns), n))

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """ln h and internal variables of films of `height` (m) on ice of `temperature` (K)."""
        if self.table is None:
            return np.log(height), np.zeros((0, height.size))
        viscosity = VariableViscosity(self.table, self.viscosity)
        return np.log(height), viscosity(temperature)[None]

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """The shear law of films in `state`, independent of the temperature."""
        return self.over(np.exp(-log_shearing(state)))

    def at_speed(self, state: InterfaceState, speed: float) -> InterfaceState:
        """The state: viscous shear is proportional to the speed."""
        return state

    def at_start(self, film_height: float, n: int) -> Sheared:
        """The shear law of `n` films of the height (m)."""
        return self.over(np.full(n, film_height))

    def film_height(self, state: InterfaceState) -> Array:
        """h of every film (n,), m."""
        return np.asarray(np.exp(state.log_height))

    def height_at(self, state: InterfaceState, read: Callable[[Array], Array]) -> Array:
        """Harmonic mean of h (m) of the films around points; it gives their mean shear.

        read: interpolation from films to points. Collective if `read` is.
        """
        return np.asarray(1.0 / read(np.exp(-state.log_height)))

    def read(self, shearing: Array, internal: Array, speed: Array) -> Sheared:
        """The shear law of points with the mean `shearing` eta / (eta_0 h) (1/m), (n,)."""
        return self.over(1.0 / shearing)

    def reported(self, internal: Array, pressure: Array) -> Mapping[str, Array]:
        """The viscosity (Pa s) from the internal variable ln(eta / eta_0), (1, n)."""
        return dict(zip(self.columns, self.viscosity * np.exp(internal), strict=True))

    def over(self, film_height: Array) -> Sheared:
        """The shear law of films with these h eta_0 / eta (m), (n,)."""

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            height = film_height.reshape(pressure.shape)
            unit, slope = self.shear(pressure, np.ones_like(height), height)
            return unit * speed, slope * speed, unit

        return shear

    def shear(self, pressure: Array, speed: Array, film_height: Array) -> tuple[Array, Array]:
        """tau = k eta v / h (5.29), faded in with pressure (Pa), and d tau / d p."""
        k, dk_dp = self.parameters.contact_area(self.read_at(pressure))
        if self.nominal is not None:
            dk_dp = np.zeros_like(dk_dp)
        ramp, slope = self.ramp(pressure)
        factor = self.viscosity * speed / film_height
        return ramp * k * factor, (slope * k + ramp * dk_dp) * factor

    def outside(self, pressure: Array) -> Mask:
        """Mask of pressures outside the table of k, D, H_V."""
        return self.parameters.outside(self.read_at(pressure))

    def read_at(self, pressure: Array) -> Array:
        """The pressure for k, D, H_V and squeeze-out, Pa: local or nominal."""
        return pressure if self.nominal is None else np.full_like(pressure, self.nominal)

    def ramp(self, pressure: Array) -> tuple[Array, Array]:
        """Fade-in factor of the shear at a pressure (Pa), and its derivative, 1/Pa."""
        x = pressure / self.ramp_pressure
        return np.clip(x, 0.0, 1.0), np.where((x > 0.0) & (x < 1.0), 1.0 / self.ramp_pressure, 0.0)


def film_law(scene: Scene) -> FilmLaw:
    """The film law of the scene."""
    return FilmLaw(
        scene.contact_parameters,
        scene.load.pressures.first if scene.film.pressure == "nominal" else None,
        scene.numerics.shear_ramp_pressure or default_ramp(scene, scene.initial_height),
        scene.viscosity,
        scene.water.table,
    )


def default_ramp(scene: Scene, height: float) -> float:
    """Pressure (Pa) over which shear fades in, at most the nominal pressure.

    It follows from the initial shear k eta v / h with the initial `height` h (m). For loads that
    change in time it uses the least pressure and the largest speed.
    """
    if not height:
        return scene.load.pressures.smallest
    pressure, speed = scene.load.pressures.smallest, scene.load.speeds.largest
    k = float(scene.contact_parameters(pressure).k)
    shear = k * scene.viscosity * speed / height
    return min(max(RAMP_SHARE * pressure, shear / STEEPEST_RAMP), pressure)
