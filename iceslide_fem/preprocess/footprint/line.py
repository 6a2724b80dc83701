"""The mono-dimensional model, 4.2 to 4.4 of the thesis: one line along the footprint.

It is a pure function of a pressure profile and of all parameters of the thesis's window (fig. 8).
The line is a map with one row (`macroscopic`). x is the direction of travel; ice enters at the
right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.preprocess.footprint.macroscopic import HeatModel, Macroscopic, heat_model
from iceslide_fem.preprocess.footprint.passing import FilmMap, film_map
from iceslide_fem.preprocess.footprint.pressure_map import GaussianLine, PressureMap
from iceslide_fem.preprocess.footprint.ride import FIRST_HEIGHT, Ride
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable

LINE_PIXELS = 540  # of a generated profile


def gaussian_profile(
    length: float, peak: float, points: int = LINE_PIXELS, sigma: float | None = None
) -> tuple[Array, Array]:
    """x (m) and pressure (Pa) of fig. 6: a Gaussian in the middle of `length` (m), `peak` in Pa.

    sigma: m; else a sixth of the length. The thesis prints neither peak nor width.
    """
    x = (np.arange(0.0, points) + 0.5) * (length / points)
    return x, GaussianLine(peak, length / 2.0, length / 6.0 if sigma is None else sigma)(x)


def macroscopic_line(
    pressure: ArrayLike,
    dx: float,
    parameters: Macroscopic,
    temperature: ArrayLike | None = None,
    state: ArrayLike | None = None,
) -> HeatModel:
    """The three modules along a line of pixels of length `dx` (m) with `pressure` (nx,), Pa.

    temperature (K) and state, both (nx,), replace the results of modules 2 and 3. Raises SceneError
    if nothing is in contact.
    """
    model = heat_model(
        as_map(pressure, dx),
        parameters,
        None if temperature is None else np.atleast_2d(np.asarray(temperature, dtype=float)),
        None if state is None else np.atleast_2d(np.asarray(state, dtype=np.uint8)),
    )
    return model._replace(
        pressure=model.pressure[0],
        flux=model.flux[0],
        rise=model.rise[0],
        temperature=model.temperature[0],
        state=model.state[0],
        mu=model.mu[0],
    )


def film_line(
    pressure: ArrayLike,
    dx: float,
    parameters: Macroscopic,
    contact_of: ContactTable | ConstantContact,
    strength: ShearStrength | None = None,
    initial_height: float = FIRST_HEIGHT,
) -> FilmMap:
    """The film law along the same line, arrays (nx,), with ice speed V and sliding speed V S.

    strength: tau_b of dry rubber on ice if it limits the shear; initial_height: m.
    """
    p = parameters
    ride = Ride(p.speed, p.slip * p.speed, p.ice_temperature, initial_height, strength=strength)
    return FilmMap(*(values[0] for values in film_map(as_map(pressure, dx), ride, contact_of)))


def as_map(pressure: ArrayLike, dx: float) -> PressureMap:
    """The line as a map of one row, 1 m wide. Raises SceneError if nothing is in contact."""
    row = np.atleast_2d(np.asarray(pressure, dtype=float))
    if not (row > 0.0).any():
        raise SceneError("the line touches nowhere: no pressure is above 0")
    return PressureMap(row, dx, 1.0)
