"""Contact parameters of all realisations of a surface under all pressures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.preprocess.roughness.case import Material, RoughnessCase, material
from iceslide_fem.preprocess.roughness.creep import hold
from iceslide_fem.preprocess.roughness.half_space import TOLERANCE, Contact, press
from iceslide_fem.preprocess.roughness.parameters import Definition, Parameters, measure
from iceslide_fem.preprocess.roughness.prepare import prepared
from iceslide_fem.preprocess.work import csv_text
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import BAR
from iceslide_fem.surfaces.surface import (
    SpectrumFit,
    Statistics,
    Surface,
    spectrum,
    spectrum_fit,
    statistics,
)

STEEP = 0.6  # rms slope above which the half-space is inaccurate
NEARLY_FULL = 0.9  # fraction of contact
# Largest roll-off over the side of a map, and shortest wave over the roll-off, without a note: k, D
# and H_V are then within 12 % of those of a long and fine map (scripts.studies.poor_maps).
OF_THE_SIDE, OF_THE_ROLLOFF = 0.35, 0.2


def wave_doubts(
    fit: SpectrumFit | None, shortest_wave: float | None, size: tuple[float, float]
) -> list[str]:
    """Sentences on a map that is too short, or whose waves end too early, for its roll-off.

    shortest_wave: m, None if the pixels limit it; size: of the map, m.
    """
    if fit is None:
        return [
            "the map has too few waves for a fit of its spectrum: k, D and H_V are those of the "
            "map, and not of a surface"
        ]
    found, rolloff = [], fit.rolloff
    if rolloff > OF_THE_SIDE * min(size):
        found.append(
            f"the roll-off found, {1e6 * rolloff:.3g} um, is {rolloff / min(size):.2f} of the "
            "map's side, so longer waves are missing: on maps of 2, 1 and 0.5 roll-offs D was 12, "
            "18 and 33 % too small, and H_V 2, 9 and 33 %"
        )
    if shortest_wave is not None and shortest_wave > OF_THE_ROLLOFF * rolloff:
        found.append(
            f"the shortest wave kept is {shortest_wave / rolloff:.2f} of the roll-off, "
            f"{1e6 * rolloff:.3g} um: at 0.25, 0.5 and 1 of it k was 1.2, 1.7 and 3.2 times that "
            "of a surface with waves down to 0.16, and H_V 7, 25 and 68 % too small"
        )
    return found


def slope_doubts(rms_slope: float) -> Sequence[str]:
    """A sentence on slopes that strain the rubber too much."""
    if rms_slope <= STEEP:
        return ()
    return (
        f"the rms slope is {rms_slope:.2f}: above {STEEP:g} rubber is strained too much for the "
        "elastic half-space",
    )


# Allowed rms slopes: from 6e-4 degrees to 84 degrees.
FLATTEST, STEEPEST = 1e-5, 10.0
COLUMNS = (
    "pressure_Pa",
    *("k", "D_m", "H_V_m"),
    *("k_std", "D_std_m", "H_V_std_m"),
    *("k_raw", "D_median_m", "open_area_below_h0"),
    "youngs_modulus_Pa",
)


class Survey(NamedTuple):
    """Results of a survey. found: (realisations, pressures, `Parameters`).

    surface: first realisation as pressed; statistics: of every realisation; cut_off: shortest wave,
    m (None: limited by the pixels); shown: index of the pressure -> Contact; iterations, error: of
    all ages; measured: figures of a map before filtering; age: time after loading, s, None for
    elastic rubber.
    """

    case: RoughnessCase
    rubber: Material
    surface: Surface
    statistics: list[Statistics]
    cut_off: float | None
    found: Array
    shown: dict[int, Contact]
    iterations: int
    error: float
    measured: dict[str, Any] | None = None
    age: float | None = None

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
    """The single survey of one age, or of elastic rubber."""
    (result,) = surveys(case)
    return result


def surveys(case: RoughnessCase) -> list[Survey]:
    """Press all realisations; one result for each age, a single one for elastic rubber.

    Raises SceneError if the surface cannot be read or resolved, or the rubber is incomplete.
    """
    rubber = material(case)
    ages: list[float | None] = [*case.rising_ages] or [None]
    arms = 0 if rubber.prony is None else len(rubber.prony.times)
    surfaces, cut_off, measured = prepared(case, arms)
    pictured = (0, len(case.pressures) // 2, len(case.pressures) - 1)
    first: Surface | None = None
    shown: list[dict[int, Contact]] = [{} for _ in ages]
    described, found = [], []
    iterations, error = 0, 0.0
    for surface in surfaces:
        described.append(statistics(surface))
        _check_slope(case, described[-1])
        rows = []
        for number, contacts in enumerate(_aged(surface, rubber, case)):
            rows.append([_measured(case, surface, each) for each in contacts])
            iterations += sum(each.iterations for each in contacts)
            error = max(error, *(each.error for each in contacts))
            if first is None and number in pictured:
                for at, contact in zip(shown, contacts, strict=True):
                    at[number] = contact
        first = first or surface
        found.append(rows)
    assert first is not None  # there is at least one realisation
    values = np.array(found)  # (realisations, pressures, ages, `Parameters`)
    return [
        Survey(
            case, rubber, first, described, cut_off, values[:, :, i], shown[i], iterations, error,
            measured, age,
        )
        for i, age in enumerate(ages)
    ]  # fmt: skip


def _measured(case: RoughnessCase, surface: Surface, contact: Contact) -> Parameters[float]:
    return measure(contact, surface.pixel, case.definition, surface.periodic)


def parameters(
    surface: Surface, modulus: float, pressures: Array, definition: Definition = "hydrodynamic"
) -> Parameters[Array]:
    """Contact parameters of one surface; arrays over the pressures (Pa), ascending."""
    contacts = _contacts(surface, modulus, pressures.tolist())
    found = [measure(each, surface.pixel, definition, surface.periodic) for each in contacts]
    return Parameters(*np.array(found).T)


def _contacts(surface: Surface, modulus: float, pressures: Sequence[float]) -> Iterator[Contact]:
    return press(surface.heights, surface.pixel, modulus, pressures, periodic=surface.periodic)


def _aged(surface: Surface, rubber: Material, case: RoughnessCase) -> Iterator[list[Contact]]:
    """Contacts under each pressure, one for each age, or a single one for elastic rubber."""
    if rubber.prony is None:
        for contact in _contacts(surface, rubber.modulus, case.pressures):
            yield [contact]
        return
    reduced = [age / rubber.stretched for age in case.rising_ages]
    yield from hold(
        surface.heights, surface.pixel, rubber.modulus, case.pressures, rubber.prony, reduced,
        periodic=surface.periodic,
    )  # fmt: skip


def _check_slope(case: RoughnessCase, figures: Statistics) -> None:
    """Raise SceneError for implausible slopes, which mean a wrong unit of heights."""
    if not FLATTEST <= figures.rms_slope <= STEEPEST and figures.rms_height > 0.0:
        raise SceneError(
            f"{case.surface} has an rms height of {1e6 * figures.rms_height:.3g} um and an rms "
            f"slope of {figures.rms_slope:.3g}; allowed: slopes of {FLATTEST:g} to {STEEPEST:g} "
            "(--height-unit says what heights are in that do not say so, else they are metres, "
            "--pixel how far apart they are)"
        )


def columns(result: Survey) -> dict[str, Array]:
    """Columns of contact.csv, names with units -> (pressures,)."""
    pressures, rubber = np.array(result.case.pressures), result.rubber
    modulus = 0.75 * rubber.modulus  # incompressible: E* = E / (1 - nu^2)
    if result.age is not None and rubber.prony is not None:
        modulus /= float(rubber.prony.creep.compliance(result.age / rubber.stretched))
    found = *result.mean[:3], *result.deviation[:3], *result.mean[3:]
    values = pressures, *found, np.full_like(pressures, modulus)
    named = dict(zip(COLUMNS, values, strict=True))
    if result.age is not None:
        named["age_s"] = np.full_like(pressures, result.age)
    return named


def table(result: Survey) -> str:
    """The text of contact.csv, which a scene reads as `film.contact`."""
    return csv_text(columns(result), 6, missing="")


def summary(result: Survey) -> dict[str, Any]:
    """All data of the surface for surface.json; SI units as in the names."""
    case, surface = result.case, result.surface
    figures = np.array(result.statistics)
    fit = spectrum_fit(spectrum(surface), result.cut_off or 2.0 * surface.pixel)
    return {
        "rms_height_m": float(figures[:, 0].mean()),
        "rms_slope": float(figures[:, 1].mean()),
        "skewness": float(figures[:, 2].mean()),
        "measured": result.measured,
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
        "rubber": result.rubber.name,
        "modulus_Pa": result.rubber.modulus,
        "a_T": result.rubber.stretched,
        "ages_s": [*case.rising_ages],
        "definition": case.definition,
        "realisations": len(result.statistics),
        "warnings": warnings(result, fit),
    }


def warnings(result: Survey, fit: SpectrumFit | None) -> list[str]:
    """Warnings on the use of the table; fit: of the surface's spectrum."""
    surface = result.surface
    found = [f"{result.case.surface.name}: {note}" for note in surface.notes]
    found += wave_doubts(fit, result.cut_off, surface.size)
    found += slope_doubts(max(each.rms_slope for each in result.statistics))
    full = np.array(result.case.pressures)[result.mean.k > NEARLY_FULL]
    if full.size:
        found.append(
            f"k is above {NEARLY_FULL:g} from {full[0] / BAR:.3g} bar on: what is left open there "
            "depends on waves that are cut off"
        )
    return found
