"""Kinematics of ice below a footprint, and parameters of its films."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from iceslide_fem.film.carrying import Carried
from iceslide_fem.film.conditions import half_film
from iceslide_fem.film.contact_age import ContactAge, contact_age
from iceslide_fem.film.first_films import films_of
from iceslide_fem.film.hysteresis import Hysteresis, hysteresis_of
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.limiting_shear import LimitingShear, film_height
from iceslide_fem.film.passes import Passes
from iceslide_fem.film.phase import Refreeze
from iceslide_fem.film.rubber_heat import INSULATED, HalfFilm, Insulated, RubberColumns, RubberHeat
from iceslide_fem.film.shear_strength import ShearStrength, shear_strength
from iceslide_fem.film.strength_over_speed import SpeedLaw, speed_law
from iceslide_fem.film.viscosity import VariableViscosity
from iceslide_fem.film.voids import Voids
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.scene import Scene
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable
from iceslide_fem.scene.materials import BOTTOMLESS, ICE, WATER_VISCOSITY, Ground, Solid

if TYPE_CHECKING:  # takes long to import, and only rough ice needs it
    from iceslide_fem.surfaces.combined_contact import Change, CombinedContact


class WetIce(NamedTuple):
    """Water of a `height` (m) on the ice, and the length of the `lug` (m) for outflow."""

    height: float
    lug: float

    def voids(
        self, contact_of: ContactTable | ConstantContact, rough: Change | None = None
    ) -> Voids:
        """The voids between rubber and ice, from a table of k, D and H_V; rough: as of `Voids`."""
        assert isinstance(contact_of, ContactTable)  # wet ice allows tables only
        return Voids(contact_of, self.lug, rough)

    def carried(
        self,
        pressure: Array,
        contact_of: ContactTable | ConstantContact,
        viscosity: Array,
        first_height: float,
        flows: Array | float,
        rough: Change | None = None,
    ) -> Carried:
        """The voids under `pressure` (Pa), (n,), in full contact, with `viscosity` (Pa s).

        first_height: of films without water, m; flows, rough: as of `Carried` and `Voids`.
        """
        voids, whole = self.voids(contact_of, rough), np.ones_like(pressure)
        return Carried(voids, pressure, whole, viscosity, 1.0, first_height, flows=flows)

    def borne(
        self,
        pressure: Array,
        water: Array,
        contact_of: ContactTable | ConstantContact,
        rough: Change | None = None,
    ) -> Array:
        """Pressure p_f (Pa) on `water` (m) under a `pressure` (Pa), any shape."""
        return pressure - self.voids(contact_of, rough).contact_pressure(pressure, water)


class Ahead(NamedTuple):
    """Ice ahead of contact: film height (m), layer of water (m) and surface temperature (K).

    Scalars or (lines,).
    """

    height: float | Array
    layer: float | Array
    temperature: float | Array


class WarmRubber(NamedTuple):
    """Rubber that takes heat: its `solid`, and the conductance between film and bodies."""

    solid: Solid
    half_film: HalfFilm


ONCE = Passes(1, 0.0, "nothing")
FIRST_HEIGHT = 70e-9  # m, the thesis's
NOTHING = 1e-15  # m, capacity of voids whose water does not move: they are full
LOCKED = 1e-9  # 1 - S of rubber that a locked wheel has warmed


class Ride(NamedTuple):
    """How ice passes the footprint: V and the sliding speed V S (m/s), T_0 (K), h0 (m).

    V, V S, T_0 and h0 may be arrays (ny,), one value for each line. water_speed: of squeezed-out
    water relative to the rubber, over the sliding speed. A viscosity table is read at the film's
    temperature. strength: tau_b of dry rubber on ice if it limits the shear; h0 may then be 0. age:
    ageing contact, or None. wet: water on the ice with load-bearing voids, or None. refreeze: which
    water freezes. warm: rubber that takes heat, or None. passes: over the same ice; ground: below
    it. own_temperature: of the rubber where it enters, K, or None for that of the ice. hysteresis:
    on rough ice, or None; rate: how the strength depends on speed, or None; rough: what rough ice
    changes in the contact, or None.
    """

    speed: float | Array
    sliding_speed: float | Array
    temperature: float | Array
    initial_height: float | Array = FIRST_HEIGHT
    solid: Solid = ICE
    viscosity: float | Curve = WATER_VISCOSITY
    water_speed: float = 1.0
    strength: ShearStrength | None = None
    age: ContactAge | None = None
    wet: WetIce | None = None
    refreeze: Refreeze = "nothing"
    warm: WarmRubber | None = None
    passes: Passes = ONCE
    ground: Ground = BOTTOMLESS
    own_temperature: float | None = None
    hysteresis: Hysteresis | None = None
    rate: SpeedLaw | None = None
    rough: CombinedContact | None = None

    @classmethod
    def of(
        cls,
        law: Scene,
        speed: float,
        sliding_speed: float | Array,
        temperature: float,
        lug: float = np.inf,
    ) -> Ride:
        """The film law of a scene on its ice, but at these speeds (m/s) and `temperature` (K).

        lug: length of the lug for outflow, m. Below the rubber nothing holds the largest contact.
        """
        film, age = law.film, contact_age(law)
        return cls(
            speed,
            sliding_speed,
            temperature,
            float(law.height_on(temperature)),
            law.ice.solid,
            law.water.table or law.water.viscosity,
            law.water_speed,
            shear_strength(law),
            age and replace(age, table=law.touching_table, holds=False),
            WetIce(law.ice.water, lug) if film.voids == "carry" else None,
            law.refreeze,
            WarmRubber(law.rubber.solid, half_film(law)) if law.rubber.heat else None,
            Passes(law.load.passes, law.load.period or 0.0, law.between),
            law.ice.model_copy(update={"temperature": temperature}).ground,
            law.rubber.temperature,
            hysteresis_of(law),
            speed_law(law),
            law.rough_contact,
        )

    def change(self, pressure: Array, speed: Array, kelvin: Array) -> Change | None:
        """What rough ice of a temperature (K) changes under pressures (Pa), at speeds (m/s)."""
        return None if self.rough is None else self.rough.at(pressure, speed, kelvin)

    @property
    def limit(self) -> LimitingShear | None:
        """Limit of the shear of the films, or None."""
        if self.strength is None:
            return None
        fastest, freezes = float(np.max(self.sliding_speed)), self.refreeze != "nothing"
        eta = float(np.max(self.viscosity_at(self.temperature)))
        return LimitingShear.of(self.strength, eta, fastest, freezes, self.rate)

    @property
    def rubber_fraction(self) -> float | Array:
        """1 - S: speed of the rubber through the patch over that of the ice; 0 if locked."""
        return np.maximum(1.0 - self.sliding_speed / self.speed, 0.0)

    @property
    def rubber_temperature(self) -> float | Array:
        """Temperature of the rubber where it enters, K."""
        return self.temperature if self.own_temperature is None else self.own_temperature

    @property
    def slower(self) -> float | Array:
        """1 / (1 - S): time of the rubber in the patch over that of the ice; infinite if locked."""
        with np.errstate(divide="ignore"):
            return np.divide(1.0, self.rubber_fraction)

    def rubber(self, duration: float | Array) -> RubberColumns | Insulated:
        """Rubber above the lines, which enters every contact at its first temperature.

        duration: of the ice in the patch, s. Heat in the rubber is steady in the frame of the
        wheel, where it moves with V (1 - S) and the ice with V. In the ice's time t = x / V

            rho c (1 - S) dT/dt = lambda d2T/dz2,

        so the column that goes with the ice has the density rho (1 - S). The rubber below a locked
        wheel has been there for ever, and takes no more heat.
        """
        if self.warm is None:
            return INSULATED
        solid, half = self.warm
        density = solid.density * np.maximum(self.rubber_fraction, LOCKED)
        T_m = self.solid.melting_temperature
        solid = solid._replace(density=density)
        times = np.array([np.min(duration), np.max(duration)])
        return RubberColumns(self.rubber_temperature, times, solid, half, T_m)

    def lines(self, some: Index) -> Ride:
        """The ride of `some` of the lines."""
        speed, sliding, temperature, height = (
            np.asarray(one)[some] if np.ndim(one) else np.full(some.size, one)
            for one in (self.speed, self.sliding_speed, self.temperature, self.initial_height)
        )
        return self._replace(
            speed=speed, sliding_speed=sliding, temperature=temperature, initial_height=height
        )

    @property
    def water_fraction(self) -> float | Array:
        """w / V of water below the rubber; the rubber passes the footprint at V (1 - S)."""
        return 1.0 - self.sliding_speed / self.speed * (1.0 - self.water_speed)

    @property
    def thinnest_layer(self) -> float | Array:
        """Least layer of squeezed-out water on the ice, m."""
        return np.where(np.asarray(self.water_fraction) > 0.0, 0.0, NOTHING)

    @property
    def first_layer(self) -> float | Array:
        """Layer of water on the ice ahead of contact, m."""
        return self.thinnest_layer if self.wet is None else self.wet.height

    @property
    def ahead(self) -> Ahead:
        """Ice that nothing has touched."""
        return Ahead(self.initial_height, self.first_layer, self.temperature)

    def first_state(self, ice: Column, rubber: RubberHeat) -> InterfaceState:
        """Lines of untouched ice, where each line has its temperature."""
        lines = np.size(self.temperature)
        height, layer = (
            np.full(lines, one, dtype=float) for one in (self.initial_height, self.first_layer)
        )
        log_height, internal = self.films(height, np.asarray(self.temperature))
        heats = ice.initial(lines), rubber.initial(lines)
        return InterfaceState(log_height, layer, *heats, internal, np.zeros((0, lines)))

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """ln h and internal variables of films of `height` (m) on ice of `temperature` (K)."""
        viscosity, variable_viscosity = self.water(height.size)
        limit, lug = self.limit, self.wet and self.wet.lug
        limit = limit and limit._replace(viscosity=viscosity)
        below = np.maximum(self.solid.melting_temperature - temperature, 0.0)
        speeds = np.broadcast_to(np.asarray(self.sliding_speed, dtype=float), height.shape)
        return films_of(height, temperature, below, speeds, variable_viscosity, limit, lug)

    def film_height(self, state: InterfaceState) -> Array:
        """h (m) of films, (n,)."""
        return film_height(state.log_height, self.limit)

    def untouched(self, n: int) -> Array:
        """No history of the contact: `AgedPath` has that of the rubber."""
        return np.zeros((0, n))

    def water(self, lines: int) -> tuple[Array, VariableViscosity | None]:
        """Viscosity of every line (Pa s), (lines,), and its temperature dependence, or None."""
        viscosity = np.broadcast_to(self.viscosity_at(self.temperature), (lines,)).copy()
        if not isinstance(self.viscosity, Curve):
            return viscosity, None
        return viscosity, VariableViscosity(self.viscosity, viscosity)

    def viscosity_at(self, temperature: float | Array) -> Array:
        """Viscosity of the water (Pa s) at temperatures (K) of any shape."""
        given = self.viscosity
        if isinstance(given, Curve):
            return given(temperature)
        return np.full_like(np.asarray(temperature, dtype=float), given)
