"""Which inputs of the film law matter: Sobol indices of mu on the point rung, as one picture.

Inputs vary evenly by 20 % around their values, the conductance of the film by a factor of two
each way. The first-order index is the share of mu's variance that goes when the input is known;
the total index what is left when all the others are known.
"""

from __future__ import annotations

from time import perf_counter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from SALib.analyze import sobol as sobol_analysis
from SALib.sample import sobol as sobol_sample

from iceslide_fem.arrays import Array, Index
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.film.point import simulate
from iceslide_fem.materials import WATER_CONDUCTIVITY
from scripts.studies.common import conditions, draw, options, picture_options

NAMES = ["k", "D", "H_V", "eta", "lambda", "h0", "G"]
SYMBOLS = ["$k$", "$D$", "$H_V$", r"$\eta$", r"$\lambda$", "$h_0$", "$G$"]
# Factors on the inputs; G as the base-2 logarithm of its factor.
PROBLEM = {
    "num_vars": len(NAMES),
    "names": np.array(NAMES),  # SALib 1.5 hands them to pandas, which takes no list since 3.0
    "bounds": [[0.8, 1.2]] * (len(NAMES) - 1) + [[-1.0, 1.0]],
}
INITIAL_HEIGHT, UNDERCOOLING, DURATION, SPEED = 70e-9, 4.0, 7e-3, 3.0
FILM_CONDUCTANCE = 2.0 * WATER_CONDUCTIVITY / 50e-9  # of half a film of 50 nm, W/(m2 K)


class ColumnBelowFilm(Column):
    """Ice column with the film's own resistance (m2 K/W) above it: G of the energy balance.

    Content: that of `Column` and a last row, the flux (W/m2), so that the temperature that decides
    on melting is the film's.
    """

    def __init__(self, temperature: Array, duration: float, resistance: Array, flux: Array) -> None:
        super().__init__(temperature, duration)
        self.film_resistance, self.first_flux = resistance, flux

    def take(self, index: Index) -> ColumnBelowFilm:
        part = super().take(index)
        part.film_resistance = self.film_resistance[index]
        return part

    def initial(self, n_points: int) -> Array:
        return np.vstack([super().initial(n_points), self.first_flux])

    def response(self, start: Array, decay: Array, dt: Array | float) -> Surface:
        below = super().response(start, decay, dt)
        return Surface.of(below.offset, below.resistance + self.film_resistance)

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        content, result = super().stage(start[:-1], dt, film)
        return np.vstack([content, result.ice_flux]), result

    def surface_temperature(self, content: Array) -> Array:
        return super().surface_temperature(content[:-1]) + self.film_resistance * content[-1]


def friction(factors: Array, bar: float) -> dict[str, Array]:
    """Peak and mean of mu for rows of factors (n, 7).

    Viscosity acts through k eta and eta D^2 only, and conductivity through its square root times
    the undercooling: so they vary exactly by varying those.
    """
    k, D, H_V, eta, conductivity, h0, conductance = factors.T
    celsius = -UNDERCOOLING * np.sqrt(conductivity)
    usual = conditions(bar, SPEED, DURATION, celsius, INITIAL_HEIGHT * h0)
    here = usual._replace(k=usual.k * k * eta, D=usual.D * D * np.sqrt(eta), H_V=usual.H_V * H_V)
    # where conductivity stands in the temperature, G is per conductivity's square root
    resistance = np.sqrt(conductivity) / (FILM_CONDUCTANCE * 2.0**conductance)
    flux = here.loads().viscous * SPEED / here.initial_height
    ice = ColumnBelowFilm(here.temperature, DURATION, resistance, flux)
    result = simulate(here, ice=ice)
    return {"peak": result.mu_peak, "mean": result.mu_mean, "end": result.mu_end}


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
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(alpha=0.25, axis="y")


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--samples", type=int, default=1024, help="a power of 2")
    picture_options(parser)
    arguments = parser.parse_args()
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
        row[0].set_ylabel("share of the variance")
    axes[0, 0].legend(frameon=False)
    figure.suptitle(
        "Sobol indices of friction: point at 3 m/s and -4 °C, inputs ± 20 % (G: × ½ to 2)"
    )
    draw(figure, arguments.pictures / "sensitivity.png", 120)


if __name__ == "__main__":
    main()
