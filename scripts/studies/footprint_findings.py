"""Figures of docs/explanation/footprint.md: pictures read back, the thesis's (4.1) and its balance
with its data, and the film law over pixels.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from iceslide_fem import reference
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.jaeger import (
    TABLE_1_ICE,
    friction_flux,
    jaeger_exposure,
    jaeger_rise,
)
from iceslide_fem.preprocess.footprint.macroscopic import (
    STATES,
    HeatModel,
    Macroscopic,
    classify,
    heat_balance,
)
from iceslide_fem.preprocess.footprint.picture import FAR
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.reading import ReadFootprint, read_footprint
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.footprint.survey import survey
from iceslide_fem.preprocess.footprint.synthetic import Tread, coloured_picture, grey_picture, save
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES
from scripts.studies.common import options, table

MU_ST, V, S, T_0, DEPTH = 0.1, 3.0, 1e-5, -4.0, 1e-4  # table 2
LENGTH, WIDTH, HIGH, SHAPE = 0.18, 0.14, 4e5, (420, 540)
PEAKS = np.array([1.0, 2.0, 3.0, 5.0]) * BAR
OWN, SOURCE = 5.0, 4.5  # K, the published peak rises
SIZE = {"length": LENGTH, "width": WIDTH, "max_pressure": HIGH}
PRINTED = TABLE_1_ICE


def show(title: str, head: list[str], rows: list[list[str]]) -> None:
    """A table with a title."""
    print(f"\n{title}\n")
    table(head, rows)


def round_trips(folder: Path) -> None:
    """Area, mean pressure and pixel error of pictures read back."""
    truth = Tread().footprint(SHAPE)
    crop = f"0,0,{SHAPE[1]},{SHAPE[0]}"
    rows = []
    for suffix in ("png", "jpg"):
        path = save(grey_picture(truth, HIGH), folder / f"grey.{suffix}", quality=85)
        rows.append([f"grey, {suffix}", *_deviations(truth, {"image": path})])
        for name in ("viridis", "jet", "inferno"):
            picture, legend = coloured_picture(truth, HIGH, name)
            path = save(picture, folder / f"{name}.{suffix}", quality=85)
            for bar, option in (
                ("name", {"colormap": name}),
                ("legend", {"legend": ",".join(map(str, legend))}),
            ):
                values = {"image": path, "crop": crop, **option}
                rows.append([f"{name} by {bar}, {suffix}", *_deviations(truth, values)])
    head = ["picture", "area", "mean pressure", "pixel error", "median distance", "far"]
    show("Round trips, 540 x 420 pixels, JPEG quality 85", head, rows)


def _deviations(truth: PressureMap, values: dict) -> list[str]:
    read = read_footprint(FootprintCase.of({**SIZE, **values}))
    found, contact = read.pressure_map, read.pressure_map.contact
    distance = read.distance
    assert distance is not None  # it is a picture
    error = np.abs(found.pressure - truth.pressure)[truth.contact].mean() / truth.mean_pressure
    return [
        f"{found.contact_area / truth.contact_area - 1:+.2%}",
        f"{found.mean_pressure / truth.mean_pressure - 1:+.2%}",
        f"{error:.2%}",
        f"{np.median(distance[contact]):.3f}",
        f"{(distance[contact] > FAR).mean():.1%}",
    ]


def printed_rises() -> None:
    """(4.1) with tables 1 and 2 as printed, and what would give the published rise."""
    times = {
        "d^2/alpha": DEPTH**2 / PRINTED.diffusivity,
        "L/V": LENGTH / V,
        "1 s": 1.0,
        "2 s": 2.0,
    }
    rows = []
    for p in PEAKS:
        Q = float(friction_flux(MU_ST, p, V, S))
        rises = [f"{float(jaeger_rise(Q, 1e-4, t, PRINTED)):.4g}" for t in times.values()]
        exposure = [f"{jaeger_exposure(Q, rise, PRINTED):.3f}" for rise in (OWN, SOURCE)]
        band = float(reference.band_source_rise(Q, LENGTH, V))
        slip = f"{S * OWN / band:.2f}"
        rows.append([f"{p / BAR:g} bar", f"{Q:.2f}", *rises, *exposure, f"{band:.2e}", slip])
    head = ["peak p", "Q (W/m2)", *(f"{name} = {t:.3g} s" for name, t in times.items())]
    head += ["t for 5 K", "for 4.5 K", "moving source (K)", "its slip for 5 K"]
    show("(4.1) at 0.1 mm, table 1 and 2, rise in K; band of 0.18 m", head, rows)
    Q, pixel = float(friction_flux(MU_ST, 2e5, V, S)), LENGTH / 540
    heat = Q * pixel**2 * LENGTH / V
    for p in PEAKS:
        rise = float(jaeger_rise(friction_flux(MU_ST, p, V, S), 1e-4, LENGTH / V, PRINTED))
        print(f"{p / BAR:g} bar, t = L/V: 5 K by (4.1) at S = {S * OWN / rise:.2g}")
    print(f"(3.3) at 2 bar with the heat of a pixel of {1e3 * pixel:.3g} mm in L/V, {heat:.2g} J: ")
    print(f"{float(jaeger_rise(heat, pixel, LENGTH / V, PRINTED)):.2g} K one pixel away")


def friction_by_balance(footprint: PressureMap) -> None:
    """mu by (4.7) to (4.9) and (3.8) with both heat models, and the depth that gives the film's."""
    case_values = {"image": "none", "thesis_balance": True, **SIZE}
    result = survey(FootprintCase.of(case_values), ReadFootprint(footprint))
    film = result.mu_mean
    rows = []
    thesis, moving = result.models["thesis"], result.models["moving_source"]
    for name, model in (("(3.3), S 1e-5, 1 s", thesis), ("moving, S 1", moving)):
        rows.append([name, *_heat_row(footprint, model, film)])
    head = ["heat", "peak (K)", "mean (K)", "dry", "mixed", "wet", "mean mu", "mu (3.8)"]
    head += ["d for the film's mu: map", "balance"]
    show(f"Balance, d = 0.1 mm, -4 degC; film law: {film:.4f}", head, rows)
    rise, contact = moving.rise, footprint.contact
    literal = thesis.mu_mean
    literal *= (V * S * footprint.contact_area) ** 2
    print(f"(4.7) to (4.9) with V, S and A_tot as factors: mean mu {literal:.1g}")
    rows = []
    for slip in (0.1, 0.2, 0.5, 1.0):
        state = classify(T_0 + slip * rise, contact)
        parameters = Macroscopic(speed=V, slip=slip, depth=DEPTH)
        balance = heat_balance(
            state, slip * rise, footprint.pixel_area, footprint.mean_pressure, parameters
        )
        shares = [f"{np.mean(state[contact] == each):.0%}" for each in STATES]
        rows.append([f"{slip:g}", f"{slip * rise.max():.2f}", *shares, f"{balance.mu:.4f}"])
    show("Moving source over slip", ["S", "peak (K)", "dry", "mixed", "wet", "mu (3.8)"], rows)


def _heat_row(footprint: PressureMap, model: HeatModel, film: float) -> list[str]:
    contact = footprint.contact
    mean = model.mu_mean
    return [
        f"{model.rise.max():.2f}",
        f"{model.rise[contact].mean():.2f}",
        *(f"{np.mean(model.state[contact] == each):.0%}" for each in STATES),
        f"{mean:.4g}",
        f"{model.balance.mu:.4g}",
        f"{1e3 * DEPTH * mean / film:.3g} mm",
        f"{1e3 * DEPTH * model.balance.mu / film:.3g} mm",
    ]


def film_over_pixels() -> None:
    """Mean mu of the film law for pictures of the same tread with other pixels."""
    rows = []
    for columns in (90, 180, 360, 720):
        footprint = Tread().footprint((columns * 7 // 9, columns))
        film = film_map(footprint, Ride(V, V, 273.15 + T_0), CONTACT_TABLES["B"])
        contact = footprint.contact
        shares = [f"{part[contact].mean():.1%}" for part in (film.melting, film.saturated)]
        mu = f"{film.mean_friction(footprint):.5f}"
        rows.append([f"{columns}", f"{1e3 * footprint.dx:.2f} mm", mu, *shares])
    show("Film law over pixel size", ["pixels", "size", "mean mu", "melting", "saturated"], rows)


def main() -> None:
    """Print all tables."""
    options(__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder:
        round_trips(Path(folder))
    printed_rises()
    friction_by_balance(Tread().footprint(SHAPE))
    film_over_pixels()


if __name__ == "__main__":
    main()
