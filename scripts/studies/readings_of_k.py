"""mu(t) at 5 bar for four readings of k, which the thesis's table 8 prints as 0.105.

The point level with columns of ice; D = 46.5 um and H_V = 0.56 um as printed.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.film import point
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES
from scripts.studies.common import draw, options, picture_options, table

READINGS = (0.105, 0.405, 0.505, 0.605)
SPEEDS = (3.0, 4.0)
TIMES = np.linspace(0.0, 7e-3, 701)
# What the thesis has of LS-DYNA at 5 bar and 3 m/s: s, mu; at 7 ms it is saturated.
PUBLISHED = ((0.8e-3, 0.12), (7e-3, 0.04))


def main() -> None:
    """Print the table, draw the picture."""
    parser = options(__doc__)
    picture_options(parser)
    pictures = parser.parse_args().pictures
    printed = CONTACT_TABLES["B"]
    speed, k = (part.ravel() for part in np.meshgrid(SPEEDS, READINGS))
    result = point.simulate(
        point.Conditions.of(
            pressure=5.0 * BAR,
            speed=speed,
            temperature=269.15,
            k=k,
            D=printed.D.values[1],
            H_V=printed.H_V.values[1],
            initial_height=70e-9,
            duration=7e-3,
        ),
        ice="column",
        tolerance=1e-5,
        times=TIMES,
    )
    rows = []
    for i in np.lexsort((k, speed)):
        early, late = (np.interp(t, TIMES, result.samples[:, i]) for t in (0.8e-3, 7e-3))
        onset, full = (
            "-" if np.isnan(time) else f"{1e3 * time:.2f}"
            for time in (result.melt_onset[i], result.saturation[i])
        )
        cells = (k[i], speed[i], f"{early:.4f}", f"{result.mu_peak[i]:.3f}", onset, full)
        rows.append((*cells, f"{late:.4f}"))
    head = ("k at 5 bar", "speed, m/s", "mu at 0.8 ms", "peak", "melts, ms", "full, ms")
    table((*head, "mu at 7 ms"), rows)

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    for i in np.flatnonzero((speed == 3.0) & (k > 0.2)):
        (line,) = axes.plot(1e3 * TIMES, result.samples[:, i], label=f"k = {k[i]}")
        if np.isfinite(result.saturation[i]):
            when = float(result.saturation[i])
            axes.plot(
                1e3 * when,
                np.interp(when, TIMES, result.samples[:, i]),
                "v",
                color=line.get_color(),
                label=f"free volume full at {1e3 * when:.1f} ms",
            )
    axes.plot(*np.array(PUBLISHED).T * [[1e3], [1.0]], "ks", label="thesis, LS-DYNA")
    axes.annotate("saturated", (7.0, 0.04), (-6, -14), textcoords="offset points", ha="right")
    axes.set(
        xlabel="time (ms)",
        ylabel="friction coefficient µ",
        title="5 bar, 3 m/s, -4 °C, the film law at one pressure",
        ylim=(0.0, None),
        xlim=(0.0, 7.15),
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    draw(figure, pictures / "readings_of_k.png")


if __name__ == "__main__":
    main()
