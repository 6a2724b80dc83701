"""Trends of mean friction with pressure, speed and temperature, on the point rung, as one picture.

Means are (5.35) over the time that ice is under a block of length L: [0, L / v]. The thesis shows
these trends in its figures 33 to 35 (compound B; after Klapproth et al., 2016). Beside them the
bands of Lahayne et al. (Tribol. Lett. 62, 2016, doi 10.1007/s11249-016-0665-z; from an account of
that paper) at 0.65 m/s and 1.5 to 4.5 bar.
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
LENGTHS = (20e-3, 50e-3, 100e-3)
# Lowest and highest measured mu from 1.5 to 4.5 bar at 0.65 m/s, by temperature (degC).
MEASURED = {-5.0: (0.14, 0.37), -10.0: (0.22, 0.53), -13.0: (0.37, 0.73)}
MEASURED_SPEED, MEASURED_PRESSURE = 0.65, np.linspace(1.5, 4.5, 13)


def mean_friction(bar: ArrayLike, speed: ArrayLike, celsius: ArrayLike, length: float) -> Array:
    """Mean of mu over [0, length / speed]; arguments broadcast."""
    parts = np.broadcast_arrays(bar, speed, celsius)
    p, v, T = (np.asarray(part, dtype=float).ravel() for part in parts)
    return simulate(conditions(p, v, length / v, T), tolerance=1e-3).mu_mean.reshape(parts[0].shape)


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


def bands(ax: Axes) -> None:
    """Measured bands beside what the point rung gives for three lengths."""
    ranges: dict[str, list[tuple[float, float]]] = {"measured": list(MEASURED.values())}
    temperatures = np.array(list(MEASURED))
    for length in LENGTHS:
        mu = mean_friction(MEASURED_PRESSURE, MEASURED_SPEED, temperatures[:, None], length)
        ranges[f"$L$ = {1e3 * length:.0f} mm"] = [(row.min(), row.max()) for row in mu]
    print("\nlowest and highest mean mu from 1.5 to 4.5 bar at 0.65 m/s")
    print(" " * 14 + "".join(f"{T:>8g} degC" for T in temperatures))
    shades = ["#D55E00", *matplotlib.colormaps["viridis"](np.linspace(0.1, 0.85, len(LENGTHS)))]
    for number, ((label, pairs), shade) in enumerate(zip(ranges.items(), shades, strict=True)):
        low, high = np.array(pairs).T
        places = np.arange(len(pairs)) + 0.2 * (number - 1.5)
        ax.bar(places, high - low, 0.17, low, color=shade, label=label)
        print(f"{label:14}" + "".join(f"{a:7.2f}-{b:.2f}" for a, b in pairs))
    ax.set_xticks(range(len(temperatures)), [f"{T:g} °C" for T in temperatures])
    ax.set(ylabel=r"$\mu$", title="0.65 m/s, 1.5 to 4.5 bar: Lahayne et al. and the point rung")
    ax.set_ylim(0.0, 0.8)
    ax.legend(frameon=False, fontsize=8, loc="upper left")


def main() -> None:
    parser = options(__doc__)
    picture_options(parser)
    arguments = parser.parse_args()
    figure = Figure(figsize=(11.5, 8.4), layout="constrained")
    (by_pressure, by_speed), (by_temperature, measured) = figure.subplots(2, 2)
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

    warmer = np.linspace(-20.0, -0.5, 79)
    lines = {f"{p} bar": mean_friction(p, 3.0, warmer, LENGTH) for p in (1, 2, 3, 5)}
    title = f"Temperature (fig. 35): 3 m/s, {fixed}"
    family(by_temperature, warmer, lines, "ice temperature (°C)", title)
    at = [20, 40, 52, 64, 72, 76]
    some = {label: line[at] for label, line in lines.items()}
    printed("3 m/s, by temperature", [f"{T:g} °C" for T in warmer[at]], some)

    bands(measured)
    for ax in figure.axes:
        ax.grid(alpha=0.25)
        ax.spines[["top", "right"]].set_visible(False)
    draw(figure, arguments.pictures / "trends.png", 120)


if __name__ == "__main__":
    main()
