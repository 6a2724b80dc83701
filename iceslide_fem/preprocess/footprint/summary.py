"""The figures of a footprint, for summary.json."""

from __future__ import annotations

from typing import Any

import numpy as np

from iceslide_fem.film.doubts import doubts
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.macroscopic import (
    STATES,
    Edges,
    HeatModel,
    States,
    edge_temperatures,
)
from iceslide_fem.preprocess.footprint.picture import FAR
from iceslide_fem.preprocess.footprint.pressure_map import gaussian_centre_line
from iceslide_fem.preprocess.footprint.reading import ReadFootprint
from iceslide_fem.preprocess.footprint.survey import Survey
from iceslide_fem.runtime.arrays import Mask
from iceslide_fem.runtime.units import ZERO_CELSIUS

MUCH = 0.1  # fraction of the friction under pressures outside the table
MODELS = {
    "thesis": "(3.3) as printed",
    "moving_source": "moving source",
    "given": "temperatures as given",
}


def summary(result: Survey) -> dict[str, Any]:
    """All figures of a survey, for summary.json; SI units as in the names."""
    case, read, film = result.case, result.read, result.film
    footprint, contact = read.pressure_map, read.pressure_map.contact
    line = gaussian_centre_line(footprint)
    melting = float(film.melting[contact].mean())
    dry = case.dry_stress is not None or bool(case.water)  # needs no melting
    outside = result.outside[contact]
    shear = film.shear[contact]
    friction_outside = float(shear[outside].sum() / shear.sum()) if shear.any() else 0.0
    mu = film.friction(footprint)[contact]
    largest = float(mu[~outside].max(initial=result.mu_mean))
    warnings = [
        *read.notes,
        *doubts(float(film.height[contact].min()), largest, melting, dry),
        *_outside(float(outside.mean()), friction_outside),
    ]
    for name, model in result.models.items():
        warnings += [f"{MODELS[name]}: {sentence}" for sentence in model.doubts]
    return {
        "footprint": footprint.summary()
        | {
            "load_factor": read.load_factor,
            "gaussian_line": {"peak_Pa": line.peak, "centre_m": line.centre, "sigma_m": line.sigma},
        },
        **_colours(read, case),
        "film": {
            "mu_mean": result.mu_mean,
            "mean_film_height_m": float(film.height[contact].mean()),
            "mean_surface_temperature_C": float(film.temperature[contact].mean() - ZERO_CELSIUS),
            "melting_share": melting,
            "saturated_share": float(film.saturated[contact].mean()),
            "outside_table_share": float(outside.mean()),
            "outside_table_friction_share": friction_outside,
            **_water(result),
            **_edges(edge_temperatures(film.temperature, contact)),
            **_fractions(result.state),
        },
        **{name: _heat(model, contact) for name, model in result.models.items()},
        **({"line": {"pixels": int(contact.size), "row": case.row}} if case.one_line else {}),
        "source": str(case.source),
        "warnings": warnings,
    }


def _outside(area: float, friction: float) -> list[str]:
    """A warning where much of the friction is under pressures outside the table."""
    if friction <= MUCH:
        return []
    return [
        f"{area:.0%} of the contact, with {friction:.0%} of the friction, is under pressures "
        "outside the table of k, D and H_V, and takes those of its nearest end; --contact takes a "
        "table with more pressures"
    ]


def _colours(read: ReadFootprint, case: FootprintCase) -> dict[str, Any]:
    """Quality of the reading of a picture; empty without one."""
    if read.distance is None or read.unclear is None:
        return {}
    contact = read.pressure_map.contact
    distance = read.distance[contact]
    figures: dict[str, Any] = {
        "median_distance": float(np.median(distance)),
        "p95_distance": float(np.percentile(distance, 95.0)),
        "far_share": float((distance > FAR).mean()),
        "unclear_share": float(read.unclear[contact].mean()),
    }
    if case.in_grey:
        figures["high_where"] = "dark" if case.dark_is == "high" else "bright"
    return {"colours": figures}


def _heat(model: HeatModel, contact: Mask) -> dict[str, Any]:
    return {
        "peak_rise_K": float(model.rise[contact].max()),
        "mean_rise_K": float(model.rise[contact].mean()),
        "mu_map_mean": model.mu_mean,
        "mu_balance": model.balance.mu,
        "heat_into_ice_W": model.balance.ice,
        "heat_into_tread_W": model.balance.tread,
        "heat_into_water_W": model.balance.water,
        **_edges(model.edges),
        **_fractions(model.state),
    }


def _water(result: Survey) -> dict[str, float]:
    """Figures of water in load-bearing voids; empty without them."""
    footprint, borne = result.read.pressure_map, result.borne
    if borne is None:
        return {}
    return {
        "mean_water_height_m": float(result.film.squeezed[footprint.contact].mean()),
        "water_borne_share": float(borne.sum() / footprint.pressure.sum()),
        "lug_m": result.case.lug_below(footprint.contact_length),
    }


def _edges(edges: Edges) -> dict[str, float]:
    return {
        f"{name}_edge_temperature_C": value - ZERO_CELSIUS
        for name, value in edges._asdict().items()
    }


def _fractions(state: States) -> dict[str, float]:
    contact = np.count_nonzero(state)
    counts = {each: np.count_nonzero(state == each) for each in STATES}
    return {f"{each.name.lower()}_share": count / contact for each, count in counts.items()}
