"""Trends of mean friction with pressure, speed and temperature, on the point rung, as one picture.

Means are (5.35) over the time that ice is under a block of length L: [0, L / v]. The thesis shows
these trends in its figures 33 to 35 (compound B; after Klapproth et al., 2016).
"""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from iceslide_fem.arrays import Array
from iceslide_fem.film.point import simulate
from scripts.studies.common import conditions, draw, options, picture_options

LENGTH = 20e-3  # m, of a tread block


def mean_friction(bar: ArrayLike, speed: ArrayLike, celsius: ArrayLike, length: float) -> Array:
    """Mean of mu over [0, length / speed]; arguments broadcast."""
    parts = np.broadcast_arrays(bar, speed, celsius)
    p, v, T = (np.asarray(part, dtype=float).ravel() for part in parts)
    return simulate(conditions(p, v, length / v, T), tolerance=1e-3).mu_mean.reshape(parts[0].shape)


def coldest_that_melts(bar: float, speed: float, celsius: Array, length: float) -> float:
    """The lowest of the temperatures (degC) at which ice melts within `length` (m)."""
    found = simulate(conditions(bar, speed, length / speed, celsius), tolerance=1e-3)
    return float(celsius[np.isfinite(found.melt_onset)].min())


def family(ax: Axes, x: Array, lines: dict[str, Array], xlabel: str, title: str) -> None:
    """Lines of one family, dark to light."""
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.88, len(lines)))
    for shade, (label, line) in zip(shades, lines.items(), strict=True):
        ax.plot(x, line, color=shade, label=label, linewidth=2)
    ax.set(xlabel=xlabel, ylabel=r"mean $\mu$ over $[0, L/v]$", title=title)
    ax.set_ylim(bottom=0.0)
    ax.legend(frameon=False, fontsize=8)


def printed(title: str, names: list[str], lines: dict[str, Array]) -> None:
    print(f"\n{title}")
    print(" " * 12 + "".join(f"{name:>9}" for name in names))
    for label, values in lines.items():
        print(f"{label:12}" + "".join(f"{value:9.3f}" for value in values))


def main() -> None:
    parser = options(__doc__)
    picture_options(parser)
    arguments = parser.parse_args()
    figure = Figure(figsize=(15.0, 4.4), layout="constrained")
    by_pressure, by_speed, by_temperature = figure.subplots(1, 3, sharey=True)
    fixed = f"$L$ = {1e3 * LENGTH:.0f} mm"

    bar, celsius = np.linspace(1.0, 5.0, 41), (-15, -10, -7, -4, -2, -1)
    lines = {f"{T} °C": mean_friction(bar, 3.0, T, LENGTH) for T in celsius}
    family(by_pressure, bar, lines, "pressure (bar)", f"Pressure (fig. 33): 3 m/s, {fixed}")
    some = {label: line[::10] for label, line in lines.items()}
    printed("3 m/s, by pressure", [f"{p:g} bar" for p in bar[::10]], some)

    speed = np.linspace(0.25, 5.0, 39)
    lines = {f"{p} bar": mean_friction(p, speed, -4.0, LENGTH) for p in (1, 2, 3, 5)}
    family(by_speed, speed, lines, "speed (m/s)", f"Speed (fig. 34): -4 °C, {fixed}")
    at = [6, 14, 22, 30, 38]
    some = {label: line[at] for label, line in lines.items()}
    printed("-4 degC, by speed", [f"{v:g} m/s" for v in speed[at]], some)
    for label, line in lines.items():
        print(f"{label}: largest at {speed[line.argmax()]:g} m/s")

    warmer = np.linspace(-20.0, -0.5, 79)
    lines = {f"{p} bar": mean_friction(p, 3.0, warmer, LENGTH) for p in (1, 2, 3, 5)}
    title = f"Temperature (fig. 35): 3 m/s, {fixed}"
    family(by_temperature, warmer, lines, "ice temperature (°C)", title)
    at = [20, 40, 52, 64, 72, 76]
    some = {label: line[at] for label, line in lines.items()}
    printed("3 m/s, by temperature", [f"{T:g} °C" for T in warmer[at]], some)
    for p in (1, 2, 3, 5):
        coldest = coldest_that_melts(p, 3.0, warmer, LENGTH)
        print(f"{p} bar: melts within the length from {coldest:g} °C on")

    for ax in figure.axes:
        ax.grid(alpha=0.25)
        ax.spines[["top", "right"]].set_visible(False)
    draw(figure, arguments.pictures / "trends.png", 120)


if __name__ == "__main__":
    main()
