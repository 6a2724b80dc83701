"""Which inputs of the film law matter: Sobol indices of mu on the point level, as one picture.

Inputs vary evenly by 20 % around their values, also the distance of the melting temperature, and
the conductance of the film by a factor of two each way. The first-order index is the fraction of
mu's variance that goes when the input is known; the total index what is left when all the others
are known. With --slices what a point does not have, one by one.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from SALib.analyze import sobol as sobol_analysis
from SALib.sample import sobol as sobol_sample

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.film.point import simulate
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.materials import ICE, WATER_CONDUCTIVITY, WATER_VISCOSITY, Solid
from scripts.studies.common import case, conditions, draw, options, picture_options, table

NAMES = ["k", "D", "H_V", "eta", "lambda", "c", "L", "T_m - T_0", "h0", "G"]
SYMBOLS = [
    "$k$", "$D$", "$H_V$", r"$\eta$", r"$\lambda$", "$c$", "$L$", "$T_m - T_0$", "$h_0$", "$G$",
]  # fmt: skip
# Factors on the inputs; G as the base-2 logarithm of its factor.
PROBLEM = {
    "num_vars": len(NAMES),
    "names": np.array(NAMES),  # SALib 1.5 hands them to pandas, which takes no list since 3.0
    "bounds": [[0.8, 1.2]] * (len(NAMES) - 1) + [[-1.0, 1.0]],
}
# What a point does not have: changes of a tread block at 5 bar, whose voids fill.
ON_SLICES = {
    "as it is": (),
    "nu = 0.495": ("rubber.nu=0.495",),
    "nu = 0.48": ("rubber.nu=0.48",),
    "water_speed = 0.5": ("film.water_speed=0.5",),
    "water_speed = 0": ("film.water_speed=0",),
    "eta + 20 %": (f"water.viscosity={1.2 * WATER_VISCOSITY}",),
    "lambda + 20 %": (f"ice.conductivity={1.2 * ICE.conductivity}",),
    "L + 20 %": (f"ice.latent_heat={1.2 * ICE.latent_heat}",),
    "T_m - 0.8 K": (f"ice.melting_temperature={ICE.melting_temperature - 0.8}",),
}
INITIAL_HEIGHT, UNDERCOOLING, DURATION, SPEED = 70e-9, 4.0, 7e-3, 3.0
FILM_CONDUCTANCE = 2.0 * WATER_CONDUCTIVITY / 50e-9  # of half a film of 50 nm, W/(m2 K)


class ColumnBelowFilm(Column):
    """Ice column with the film's own resistance (m2 K/W) above it: G of the energy balance.

    Content: that of `Column` and a last row, the flux (W/m2), so that the temperature that decides
    on melting is the film's.
    """

    def __init__(
        self, temperature: Array, duration: float, resistance: Array, flux: Array, solid: Solid
    ) -> None:
        super().__init__(temperature, duration, solid=solid)
        self.film_resistance, self.first_flux = resistance, flux

    def take(self, index: Index) -> ColumnBelowFilm:
        part = super().take(index)
        part.film_resistance = self.film_resistance[index]
        return part

    def initial(self, n_points: int) -> Array:
        return np.vstack([super().initial(n_points), self.first_flux])

    def response(self, start: Array, dt: Array | float) -> Surface:
        below = super().response(start, dt)
        return Surface.of(below.offset, below.resistance + self.film_resistance, self.solid)

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        heat_state, result = super().stage(start[:-1], dt, film)
        return np.vstack([heat_state, result.ice_flux]), result

    def surface_temperature(self, heat_state: Array) -> Array:
        return super().surface_temperature(heat_state[:-1]) + self.film_resistance * heat_state[-1]


def friction(factors: Array, bar: float) -> dict[str, Array]:
    """Peak, mean and end of mu for rows of factors (n, 10)."""
    k, D, H_V, eta, conductivity, capacity, latent, undercooling, h0, conductance = factors.T
    usual = conditions(bar, SPEED, DURATION, -UNDERCOOLING, INITIAL_HEIGHT * h0)
    here = usual._replace(
        k=usual.k * k,
        D=usual.D * D,
        H_V=usual.H_V * H_V,
        viscosity=usual.viscosity * eta,
        conductivity=usual.conductivity * conductivity,
        heat_capacity=usual.heat_capacity * capacity,
        latent_heat=usual.latent_heat * latent,
        melting_temperature=usual.temperature + UNDERCOOLING * undercooling,
    )
    resistance = 1.0 / (FILM_CONDUCTANCE * 2.0**conductance)
    flux = here.loads().viscous * SPEED / here.initial_height
    ice = ColumnBelowFilm(here.temperature, DURATION, resistance, flux, here.solid)
    result = simulate(here, ice=ice)
    return {"peak": result.mu_peak, "mean": result.mu_mean, "end": result.mu_end}


def on_slices(quick: bool) -> Iterator[list[object]]:
    """Rows: mean and end of mu of a tread block over one length and a half, and their changes."""
    from scripts.studies.blocks import slid  # finite elements, which points do not need

    first: tuple[float, float] | None = None
    coarse = ["load.pressure=5bar", "numerics.tolerance=1e-2", "numerics.refinement=0.5"]
    coarse += ["load.duration=0.1ms"] if quick else []
    for name, changes in list(ON_SLICES.items())[: 2 if quick else None]:
        found = slid(case("tread_block", "model=slice", *coarse, *changes))
        values = found.mean, float(found.mu[-1])
        first = first or values
        shown = (f"{a:.4f} ({a / b - 1.0:+.1%})" for a, b in zip(values, first, strict=True))
        yield [name, *shown]


def bars(ax: Axes, indices: dict[str, Array], title: str) -> None:
    places = np.arange(len(NAMES))
    for shift, order, label, colour in (
        (-0.2, "S1", "first order", "#56B4E9"),
        (0.2, "ST", "total", "#0072B2"),
    ):
        error = indices[f"{order}_conf"]
        ax.bar(places + shift, indices[order], 0.38, yerr=error, label=label, color=colour)
    ax.set_xticks(places, SYMBOLS)
    ax.set(title=title, ylim=(0.0, 1.0))
    ax.tick_params(axis="x", labelsize=8)
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(alpha=0.25, axis="y")


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--samples", type=int, default=1024, help="a power of 2")
    parser.add_argument("--slices", action="store_true", help="what a point does not have, minutes")
    parser.add_argument("--quick", action="store_true", help="slices of 0.1 ms")
    picture_options(parser)
    arguments = parser.parse_args()
    if arguments.slices or arguments.quick:
        table(["changed", "mean mu", "at the end"], on_slices(arguments.quick))
        return
    factors = sobol_sample.sample(PROBLEM, arguments.samples, calc_second_order=False, seed=1)
    figure = Figure(figsize=(11.5, 6.4), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True, sharey=True)
    names = {"peak": "peak", "mean": "mean over 7 ms", "end": "at 7 ms"}
    for row, bar in zip(axes, (1.0, 5.0), strict=True):
        started = perf_counter()
        outputs = friction(factors, bar)
        seconds = perf_counter() - started
        print(f"\n{bar:g} bar: {len(factors)} points in {seconds:.1f} s")
        print(f"{'':6}{'mean':>8}{'std':>8}" + "".join(f"{name:>14}" for name in NAMES))
        for ax, (name, mu) in zip(row, outputs.items(), strict=True):
            indices = sobol_analysis.analyze(PROBLEM, mu, calc_second_order=False, seed=1)
            shown = zip(indices["S1"], indices["ST"], strict=True)
            cells = "".join(f"{first:7.3f}/{total:6.3f}" for first, total in shown)
            print(f"{name:6}{mu.mean():8.4f}{mu.std():8.4f}{cells}")
            title = rf"$\mu$ {names[name]}, {bar:g} bar: {mu.mean():.3f} ± {mu.std():.3f}"
            bars(ax, indices, title)
        row[0].set_ylabel("fraction of the variance")
    axes[0, 0].legend(frameon=False)
    figure.suptitle(
        "Sobol indices of friction: point at 3 m/s and -4 °C, inputs ± 20 % (G: × ½ to 2)"
    )
    draw(figure, arguments.pictures / "sensitivity.png", 120)


if __name__ == "__main__":
    main()
