"""A law of the published protocol as an interface law (`laws.protocol`).

Its state is one array, and its results are checked. A fault is stored, not raised, because all
ranks must stop together (`coupling.sliding` checks for it). Until then the result is NaN, which no
step accepts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np

from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.laws.protocol import Contact, Law, Response, Sheared, Surface
from iceslide_fem.laws.user_stage import Answer, UserLoads
from iceslide_fem.runtime.arrays import Array, Mask

# Relative increment of the slip speed for the numerical derivative of the shear.
SPEED_CHANGE = 1e-6
# Rubber and ice touch: a water layer (m) of negligible thermal resistance.
NO_FILM = 1e-9


class UserLaw:
    """A user's `law`, called `name` in messages, on ice that melts at `melting_temperature` (K).

    temperature: initial, of the ice, K; fault: message about an invalid result, or None.
    """

    has_film: ClassVar[bool] = False
    viscous: ClassVar[bool] = False
    wet: ClassVar[None] = None

    def __init__(self, law: Law, name: str, temperature: float, melting_temperature: float) -> None:
        self._law, self.name = law, name
        self._temperature, self._melting_temperature = temperature, melting_temperature
        self.fields = {field: float(value) for field, value in law.fields.items()}
        self.fault: str | None = None
        self._frame: str | None = getattr(law, "carrier", None)

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the fields with the prefix law_."""
        return tuple(f"law_{field}" for field in self.fields)

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """Initial values of the fields."""
        return tuple(self.fields.values())

    def frame(self, asked: str) -> str:
        """The frame of the law, else that `asked` for; "rubber" without a history."""
        return (self._frame or asked) if self.fields else "rubber"

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """No film, no squeezed-out water, and the law's initial state of `n` points."""
        return np.full(n, np.log(NO_FILM)), np.zeros(n), self._internal(n)

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """No film, and the law's initial state."""
        return np.full_like(height, np.log(NO_FILM)), self._internal(height.size)

    def untouched(self, n: int) -> Array:
        """No history of the contact: a law has internal variables instead."""
        return np.zeros((0, n))

    def aged(
        self, age: Array, start: Array, end: Array, dt: Array | float, kelvin: Array | None
    ) -> Array:
        """The same."""
        return age

    def loads(self, pressure: Array, speed: Array, age: Array) -> UserLoads:
        """Loads at local `pressure` (Pa) and `speed` (m/s)."""
        return UserLoads(self, np.maximum(pressure, 0.0), speed)

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """The shear law in `state`, on ice of `temperature` (K)."""
        return self._over(state.internal, temperature())

    def at_speed(self, state: InterfaceState, speed: float) -> InterfaceState:
        """The state: there is no film."""
        return state

    def at_start(self, film_height: float, n: int) -> Sheared:
        """Shear of `n` points at the start."""
        return self._over(self._internal(n), np.full(n, self._temperature))

    def film_height(self, state: InterfaceState) -> Array:
        """NaN: there is no film."""
        return np.full_like(state.log_height, np.nan)

    def water_height(self, state: InterfaceState) -> Array:
        """That of the state."""
        return state.squeezed_height

    def reported(self, internal: Array, pressure: Array, age: Array) -> Mapping[str, Array]:
        """The fields under their column names."""
        return dict(zip(self.columns, internal, strict=True))

    def contact_pressure(self, pressure: Array, water: Array, age: Array) -> Array:
        """All of the pressure."""
        return pressure

    def outside(self, pressure: Array) -> Mask:
        """False everywhere: there is no table."""
        return np.zeros(pressure.shape, dtype=bool)

    def respond(
        self,
        pressure: Array,
        speed: Array,
        internal: Array,
        surface: Surface,
        dt: Array | float,
    ) -> Answer:
        """The law's result; NaN and a `fault` if it is invalid."""
        n = pressure.size
        state = dict(zip(self.fields, internal.copy(), strict=True))
        try:
            given = self._law.respond(
                Contact(pressure.copy(), speed.copy()), state, surface, float(np.max(dt))
            )
            return self._checked(given, speed, n)
        except _Wrong as wrong:
            fault = str(wrong)
        except Exception as error:  # user code may raise anything
            fault = f"raises {type(error).__name__}: {error}"
        self.fault = self.fault or f"the friction law {self.name} {fault}"
        nan = np.full(n, np.nan)
        return Answer(nan, nan, nan, np.full((len(self.fields), n), np.nan))

    def shear(
        self, pressure: Array, speed: Array, internal: Array, temperature: Array
    ) -> tuple[Array, Array, Array]:
        """Shear (Pa) of a state on ice of `temperature` (K), and its two derivatives.

        They are with pressure and with speed. Arrays have one shape; internal is (m, n).
        """
        shape, zero = pressure.shape, np.zeros(pressure.size)
        T_m, most = self._melting_temperature, np.full(pressure.size, np.inf)
        surface = Surface(np.minimum(temperature.ravel(), T_m), zero, T_m, most)
        values = pressure.ravel(), speed.ravel()
        here = self.respond(*values, internal, surface, 0.0)
        change = SPEED_CHANGE * np.maximum(np.abs(values[1]), SPEED_CHANGE)
        faster = self.respond(values[0], values[1] + change, internal, surface, 0.0)
        by_speed = (faster.shear - here.shear) / change
        return here.shear.reshape(shape), here.by_pressure.reshape(shape), by_speed.reshape(shape)

    def _internal(self, n: int) -> Array:
        """Internal variables at the start, (m, n)."""
        return np.repeat(np.array(self.internal_at_start)[:, None], n, axis=1)

    def _over(self, internal: Array, temperature: Array) -> Sheared:
        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            return self.shear(np.maximum(pressure, 0.0), speed, internal, temperature)

        return shear

    def _checked(self, given: Response, speed: Array, n: int) -> Answer:
        if not isinstance(given, Response):
            raise _Wrong(f"returns {type(given).__name__} instead of a Response")
        missing = sorted({*self.fields} ^ {*given.state})
        if missing:
            raise _Wrong(f"returns another state than its fields: {missing[0]}")
        shear = _array("shear", given.shear, n)
        heat = shear * speed if given.heat is None else _array("heat", given.heat, n)
        state = [_array(f"state {name}", given.state[name], n) for name in self.fields]
        internal = np.array(state).reshape(len(self.fields), n)
        return Answer(shear, _array("by_pressure", given.by_pressure, n), heat, internal)


class _Wrong(Exception):
    """A result is invalid."""


def _array(what: str, value: object, n: int) -> Array:
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise _Wrong(f"returns a {what} that is not an array of numbers") from None
    if array.shape != (n,):
        raise _Wrong(f"returns a {what} of shape {array.shape}; it must be ({n},)")
    if not np.isfinite(array).all():
        raise _Wrong(f"returns a {what} that is not finite at {np.sum(~np.isfinite(array))} points")
    return array
