"""A law as the program calls it: its state as one array, its answers checked.

A fault is kept, not raised: ranks that step together must also stop together (`coupling.sliding`
asks for it). Until then the answer is NaN, which no step accepts.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.laws.protocol import Contact, Law, Response, Surface
from iceslide_fem.materials import MELTING_TEMPERATURE

# Relative change of the slip speed by which the shear's derivative is taken.
SPEED_CHANGE = 1e-6


class Answer:
    """A response with its state as one array: shear, by_pressure, heat (n,), memory (m, n)."""

    def __init__(self, shear: Array, by_pressure: Array, heat: Array, memory: Array) -> None:
        self.shear, self.by_pressure, self.heat, self.memory = shear, by_pressure, heat, memory


class BoundLaw:
    """`law`, of which messages speak as `name`; fault: what it did wrong, or None.

    melting_temperature: of the ice, K.
    """

    def __init__(
        self, law: Law, name: str, melting_temperature: float = MELTING_TEMPERATURE
    ) -> None:
        self._law, self.name, self.melting_temperature = law, name, melting_temperature
        self.fields = {field: float(value) for field, value in law.fields.items()}
        self.fault: str | None = None
        self._carrier: str | None = getattr(law, "carrier", None)

    def carried_by(self, carrier: str) -> str:
        """Whose places remember where ice slides, "rubber" or "ice": by the law, else `carrier`.

        The rubber's, where there is nothing to remember.
        """
        return (self._carrier or carrier) if self.fields else "rubber"

    @property
    def columns(self) -> tuple[str, ...]:
        """How tables call the fields: with law_ before the law's own names."""
        return tuple(f"law_{field}" for field in self.fields)

    def initial(self, n: int) -> Array:
        """Memory at the start, (m, n)."""
        values = np.array(list(self.fields.values()), dtype=float)
        return np.repeat(values[:, None], n, axis=1)

    def respond(
        self,
        pressure: Array,
        speed: Array,
        memory: Array,
        surface: Surface,
        dt: Array | float,
    ) -> Answer:
        """The law's answer; NaN, and a `fault`, where it is none."""
        n = pressure.size
        state = dict(zip(self.fields, memory.copy(), strict=True))
        try:
            given = self._law.respond(
                Contact(pressure.copy(), speed.copy()), state, surface, float(np.max(dt))
            )
            return self._checked(given, speed, n)
        except _Wrong as wrong:
            fault = str(wrong)
        except Exception as error:  # whatever a person's code may raise
            fault = f"raises {type(error).__name__}: {error}"
        self.fault = self.fault or f"the friction law {self.name} {fault}"
        nan = np.full(n, np.nan)
        return Answer(nan, nan, nan, np.full((len(self.fields), n), np.nan))

    def shear(
        self, pressure: Array, speed: Array, memory: Array, temperature: Array
    ) -> tuple[Array, Array, Array]:
        """Shear (Pa) of a state on ice of `temperature` (K), and its derivatives by pressure and
        by speed; arrays of any one shape, memory (m, n)."""
        shape, zero = pressure.shape, np.zeros(pressure.size)
        T_m, most = self.melting_temperature, np.full(pressure.size, np.inf)
        surface = Surface(np.minimum(temperature.ravel(), T_m), zero, T_m, most)
        values = pressure.ravel(), speed.ravel()
        here = self.respond(*values, memory, surface, 0.0)
        change = SPEED_CHANGE * np.maximum(np.abs(values[1]), SPEED_CHANGE)
        faster = self.respond(values[0], values[1] + change, memory, surface, 0.0)
        by_speed = (faster.shear - here.shear) / change
        return tuple(one.reshape(shape) for one in (here.shear, here.by_pressure, by_speed))  # type: ignore[return-value]

    def _checked(self, given: Response, speed: Array, n: int) -> Answer:
        if not isinstance(given, Response):
            raise _Wrong(f"returns {type(given).__name__} instead of a Response")
        missing = sorted({*self.fields} ^ {*given.state})
        if missing:
            raise _Wrong(f"returns another state than its fields: {missing[0]}")
        shear = _array("shear", given.shear, n)
        heat = shear * speed if given.heat is None else _array("heat", given.heat, n)
        state = [_array(f"state {name}", given.state[name], n) for name in self.fields]
        memory = np.array(state).reshape(len(self.fields), n)
        return Answer(shear, _array("by_pressure", given.by_pressure, n), heat, memory)


class _Wrong(Exception):
    """An answer is none."""


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
