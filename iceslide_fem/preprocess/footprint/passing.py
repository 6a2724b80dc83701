"""Ice points that pass below lines of a footprint, and carry their films from pixel to pixel.

An ice point comes in at the leading edge with film h0 and cold ice, and sees the pressure of one
pixel in contact after the other, each for dx / V. Lines advance in one call, every line with steps
of its own and at a pixel of its own. Across gaps film and warmth stay with the ice, which cools.

Squeezed-out water moves at a fraction of the ice's speed (`Ride.water_fraction`; of a block that
slides `interface.water`). Where it is steady its flux is the same: below the rubber it is deeper
than the layer that the ice alone would carry. So what a line carries along is that layer, w H_s /
V, and the layer that voids of H_V can pass on is the same fraction of H_V.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.carrying import CarryingLoads
from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.loads import FilmLoads, film_loads
from iceslide_fem.film.point import taken
from iceslide_fem.film.rubber_heat import INSULATED
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.step_control import StepControl, close_enough
from iceslide_fem.film.viscosity import temperature_scale
from iceslide_fem.preprocess.footprint.aged_path import AgedPath
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable

METHOD = INTEGRATORS["sdirk2"]
# Relative to a pixel's time: the shortest step, and what is left over to rounding.
SHORTEST, SLACK = 1e-9, 1e-6


class Path(NamedTuple):
    """Pixels in contact, line by line, every line as its ice passes them; arrays (n,).

    line, column: of the map; pressure (Pa); enters: whether contact begins there; behind: how many
    pixels without contact the ice passes next; passing: a pixel's time, dx / V (s).
    """

    line: Index
    column: Index
    pressure: Array
    enters: Mask
    behind: Index
    passing: float

    @classmethod
    def below(cls, pressure: Array, passing: float) -> Path:
        """Of lines (n, nx), all of which touch; the ice comes in at the last column."""
        line, steps = np.nonzero(pressure[:, ::-1] > 0.0)
        column = pressure.shape[1] - 1 - steps
        last = np.diff(line, append=-1) != 0
        behind = np.where(last, column, column - np.append(column[1:], 0) - 1)
        enters = np.append(True, last[:-1] | (behind[:-1] > 0))
        return cls(line, column, pressure[line, column], enters, behind, passing)


class FilmMap(NamedTuple):
    """Film and friction of pixels, arrays (ny, nx), or (n,) along a path.

    shear: mean of tau over the pixel (Pa); ice_heat, latent_heat: what ice and melting take, J/m2
    per pixel passed. When the ice leaves the pixel: height: h (m); squeezed: H_s, in voids
    that carry W (m); temperature:
    of the ice surface (K); melting, saturated: which switches are on.
    """

    shear: Array
    ice_heat: Array
    latent_heat: Array
    height: Array
    squeezed: Array
    temperature: Array
    melting: Mask
    saturated: Mask

    @classmethod
    def untouched(cls, shape: tuple[int, int], ride: Ride) -> FilmMap:
        """The map of ice (ny, nx) that nothing has touched."""
        still, never = np.zeros((3, *shape)), np.zeros((2, *shape), dtype=bool)
        lines = ride.initial_height, ride.first_layer, ride.temperature
        height, layer, temperature = (np.broadcast_to(one, shape[::-1]).T.copy() for one in lines)
        return cls._make([*still, height, layer, temperature, *never])

    def lines(self, some: slice) -> FilmMap:
        """The map of `some` of the lines."""
        return FilmMap._make(field[some] for field in self)

    def friction(self, footprint: PressureMap) -> Array:
        """mu per pixel, tau / p (5.30); 0 where there is no contact."""
        pressure = footprint.pressure
        return np.divide(self.shear, pressure, out=np.zeros_like(pressure), where=pressure > 0.0)

    def mean_friction(self, footprint: PressureMap) -> float:
        """Friction force over load of the whole footprint."""
        return float(self.shear.sum() / footprint.pressure.sum())


def films_along(
    path: Path,
    ride: Ride,
    ice: Column,
    contact_of: ContactTable | ConstantContact,
    tolerance: float,
    tell: Callable[[int], None],
) -> tuple[FilmMap, Array]:
    """Films of all lines of a `path`, whose `ice` and ride have a temperature for each line.

    Films (n,), whose `squeezed` is the layer as the ice alone carries it; heat of the ice where
    contact ends, (modes, ends). Each line takes equal steps, as long as its last error lets it,
    that end with the pixel, and repeats a step whose estimated error is too large. It does not wait
    for others. Across a gap the ice cools in one step, which is exact. `tell` is called with the
    number of pixels passed. Raises SimulationStopped where a step cannot be made.
    """
    # The pixels that lines are at, and those that they end with.
    at = np.flatnonzero(np.diff(path.line, prepend=-1))
    last = np.append(at[1:], path.line.size) - 1
    lines, passing = at.size, path.passing
    share, thinnest, speeds = (
        np.broadcast_to(np.asarray(one, dtype=float), (lines,))
        for one in (ride.water_fraction, ride.thinnest_layer, ride.sliding_speed)
    )
    viscosity, variable_viscosity = ride.water(lines)
    k, D, H_V, _ = contact_of(path.pressure)
    voids = np.maximum(share[path.line] * H_V, thinnest[path.line])
    sliding = speeds[path.line]
    limit, eta = ride.limit, viscosity[path.line]
    of_pixels = variable_viscosity and variable_viscosity.take(path.line)
    touching = film_loads(path.pressure, sliding, k, D, voids, eta, of_pixels, limit)
    loads: FilmLoads | CarryingLoads = touching
    if ride.wet is not None:
        loads = ride.wet.loads(touching, path.pressure, contact_of, float(viscosity[0]))
    gaps = path.behind > 0
    gap, content = np.cumsum(gaps) - 1, ice.initial(int(np.count_nonzero(gaps)))
    films = FilmMap(*np.empty((6, k.size)), *np.empty((2, k.size), dtype=bool))
    first = np.full(lines, ride.initial_height)
    # Dry shear needs no history: it is that of height and temperature.
    state = InterfaceState(
        np.log(first) if limit is None else limit.log_height(first),
        np.broadcast_to(ride.first_layer, (lines,)).astype(float),
        ice.initial(lines),
        INSULATED.initial(lines),
        np.zeros((0 if variable_viscosity is None else 1, lines)),
    )
    # What goes round over a film's height in turn with viscosity or voids wants it exactly.
    close = CLOSE if variable_viscosity or ride.wet else close_enough(tolerance)
    aged = None
    if ride.age is not None:
        pixels, kelvin = (path.line, path.pressure, path.behind), np.full(lines, ride.temperature)
        aged = AgedPath.along(ride.age, touching, *pixels, passing, kelvin)
    control, table = (
        StepControl(METHOD, tolerance, close),
        variable_viscosity and variable_viscosity.table,
    )
    undercooling = ride.solid.melting_temperature - ice.temperature
    scale = np.broadcast_to(temperature_scale(undercooling, table), (lines,))
    arrives, left, dt = np.arange(lines), np.full(lines, passing), np.full(lines, passing)
    works, rate = list(np.zeros((3, lines))), np.zeros(lines)  # of a pixel, and d ln h / dt
    while at.size:
        if arrives.size:
            pixel, load = at[arrives], loads.take(at)
            # At a leading edge voids take in as deep a layer as lies on the ice, of that share.
            line = path.line[pixel]
            layer = np.where(path.enters[pixel], share[line], 1.0) * state.squeezed_height[arrives]
            state.squeezed_height[arrives] = np.maximum(layer, thinnest[line])
            left[arrives] = passing
            for work in works:
                work[arrives] = 0.0
        trial = left / np.ceil(left / dt - SLACK)
        begin, end = (load, load) if aged is None else aged.over(at, passing - left, trial)
        step, good, dt = control.trial(state, begin, end, trial, ice, scale, rate=rate)
        bad = np.flatnonzero(~good)
        if bad.size and dt[bad].min() < SHORTEST * passing:
            raise SimulationStopped(
                "the film below the footprint cannot be advanced: even steps of "
                f"{dt.min():.1g} s miss the tolerance"
            )
        state = taken(state, step.state, bad)
        growth = step.change.log_height / step.stage_dt
        growth[bad] = rate[bad]
        rate, passed = growth, np.where(good, trial, 0.0)
        left -= passed
        added = step.friction_work, step.ice_heat, step.latent_heat
        for work, more in zip(works, added, strict=True):
            more[bad] = 0.0
            work += more
        arrives = np.flatnonzero(left <= SLACK * passing)
        if not arrives.size:
            continue
        pixel = at[arrives]
        surface = ice.surface_temperature(state.ice)
        switches = step.last.melting, step.last.saturated
        now = *works, state.log_height, state.squeezed_height, surface, *switches
        for values, new in zip(films, now, strict=True):
            values[pixel] = new[arrives]
        tell(pixel.size)
        leaves = arrives[gaps[pixel]]
        if leaves.size:
            pixel = at[leaves]
            content[:, gap[pixel]] = warm = state.ice[:, leaves]
            state.ice[:, leaves] = ice.cooled(warm, passing * path.behind[pixel])
        at[arrives] += 1
        running = at <= last
        if not running.all():
            keep = np.flatnonzero(running)
            arrives = np.flatnonzero((left <= SLACK * passing)[keep])
            at, last, left, dt, scale = at[keep], last[keep], left[keep], dt[keep], scale[keep]
            state, load, ice = state.take(keep), load.take(keep), ice.take(keep)
            works, rate = [work[keep] for work in works], rate[keep]
    # Rounding apart, the ice has its melting temperature where it melts.
    T_m = ride.solid.melting_temperature
    surface = np.where(films.melting, T_m, films.temperature)
    shear = films.shear / (sliding * passing)
    height = touching.height(films.height)
    return films._replace(shear=shear, height=height, temperature=surface), content
