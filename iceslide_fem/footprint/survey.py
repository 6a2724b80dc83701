"""All of a footprint: pressure from its picture, both heat models, the film, the thesis's mu."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.film.doubts import doubts
from iceslide_fem.footprint.balance import STATES, classify
from iceslide_fem.footprint.case import FootprintCase
from iceslide_fem.footprint.colours import (
    FAR,
    Reading,
    legend_bar,
    lowest_colour,
    named_bar,
    read_colours,
    read_grey,
)
from iceslide_fem.footprint.film_map import FilmMap, film_map
from iceslide_fem.footprint.image import colour, cut, read_picture, rotate
from iceslide_fem.footprint.macroscopic import Edges, HeatModel, edge_temperatures, heat_model
from iceslide_fem.footprint.pressure_map import (
    PressureMap,
    gaussian_centre_line,
    pressure_from_values,
)
from iceslide_fem.materials import MELTING_TEMPERATURE


class ReadFootprint(NamedTuple):
    """A pressure map and how well it was read.

    distance: of every pixel's colour to the bar, (ny, nx), relative to the range of a channel;
    unclear: pixels whose value is that of a neighbour; load_factor: by which a given load changed
    all pressures.
    """

    pressure_map: PressureMap
    distance: Array
    unclear: Mask
    load_factor: float


class Survey(NamedTuple):
    """Everything computed of a footprint: `thesis` by (3.3), `moving` by the moving source."""

    case: FootprintCase
    read: ReadFootprint
    thesis: HeatModel
    moving: HeatModel
    film: FilmMap

    @property
    def state(self) -> NDArray[np.uint8]:
        """Dry, mixed, wet by the surface temperature of the film model."""
        footprint = self.read.pressure_map
        return classify(self.film.temperature - MELTING_TEMPERATURE, footprint.contact)


def read_footprint(case: FootprintCase) -> ReadFootprint:
    """Module 1. Raises SceneError for everything that is wrong with the picture or its reading."""
    background = None if case.background == "none" else colour(case.background)
    in_grey = case.legend is None and case.colormap is None
    around = (0, 0, 0) if in_grey else background or (255, 255, 255)
    picture = read_picture(case.image, around)
    bar = None
    if case.legend is not None:
        bar = legend_bar(cut(picture, case.legend, "legend"))
    elif case.colormap is not None:
        bar = named_bar(case.colormap)
    if bar is not None and background is None:  # what a rotation adds is no contact
        around = lowest_colour(bar)
    picture = rotate(picture, case.rotation, around)
    if case.crop is not None:
        picture = cut(picture, case.crop, "crop")
    reading: Reading = read_grey(picture) if bar is None else read_colours(picture, bar, background)
    footprint = pressure_from_values(
        reading.value,
        case.min_pressure,
        case.max_pressure,
        case.lowest_pressure,
        (case.length, case.width),
    )
    factor = 1.0
    if case.load is not None:
        footprint, factor = footprint.carrying(case.load)
    return ReadFootprint(footprint, reading.distance[::-1], reading.unclear[::-1], factor)


def survey(
    case: FootprintCase, read: ReadFootprint, tell: Callable[[float], None] = lambda share: None
) -> Survey:
    """Modules 2 and 3 by both heat models, and the film under every pixel.

    `tell` is called with the share of the pixels that is done.
    """
    footprint = read.pressure_map
    return Survey(
        case,
        read,
        heat_model(footprint, case.thesis),
        heat_model(footprint, case.moving),
        film_map(footprint, case.ride, case.contact_table, case.tolerance, tell=tell),
    )


def summary(result: Survey) -> dict[str, Any]:
    """All figures of a survey, for summary.json; SI units as in the names."""
    case, read, film = result.case, result.read, result.film
    footprint, contact = read.pressure_map, read.pressure_map.contact
    distance = read.distance[contact]
    line = gaussian_centre_line(footprint)
    outside = case.contact_table.outside(footprint.pressure[contact])
    return {
        "footprint": footprint.summary()
        | {
            "load_factor": read.load_factor,
            "gaussian_line": {"peak_Pa": line.peak, "centre_m": line.centre, "sigma_m": line.sigma},
        },
        "colours": {
            "median_distance": float(np.median(distance)),
            "p95_distance": float(np.percentile(distance, 95.0)),
            "far_share": float((distance > FAR).mean()),
            "unclear_share": float(read.unclear[contact].mean()),
        },
        "film": {
            "mu_mean": film.mean_friction(footprint),
            "mean_film_height_m": float(film.height[contact].mean()),
            "mean_surface_temperature_C": float(
                film.temperature[contact].mean() - MELTING_TEMPERATURE
            ),
            "melting_share": float(film.melting[contact].mean()),
            "saturated_share": float(film.saturated[contact].mean()),
            "outside_table_share": float(outside.mean()),
        }
        | _edges(edge_temperatures(film.temperature, contact))
        | _shares(result.state),
        "thesis": _heat_summary(result.thesis, contact),
        "moving_source": _heat_summary(result.moving, contact),
        "warnings": doubts(
            float(film.height[contact].min()), float(film.friction(footprint)[contact].max())
        ),
        "case": case.model_dump(mode="json"),
    }


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
        "leading_edge_temperature_C": edges.leading - MELTING_TEMPERATURE,
        "trailing_edge_temperature_C": edges.trailing - MELTING_TEMPERATURE,
    }


def _shares(state: NDArray[np.uint8]) -> dict[str, float]:
    contact = np.count_nonzero(state)
    return {
        f"{each.name.lower()}_share": float(np.count_nonzero(state == each) / contact)
        for each in STATES
    }
