"""Coulomb friction, tau = mu p, with mu a number or a table over temperature and speed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from iceslide_fem.laws.protocol import Contact, Response, Surface
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.film import LARGEST, read_table

if TYPE_CHECKING:  # slow import, needed for tables only
    from scipy.interpolate import RegularGridInterpolator

from math import sqrt

from iceslide_fem.laws.user_law import UserLaw
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene

# Pressure at an edge of a sheared block over the mean pressure (docs/reference/laws.md).
EDGE = 8.0
SPEEDS = 60  # number of speeds at which the shear is evaluated
SLOWEST = 1e-3  # m/s, smallest of these above 0


def check_weakening(scene: Scene, law: UserLaw) -> None:
    """Raise SceneError if the `law` falls with the slip speed more than a block can follow."""
    if scene.model == "point" or scene.load.speeds.is_constant:
        return
    fall, where = _steepest_fall(scene, law)
    G, density = scene.mooney_rivlin.shear_modulus, scene.rubber.density
    most = sqrt(density * G) / EDGE if scene.rubber.inertia else 0.0
    if fall <= most:
        return
    allowed = readable(sqrt(density * G) / EDGE, "Pa*s/m")
    fate = "sticks and slips faster than any step" if most else "without inertia has no motion then"
    raise SceneError(
        f"the friction of {law.name} falls with the slip speed, by up to "
        f"{readable(fall, 'Pa*s/m')} at {readable(where, 'm/s')}, and load.speed changes: a block "
        f"{fate}; allowed: a constant load.speed, friction that does not fall, or rubber.inertia = "
        f"true and a fall of at most {allowed} "
        '(page "Friction laws")'
    )


def _steepest_fall(scene: Scene, law: UserLaw) -> tuple[float, float]:
    """Largest -d tau / d v (Pa s/m) up to the highest speed of the scene, and the speed (m/s)."""
    fastest = max(scene.load.speeds.largest, 2.0 * SLOWEST)
    speeds = np.append(0.0, np.geomspace(SLOWEST, fastest, SPEEDS - 1))
    pressure = np.full(SPEEDS, scene.load.pressures.largest)
    fall, where = 0.0, 0.0
    for temperature in (scene.ice.temperature, scene.ice.melting_temperature):
        internal, warm = law.initial(1.0, SPEEDS)[2], np.full(SPEEDS, temperature)
        shear = law.shear(pressure, speeds, internal, warm)[0]
        falls = -np.diff(shear) / np.diff(speeds)
        if np.isfinite(falls).all() and falls.max() > max(fall, 1e-9 * pressure[0]):
            fall, where = float(falls.max()), float(speeds[1:][falls.argmax()])
    return fall, where


# Bisections for the temperature consistent with its heat, to 1e-12 K.
BISECTIONS = 50


class Coulomb:
    """mu over surface temperature (K) and slip speed (m/s); constant beyond the table."""

    fields: Mapping[str, float] = {}

    def __init__(self, mu: float | RegularGridInterpolator) -> None:
        self._mu = mu

    @classmethod
    def of(cls, mu: float | None, table: Path | None) -> Self:
        """Build from the number `mu`, or from the file of a `table`. Raises SceneError."""
        return cls(read_table(table) if table is not None else mu or 0.0)

    def coefficient(self, temperature: Array, speed: Array) -> Array:
        """mu, (n,)."""
        if isinstance(self._mu, int | float):
            return np.full(speed.shape, self._mu)
        low, high = (np.array([axis[i] for axis in self._mu.grid]) for i in (0, -1))
        values = np.stack([temperature - ZERO_CELSIUS, speed], axis=-1)
        return np.asarray(self._mu(np.clip(values, low, high)))

    def respond(
        self, contact: Contact, state: Mapping[str, Array], surface: Surface, dt: float
    ) -> Response:
        """Shear at the temperature at the end of the step, consistent with the friction heat."""
        p, v = contact
        low = surface.offset
        high = np.maximum(low, surface.temperature(LARGEST * p * np.abs(v)))
        for _ in range(0 if isinstance(self._mu, int | float) else BISECTIONS):
            middle = 0.5 * (low + high)
            heat = self.coefficient(middle, v) * p * np.abs(v)
            warmer = surface.temperature(heat) > middle
            low, high = np.where(warmer, middle, low), np.where(warmer, high, middle)
        mu = self.coefficient(0.5 * (low + high), v)
        return Response(mu * p, mu)
