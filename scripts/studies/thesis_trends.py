"""Trends of mean friction with pressure, speed and temperature, on the point level, as one picture.

Means are (5.35) over the time that ice is under a block of length L: [0, L / v]. The thesis shows
these trends in its figures 33 to 35 (compound B; after Klapproth et al., 2016).
"""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from iceslide_fem.film.point import PointResult, simulate
from iceslide_fem.runtime.arrays import Array
from scripts.studies.common import conditions, draw, options, picture_options

LENGTH = 20e-3  # m, of a tread block


def passing(bar: ArrayLike, speed: ArrayLike, celsius: ArrayLike) -> PointResult:
    """Points over [0, LENGTH / speed], of which `mu_mean` is (5.35); arguments broadcast."""
    duration = LENGTH / np.asarray(speed)
    return simulate(conditions(bar, speed, duration, celsius), tolerance=1e-3)


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
    lines = {f"{T} °C": passing(bar, 3.0, T).mu_mean for T in celsius}
    family(by_pressure, bar, lines, "pressure (bar)", f"Pressure (fig. 33): 3 m/s, {fixed}")
    some = {label: line[::10] for label, line in lines.items()}
    printed("3 m/s, by pressure", [f"{p:g} bar" for p in bar[::10]], some)

    speed = np.linspace(0.25, 5.0, 39)
    lines = {f"{p} bar": passing(p, speed, -4.0).mu_mean for p in (1, 2, 3, 5)}
    family(by_speed, speed, lines, "speed (m/s)", f"Speed (fig. 34): -4 °C, {fixed}")
    at = [6, 14, 22, 30, 38]
    some = {label: line[at] for label, line in lines.items()}
    printed("-4 degC, by speed", [f"{v:g} m/s" for v in speed[at]], some)
    for label, line in lines.items():
        print(f"{label}: largest at {speed[line.argmax()]:g} m/s")

    warmer = np.linspace(-20.0, -0.5, 79)
    found = {f"{p} bar": passing(p, 3.0, warmer) for p in (1, 2, 3, 5)}
    lines = {label: points.mu_mean for label, points in found.items()}
    title = f"Temperature (fig. 35): 3 m/s, {fixed}"
    family(by_temperature, warmer, lines, "ice temperature (°C)", title)
    at = [20, 40, 52, 64, 72, 76]
    some = {label: line[at] for label, line in lines.items()}
    printed("3 m/s, by temperature", [f"{T:g} °C" for T in warmer[at]], some)
    for label, points in found.items():
        coldest = warmer[np.isfinite(points.melt_onset)].min()
        print(f"{label}: melts within the length from {coldest:g} °C on")

    for ax in figure.axes:
        ax.grid(alpha=0.25)
        ax.spines[["top", "right"]].set_visible(False)
    draw(figure, arguments.pictures / "trends.png", 120)


if __name__ == "__main__":
    main()
