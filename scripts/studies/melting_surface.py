"""Ice that melts under constant power: the program, the closed form, and the Stefan problem.

The program keeps the surface of the ice where it is: the melt is thin beside the warm layer. Its
column of ice is driven through melt onset up to 7 ms, and compared with the closed form of a
fixed surface; both with the Stefan problem itself, where the surface recedes by what has melted
(solved here on a grid that moves with it).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import erfc

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.law import FilmStage, Surface
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.reference import flux_after_onset, melted_depth
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import (
    ICE_CONDUCTIVITY,
    ICE_DIFFUSIVITY,
    ICE_EFFUSIVITY,
    MELTING_ENTHALPY,
    MELTING_TEMPERATURE,
)
from scripts.studies.common import conditions, options, table

POWERS = (1.6e5, 2.3e5, 3.2e5)  # W/m2: mu p v at the peaks of 1 bar, 5 bar (3 m/s), 5 bar (4 m/s)
UNDERCOOLING, DURATION = 4.0, 7e-3  # K, s
STEPS = 400  # of the column
NODES, DEPTH = 400, 8.0  # of the moving grid; thermal layers


def onset_of(q: float) -> float:
    """When the surface is at T_m under constant q (s)."""
    return float(np.pi * (UNDERCOOLING * ICE_EFFUSIVITY / (2.0 * q)) ** 2)


def constant_power(q: float) -> Callable[..., FilmStage]:
    """Stage of a film that gives `q` (W/m2) whatever its height."""

    def stage(
        y: Array,
        squeezed: Array,
        dt: Array | float,
        loads: FilmLoads,
        ice: Surface,
        **guess: Any,
    ) -> FilmStage:
        power = np.full_like(y, q)
        flux = np.minimum(power, ice.melted_flux)
        melting = power > ice.melted_flux
        dry, slope = ice.offset + ice.resistance * power, melting.astype(float)
        none = np.zeros_like(y)
        return FilmStage(
            y, squeezed, power, flux, power - flux, dry, melting, melting, none, slope, none
        )

    return stage


def by_column(q: float, onset: float) -> tuple[float, float]:
    """Melted depth (m) at the end, and largest relative error of the ice's flux after onset."""
    method = INTEGRATORS["sdirk2"]._replace(stage=constant_power(q))
    column = Column(MELTING_TEMPERATURE - UNDERCOOLING, DURATION)
    loads, nothing = conditions(1.0, 3.0).loads(), np.zeros(1)
    state = InterfaceState(nothing, nothing, column.initial(1))
    before = onset * (np.arange(1, STEPS + 1) / STEPS) ** 2
    times = np.concatenate(
        [before, onset + (DURATION - onset) * (np.arange(1, STEPS + 1) / STEPS) ** 2]
    )
    latent, worst = 0.0, 0.0
    for time, dt in zip(times, np.diff(times, prepend=0.0), strict=True):
        step = advance(state, loads, loads, float(dt), column, method)
        state, latent = step.state, latent + float(step.latent_heat[0])
        if time > 1.01 * onset:
            exact = float(flux_after_onset(q, onset, time))
            worst = max(worst, abs(float(step.last.ice_flux[0]) / exact - 1.0))
    return latent / MELTING_ENTHALPY, worst


def by_moving_grid(q: float, onset: float) -> float:
    """Melted depth (m) at the end where the surface recedes: T_t = alpha T_xx + s' T_x."""
    layer = np.sqrt(ICE_DIFFUSIVITY * DURATION)
    x = DEPTH * layer * np.sinh(6.0 * np.linspace(0.0, 1.0, NODES)) / np.sinh(6.0)
    step, middle = np.diff(x), 0.5 * (x[1:] + x[:-1])
    width = np.diff(middle)

    def melting(rise: Array) -> float:
        # one-sided slope of second order at the surface, which is at T_m
        a, b = x[1], x[2]
        inward = UNDERCOOLING - rise[0], UNDERCOOLING - rise[1]
        slope = (inward[0] * b**2 - inward[1] * a**2) / (a * b * (b - a))
        return float(q - ICE_CONDUCTIVITY * slope) / MELTING_ENTHALPY

    def rates(_: float, unknowns: Array) -> Array:
        rise, speed = unknowns[1:], melting(unknowns[1:])
        whole = np.concatenate([[UNDERCOOLING], rise, [0.0]])
        gradient = np.diff(whole) / step
        carried = speed * 0.5 * (gradient[1:] + gradient[:-1])
        inner = ICE_DIFFUSIVITY * np.diff(gradient) / width + carried
        return np.concatenate([[speed], inner])

    scale = 2.0 * np.sqrt(ICE_DIFFUSIVITY * onset)
    at_onset = np.exp(-((x / scale) ** 2)) - np.sqrt(np.pi) * x / scale * erfc(x / scale)
    start = np.concatenate([[0.0], UNDERCOOLING * at_onset[1:-1]])
    atol = np.full(start.size, 1e-8)
    atol[0] = 1e-15
    band = solve_ivp(rates, (onset, DURATION), start, "BDF", rtol=1e-8, atol=atol)
    return float(band.y[0, -1])


def main() -> None:
    """Print the table."""
    options(__doc__).parse_args()
    rows = []
    for q in POWERS:
        onset = onset_of(q)
        fixed = float(melted_depth(q, onset, DURATION))
        column, worst = by_column(q, onset)
        moving = by_moving_grid(q, onset)
        layer = np.sqrt(ICE_DIFFUSIVITY * DURATION)
        rows.append(
            (
                f"{q:.1e}", f"{1e3 * onset:.2f}", f"{1e6 * fixed:.4f}",
                f"{column / fixed - 1.0:+.2%}", f"{worst:.2%}", f"{moving / fixed - 1.0:+.2%}",
                f"{fixed / layer:.2%}",
            )
        )  # fmt: skip
    head = ("q, W/m2", "melts, ms", "melted in 7 ms, um", "column", "its flux, largest",
            "surface that recedes", "melt / warm layer")  # fmt: skip
    table(head, rows)


if __name__ == "__main__":
    main()
