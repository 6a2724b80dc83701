"""From dry rubber on ice to films of water: mu over speed and temperature, and what rubs where.

Points of ice that passes a block of 20 mm at 2 bar, with the two sets of dry stress that
`dry_calibration` finds, as maps and as curves. Lines of the maps, as far as they are on them: where
ice begins to melt within the block's length; where N = eta v / (h tau_b) is 10 and 0.1 at the
trailing edge (above 10 dry, below 0.1 viscous, limited between). Hatched: where the film law alone,
without dry stress, is off by more than a factor of two. Contact takes 20 mm / v, but no more than
1000 s. With --slices the slice of cold_block runs for 1.03 ms with both sets.
"""

from __future__ import annotations

import tempfile
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from iceslide_fem.film.point import PointResult
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import BAR, ICE, WATER_VISCOSITY
from iceslide_fem.simulate import run
from iceslide_fem.workflow.planning.regime import DRY, VISCOUS
from scripts.studies import common
from scripts.studies.common import draw, options, picture_options, table
from scripts.studies.dry_calibration import CALIBRATED, CONTACT, FACTOR, OF_ALL, DryShear, passing

PRESSURE = 2.0  # bar
SPEEDS = 3e-6, 10.0  # m/s
CELSIUS = -35.0, -0.5
CURVES = (-30.0, -15.0, -10.0, -5.0, -1.0)  # degC
SHOWN_SPEEDS = (3e-6, 1e-3, 1e-2, 0.1, 0.65, 4.0, 10.0)
SHOWN_CELSIUS = (-30.0, -15.0, -5.0, -1.0)
PARTS = (0.0, 0.5, 1.0, 1.03)  # ms, of slices
LATEST = PARTS[-1]
TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # of the colours
NAMES = {CALIBRATED: "calibrated on three bands", OF_ALL: "calibrated on all bands"}


class Map(NamedTuple):
    """What a map shows, over temperature (rows) and speed (columns).

    mu: the mean; number: N at the trailing edge, infinite without a film; melts: whether ice melts
    within the length; film_alone: mu of the film law without dry stress.
    """

    speed: Array
    celsius: Array
    mu: Array
    number: Array
    melts: Array
    film_alone: Array

    @classmethod
    def of(cls, speed: Array, celsius: Array, dry_shear: DryShear) -> Map:
        """At all combinations of speeds (m/s) and temperatures (degC)."""
        T, v = (part.ravel() for part in np.meshgrid(celsius, speed, indexing="ij"))
        dry, film = passing(PRESSURE, v, T, dry_shear), passing(PRESSURE, v, T)
        parts = dry.mu_mean, number(dry, v), np.isfinite(dry.melt_onset), film.mu_mean
        shape = celsius.size, speed.size
        return cls(speed, celsius, *(part.reshape(shape) for part in parts))

    @property
    def off(self) -> Array:
        """By which factor the film law alone is off, at least 1."""
        return np.asarray(np.exp(np.abs(np.log(self.film_alone / self.mu))))


def number(found: PointResult, speed: Array) -> Array:
    """N at the end: mu p = k eta v / (h + h_b), and N = h_b / h."""
    drag = float(CONTACT(np.array([PRESSURE * BAR]))[0][0]) * WATER_VISCOSITY * speed
    both = drag / (found.mu_end * PRESSURE * BAR)
    film = found.film_height
    return np.divide(both - film, film, out=np.full(film.size, np.inf), where=film > 0.0)


def draw_map(ax: Axes, here: Map) -> None:
    """The mean mu in colour, with the lines that are on the map."""
    v, T = here.speed, here.celsius
    shade = ax.pcolormesh(v, T, here.mu, norm=LogNorm(0.02, 1.0), shading="nearest")
    ax.figure.colorbar(shade, ax=ax, label=r"mean $\mu$ over the block", ticks=TICKS, format="%g")
    ax.contourf(v, T, here.off, levels=[FACTOR, np.inf], colors="none", hatches=["//"])
    ax.contour(v, T, here.melts, levels=[0.5], colors="white", linewidths=2.5)
    shown = [
        Patch(facecolor="none", hatch="//", label="film law alone off by more than 2"),
        Line2D([], [], color="white", linewidth=2.5, label="ice melts above and right of it"),
    ]
    logarithm = np.log10(np.clip(here.number, 1e-3, 1e3))
    for value, colour, side in ((DRY, "tab:red", "below it dry"), (VISCOUS, "k", "above viscous")):
        there = here.number.min() < value
        if there:
            ax.contour(v, T, logarithm, levels=[np.log10(value)], colors=colour, linewidths=2)
        words = f"N = {value:g}, {side}" if there else f"N = {value:g}: not on this map"
        shown.append(Line2D([], [], color=colour, linewidth=2.0 * there, label=words))
    ax.set(xscale="log", xlabel="speed (m/s)", ylabel="ice temperature (°C)", xlim=SPEEDS,
           ylim=CELSIUS)  # fmt: skip
    ax.legend(handles=shown, fontsize=8, facecolor="0.8", framealpha=1.0, loc="lower left")


def draw_curves(ax: Axes, curves: Map) -> None:
    """Mean mu over speed at some temperatures, with dry stress and without."""
    shades = matplotlib.colormaps["plasma"](np.linspace(0.0, 0.85, len(CURVES)))
    shown = []
    for shade, celsius, mu, film in zip(shades, CURVES, curves.mu, curves.film_alone, strict=True):
        shown += ax.plot(curves.speed, mu, color=shade, linewidth=2, label=f"{celsius:g} °C")
        ax.plot(curves.speed, film, color=shade, linewidth=1.2, linestyle=":")
    shown.append(Line2D([], [], color="0.3", linestyle=":", label="film law alone, same colours"))
    ax.set(xscale="log", xlabel="speed (m/s)", ylabel=r"mean $\mu$ over the block", xlim=SPEEDS,
           ylim=(0.0, 1.0))  # fmt: skip
    free = (0.02, 0.13) if curves.mu.max() > 0.6 else (0.02, 0.75)
    ax.legend(handles=shown, fontsize=8, ncols=2, loc=free)
    ax.grid(alpha=0.25)


def regime(N: float) -> str:
    """The name of a number N."""
    return "dry" if N > DRY else "viscous" if N < VISCOUS else "limited"


def print_table(few: Map) -> None:
    """Print mu, regime and mu of the film law alone, over temperature and speed."""
    rows = []
    for celsius, *row in zip(few.celsius, few.mu, few.number, few.film_alone, strict=True):
        cells = zip(*row, strict=True)
        words = (f"{mu:.3f} {regime(N)}, {film:.3f}" for mu, N, film in cells)
        rows.append((f"{celsius:g} °C", *words))
    table(("ice", *(f"{v:g} m/s" for v in few.speed)), rows)


def print_lines(here: Map) -> None:
    """Print where ice melts, what N comes to, and where the film law alone is off."""
    print(
        f"The film law alone is off by more than {FACTOR:g} in {np.mean(here.off > FACTOR):.0%} of "
        f"the map. Ice melts in {here.melts.mean():.1%} of it, from "
        f"{here.celsius[here.melts.any(axis=1)][0]:.1f} degC on; N is below {DRY:g} in "
        f"{np.mean(here.number < DRY):.1%}, below {VISCOUS:g} in "
        f"{np.mean(here.number < VISCOUS):.1%}, and {here.number.min():.2g} at least."
    )


def fastest_growth(dry: DryShear) -> float:
    """(beta tau / (e sqrt(rho G)))^2 (1/s), largest where dry stress falls and is largest.

    tau = k tau_b of `PRESSURE`, beta = -d tau / d T, e the ice's effusivity; rubber is compound B.
    """
    k = float(CONTACT(np.array([PRESSURE * BAR]))[0][0])
    beta, tau = k * dry.stress / dry.softening, k * dry.stress
    effusivity = np.sqrt(ICE.conductivity * ICE.density * ICE.heat_capacity)
    rubber = common.case("cold_block")
    G = rubber.mooney_rivlin.youngs_modulus / 3.0
    return float(beta * tau / (effusivity * np.sqrt(rubber.rubber.density * G))) ** 2


def slices() -> None:
    """Steps of the slice of cold_block within parts of its first `LATEST` ms."""
    rows = []
    for dry, name in NAMES.items():
        stress = f"film.dry_stress={dry.stress} Pa", f"film.dry_softening={dry.softening} K"
        scene = common.case("cold_block", *stress, f"load.duration={LATEST} ms")
        with tempfile.TemporaryDirectory() as folder:
            run(scene, Path(folder))
            history = read_run(folder).history
        milliseconds = 1e3 * history["time_s"][1:]
        parts = np.histogram(milliseconds, PARTS)[0]
        rows.append((dry, name, *parts, f"{history['mu'][-1]:.3f}"))
    heads = (f"steps, {first:g} to {last:g} ms" for first, last in pairwise(PARTS))
    table(("dry stress", "set", *heads, "mu at the end"), rows)


def main() -> None:
    """Print the table, draw the map and the curves."""
    parser = options(__doc__)
    picture_options(parser)
    parser.add_argument("--quick", action="store_true", help="a coarse map")
    parser.add_argument("--slices", action="store_true", help="run slices, and nothing else")
    given = parser.parse_args()
    if given.slices:
        slices()
        return
    figure = Figure(figsize=(12.5, 9.0), layout="constrained")
    axes = figure.subplots(2, 2, width_ratios=[1.2, 1.0])
    nt, nv = (24, 28) if given.quick else (140, 160)
    speed = np.geomspace(*SPEEDS, nv)
    for (left, right), (dry, name) in zip(axes, NAMES.items(), strict=True):
        print(f"\n{dry}, {name}: mean mu, regime at the trailing edge, mu of the film law alone")
        print_table(Map.of(np.array(SHOWN_SPEEDS), np.array(SHOWN_CELSIUS), dry))
        here = Map.of(speed, np.linspace(*CELSIUS, nt), dry)
        print_lines(here)
        growth = fastest_growth(dry)
        print(f"With inertia a disturbance grows by e in {1e3 / growth:.2g} ms at the fastest.")
        draw_map(left, here)
        draw_curves(right, Map.of(speed, np.array(CURVES), dry))
        for ax in (left, right):
            ax.set_title(f"{dry} ({name})", fontsize=10)
    draw(figure, given.pictures / "dry_to_wet.png", 90)


if __name__ == "__main__":
    main()
