"""All realisations of a surface under all pressures: the table of contact parameters."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import SceneError
from iceslide_fem.materials import BAR
from iceslide_fem.roughness.case import PIXELS_PER_WAVE, SOURCE_WAVE, THINNED_TO, RoughnessCase
from iceslide_fem.roughness.generate import generate, read_spec
from iceslide_fem.roughness.half_space import TOLERANCE, Contact, press
from iceslide_fem.roughness.parameters import Definition, Parameters, measure
from iceslide_fem.roughness.read import read_surface
from iceslide_fem.roughness.surface import (
    Statistics,
    Surface,
    coarsened,
    levelled,
    low_passed,
    spectrum,
    spectrum_fit,
    statistics,
)

STEEP = 0.6  # rms slope beyond which the half-space is not to be relied on
STEEPEST = 10.0  # that a surface may have: a cliff of 84 degrees at every place
PIXEL_ROUNDING = 1e-3  # of a pixel's side, in files that have it to few digits
NEARLY_FULL = 0.9  # share of contact
COLUMNS = (
    "pressure_Pa",
    *("k", "D_m", "H_V_m"),
    *("k_std", "D_std_m", "H_V_std_m"),
    *("k_raw", "D_median_m", "open_area_below_h0"),
)


class Measured(NamedTuple):
    """A map, levelled, with all its waves: its figures, and the pixels (columns, rows) it has."""

    statistics: Statistics
    pixel: float
    pixels: tuple[int, int]

    @classmethod
    def of(cls, surface: Surface) -> Measured:
        """Those of `surface`."""
        rows, columns = surface.heights.shape
        return cls(statistics(surface), surface.pixel, (columns, rows))


class Survey(NamedTuple):
    """What was found. found: (realisations, pressures, `Parameters`); shown: some contacts.

    surface: the first realisation as it was pressed; statistics: of every realisation; cut_off:
    its shortest wave, m (None: all that the pixels show); shown: number of the pressure -> Contact;
    measured: of a map.
    """

    case: RoughnessCase
    surface: Surface
    statistics: list[Statistics]
    cut_off: float | None
    found: Array
    shown: dict[int, Contact]
    iterations: int
    error: float
    measured: Measured | None = None

    @property
    def mean(self) -> Parameters[Array]:
        """Means over the realisations; arrays over pressure."""
        return Parameters(*self.found.mean(axis=0).T)

    @property
    def deviation(self) -> Parameters[Array]:
        """Standard deviations between realisations; NaN if there is one only."""
        if len(self.found) == 1:
            return Parameters(*np.full(self.found.shape[1:], np.nan).T)
        return Parameters(*self.found.std(axis=0, ddof=1).T)


def survey(case: RoughnessCase) -> Survey:
    """Press all realisations; raises SceneError if the surface cannot be read or resolved."""
    surfaces, cut_off, measured = _surfaces(case)
    modulus = case.rubber[1]
    middle = len(case.pressures) // 2
    first: Surface | None = None
    shown: dict[int, Contact] = {}
    described, found = [], []
    iterations, error = 0, 0.0
    for surface in surfaces:
        described.append(statistics(surface))
        _check_slope(case, described[-1])
        rows = []
        for number, contact in enumerate(
            press(
                surface.heights,
                surface.pixel,
                modulus,
                case.pressures,
                periodic=surface.periodic,
            )
        ):
            rows.append(measure(contact, surface.pixel, case.definition, surface.periodic))
            iterations, error = iterations + contact.iterations, max(error, contact.error)
            if first is None and number in (0, middle, len(case.pressures) - 1):
                shown[number] = contact
        first = first or surface
        found.append(rows)
    assert first is not None  # there is one realisation at least
    return Survey(
        case, first, described, cut_off, np.array(found), shown, iterations, error, measured
    )


def parameters(
    surface: Surface, modulus: float, pressures: Array, definition: Definition = "hydrodynamic"
) -> Parameters[Array]:
    """Contact parameters of one surface; arrays over the pressures (Pa), ascending."""
    pixel, periodic = surface.pixel, surface.periodic
    contacts = press(surface.heights, pixel, modulus, pressures.tolist(), periodic=periodic)
    return Parameters(
        *np.array([measure(contact, pixel, definition, periodic) for contact in contacts]).T
    )


def _check_slope(case: RoughnessCase, figures: Statistics) -> None:
    """Raise SceneError for slopes that no surface has: heights in another unit than was said."""
    if figures.rms_slope > STEEPEST:
        raise SceneError(
            f"{case.surface} has an rms height of {1e6 * figures.rms_height:.3g} um and an rms "
            f"slope of {figures.rms_slope:.3g}; allowed: slopes up to {STEEPEST:g} (--height-unit "
            "says what heights are in that do not say so, else they are metres, --pixel how far "
            "apart they are)"
        )


def _surfaces(
    case: RoughnessCase,
) -> tuple[Iterator[Surface], float | None, Measured | None]:
    """Surfaces without waves below the cut-off, the cut-off (m), and figures of a map as it was
    measured.

    What is left of a map is pressed on coarser pixels where its shortest wave allows it; by the
    definition of the source, which counts pixels, it keeps them.
    """
    wave = case.shortest_wave
    if case.surface.suffix.lower() == ".toml":
        if case.pixel is not None:
            raise SceneError("--pixel has no meaning for a surface that is generated")
        spec = read_spec(case.surface)
        if wave is not None and wave < spec.shortest_wave:
            raise SceneError(
                f"--shortest-wave {1e6 * wave:.4g} um is shorter than that of {case.surface}, "
                f"{1e6 * spec.shortest_wave:.4g} um"
            )
        _check_resolution(case.definition, wave or spec.shortest_wave, spec.pixel, spec.size)
        every = (generate(spec, number) for number in range(case.realisations))
        if wave is None:
            return every, spec.shortest_wave, None
        return (low_passed(surface, wave) for surface in every), wave, None

    surface = levelled(read_surface(case.surface, case.pixel, case.height_unit))
    if wave is None and case.definition == "hydrodynamic":
        wave = SOURCE_WAVE
    measured = Measured.of(surface)
    if wave is None:
        return iter([surface]), None, measured
    _check_resolution(case.definition, wave, surface.resolution, min(surface.size))
    if case.definition == "hydrodynamic":
        surface = coarsened(surface, wave / THINNED_TO)
    return iter([low_passed(surface, wave)]), wave, measured


def _check_resolution(definition: Definition, wave: float, pixel: float, size: float) -> None:
    """Raise SceneError if the shortest wave has too few pixels, or the map too few waves."""
    if definition == "hydrodynamic" and wave < PIXELS_PER_WAVE * pixel * (1.0 - PIXEL_ROUNDING):
        raise SceneError(
            f"the shortest wave, {1e6 * wave:.4g} um, has {wave / pixel:.4g} pixels of "
            f"{1e6 * pixel:.4g} um; allowed: {PIXELS_PER_WAVE:g} or more (give a longer "
            "--shortest-wave, or --definition thesis)"
        )
    if wave > 0.25 * size:
        raise SceneError(
            f"the shortest wave, {1e6 * wave:.4g} um, is longer than a quarter of the map, "
            f"{1e6 * size:.4g} um: nothing of its roughness would be left"
        )


def table(result: Survey) -> str:
    """The text of contact.csv, which a scene reads as `film.contact`."""
    mean, deviation = result.mean, result.deviation
    columns = (
        result.case.pressure_array,
        *mean[:3],
        *deviation[:3],
        mean.k_raw,
        mean.D_median,
        mean.open_area_below_h0,
    )
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in zip(*columns, strict=True):
        writer.writerow("" if np.isnan(value) else f"{value:.6g}" for value in row)
    return file.getvalue()


def summary(result: Survey) -> dict[str, Any]:
    """Everything about the surface, for surface.json; SI units as in the names."""
    case, surface = result.case, result.surface
    name, modulus = case.rubber
    figures = np.array(result.statistics)
    fit = spectrum_fit(spectrum(surface), result.cut_off or 2.0 * surface.pixel)
    return {
        "rms_height_m": float(figures[:, 0].mean()),
        "rms_slope": float(figures[:, 1].mean()),
        "skewness": float(figures[:, 2].mean()),
        "measured": None if result.measured is None else _before(result.measured),
        "spectrum_fit": None if fit is None else {"hurst": fit.hurst, "rolloff_m": fit.rolloff},
        "cut_offs": {
            "shortest_wave_m": result.cut_off,
            "pixel_m": surface.pixel,
            "size_m": list(surface.size),
        },
        "pixels": list(surface.heights.shape[::-1]),
        "solver": {
            "tolerance": TOLERANCE,
            "largest_error": result.error,
            "iterations": result.iterations,
        },
        "rubber": name,
        "modulus_Pa": modulus,
        "definition": case.definition,
        "realisations": len(result.statistics),
        "warnings": warnings(result),
        "case": case.model_dump(mode="json"),
    }


def _before(measured: Measured) -> dict[str, Any]:
    return measured.statistics._asdict() | {
        "pixel_m": measured.pixel,
        "pixels": list(measured.pixels),
    }


def warnings(result: Survey) -> list[str]:
    """What a person should know before using the table; one sentence each."""
    slope = max(each.rms_slope for each in result.statistics)
    found = [f"{result.case.surface.name}: {note}" for note in result.surface.notes]
    if slope > STEEP:
        found.append(
            f"the rms slope is {slope:.2f}: above {STEEP:g} rubber is strained too much for the "
            "elastic half-space"
        )
    full = result.case.pressure_array[result.mean.k > NEARLY_FULL]
    if full.size:
        found.append(
            f"k is above {NEARLY_FULL:g} from {full[0] / BAR:.3g} bar on: what is left open there "
            "depends on waves that are cut off"
        )
    return found
