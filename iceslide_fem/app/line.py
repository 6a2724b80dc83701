"""The tab of a line along a footprint: film law, and the thesis's balance (4.2 to 4.4)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from iceslide_fem.app.film_case import slider_of
from iceslide_fem.app.form import Texts
from iceslide_fem.app.line_case import LineCase
from iceslide_fem.app.snippets import api_lines
from iceslide_fem.film.doubts import doubts
from iceslide_fem.film.shear_strength import strength_of
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.line import film_line, macroscopic_line
from iceslide_fem.preprocess.footprint.macroscopic import State, classify, edge_temperatures
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES, MELTING_TEMPERATURE

T_0 = ZERO_CELSIUS
_slider = partial(slider_of, LineCase)
SLIDERS = (
    _slider("length", "length of the line", "mm", 1e-3, 20.0, 500.0, False),
    _slider("peak", "largest pressure", "bar", BAR, 0.2, 20.0),
    _slider("sigma", "standard deviation of the Gaussian", "mm", 1e-3, 2.0, 200.0),
    _slider("max_pressure", "high end of its colours", "bar", BAR, 0.2, 20.0),
    _slider("row", "row of the picture, 0 below to 1", "", 1.0, 0.0, 1.0, False),
    _slider("speed", "V, speed", "m/s", 1.0, 0.1, 50.0),
    _slider("slip", "S, slip ratio", "", 1.0, 1e-7, 1.0),
    _slider("static_friction", "μ_st, static friction", "", 1.0, 0.01, 1.0),
    _slider("ice_temperature", "T₀, ice temperature", "degC", 1.0, -30.0, -0.1, False, T_0),
    _slider("air_temperature", "air and tread (or as the ice)", "degC", 1.0, -30, 30, False, T_0),
    _slider("time", "t of (3.3), time", "s", 1.0, 0.01, 100.0),
    _slider("depth", "d, depth of heat", "mm", 1e-3, 0.01, 10.0),
    _slider("ice_conductivity", "ice: conductivity", "W/m/K", 1.0, 0.5, 5.0, False),
    _slider("ice_density", "ice: density", "kg/m^3", 1.0, 500.0, 1000.0, False),
    _slider("ice_heat_capacity", "ice: heat capacity", "J/kg/K", 1.0, 1000.0, 4000.0, False),
    _slider("tread_conductivity", "tread: conductivity", "W/m/K", 1.0, 0.05, 1.0, False),
    _slider("initial_height", "first height of the film", "nm", 1e-9, 5.0, 1000.0, zero=True),
    _slider("dry_stress", "stress of dry contact, or 0", "bar", BAR, 0.1, 20.0, zero=True),
    _slider("dry_softening", "dry contact: softens over", "K", 1.0, 0.5, 50.0),
    _slider("dry_residual", "dry contact: 0 above melting by", "K", 1.0, 0.0, 10.0, False),
    _slider("water_conductivity", "water: conductivity", "W/m/K", 1.0, 0.1, 2.0, False),
)
OF_FILM = ("initial_height", "dry_stress", "dry_softening", "dry_residual")
OF_BALANCE = (
    "source static_friction air_temperature depth ice_conductivity ice_density ice_heat_capacity "
    "tread_conductivity water_conductivity"
).split()
OF_PICTURE = ("length", "image", "max_pressure", "legend", "crop", "row")


def described() -> dict[str, Any]:
    """Data of the fields for the page; only: choices with which a field has an effect."""
    return {
        "sliders": [slider.described() for slider in SLIDERS],
        "texts": [
            ("file", "profile (CSV: x_mm or cell_mm, pressure_bar)"),
            ("image", "picture of a footprint (file on this machine)"),
            ("legend", "box of its colour bar: LEFT,TOP,RIGHT,BOTTOM"),
            ("crop", "box of the footprint: LEFT,TOP,RIGHT,BOTTOM"),
        ],
        "choices": [
            ("profile", "pressure along the line", ("gaussian", "file", "picture")),
            ("thesis_balance", "the thesis's balance, too", ("no", "yes")),
            ("source", "its heat comes from", ("moving", "next pixel")),
        ],
        "empty": ["air_temperature"],
        "only": {
            **{key: ("profile", ["gaussian"]) for key in ("peak", "sigma")},
            **{key: ("profile", ["picture"]) for key in OF_PICTURE},
            "length": ("profile", ["gaussian", "picture"]),
            "file": ("profile", ["file"]),
            "time": ("source", ["next pixel"]),
            **{key: ("thesis_balance", ["yes"]) for key in OF_BALANCE},
        },
    }


def curves(texts: Texts) -> dict[str, Any]:
    """All content of the tab. Raises SceneError, SimulationStopped.

    series over x (mm): pressure (bar), flux (W/m2), temperature (degC), mu, state; of the thesis's
    balance model_flux, model_temperature and model_mu; notes: warnings.
    """
    case = LineCase.of(texts)
    pressure, dx = case.pressure()
    strength = strength_of(case.dry_shear, MELTING_TEMPERATURE)
    film = film_line(
        pressure, dx, case.parameters, CONTACT_TABLES["B"], strength, case.initial_height
    )
    touching = pressure > 0.0
    mu = np.divide(film.shear, pressure, out=np.zeros_like(pressure), where=touching)
    states = classify(film.temperature - MELTING_TEMPERATURE, touching)
    edges = edge_temperatures(film.temperature, touching)
    known = touching & ~CONTACT_TABLES["B"].outside(pressure)  # a table has no data elsewhere
    notes = doubts(
        float(film.height[touching].min()), float(mu[known].max(initial=0.0)),
        float(film.melting[touching].mean()), strength is not None,
    )  # fmt: skip
    series = {
        "x": (1e3 * dx * (np.arange(pressure.size) + 0.5)).tolist(),
        "pressure": (pressure / BAR).tolist(),
        "flux": (film.shear * case.slip * case.speed).tolist(),
        "temperature": (film.temperature - ZERO_CELSIUS).tolist(),
        "mu": mu.tolist(),
        "state": [State(each).name.lower().replace("_", " ") for each in states],
    }
    numbers = {
        "mu_mean": float(film.shear.sum() / pressure.sum()),
        "leading": edges.leading - ZERO_CELSIUS,
        "trailing": edges.trailing - ZERO_CELSIUS,
    }
    if case.thesis_balance == "yes":
        model = macroscopic_line(pressure, dx, case.parameters)
        series |= {
            "model_flux": model.flux.tolist(),
            "model_temperature": (model.temperature - ZERO_CELSIUS).tolist(),
            "model_mu": model.mu.tolist(),
        }
        numbers |= {
            "mu_map": model.mu_mean,
            "mu_balance": model.balance.mu,
            "peak_rise": float(model.rise.max()),
            "heat_of_ice": model.balance.ice,
            "heat_of_tread": model.balance.tread,
            "heat_of_water": model.balance.water,
        }
        notes = [*model.doubts, *notes]
    return {
        "notes": notes,
        "series": series,
        "numbers": numbers,
        "values": {slider.key: getattr(case, slider.key) for slider in SLIDERS},
        "python": api_lines("footprint", case.options, "found.attrs['film.mu_mean']"),
        "command": FootprintCase.of(case.options).as_command("footprint"),
    }
