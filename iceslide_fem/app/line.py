"""The tab of a line along a footprint: what `iceslide footprint` computes of it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from iceslide_fem.app.form import Texts
from iceslide_fem.app.tab import Tab, slider_of
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.jaeger import TABLE_1_ICE, TABLE_1_RUBBER
from iceslide_fem.preprocess.footprint.macroscopic import State
from iceslide_fem.preprocess.footprint.reading import one_row, read_footprint
from iceslide_fem.preprocess.footprint.survey import summary, survey
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.command_options import option_names
from iceslide_fem.scene.materials import BAR
from iceslide_fem.scene.messages import missing

T_0 = ZERO_CELSIUS
OF_GAUSSIAN = ("gaussian.0", "gaussian.1", "gaussian.2")
OF_PICTURE = ("image", "length", "max_pressure", "legend", "crop", "row")
OF_BALANCE = (
    "model", "static_friction", "air_temperature", "depth", "ice_material.0", "ice_material.1",
    "ice_material.2", "tread_material.0", "water_conductivity",
)  # fmt: skip
PRINTED = ("thesis_slip", "thesis_time")
# What the balance's heat comes from, and its name in the summary.
MODELS = {"moving": "moving_source", "next pixel": "thesis"}
STARTS: dict[str, Sequence[float]] = {
    "gaussian": (0.18, 4.0 * BAR, 0.03),
    "length": (0.18,),
    "max_pressure": (4.0 * BAR,),
    "air_temperature": (T_0 - 4.0,),
    "ice_material": TABLE_1_ICE[:3],
    "tread_material": TABLE_1_RUBBER[:3],
    "dry_stress": (0.0,),
    "dry_softening": (10.0,),
}
_slider = partial(slider_of, FootprintCase, STARTS)
TAB = Tab(
    name="footprint",
    case=FootprintCase,
    starts=STARTS,
    needed=("gaussian", "length", "max_pressure", "dry_softening"),
    sliders=(
        _slider("gaussian.0", "length of the line", "mm", 1e-3, 20.0, 500.0, False),
        _slider("gaussian.1", "largest pressure", "bar", BAR, 0.2, 20.0),
        _slider("gaussian.2", "standard deviation of the Gaussian", "mm", 1e-3, 2.0, 200.0),
        _slider("length", "length of the picture", "mm", 1e-3, 20.0, 500.0, False),
        _slider("max_pressure", "high end of its colours", "bar", BAR, 0.2, 20.0),
        _slider("speed", "V, speed", "m/s", 1.0, 0.1, 50.0),
        _slider("slip", "S, slip ratio", "", 1.0, 1e-6, 1.0),
        _slider("static_friction", "μ_st, static friction", "", 1.0, 0.01, 1.0),
        _slider("temperature", "T₀, ice temperature", "degC", 1.0, -30.0, -0.1, False, T_0),
        _slider("air_temperature", "air and tread (or as ice)", "degC", 1.0, -30, 30, False, T_0),
        _slider("thesis_slip", "slip ratio of (3.3)", "", 1.0, 1e-7, 1.0),
        _slider("thesis_time", "t of (3.3), time", "s", 1.0, 0.01, 100.0),
        _slider("depth", "d, depth of heat", "mm", 1e-3, 0.01, 10.0),
        _slider("ice_material.0", "ice: conductivity", "W/m/K", 1.0, 0.5, 5.0, False),
        _slider("ice_material.1", "ice: density", "kg/m^3", 1.0, 500.0, 1000.0, False),
        _slider("ice_material.2", "ice: heat capacity", "J/kg/K", 1.0, 1e3, 4e3, False),
        _slider("tread_material.0", "tread: conductivity", "W/m/K", 1.0, 0.05, 1.0, False),
        _slider("initial_height", "first height of the film", "nm", 1e-9, 5.0, 1e3, zero=True),
        _slider("dry_stress", "stress of dry contact, or 0", "bar", BAR, 0.1, 20.0, zero=True),
        _slider("dry_softening", "dry contact: softens over", "K", 1.0, 0.5, 50.0),
        _slider("dry_residual", "dry contact: 0 above melting by", "K", 1.0, 0.0, 10.0, False),
        _slider("water_conductivity", "water: conductivity", "W/m/K", 1.0, 0.1, 2.0, False),
    ),
    texts=(
        ("line", "profile (CSV: x_mm or cell_mm, pressure_bar)"),
        ("image", "picture of a footprint (file on this machine)"),
        ("legend", "box of its colour bar: LEFT,TOP,RIGHT,BOTTOM"),
        ("crop", "box of the footprint: LEFT,TOP,RIGHT,BOTTOM"),
        ("row", "row of its pixels from the top (or the middle)"),
    ),
    choices=(
        ("source", "pressure along the line", ("gaussian", "line", "image")),
        ("thesis_balance", "the thesis's balance, too", ("no", "yes")),
        ("model", "its heat comes from", tuple(MODELS)),
    ),
    only={
        **dict.fromkeys(OF_GAUSSIAN, ("source", ("gaussian",))),
        **dict.fromkeys(OF_PICTURE, ("source", ("image",))),
        "line": ("source", ("line",)),
        **dict.fromkeys(OF_BALANCE, ("thesis_balance", ("yes",))),
        **dict.fromkeys(PRINTED, ("model", ("next pixel",))),
    },
    empty=("air_temperature", "ice_material.0", "ice_material.1", "ice_material.2"),
)


def curves(texts: Texts) -> dict[str, Any]:
    """All content of the tab. Raises SceneError, SimulationStopped.

    series over x (mm): pressure (bar), flux (W/m2), temperature (degC), mu, state; of the thesis's
    balance model_flux, model_temperature and model_mu; notes: warnings.
    """
    options = TAB.options(texts)
    if (source := texts.get("source") or "gaussian") not in options:
        raise SceneError(missing([option_names("image")(source)]))
    if source == "image":  # a line knows nothing of the picture's width
        options["width"] = options["length"]
    case = FootprintCase.of(options)
    read = read_footprint(case)
    if source == "image" and case.row is None:
        row = len(read.pressure_map.pressure) // 2
        options["row"] = str(row)
        case, read = FootprintCase.of(options), one_row(read, row)
    found = survey(case, read)
    figures, film, line = summary(found), found.film, found.read.pressure_map
    of_film = figures["film"]
    series = {
        "x": (1e3 * line.x).tolist(),
        "pressure": (line.pressure[0] / BAR).tolist(),
        "flux": (film.shear[0] * case.slip * case.speed).tolist(),
        "temperature": (film.temperature[0] - ZERO_CELSIUS).tolist(),
        "mu": film.friction(line)[0].tolist(),
        "state": [State(each).name.lower().replace("_", " ") for each in found.state[0]],
    }
    numbers = {
        "mu_mean": of_film["mu_mean"],
        "leading": of_film["leading_edge_temperature_C"],
        "trailing": of_film["trailing_edge_temperature_C"],
    }
    if found.models:
        name = MODELS[texts.get("model") or "moving"]
        model, of_model = found.models[name], figures[name]
        series |= {
            "model_flux": model.flux[0].tolist(),
            "model_temperature": (model.temperature[0] - ZERO_CELSIUS).tolist(),
            "model_mu": model.mu[0].tolist(),
        }
        numbers |= {
            "mu_map": of_model["mu_map_mean"],
            "mu_balance": of_model["mu_balance"],
            "peak_rise": of_model["peak_rise_K"],
            "heat_of_ice": of_model["heat_into_ice_W"] / line.dy,
            "heat_of_tread": of_model["heat_into_tread_W"] / line.dy,
            "heat_of_water": of_model["heat_into_water_W"] / line.dy,
        }
    return {
        "notes": [TAB.worded(note) for note in figures["warnings"]],
        "series": series,
        "numbers": numbers,
        "values": TAB.values(case),
        **TAB.snippets(options, case, "found.attrs['film.mu_mean']"),
    }
