"""Preparation of surfaces: read or generate, level, filter short waves, and coarsen."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from iceslide_fem.preprocess.roughness.case import PIXELS_PER_WAVE, SOURCE_WAVE, RoughnessCase
from iceslide_fem.preprocess.roughness.generate import generate, read_spec
from iceslide_fem.preprocess.roughness.parameters import Definition
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.launch import memory_of_machine
from iceslide_fem.surfaces.read import read_surface
from iceslide_fem.surfaces.surface import (
    Surface,
    coarsened,
    levelled,
    low_passed,
    statistics,
)

PIXEL_ROUNDING = 1e-3  # of a pixel's side: rounding in files with few digits
# Coarser pixels change k and D noticeably.
THINNED_TO = 10.0  # pixels per shortest wave of a coarsened map
THINNED_AT_LEAST = 256  # least pixels along the longer side; takes a second or two
PROGRAM, PER_PIXEL = 0.2e9, 200.0  # bytes, measured by scripts.studies.rough_surfaces
PER_ARM = 32.0  # additional bytes per pixel: a map per arm, and three during a step


def prepared(
    case: RoughnessCase, arms: int = 0
) -> tuple[Iterator[Surface], float | None, dict[str, Any] | None]:
    """Filtered surfaces, the cut-off (m), and figures of a measured map.

    The figures are those of the levelled map with all its waves. A filtered map is coarsened if its
    shortest wave allows it, except under the source's definition, which counts pixels. arms: number
    of arms of viscoelastic rubber. Raises SceneError if the surface cannot be read or resolved, or
    if memory does not suffice.
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
        _check_memory(spec.pixels**2, arms)
        every = (generate(spec, number) for number in range(case.realisations))
        if wave is None:
            return every, spec.shortest_wave, None
        return (low_passed(surface, wave) for surface in every), wave, None

    surface = levelled(read_surface(case.surface, case.pixel, case.height_unit))
    measured = statistics(surface)._asdict()
    measured |= {"pixel_m": surface.pixel, "pixels": list(surface.heights.shape[::-1])}
    if wave is None and case.definition == "hydrodynamic":
        wave = SOURCE_WAVE
    if wave is None:
        _check_memory(surface.heights.size, arms)
        return iter([surface]), None, measured
    _check_resolution(case.definition, wave, surface.resolution, min(surface.size))
    if case.definition == "hydrodynamic":
        surface = coarsened(surface, thinned_pixel(surface, wave))
    _check_memory(surface.heights.size, arms)
    return iter([low_passed(surface, wave)]), wave, measured


def thinned_pixel(surface: Surface, wave: float) -> float:
    """The pixel (m) that resolves a shortest `wave` (m); finer on small maps with few patches."""
    return min(wave / THINNED_TO, max(surface.size) / THINNED_AT_LEAST)


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


def _check_memory(pixels: int, arms: int) -> None:
    """Raise SceneError if the memory of this machine is too small for this many pixels."""
    per_pixel = PER_PIXEL + (PER_ARM * (arms + 1) if arms else 0.0)
    needed, present = PROGRAM + per_pixel * pixels, memory_of_machine()
    if needed > present:
        raise SceneError(
            f"{pixels / 1e6:.3g} million pixels take about {needed / 1e9:.3g} GB of memory, and "
            f"there are {present / 1e9:.3g} GB: a longer --shortest-wave takes fewer pixels of a "
            f"map, {THINNED_TO:g} to that wave"
        )
