"""Ice points that pass below lines of a footprint, with films from pixel to pixel.

An ice point enters at the leading edge with film h0 and cold ice. It passes one pixel in contact
after the other, each for dx / V under the pixel's pressure. All lines advance in one call; each
line has its own steps and its own pixel. In gaps film and heat stay with the ice, which cools, and
behind them the rubber is cold again (`Ride.rubber`).

Squeezed-out water moves at a fraction of the ice's speed (`Ride.water_fraction`; for a sliding
block see `interface.on_ice`). Its steady flux is constant, so water is deeper below the rubber than
a layer that moves with the ice. The variable of a line is this equivalent layer w H_s / V. The
layer that voids of H_V can transport is the same fraction of H_V.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.first_films import films_of
from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.loads import MOLTEN, film_loads
from iceslide_fem.film.point import taken
from iceslide_fem.film.rubber_heat import Insulated, RubberHeat
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
# Relative to a pixel's time: the shortest step, and the rounding of the rest.
SHORTEST, SLACK = 1e-9, 1e-6
YOUNGEST = 1e-2  # the first step where water meets cold ice, or cold rubber warm ice


class Path(NamedTuple):
    """Pixels in contact, line by line in the order of passage; arrays (n,).

    line, column: of the map; pressure: Pa; enters: whether contact begins there; resumes: whether
    it begins again, behind a gap; behind: number of following pixels without contact; passing: time
    per pixel, dx / V, s.
    """

    line: Index
    column: Index
    pressure: Array
    enters: Mask
    resumes: Mask
    behind: Index
    passing: float

    @classmethod
    def below(cls, pressure: Array, passing: float) -> Path:
        """The path of touching lines (n, nx); ice enters at the last column."""
        line, steps = np.nonzero(pressure[:, ::-1] > 0.0)
        column = pressure.shape[1] - 1 - steps
        last = np.diff(line, append=-1) != 0
        behind = np.where(last, column, column - np.append(column[1:], 0) - 1)
        resumes = np.append(False, ~last[:-1] & (behind[:-1] > 0))
        enters = np.append(True, last[:-1]) | resumes
        return cls(line, column, pressure[line, column], enters, resumes, behind, passing)


class FilmMap(NamedTuple):
    """Film and friction of pixels, arrays (ny, nx), or (n,) along a path.

    shear: mean of tau over the pixel, Pa; ice_heat, latent_heat: heat into ice and of melting, J/m2
    per pixel. At the exit of the pixel: height: h, m; squeezed: H_s, or W in load-bearing voids, m;
    temperature: of the ice surface, K; melting, saturated: masks of the switches.
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
        """The map of untouched ice (ny, nx)."""
        still, never = np.zeros((3, *shape)), np.zeros((2, *shape), dtype=bool)
        lines = ride.initial_height, ride.first_layer, ride.temperature
        height, layer, temperature = (np.broadcast_to(one, shape[::-1]).T.copy() for one in lines)
        return cls._make([*still, height, layer, temperature, *never])

    def lines(self, some: slice) -> FilmMap:
        """The map of `some` of the lines."""
        return FilmMap._make(field[some] for field in self)

    def friction(self, footprint: PressureMap) -> Array:
        """mu per pixel, tau / p (5.30); 0 without contact."""
        pressure = footprint.pressure
        return np.divide(self.shear, pressure, out=np.zeros_like(pressure), where=pressure > 0.0)

    def mean_friction(self, footprint: PressureMap) -> float:
        """Friction force over load of the whole footprint."""
        return float(self.shear.sum() / footprint.pressure.sum())


def films_along(
    path: Path,
    ride: Ride,
    ice: Column,
    rubber: RubberHeat,
    contact_of: ContactTable | ConstantContact,
    tolerance: float,
    tell: Callable[[int], None],
    slides: Mask,
) -> tuple[FilmMap, Array]:
    """Films along a `path`; `ice`, `rubber` and ride have a temperature for each line.

    Returns films (n,), whose `squeezed` is the equivalent layer, and the heat of the ice at ends of
    contact, (modes, ends). Each line divides a pixel into equal steps by its last error, and
    repeats a step with a too large error, independent of other lines. In a gap the ice cools in one
    exact step. tell: called with the number of finished pixels; slides: pixels of the path in which
    rubber slides. In others it sticks: pressure squeezes their films, too. Raises SimulationStopped
    if a step fails.
    """
    # Present and last pixel of each line.
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
    sliding = np.where(slides, speeds[path.line], 0.0)
    limit, eta = ride.limit, viscosity[path.line]
    of_pixels = variable_viscosity and variable_viscosity.take(path.line)
    dry = float(np.max(ride.initial_height))
    layer = share[path.line]
    carried = ride.wet and ride.wet.carried(path.pressure, contact_of, eta, dry, layer)
    limit = limit and limit._replace(viscosity=eta)
    components = of_pixels, limit, carried, ride.refreeze
    loads = film_loads(path.pressure, sliding, k, D, voids, eta, *components)
    gaps = path.behind > 0
    gap, content = np.cumsum(gaps) - 1, ice.initial(int(np.count_nonzero(gaps)))
    films = FilmMap(*np.empty((6, k.size)), *np.empty((2, k.size), dtype=bool))
    first = np.full(lines, ride.initial_height)
    kelvin = np.broadcast_to(np.asarray(ride.temperature, dtype=float), (lines,))
    below, lug = ride.solid.melting_temperature - kelvin, ride.wet and ride.wet.lug
    log_height, internal = films_of(
        first, kelvin, below, speeds, variable_viscosity, loads.take(at).limit, lug
    )
    state = InterfaceState(
        log_height,
        np.broadcast_to(ride.first_layer, (lines,)).astype(float),
        ice.initial(lines),
        rubber.initial(lines),
        internal,
        np.zeros((0, lines)),
    )
    # Iterations over film height and another unknown need an exact height.
    insulated = isinstance(rubber, Insulated)
    alone = loads.alone and insulated
    close = close_enough(tolerance) if alone else CLOSE
    aged = None
    if ride.age is not None:
        pixels, slower = (path.line, path.pressure, path.behind), np.full(lines, ride.slower)
        aged = AgedPath.along(ride.age, loads, *pixels, passing, kelvin, slower)
    control, table = (
        StepControl(METHOD, tolerance, close),
        variable_viscosity and variable_viscosity.table,
    )
    undercooling = ride.solid.melting_temperature - ice.temperature
    scale = np.broadcast_to(temperature_scale(undercooling, table), (lines,))
    arrives, left, dt = np.arange(lines), np.full(lines, passing), np.full(lines, passing)
    works, rate = list(np.zeros((3, lines))), np.zeros(lines)  # sums over a pixel, and d ln h / dt
    while at.size:
        if arrives.size:
            pixel, load = at[arrives], loads.take(at)
            # At a leading edge voids take in a layer as deep as that on the ice.
            line = path.line[pixel]
            layer = np.where(path.enters[pixel], share[line], 1.0) * state.squeezed_height[arrives]
            state.squeezed_height[arrives] = np.maximum(layer, thinnest[line])
            left[arrives] = passing
            meets = arrives[path.enters[pixel]]
            if not insulated:
                state.rubber[:, meets] = 0.0
                dt[arrives[path.resumes[pixel]]] = YOUNGEST * passing
            if ride.refreeze == "area":  # water meets cold ice
                dt[meets], state.internal[MOLTEN, meets] = YOUNGEST * passing, 0.0
            for work in works:
                work[arrives] = 0.0
        trial = left / np.ceil(left / dt - SLACK)
        begin, end = (load, load) if aged is None else aged.over(at, passing - left, trial)
        step, good, dt = control.trial(state, begin, end, trial, ice, scale, rubber, rate)
        if not insulated:
            # Surfaces of two temperatures meet: a shorter step has no smaller error.
            good |= path.resumes[at] & (left == passing) & np.isfinite(step.state.log_height)
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
            state, load = state.take(keep), load.take(keep)
            ice, rubber = ice.take(keep), rubber.take(keep)
            works, rate = [work[keep] for work in works], rate[keep]
    # Melting ice is at the melting temperature; this removes rounding.
    T_m = ride.solid.melting_temperature
    surface = np.where(films.melting, T_m, films.temperature)
    work = sliding * passing
    shear = np.divide(films.shear, work, out=np.zeros_like(work), where=work > 0.0)
    height = loads.height(films.height)
    return films._replace(shear=shear, height=height, temperature=surface), content


# Lines that advance together: their columns of ice stay in the processor's cache.
LINES = 2048
# Error of the ice response with fewer modes, relative to the tolerance.
CONDENSED = 1e-3


def film_map(
    footprint: PressureMap,
    ride: Ride,
    contact_of: ContactTable | ConstantContact,
    tolerance: float = 1e-2,
    ice: Callable[..., Column] = Column,
    tell: Callable[[float], None] = lambda fraction: None,
    slides: Mask | None = None,
) -> FilmMap:
    """Film, temperature and friction at every pixel of the footprint.

    contact_of: k, D and H_V over the local pressure; tolerance: target relative error of mu; ice:
    builds columns from a temperature (K), a duration (s) and the ride's solid; tell: called with
    the finished fraction of the pixels in contact; slides: where rubber slides, (ny, nx), by
    default everywhere in contact. Raises SimulationStopped if a step fails.
    """
    rows, columns = footprint.pressure.shape
    result = FilmMap.untouched((rows, columns), ride)
    passing = footprint.dx / ride.speed
    touching = np.flatnonzero(footprint.contact.any(axis=1))
    pixels = np.count_nonzero(footprint.contact)
    done = 0

    def told(more: int) -> None:
        nonlocal done
        done += more
        tell(done / pixels)

    for first in range(0, touching.size, LINES):
        lines = touching[first : first + LINES]
        path = Path.below(footprint.pressure[lines], passing)
        part = ride.lines(lines)
        below = ice(part.temperature, columns * passing, solid=part.solid)
        below = below.condensed(CONDENSED * tolerance)
        moves = np.ones(path.line.size, dtype=bool)
        if slides is not None:
            moves = slides[lines][path.line, path.column]
        above = part.rubber(columns * passing)
        films, warm = films_along(path, part, below, above, contact_of, tolerance, told, moves)
        _enter(films, warm, result, lines, path, part, below, contact_of)
    return result


def _enter(
    films: FilmMap,
    warm: Array,
    result: FilmMap,
    lines: Index,
    path: Path,
    ride: Ride,
    ice: Column,
    contact_of: ContactTable | ConstantContact,
) -> None:
    """Enter the films of a path, and values in gaps between its pixels, into the map's `lines`."""
    here = lines[path.line], path.column
    fraction = np.broadcast_to(ride.water_fraction, lines.shape)[path.line]
    for whole, values in zip(result, films, strict=True):
        whole[here] = values
    carried = fraction > 0.0
    squeezed = np.where(
        carried, films.squeezed / np.where(carried, fraction, 1.0), contact_of(path.pressure).H_V
    )
    result.squeezed[here] = squeezed
    ends = np.flatnonzero(path.behind)
    long = path.behind[ends]
    number = np.repeat(np.arange(ends.size), long)  # of the gap, for every pixel in one
    ahead = 1 + np.arange(number.size) - np.repeat(np.cumsum(long) - long, long)
    before = ends[number]
    here = lines[path.line[before]], path.column[before] - ahead
    result.height[here], result.squeezed[here] = films.height[before], films.squeezed[before]
    content = ice.cooled(warm[:, number], ahead * path.passing)
    result.temperature[here] = ice.take(path.line[before]).surface_temperature(content)
