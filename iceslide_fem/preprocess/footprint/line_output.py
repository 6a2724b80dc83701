"""What a line along a footprint leaves: line.csv, and line.png like figs. 6 and 7 of the thesis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.postprocess.results.style import BLACK, BLUE, GREEN, ORANGE, RED
from iceslide_fem.preprocess.footprint.survey import Survey
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import BAR, ZERO_CELSIUS

COLOURS = {"thesis": ORANGE, "moving": BLUE, "given": GREEN, "film": BLACK}
NAMES = {"thesis": "(3.3)", "moving": "moving source", "given": "as given", "film": "film law"}
DPI = 130


def line_columns(result: Survey) -> dict[str, Array]:
    """Columns of line.csv, names with units -> (nx,): all three modules, and the film law."""
    footprint, film = result.read.pressure_map, result.film
    columns = {"x_m": result.read.left + footprint.x, "pressure_Pa": footprint.pressure[0]}
    models = {"thesis": result.thesis, "moving": result.moving}
    if result.given is not None:
        models["given"] = result.given
    for name, model in models.items():
        columns |= {
            f"flux_{name}_W_m2": model.flux[0],
            f"rise_{name}_K": model.rise[0],
            f"temperature_{name}_C": model.temperature[0] - ZERO_CELSIUS,
            f"state_{name}": model.state[0].astype(float),
            f"mu_{name}": model.mu[0],
        }
    return columns | {
        "temperature_film_C": film.temperature[0] - ZERO_CELSIUS,
        "film_height_m": film.height[0],
        "state_film": result.state[0].astype(float),
        "mu_film": film.friction(footprint)[0],
    }


def line_text(columns: dict[str, Array]) -> str:
    """The columns as CSV."""
    rows = (
        ",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values(), strict=True)
    )
    return "\n".join([",".join(columns), *rows]) + "\n"


def draw_line(columns: dict[str, Array], title: str, path: Path) -> None:
    """Pressure, temperature rise, temperature and friction along the line."""
    figure = Figure(figsize=(11.5, 7.5), layout="constrained")
    figure.suptitle(title, fontsize=13)
    panels = figure.subplots(2, 2, sharex=True)
    x = 1e3 * columns["x_m"]
    pressure, rise, temperature, friction = panels.flat
    pressure.plot(x, columns["pressure_Pa"] / BAR, color=BLACK)
    pressure.set(title="Pressure (module 1)", ylabel="p (bar)")
    for name in COLOURS:
        style = {"color": COLOURS[name], "label": NAMES[name]}
        if f"rise_{name}_K" in columns:
            rise.plot(x, columns[f"rise_{name}_K"], **style)
        if f"temperature_{name}_C" in columns:
            temperature.plot(x, columns[f"temperature_{name}_C"], **style)
        if f"mu_{name}" in columns:
            mu = columns[f"mu_{name}"]
            friction.semilogy(x, np.where(mu > 0.0, mu, np.nan), **style)
    for bound in (-2.0, 0.0):
        temperature.axhline(bound, color=RED, linewidth=0.8, linestyle=":")
    rise.set(title="Temperature rise (module 2)", ylabel="K")
    temperature.set(title="Temperature; dotted: bounds of dry, mixed, wet", ylabel="°C")
    friction.set(title="Friction (module 3)", ylabel=r"$\mu$ (1)")
    for panel in panels[1]:
        panel.set_xlabel("x (mm), the tyre moves to the right")
    for panel in panels.flat:
        panel.grid(alpha=0.25)
    rise.legend(fontsize=8)
    friction.legend(fontsize=8)
    figure.savefig(path, dpi=DPI)
