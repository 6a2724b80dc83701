"""Heat from films to the bodies around them, at given temperatures of their points.

Points are coupled to the surfaces through a small `interface_resistance` (K m2/W). The flux of a
melting point is then a unique function of its temperature.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.film_between import FilmBetween, HalfFilm, RubberSurface, parallel
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import Solid


class Answer(NamedTuple):
    """Films at given temperatures: the heat to each reading, W, (m,).

    slopes: fall of this heat with the temperature there, and with that of the other body, if there
    are two, W/K, (bodies, m).
    """

    stage: FilmStage
    given: Array
    slopes: Array


class Contact(Protocol):
    """Films between bodies, or above one."""

    def evaluate(self, film: Film, temperature: Array, near: Array) -> Answer:
        """Heat at the read temperatures (K); first guess of heights: ln h = `near`."""


class AboveIce(NamedTuple):
    """Films above ice of `solid`: one reading for each point; area: of the points, m2."""

    area: Array
    solid: Solid
    interface_resistance: float

    def evaluate(self, film: Film, temperature: Array, near: Array) -> Answer:
        """Heat to the ice."""
        resistances = np.full_like(temperature, self.interface_resistance)
        stage = film.solve(Surface.of(temperature, resistances, self.solid), near)
        slopes = (self.area * stage.ice_slope / self.interface_resistance)[None]
        return Answer(stage, self.area * stage.ice_flux, slopes)


class BetweenIceAndRubber(NamedTuple):
    """Films between ice of `solid` and rubber: readings of the ice, then of the rubber.

    The half of a film conducts to either body (`HalfFilm`); area: of the points, m2.
    """

    area: Array
    solid: Solid
    interface_resistance: float
    half_film: HalfFilm

    def evaluate(self, film: Film, temperature: Array, near: Array) -> Answer:
        """Heat to both bodies.

        G_i and G_r are the conductances to the bodies. A melting film is at T_m, so the slope for a
        body is its own G. A film that does not melt gives its whole power to both, so the slope is
        G_i G_r / (G_i + G_r).
        """
        below, above = np.split(temperature, 2)
        resistances, cover = np.full_like(below, self.interface_resistance), np.ones_like(below)
        ice = Surface.of(below, resistances, self.solid)
        rubber = RubberSurface(above, resistances, cover, self.half_film)
        stage = FilmBetween(film, rubber).solve(ice, near)
        to_ice, to_rubber, _ = parallel(ice, rubber, film.height(stage.log_height))
        through = to_ice * to_rubber / (to_ice + to_rubber)
        own = [np.where(stage.melting, one, through) for one in (to_ice, to_rubber)]
        across = [np.where(stage.melting, 0.0, -through)] * 2
        given = self.area * stage.ice_flux, self.area * stage.rubber_flux
        slopes = np.tile(self.area, 2) * np.array([np.concatenate(own), np.concatenate(across)])
        return Answer(stage, np.concatenate(given), slopes)
