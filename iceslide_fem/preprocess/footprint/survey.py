"""Full survey of a footprint: both heat models, film, and mean friction over ice temperature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.film.doubts import doubts
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.jaeger import friction_flux
from iceslide_fem.preprocess.footprint.macroscopic import (
    STATES,
    Edges,
    HeatModel,
    States,
    classify,
    edge_temperatures,
    heat_model,
)
from iceslide_fem.preprocess.footprint.passing import FilmMap
from iceslide_fem.preprocess.footprint.picture import FAR
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap, gaussian_centre_line
from iceslide_fem.preprocess.footprint.reading import ReadFootprint
from iceslide_fem.reference import hayhoe_shapley, navin, peng_rectangle
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import ICE_EFFUSIVITY, MELTING_TEMPERATURE, WATER_VISCOSITY

# K, undercooling of the ice in the curves
UNDERCOOLING = np.array([20.0, 15.0, 10.0, 7.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5])
LINES = 20  # representative lines of the footprint: error of mu 0.2 % on a tread
LARGEST_MEAN = 5.0  # mu of the film law, mean over the footprint


class Curves(NamedTuple):
    """Mean mu over the ice's temperature (K), by the film law and by formulas of chapter 2."""

    temperature: Array
    film: Array
    navin: Array
    hayhoe: Array
    peng: Array


class Survey(NamedTuple):
    """Everything computed of a footprint.

    models: the thesis's macroscopic models by their names in the summary, if they are asked for:
    thesis by (3.3), moving_source, and given with given temperatures.
    """

    case: FootprintCase
    read: ReadFootprint
    film: FilmMap
    curves: Curves
    models: dict[str, HeatModel]

    @property
    def mu_mean(self) -> float:
        """Mean friction by the film law."""
        return self.film.mean_friction(self.read.pressure_map)

    @property
    def borne(self) -> Array | None:
        """p_f (Pa), (ny, nx), at the exit of a pixel; None without load-bearing voids."""
        footprint = self.read.pressure_map
        ride = self.case.ride(footprint.contact_length)
        if ride.wet is None:
            return None
        p, contact_of = footprint.pressure, self.case.contact_of
        kelvin, speed = (np.asarray(one) for one in (ride.temperature, ride.sliding_speed))
        change = ride.change(p, speed, kelvin)
        return ride.wet.borne(p, self.film.squeezed, contact_of, change)

    @property
    def outside(self) -> Mask:
        """Pixels in contact with a pressure outside the table of k, D and H_V, (ny, nx)."""
        footprint = self.read.pressure_map
        return footprint.contact & self.case.contact_of.outside(footprint.pressure)

    @property
    def state(self) -> States:
        """Dry, mixed, wet by the film model's surface temperature relative to melting."""
        contact = self.read.pressure_map.contact
        return classify(self.film.temperature - self.case.melting_temperature, contact)


def survey(
    case: FootprintCase, read: ReadFootprint, tell: Callable[[float], None] = lambda fraction: None
) -> Survey:
    """Modules 2 and 3 by both heat models, films of all pixels, and friction over temperature.

    tell: called with the finished fraction of the pixels. Raises SceneError if the film law's mean
    friction is implausible for rubber on ice.
    """
    footprint = read.pressure_map
    ride = case.ride(footprint.contact_length)
    rows, temperatures = len(footprint.pressure), case.melting_temperature - UNDERCOOLING
    some = footprint.sample(LINES)
    # Lines at other temperatures join the call: its time depends on pixels per line, not on lines.
    pressure = np.concatenate([footprint.pressure, *[some] * temperatures.size])
    below = np.append(np.full(rows, ride.temperature), np.repeat(temperatures, len(some)))
    film = film_map(
        replace(footprint, pressure=pressure),
        ride._replace(temperature=below, initial_height=case.law.height_on(below)),
        case.contact_of,
        case.tolerance,
        tell=tell,
    )
    shear = film.shear[rows:].reshape(temperatures.size, -1).sum(axis=1)
    result = Survey(
        case,
        read,
        film.lines(slice(rows)),
        friction_curves(footprint, case, shear / some.sum()),
        _models(case, read) if case.thesis_balance else {},
    )
    if not 0.0 <= result.mu_mean <= LARGEST_MEAN:
        raise SceneError(
            f"the film law finds a mean mu of {result.mu_mean:.4g} under {case.source}, which no "
            f"rubber has on ice; allowed: up to {LARGEST_MEAN:g}; check the pressures and their "
            "unit, the speed, --viscosity, --initial-height and --dry-stress"
        )
    return result


def _models(case: FootprintCase, read: ReadFootprint) -> dict[str, HeatModel]:
    """The macroscopic model with both sources of heat, and with given temperatures."""
    footprint = read.pressure_map
    found = {
        "thesis": heat_model(footprint, case.thesis, state=read.state),
        "moving_source": heat_model(footprint, case.moving, state=read.state),
    }
    if read.temperature is not None:
        found["given"] = heat_model(footprint, case.moving, read.temperature, read.state)
    return found


def friction_curves(footprint: PressureMap, case: FootprintCase, mu: Array) -> Curves:
    """Mean friction at `UNDERCOOLING`: `mu` of the film law, and the formulas.

    The formulas use one contact with the footprint's mean pressure; its length is the mean contact
    length of touching lines. Peng's wet area begins where the moving source with static friction
    reaches T_m; its film is that of Hayhoe and Shapley. Water and salt affect the film law only.
    Navin's formula uses degC; the others use pure ice with the same undercooling.
    """
    temperatures = case.melting_temperature - UNDERCOOLING
    pure = MELTING_TEMPERATURE - UNDERCOOLING
    lines = np.flatnonzero(footprint.contact.any(axis=1))
    p, v = footprint.mean_pressure, case.ride().sliding_speed
    length = footprint.contact[lines].sum(axis=1).mean() * footprint.dx
    # Under the flux q a half-space rises by 2 q sqrt(t / pi) / e.
    q = friction_flux(case.static_friction, p, case.speed, case.slip)
    onset = np.pi * (UNDERCOOLING * ICE_EFFUSIVITY / (2.0 * q)) ** 2 * case.speed
    wet = np.maximum(length - onset, 1e-9)
    height = WATER_VISCOSITY * v / (p * hayhoe_shapley(p, v, pure, wet))
    return Curves(
        temperatures,
        mu,
        navin(temperatures, case.aggregate),
        hayhoe_shapley(p, v, pure, length),
        peng_rectangle(v, height, p, wet, length, case.static_friction),
    )


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
    outside = result.outside[contact]
    shear = film.shear[contact]
    friction_outside = float(shear[outside].sum() / shear.sum()) if shear.any() else 0.0
    mu = film.friction(footprint)[contact]
    largest = float(mu[~outside].max(initial=result.mu_mean))
    warnings = [
        *read.notes,
        *case.scene_notes,
        *doubts(float(film.height[contact].min()), largest, melting, case.rubs_without_melting),
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
