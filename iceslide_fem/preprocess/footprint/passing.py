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

from iceslide_fem.film.height import CLOSE
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.film.loads import MOLTEN, film_loads
from iceslide_fem.film.point import taken
from iceslide_fem.film.rubber_heat import Insulated, RubberHeat
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.step_control import StepControl, close_enough
from iceslide_fem.film.viscosity import temperature_scale
from iceslide_fem.preprocess.footprint.aged_path import AgedPath
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ahead, Ride
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable, contact_on

METHOD = INTEGRATORS["sdirk2"]
# Relative to a pixel's time: the shortest step, and the rounding of the rest.
SHORTEST, SLACK = 1e-12, 1e-6
FIRST = 1e-3  # first step where water meets cold ice, of a pixel's time


class Path(NamedTuple):
    """Pixels in contact, line by line in the order of passage; arrays (n,).

    line, column: of the map; pressure: Pa; enters: whether contact begins there; behind: number of
    following pixels without contact; passing: time per pixel of each line, dx / V, s, (lines,).
    """

    line: Index
    column: Index
    pressure: Array
    enters: Mask
    behind: Index
    passing: Array

    @classmethod
    def below(cls, pressure: Array, passing: float | Array) -> Path:
        """The path of touching lines (n, nx); ice enters at the last column.

        passing: time per pixel, s, of all or of each line.
        """
        line, steps = np.nonzero(pressure[:, ::-1] > 0.0)
        column = pressure.shape[1] - 1 - steps
        last = np.diff(line, append=-1) != 0
        behind = np.where(last, column, column - np.append(column[1:], 0) - 1)
        enters = np.append(True, last[:-1] | (behind[:-1] > 0))
        times = np.broadcast_to(np.asarray(passing, dtype=float), (len(pressure),))
        return cls(line, column, pressure[line, column], enters, behind, times)


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
    def untouched(cls, shape: tuple[int, int], ahead: Ahead) -> FilmMap:
        """The map of ice (ny, nx) as it comes in."""
        still, never = np.zeros((3, *shape)), np.zeros((2, *shape), dtype=bool)
        height, layer, temperature = (np.broadcast_to(one, shape[::-1]).T.copy() for one in ahead)
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


def works_of(step: Step) -> tuple[Array, Array, Array]:
    """Friction work, heat into the ice and latent heat of a step, J/m2, (n,)."""
    return step.friction_work, step.ice_heat, step.latent_heat


def films_along(
    path: Path,
    ride: Ride,
    state: InterfaceState,
    ice: Column,
    rubber: RubberHeat,
    contact_of: ContactTable | ConstantContact,
    tolerance: float,
    tell: Callable[[int], None],
    slides: Mask,
) -> tuple[FilmMap, Array, InterfaceState]:
    """Films along a `path`; `ice`, `rubber` and ride have a temperature for each line.

    state: of the lines ahead of contact. Returns films (n,), whose `squeezed` is the equivalent
    layer, the heat of the ice at ends of contact, (modes, ends), and the state of the lines where
    their last contact ends. Each line divides a pixel into equal steps by its last error, and
    repeats a step with a too large error, independent of other lines. In a gap the ice cools in one
    exact step. tell: called with the number of finished pixels; slides: pixels of the path in which
    rubber slides. In others it sticks: pressure squeezes their films, too. Raises SimulationStopped
    if a step fails.
    """
    # Present and last pixel of each line.
    at = np.flatnonzero(np.diff(path.line, prepend=-1))
    last = np.append(at[1:], path.line.size) - 1
    lines, passing = at.size, path.passing
    whole = passing.copy()  # of the lines that still advance
    share, thinnest, speeds = (
        np.broadcast_to(np.asarray(one, dtype=float), (lines,))
        for one in (ride.water_fraction, ride.thinnest_layer, ride.sliding_speed)
    )
    viscosity, variable_viscosity = ride.water(lines)
    sliding = np.where(slides, speeds[path.line], 0.0)
    below = np.broadcast_to(np.asarray(ride.temperature, dtype=float), (lines,))[path.line]
    change = ride.change(path.pressure, sliding, below)
    k, D, H_V, _ = contact_on(contact_of, path.pressure, change)
    voids = np.maximum(share[path.line] * H_V, thinnest[path.line])
    limit, eta = ride.limit, viscosity[path.line]
    of_pixels = variable_viscosity and variable_viscosity.take(path.line)
    dry = float(np.max(ride.initial_height))
    layer = share[path.line]
    carried = ride.wet and ride.wet.carried(path.pressure, contact_of, eta, dry, layer, change)
    limit = limit and limit._replace(viscosity=eta)
    components = of_pixels, limit, carried, ride.refreeze
    rough = None
    if ride.hysteresis is not None:
        rough = ride.hysteresis.at(path.pressure, sliding, below)
    loads = film_loads(path.pressure, sliding, k, D, voids, eta, *components, rough=rough)
    gaps = path.behind > 0
    gap, content = np.cumsum(gaps) - 1, np.empty((ice.rates.size, np.count_nonzero(gaps)))
    films = FilmMap(*np.empty((6, k.size)), *np.empty((2, k.size), dtype=bool))
    kelvin = np.broadcast_to(np.asarray(ride.rubber_temperature, dtype=float), (lines,))
    leaving = InterfaceState(*(np.empty_like(part) for part in state))
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
    arrives, left, dt = np.arange(lines), whole.copy(), whole.copy()
    works, rate = list(np.zeros((3, lines))), np.zeros(lines)  # sums over a pixel, and d ln h / dt
    while at.size:
        if arrives.size:
            pixel, load = at[arrives], loads.take(at)
            # At a leading edge voids take in a layer as deep as that on the ice.
            line = path.line[pixel]
            layer = np.where(path.enters[pixel], share[line], 1.0) * state.squeezed_height[arrives]
            state.squeezed_height[arrives] = np.maximum(layer, thinnest[line])
            left[arrives] = whole[arrives]
            meets = arrives[path.enters[pixel]]
            if not insulated:
                state.rubber[:, meets] = 0.0
            for work in works:
                work[arrives] = 0.0
            if ride.refreeze == "area":  # water meets cold ice
                dt[meets], state.internal[MOLTEN, meets] = FIRST * whole[meets], 0.0
        trial = left / np.ceil(left / dt - SLACK)
        begin, end = (load, load) if aged is None else aged.over(at, whole - left, trial)
        step, good, dt = control.trial(state, begin, end, trial, ice, scale, rubber, rate)
        bad = np.flatnonzero(~good)
        if (dt[bad] < SHORTEST * whole[bad]).any():
            raise SimulationStopped(
                "the film below the footprint cannot be advanced: even steps of "
                f"{dt.min():.1g} s miss the tolerance"
            )
        state = taken(state, step.state, bad)
        growth = step.change.log_height / step.stage_dt
        growth[bad] = rate[bad]
        rate, passed = growth, np.where(good, trial, 0.0)
        left -= passed
        for work, more in zip(works, works_of(step), strict=True):
            more[bad] = 0.0
            work += more
        arrives = np.flatnonzero(left <= SLACK * whole)
        if not arrives.size:
            continue
        pixel = at[arrives]
        surface = ice.surface_temperature(state.ice)
        switches = step.last.melting, step.last.saturated
        reached = *works, state.log_height, state.squeezed_height, surface, *switches
        for values, new in zip(films, reached, strict=True):
            values[pixel] = new[arrives]
        tell(pixel.size)
        ends = arrives[pixel == last[arrives]]
        if ends.size:
            for every, now in zip(leaving, state, strict=True):
                every[..., path.line[at[ends]]] = now[..., ends]
        leaves = arrives[gaps[pixel]]
        if leaves.size:
            pixel = at[leaves]
            content[:, gap[pixel]] = warm = state.ice[:, leaves]
            state.ice[:, leaves] = ice.cooled(warm, whole[leaves] * path.behind[pixel])
        at[arrives] += 1
        running = at <= last
        if not running.all():
            keep = np.flatnonzero(running)
            arrives = np.flatnonzero((left <= SLACK * whole)[keep])
            whole = whole[keep]
            at, last, left, dt, scale = at[keep], last[keep], left[keep], dt[keep], scale[keep]
            state, load = state.take(keep), load.take(keep)
            ice, rubber = ice.take(keep), rubber.take(keep)
            works, rate = [work[keep] for work in works], rate[keep]
    # Melting ice is at the melting temperature; this removes rounding.
    T_m = ride.solid.melting_temperature
    surface = np.where(films.melting, T_m, films.temperature)
    work = sliding * passing[path.line]
    shear = np.divide(films.shear, work, out=np.zeros_like(work), where=work > 0.0)
    height = loads.height(films.height)
    return films._replace(shear=shear, height=height, temperature=surface), content, leaving
