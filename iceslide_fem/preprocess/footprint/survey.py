"""All of a footprint: both heat models, the film, the thesis's mu, and the figures of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.film.doubts import doubts, partly_dry
from iceslide_fem.preprocess.footprint.balance import STATES, classify
from iceslide_fem.preprocess.footprint.balance import doubts as doubts_of_balance
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.colours import FAR
from iceslide_fem.preprocess.footprint.comparison import Curves, OtherIce, friction_curves
from iceslide_fem.preprocess.footprint.film_map import FilmMap, film_map
from iceslide_fem.preprocess.footprint.macroscopic import (
    Edges,
    HeatModel,
    edge_temperatures,
    heat_model,
)
from iceslide_fem.preprocess.footprint.pressure_map import gaussian_centre_line
from iceslide_fem.preprocess.footprint.reading import ReadFootprint
from iceslide_fem.runtime.arrays import Mask
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import ZERO_CELSIUS

MODELS = {
    "thesis": "(3.3) as printed",
    "moving_source": "moving source",
    "given": "temperatures as given",
}


LARGEST_MEAN = 5.0  # mu of the film law, mean over the footprint


class Survey(NamedTuple):
    """Everything computed of a footprint: `thesis` by (3.3), `moving` by the moving source.

    curves: mean friction over the ice's temperature; given: the macroscopic model with the
    temperatures that were given, or None.
    """

    case: FootprintCase
    read: ReadFootprint
    thesis: HeatModel
    moving: HeatModel
    film: FilmMap
    curves: Curves
    given: HeatModel | None = None

    @property
    def models(self) -> dict[str, HeatModel]:
        """The macroscopic models by the names that summary and tables have for them."""
        found = {"thesis": self.thesis, "moving_source": self.moving}
        return found if self.given is None else {**found, "given": self.given}

    @property
    def state(self) -> NDArray[np.uint8]:
        """Dry, mixed, wet by the surface temperature of the film model, from that of melting."""
        footprint = self.read.pressure_map
        return classify(self.film.temperature - self.case.melting_temperature, footprint.contact)


def survey(
    case: FootprintCase, read: ReadFootprint, tell: Callable[[float], None] = lambda share: None
) -> Survey:
    """Modules 2 and 3 by both heat models, and the film under every pixel; its mean friction
    over the ice's temperature beside formulas.

    `tell` is called with the share of the pixels that is done.
    """
    footprint, ride = read.pressure_map, case.ride
    rows, other = len(footprint.pressure), OtherIce.below(footprint, case.melting_temperature)
    # Lines on other ice pass with the rest: a pass takes its time for its pixels, not its lines.
    film = film_map(
        replace(footprint, pressure=np.concatenate([footprint.pressure, other.pressure])),
        ride._replace(temperature=np.append(np.full(rows, ride.temperature), other.of_lines)),
        case.contact_table,
        case.tolerance,
        tell=tell,
    )
    mu = other.friction(film.shear[rows:])
    return Survey(
        case,
        read,
        heat_model(footprint, case.thesis, state=read.state),
        heat_model(footprint, case.moving, state=read.state),
        film.lines(slice(rows)),
        friction_curves(footprint, case, mu),
        None
        if read.temperature is None
        else heat_model(footprint, case.moving, read.temperature, read.state),
    )


def check_friction(result: Survey) -> None:
    """Raise SceneError if the film law's mean friction is none that rubber has on ice."""
    mu = result.film.mean_friction(result.read.pressure_map)
    if not 0.0 <= mu <= LARGEST_MEAN:
        raise SceneError(
            f"the film law finds a mean mu of {mu:.4g} under {result.case.source}, which no rubber "
            f"has on ice; allowed: up to {LARGEST_MEAN:g}; check the pressures and their unit, the "
            "speed, --viscosity and --initial-height"
        )


def summary(result: Survey) -> dict[str, Any]:
    """All figures of a survey, for summary.json; SI units as in the names."""
    case, read, film = result.case, result.read, result.film
    footprint, contact = read.pressure_map, read.pressure_map.contact
    line = gaussian_centre_line(footprint)
    outside = case.contact_table.outside(footprint.pressure[contact])
    return {
        "footprint": footprint.summary()
        | {
            "load_factor": read.load_factor,
            "gaussian_line": {"peak_Pa": line.peak, "centre_m": line.centre, "sigma_m": line.sigma},
        },
        **_colours(read, case),
        "film": {
            "mu_mean": film.mean_friction(footprint),
            "mean_film_height_m": float(film.height[contact].mean()),
            "mean_surface_temperature_C": float(film.temperature[contact].mean() - ZERO_CELSIUS),
            "melting_share": float(film.melting[contact].mean()),
            "saturated_share": float(film.saturated[contact].mean()),
            "outside_table_share": float(outside.mean()),
        }
        | _edges(edge_temperatures(film.temperature, contact))
        | _shares(result.state),
        **{name: _heat_summary(model, contact) for name, model in result.models.items()},
        **({"line": {"pixels": int(contact.size), "row": case.row}} if case.one_line else {}),
        "source": str(case.source),
        "warnings": list(read.notes)
        + doubts(
            float(film.height[contact].min()),
            float(film.friction(footprint)[contact].max()),
            bool(film.melting[contact].any()),
        )
        + partly_dry(float(film.melting[contact].mean()))
        + [
            f"{MODELS[name]}: {sentence}"
            for name, model in result.models.items()
            for sentence in doubts_of_balance(float(model.mu[contact].mean()), model.sliding)
        ],
        "case": case.model_dump(mode="json"),
    }


def _colours(read: ReadFootprint, case: FootprintCase) -> dict[str, Any]:
    """How well a picture was read; nothing where none was."""
    if read.distance is None or read.unclear is None:
        return {}
    contact = read.pressure_map.contact
    distance = read.distance[contact]
    figures = {
        "median_distance": float(np.median(distance)),
        "p95_distance": float(np.percentile(distance, 95.0)),
        "far_share": float((distance > FAR).mean()),
        "unclear_share": float(read.unclear[contact].mean()),
    }
    if case.in_grey:
        return {"colours": figures | {"high_where": "dark" if case.dark_is == "high" else "bright"}}
    return {"colours": figures}


def _heat_summary(model: HeatModel, contact: Mask) -> dict[str, Any]:
    return {
        "peak_rise_K": float(model.rise[contact].max()),
        "mean_rise_K": float(model.rise[contact].mean()),
        "mu_map_mean": float(model.mu[contact].mean()),
        "mu_balance": model.balance.mu,
        "heat_into_ice_W": model.balance.ice,
        "heat_into_tread_W": model.balance.tread,
        "heat_into_water_W": model.balance.water,
    } | (_edges(model.edges) | _shares(model.state))


def _edges(edges: Edges) -> dict[str, float]:
    return {
        "leading_edge_temperature_C": edges.leading - ZERO_CELSIUS,
        "trailing_edge_temperature_C": edges.trailing - ZERO_CELSIUS,
    }


def _shares(state: NDArray[np.uint8]) -> dict[str, float]:
    contact = np.count_nonzero(state)
    return {
        f"{each.name.lower()}_share": float(np.count_nonzero(state == each) / contact)
        for each in STATES
    }
