"""What k, D and H_V of a rough surface depend on: the cut-off, the definition, chance, the map.

Prints the tables of docs/explanation/roughness.md: errors against closed forms; parameters and mean
mu over the shortest wave that is kept; both definitions over pixels; the spread between
realisations; and what tilt, wrapping and missing heights would do.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from iceslide_fem.film import point
from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate, read_spec
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.preprocess.roughness.parameters import (
    Parameters,
    corrected_share,
    squeeze_diameter,
)
from iceslide_fem.preprocess.roughness.surface import Surface, levelled, low_passed, statistics
from iceslide_fem.preprocess.roughness.survey import parameters
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import BAR, YOUNGS_MODULUS
from scripts.studies.common import ROOT, options

COMPOUND_B = ROOT / "cases" / "surfaces" / "compound_B.toml"
MODULUS = YOUNGS_MODULUS["B"] / 0.75
PRESSURES = np.array([1.0, 5.0]) * BAR


def table(heading: str, columns: str, rows: list[str]) -> None:
    """Print a Markdown table."""
    print(f"\n{heading}\n\n| {columns} |\n|{'---|' * (columns.count('|') + 1)}")
    for row in rows:
        print(f"| {row} |", flush=True)


def westergaard(share: float) -> tuple[float, float]:
    """Errors of k (absolute) and of the mean gap (relative) for a wave in one direction."""
    n, wave, height = 512, 1e-3, 5e-6
    x = (np.arange(n) + 0.5) / n
    pressure = share * pi * MODULUS * height / wave
    heights = np.tile(height * np.cos(2 * pi * x), (4, 1))
    (contact,) = press(heights, wave / n, MODULUS, [pressure])
    end, s = np.sqrt(share), np.abs(np.sin(pi * (np.arange(100_000) + 0.5) / 100_000))
    outside = s[s > end]
    root = np.sqrt(outside**2 - end**2)
    gap = 2.0 * height * (outside * root - end**2 * np.log((outside + root) / end)).sum() / s.size
    share_error = (contact.pressure > 0).mean() - 2.0 / pi * np.arcsin(end)
    return float(share_error), float(contact.gap.mean() / gap - 1.0)


def hertz(radius_in_pixels: float) -> tuple[float, float]:
    """Relative errors of a sphere's contact radius, without and with the correction of its rim."""
    n, pixel, radius = int(8 * radius_in_pixels), 1e-6, 1e-3
    y, x = (np.indices((n, n)) - 0.5 * (n - 1)) * pixel
    a = radius_in_pixels * pixel
    force = 4.0 * MODULUS * a**3 / (3.0 * radius)
    heights = -(x**2 + y**2) / (2.0 * radius)
    (contact,) = press(heights, pixel, MODULUS, [force / (n * pixel) ** 2])
    mask = contact.pressure > 0
    raw, corrected = (np.sqrt(share * n**2 / pi) for share in (mask.mean(), corrected_share(mask)))
    return raw / radius_in_pixels - 1.0, corrected / radius_in_pixels - 1.0


def disc(radius: float) -> float:
    """Largest relative error of D of discs at 20 places, against discs of the same area."""
    errors = []
    for dx, dy in np.random.default_rng(1).random((20, 2)):
        n = int(2 * radius + 8)
        y, x = np.indices((n, n)) - 0.5 * (n - 1)
        inside = (x - dx) ** 2 + (y - dy) ** 2 < radius**2
        errors.append(squeeze_diameter(inside) / (2.0 * np.sqrt(inside.sum() / pi)) - 1.0)
    return float(np.abs(errors).max())


def kappa(hurst: float, pixels: int) -> list[float]:
    """k E* g / p at light loads; g: rms slope."""
    spec = SurfaceSpec(
        rms_slope=0.3, hurst=hurst, rolloff=0.25e-3, shortest_wave=16e-3 / pixels,
        size=1e-3, pixels=pixels,
    )  # fmt: skip
    surface = generate(spec)
    reduced = np.array([0.005, 0.01, 0.02, 0.05])
    found = parameters(surface, MODULUS, reduced * MODULUS * 0.3)
    return list(found.k / reduced)


def closed_forms(quick: bool) -> None:
    """Errors of the solver."""
    rows = [
        f"wave in one direction, p/p* = {share} | k {errors[0]:+.4f}, mean gap {errors[1]:+.2%}"
        for share in (0.05, 0.3, 0.8)
        for errors in [westergaard(share)]
    ]
    for radius in (12,) if quick else (12, 25, 51):
        raw, corrected = hertz(radius)
        rows.append(
            f"sphere, radius of contact {radius} pixels | {raw:+.2%}, with its rim {corrected:+.2%}"
        )
    rows += [f"D of discs, radius {radius} pixels | up to {disc(radius):.2%}" for radius in (8, 30)]
    for hurst in (0.2, 0.8):
        values = kappa(hurst, 128 if quick else 512)
        rows.append(
            f"k E* slope / p at p/(E* slope) = 0.005, 0.01, 0.02, 0.05, Hurst {hurst} | "
            + ", ".join(f"{value:.2f}" for value in values)
        )
    table("Against closed forms", "what | error, or value", rows)


def mean_friction(found: Parameters[Array], speed: float = 3.0) -> tuple[Array, Array]:
    """Mean and peak mu over 7 ms at both pressures, -4 degC, by the point level."""
    result = point.simulate(
        point.Conditions.of(
            pressure=PRESSURES, speed=speed, temperature=269.15, k=found.k, D=found.D,
            H_V=found.H_V, initial_height=70e-9, duration=7e-3,
        )
    )  # fmt: skip
    return result.mu_mean, result.mu_peak


def row_of(name: str, found: Parameters[Array]) -> str:
    """k, D, H_V, k/D and friction at 1 and 5 bar."""
    mean, peak = mean_friction(found)
    cells = [name]
    for values, form in (
        (found.k, "{:.3f}"),
        (1e6 * found.D, "{:.1f}"),
        (1e6 * found.H_V, "{:.2f}"),
        (1e-3 * found.k / found.D, "{:.1f}"),
        (mean, "{:.3f}"),
        (peak, "{:.3f}"),
    ):
        cells.append(", ".join(form.format(value) for value in values))
    return " | ".join(cells)


PAIRS = "k | D, um | H_V, um | k/D, 1/mm | mean mu | peak mu"


def cut_offs(quick: bool) -> None:
    """The same surface, continued to short waves by its own power law, with less and less of it."""
    base = read_spec(COMPOUND_B)
    finest, size, pixels = (8e-6, 0.25e-3, 128) if quick else (4e-6, 0.4e-3, 400)
    long = base.model_copy(
        update={"size": size, "pixels": pixels, "rolloff": min(base.rolloff, size)}
    )
    spec = long.model_copy(update={"shortest_wave": finest})
    rows = []
    surfaces = [generate(spec, number) for number in range(1 if quick else 2)]
    # As much of the waves that compound B has as in its own surface.
    own = np.mean([statistics(low_passed(s, base.shortest_wave)).rms_height for s in surfaces])
    wanted = statistics(generate(long.model_copy(update={"pixels": pixels}))).rms_height
    for wave in (35e-6, 16e-6, 11.6e-6, 8e-6, 4e-6):
        if wave < finest:
            break
        each = []
        for surface in surfaces:
            scaled = Surface(surface.heights * wanted / own, surface.pixel, True)
            cut = low_passed(scaled, wave)
            each.append(np.array(parameters(cut, MODULUS, PRESSURES)))
        slope = statistics(cut).rms_slope
        found = Parameters(*np.mean(each, axis=0))
        rows.append(row_of(f"{1e6 * wave:g} | {slope:.2f}", found))
    table(
        "One surface, ever shorter waves kept (1 bar, 5 bar)",
        f"shortest wave, um | rms slope | {PAIRS}",
        rows,
    )


def definitions(quick: bool) -> None:
    """Both definitions on the same surface over pixels per shortest wave."""
    base = read_spec(COMPOUND_B)
    rows = []
    for per_wave in (2, 4) if quick else (2, 4, 8):
        pixels = round(per_wave * base.size / base.shortest_wave)
        pixels = max(pixels, int(np.ceil(2 * base.size / base.shortest_wave)))
        surface = generate(base.model_copy(update={"pixels": pixels}))
        for definition in ("hydrodynamic", "thesis"):
            found = parameters(surface, MODULUS, PRESSURES, definition)
            rows.append(row_of(f"{per_wave} | {definition}", found))
    table(
        "Both definitions, one realisation of compound B's surface (1 bar, 5 bar)",
        f"pixels per wave | definition | {PAIRS}",
        rows,
    )


def spread(quick: bool) -> None:
    """Standard deviations between realisations over the size of the map."""
    base = read_spec(COMPOUND_B)
    rows = []
    for share in (0.5, 1.0):
        spec = base.model_copy(
            update={
                "size": share * base.size,
                "pixels": round(share * base.pixels),
            }
        )
        each = np.array(
            [
                np.array(parameters(generate(spec, number), MODULUS, PRESSURES)[:3])
                for number in range(2 if quick else 8)
            ]
        )
        deviation = each.std(axis=0, ddof=1) / each.mean(axis=0)
        cells = [", ".join(f"{value:.1%}" for value in row) for row in deviation]
        rows.append(f"{1e3 * spec.size:.3g} | " + " | ".join(cells))
    table(
        "Standard deviation between realisations (1 bar, 5 bar)",
        "side of the map, mm | k | D | H_V",
        rows,
    )


def maps(quick: bool) -> None:
    """What a measured map suffers if it is not levelled, mirrored or filled."""
    base = read_spec(COMPOUND_B)
    whole = generate(base.model_copy(update={"size": 2 * base.size, "pixels": 2 * base.pixels}))
    n = base.pixels // (2 if quick else 1)
    part, pixel = whole.heights[:n, :n], whole.pixel
    tilt = np.tan(np.radians(1.1)) * pixel * np.arange(n)
    waves = np.linspace(0.0, 1.0, n)
    holes = np.where(np.random.default_rng(1).random((n, n)) < 0.09, np.nan, part)
    bow = 2e-6 * np.cos(pi * waves)
    changes: list[tuple[str, Callable[[], Surface]]] = [
        ("levelled and mirrored, as the program does", lambda: levelled(_map(part, pixel))),
        ("1.1 degrees of tilt added, levelled", lambda: levelled(_map(part + tilt, pixel))),
        ("1.1 degrees of tilt left in, wrapped", lambda: Surface(part + tilt, pixel, True)),
        ("wrapped without being mirrored", lambda: Surface(part, pixel, True)),
        ("half a wave of 2 um added, mirrored", lambda: levelled(_map(part + bow, pixel))),
        ("half a wave of 2 um added, wrapped", lambda: Surface(part + bow, pixel, True)),
        ("9 % of the heights missing, filled", lambda: levelled(_map(holes, pixel))),
    ]
    rows = []
    for name, surface in changes:
        found = parameters(surface(), MODULUS, PRESSURES)
        k, D, H = (
            ", ".join(form.format(value) for value in values)
            for form, values in (
                ("{:.3f}", found.k),
                ("{:.1f}", 1e6 * found.D),
                ("{:.2f}", 1e6 * found.H_V),
            )
        )
        rows.append(f"{name} | {k} | {D} | {H}")
    table("A map that is not periodic (1 bar, 5 bar)", "map | k | D, um | H_V, um", rows)


def _map(heights: Array, pixel: float) -> Surface:
    return Surface(heights, pixel, periodic=False)


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="small maps, few realisations")
    quick = parser.parse_args().quick
    for part in (cut_offs, definitions, spread, maps, closed_forms):
        part(quick)


if __name__ == "__main__":
    main()
