"""Ageing contact of rubber that passes through a footprint, from pixel to pixel.

Each line has a constant pressure in a pixel and none in a gap, so the contact history does not
depend on the films. The age is that of the rubber. It passes through the patch with V - V S, more
slowly than the ice below it: where the ice has been for t, the rubber has been for t / (1 - S).
The rubber below a locked wheel has been there for ever.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.contact_age import ContactAge
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.runtime.arrays import Array, Index

# Gauss points of the interval from 0 to 1.
GAUSS = 0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)


class AgedPath(NamedTuple):
    """Contact along a path of n pixels.

    touching: loads of films under fresh contact; pressure: Pa, (n,); entering: history at the entry
    of each pixel, (rows, n); temperature: there, K, (n,); slower: 1 / (1 - S), (n,); passing:
    time of the ice per pixel, s, (n,).
    """

    age: ContactAge
    touching: FilmLoads | None
    pressure: Array
    entering: Array
    temperature: Array
    slower: Array
    passing: Array

    @classmethod
    def along(
        cls,
        age: ContactAge,
        touching: FilmLoads | None,
        line: Index,
        pressure: Array,
        behind: Index,
        passing: Array,
        temperature: Array,
        slower: Array,
    ) -> AgedPath:
        """The path of pixels in the order of `passing.Path`.

        passing: time per pixel of the ice in each line, s; behind: number of following pixels
        without contact; temperature: of the rubber above each line, K; slower: 1 / (1 - S) of each
        line.
        """
        entering = age.fresh(line.size)
        at = np.flatnonzero(np.diff(line, prepend=-1))
        last = np.append(at[1:], line.size) - 1
        history = age.fresh(at.size)
        while at.size:
            entering[:, at] = history
            p, kelvin, nothing = pressure[at], temperature[line[at]], np.zeros(at.size)
            pixel = age.relaxation.reduced(passing[line[at]] * slower[line[at]], kelvin)
            history = age.after(history, p, p, pixel)
            gap = np.where(behind[at] > 0, np.maximum(behind[at], 1) * pixel, 0.0)
            rested = age.after(history, nothing, nothing, gap)
            history = np.where(gap > 0.0, rested, history)
            keep = at < last
            at, last, history = at[keep] + 1, last[keep], history[:, keep]
        return cls(
            age, touching, pressure, entering, temperature[line], slower[line], passing[line]
        )

    @property
    def leaving(self) -> Array:
        """History at the exit of each pixel, (rows, n)."""
        reduced = self.age.relaxation.reduced(self.passing * self.slower, self.temperature)
        return self.age.after(self.entering, self.pressure, self.pressure, reduced)

    def over(self, pixel: Index, start: Array, dt: Array) -> tuple[FilmLoads, FilmLoads]:
        """Loads of films at both ends of a step that begins `start` (s) after the ice's entry of
        the pixel.

        They are extrapolated linearly from the two Gauss points, so fast creep also has the right
        mean.
        """
        assert self.touching is not None
        touching = self.touching.take(pixel)
        first, last = (self._after(touching, pixel, start + point * dt) for point in GAUSS)
        width = GAUSS[1] - GAUSS[0]
        begin, end = ((at - GAUSS[0]) / width for at in (0.0, 1.0))
        return first.at(last, begin), first.at(last, end)

    def _after(self, touching: FilmLoads, pixel: Index, time: Array) -> FilmLoads:
        p, kelvin = self.pressure[pixel], self.temperature[pixel]
        reduced = self.age.relaxation.reduced(time * self.slower[pixel], kelvin)
        contact = self.age.so_far(self.age.after(self.entering[:, pixel], p, p, reduced))
        new, old, carried = self.age.table(p), contact(p), touching.carried
        return touching._replace(
            viscous=touching.viscous * (old.k / new.k),
            squeeze_rate=touching.squeeze_rate * (new.D / old.D) ** 2,
            free_height=touching.free_height * (old.H_V / new.H_V),
            carried=carried and carried._replace(softness=contact.softness(p)),
        )
