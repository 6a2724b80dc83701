"""Contact of rough rubber: against closed forms, and what is done to surfaces on the way."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.sparse import csr_array, diags
from scipy.sparse.linalg import spsolve

from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.preprocess.roughness.parameters import (
    corrected_share,
    measure,
    median_run,
    squeeze_diameter,
)
from iceslide_fem.preprocess.roughness.survey import parameters, wave_doubts
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.surfaces.surface import (
    Surface,
    coarsened,
    levelled,
    low_passed,
    spectrum,
    spectrum_fit,
    statistics,
)

pytestmark = pytest.mark.quick

MODULUS = 2.2e6  # E*, Pa
SPEC = {
    "rms_height": 5.8e-6,
    "hurst": 0.2,
    "rolloff": 175e-6,
    "shortest_wave": 35e-6,
    "skewness": -1.2,
    "size": 1e-3,
    "pixels": 128,
}


def rough(**changes):
    return generate(SurfaceSpec.model_validate(SPEC | changes))


def one(heights, pixel, pressure, tolerance=1e-8):
    (contact,) = press(heights, pixel, MODULUS, [pressure], tolerance)
    return contact


@pytest.mark.parametrize("share", [0.05, 0.3, 0.8, 0.98])
def test_a_wave_in_one_direction_is_westergaards(share):
    """Johnson, Contact Mechanics, (13.7) and (13.8), and the gap that continues the pressure."""
    n, wave, height = 512, 1e-3, 5e-6
    x = (np.arange(n) + 0.5) / n * wave
    pressure = share * pi * MODULUS * height / wave
    contact = one(np.tile(height * np.cos(2 * pi * x / wave), (4, 1)), wave / n, pressure)
    end = np.sqrt(share)
    exact = 2.0 / pi * np.arcsin(end)
    assert (contact.pressure > 0).mean() == pytest.approx(exact, abs=2.1 / n)
    s = np.abs(np.sin(pi * x / wave))
    inside = 2.0 * pi * MODULUS * height / wave * np.abs(np.cos(pi * x / wave))
    inside *= np.sqrt(np.maximum(end**2 - s**2, 0.0))
    assert contact.pressure[1] == pytest.approx(inside, abs=0.03 * inside.max())
    root = np.sqrt(np.maximum(s**2 - end**2, 0.0))
    gap = 2.0 * height * (s * root - end**2 * np.log((np.maximum(s, end) + root) / end))
    gap[s <= end] = 0.0
    assert contact.gap[2] == pytest.approx(gap, abs=2e-3 * height)
    assert contact.gap.mean() == pytest.approx(gap.mean(), rel=0.02, abs=1e-4 * height)


def test_a_wave_in_two_directions_at_both_limits():
    """Johnson, Greenwood and Higginson, Int. J. Mech. Sci. 27 (1985) 383-396."""
    n, wave, height = 256, 1e-3, 5e-6
    x = 2 * pi * (np.arange(n) + 0.5) / n
    heights = height * np.cos(x)[:, None] * np.cos(x)
    full = np.sqrt(2.0) * pi * MODULUS * height / wave
    light, heavy = 0.01, 0.97
    contacts = list(press(heights, wave / n, MODULUS, [light * full, heavy * full]))
    found = [corrected_share(contact.pressure > 0) for contact in contacts]
    assert found[0] == pytest.approx(pi * (3.0 / (8.0 * pi) * light) ** (2 / 3), rel=0.02)
    assert found[1] == pytest.approx(1.0 - 1.5 / pi * (1.0 - heavy), abs=2e-3)


def test_complete_contact_has_the_pressure_of_the_flattened_wave():
    n, wave, height = 64, 1e-3, 5e-6
    x = 2 * pi * np.arange(n) / n
    full = pi * MODULUS * height / wave
    contact = one(np.tile(height * np.cos(x), (n, 1)), wave / n, 1.1 * full)
    assert contact.gap.max() == 0.0 and contact.iterations < 10
    assert contact.pressure[0] == pytest.approx(full * (1.1 + np.cos(x)), rel=1e-6)
    flat = one(np.zeros((16, 16)), 1e-6, 1e5)
    assert flat.pressure == pytest.approx(1e5) and flat.gap.max() == 0.0


def test_a_sphere_is_hertzs():
    """a^3 = 3 F R / (4 E*), p0 = 3 F / (2 pi a^2); images of the periodic box are 8 radii away."""
    n, pixel, radius = 256, 1e-6, 2e-3
    y, x = (np.indices((n, n)) - 0.5 * (n - 1)) * pixel
    a = 32 * pixel
    force = 4.0 * MODULUS * a**3 / (3.0 * radius)
    contact = one(-(x**2 + y**2) / (2.0 * radius), pixel, force / (n * pixel) ** 2)
    assert contact.pressure.sum() * pixel**2 == pytest.approx(force, rel=1e-12)
    assert contact.pressure.max() == pytest.approx(1.5 * force / (pi * a**2), rel=5e-3)
    mask = contact.pressure > 0
    assert np.sqrt(corrected_share(mask) * n**2 / pi) == pytest.approx(32.0, rel=4e-3)


def test_a_load_that_rises_from_a_single_pixel():
    """Where one pixel touches its gap says nothing about what others take."""
    x = np.arange(64) * 2.0 * pi / 64
    heights = np.tile(1e-6 * np.cos(x), (64, 1))
    heights[10, 20] += 1e-5
    first, second = press(heights, 1e-6, MODULUS, [1e2, 5e4])
    assert np.count_nonzero(first.pressure) == 1
    assert second.pressure == pytest.approx(one(heights, 1e-6, 5e4).pressure, abs=1.0)


def test_the_share_that_touches_depends_on_pressure_over_modulus_alone():
    surface = rough()
    soft = list(press(surface.heights, surface.pixel, 1e6, [1e5]))[0]
    stiff = list(press(surface.heights, surface.pixel, 3e6, [3e5]))[0]
    assert stiff.pressure == pytest.approx(3.0 * soft.pressure, rel=1e-9, abs=1e-6 * 1e5)
    assert stiff.gap == pytest.approx(soft.gap, abs=1e-12)


def test_the_start_does_not_matter():
    surface = rough()
    cold = one(surface.heights, surface.pixel, 3e5)
    *_, warm = press(surface.heights, surface.pixel, MODULUS, [1e5, 8e5, 3e5], 1e-8)
    assert warm.pressure == pytest.approx(cold.pressure, abs=1e-4 * 3e5)
    assert warm.gap.mean() == pytest.approx(cold.gap.mean(), rel=1e-6)


def test_light_loads_touch_in_proportion():
    """k = kappa p / (E* rms slope), with kappa between Persson's 1.6 and Bush's 2.5."""
    surface = rough(hurst=0.8, skewness=0.0, pixels=300, shortest_wave=25e-6, rolloff=250e-6)
    slope = statistics(surface).rms_slope
    pressures = np.array([0.01, 0.02]) * MODULUS * slope
    k = parameters(surface, MODULUS, pressures).k
    kappa = k * MODULUS * slope / pressures
    assert ((2.0 < kappa) & (kappa < 2.4)).all()
    assert kappa[0] == pytest.approx(kappa[1], rel=0.05)


@pytest.mark.parametrize("radius", [8, 12, 20, 33])
def test_a_disc_has_its_own_diameter(radius):
    errors = []
    for dx, dy in np.random.default_rng(radius).random((10, 2)):
        y, x = np.indices((2 * radius + 8, 2 * radius + 8)) - radius - 3.5
        disc = (x - dx) ** 2 + (y - dy) ** 2 < radius**2
        same_area = 2.0 * np.sqrt(disc.sum() / pi)
        errors.append(squeeze_diameter(disc) / same_area - 1.0)
    assert max(map(abs, errors)) < 5e-3


def test_long_strips_squeeze_as_reynolds_says():
    """<phi> of a strip of width w is w^2/12: D = w sqrt(8/3)."""
    for width in (8, 16, 32):
        mask = np.zeros((8, 64), dtype=bool)
        mask[:, :width] = True
        diameter = squeeze_diameter(mask)
        assert diameter == pytest.approx(width * np.sqrt(8.0 / 3.0), rel=0.3 / width)


def smooth_patches(share, shape, seed=3):
    """A mask of patches and holes of some pixels, of which `share` is patches."""
    field = gaussian_filter(np.random.default_rng(seed).normal(size=shape), 1.5, mode="wrap")
    return field < np.quantile(field, share)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("periodic", [True, False])
def test_the_diameter_is_that_of_a_direct_solution(share, periodic):
    mask = smooth_patches(share, (96, 120))
    number = np.where(mask, np.cumsum(mask).reshape(mask.shape) - 1, -1)
    wide = np.pad(number, 1, mode="wrap" if periodic else "symmetric")
    here, diagonal, links = number[mask], np.zeros(mask.sum()), []
    for rows, columns in ((0, 1), (2, 1), (1, 0), (1, 2)):
        other = wide[rows : rows + mask.shape[0], columns : columns + mask.shape[1]][mask]
        diagonal += np.where(other >= 0, 1.0, 1.0 / 0.58)
        links.append((here[other >= 0], other[other >= 0]))
    i, j = np.concatenate(links, axis=1)
    laplacian = diags(diagonal) - csr_array((np.ones(i.size), (i, j)), shape=2 * [here.size])
    mean = spsolve(laplacian.tocsc(), np.ones(here.size)).mean()
    exact = np.sqrt(32.0 * (mean - 1.0 / 6.0))
    assert squeeze_diameter(mask, periodic) == pytest.approx(exact, rel=2e-5)


def test_mirror_images_make_patches_whole():
    y, x = np.indices((30, 40))
    quarter = (x + 0.5) ** 2 + (y + 0.5) ** 2 < 20.0**2
    whole = np.block([[quarter[::-1, ::-1], quarter[::-1]], [quarter[:, ::-1], quarter]])
    assert squeeze_diameter(quarter, False) == pytest.approx(squeeze_diameter(whole), rel=1e-5)
    assert corrected_share(quarter, False) == pytest.approx(corrected_share(whole))
    assert median_run(quarter, False) == median_run(whole)


def test_diameters_at_the_ends():
    full = np.ones((20, 30), dtype=bool)
    assert squeeze_diameter(full) == 30.0  # no way out of this map
    assert squeeze_diameter(full, periodic=False) == 60.0
    dot = np.zeros((20, 20), dtype=bool)
    dot[3, 4] = True
    assert squeeze_diameter(dot) == pytest.approx(2.0 / np.sqrt(pi))  # a pixel's area


def test_runs_go_on_across_the_edge():
    mask = np.zeros((4, 6), dtype=bool)
    mask[0, [0, 1, 5]] = True  # one run of 3 along x; along y runs of 1
    assert median_run(mask) == 1.0
    mask[1] = True  # a closed ring of 6; along y 2, 2, 1, 1, 1, 2
    assert median_run(mask) == np.median([3, 6, 2, 2, 1, 1, 1, 2])
    assert median_run(np.zeros((3, 3), dtype=bool)) == 0.0


def test_definitions_of_the_source():
    surface = rough()
    contact = one(surface.heights, surface.pixel, 1e5)
    thesis = measure(contact, surface.pixel, "thesis")
    ours = measure(contact, surface.pixel, "hydrodynamic")
    assert thesis.k == 0.75 * thesis.k_raw and thesis.D == thesis.D_median
    outside = contact.pressure == 0.0
    by_5_31 = (1.0 - thesis.k_raw) * contact.gap[outside].mean()
    assert thesis.H_V == pytest.approx(by_5_31) == pytest.approx(ours.H_V)
    assert thesis.k < ours.k < ours.k_raw == thesis.k_raw
    assert 0.0 < ours.open_area_below_h0 < 0.1


@pytest.mark.parametrize("changes", [{}, {"skewness": 0.8, "hurst": 0.8}, {"pixels": 125}])
def test_generated_surfaces_are_as_ordered(changes):
    surface = rough(**changes)
    found = statistics(surface)
    assert found.rms_height == pytest.approx(5.8e-6, rel=1e-9)
    assert found.rms_height == pytest.approx(surface.heights.std(), rel=1e-9)
    assert found.skewness == pytest.approx(changes.get("skewness", -1.2), abs=0.021)
    dx = np.roll(surface.heights, -1, 1) - np.roll(surface.heights, 1, 1)
    dy = np.roll(surface.heights, -1, 0) - np.roll(surface.heights, 1, 0)
    differences = np.sqrt(np.mean(dx**2 + dy**2)) / (2.0 * surface.pixel)
    assert 0.8 < differences / found.rms_slope < 1.0  # differences smooth
    ring = spectrum(surface)
    assert (ring.density[ring.q > 2 * pi / 34e-6] < 1e-9 * ring.density.max()).all()
    fit = spectrum_fit(ring, 35e-6)
    assert fit is not None
    assert fit.hurst == pytest.approx(changes.get("hurst", 0.2), abs=0.03)
    assert fit.rolloff == pytest.approx(175e-6, rel=0.05)
    total = (ring.q * ring.density).sum() * (ring.q[1] - ring.q[0]) / (2 * pi)
    assert total == pytest.approx(found.rms_height**2, rel=0.1)


def test_generated_slopes_and_seeds():
    spec = {key: value for key, value in SPEC.items() if key != "rms_height"}
    surface = generate(SurfaceSpec.model_validate(spec | {"rms_slope": 0.3}))
    assert statistics(surface).rms_slope == pytest.approx(0.3, rel=1e-9)
    again, other = (
        generate(SurfaceSpec.model_validate(SPEC | {"seed": seed}), number)
        for seed, number in ((3, 1), (4, 0))
    )
    assert np.array_equal(again.heights, other.heights)
    assert np.corrcoef(rough().heights.ravel(), other.heights.ravel())[0, 1] < 0.2


def test_the_same_map_shifted_or_turned():
    surface = rough()
    pressures = np.array([1e5, 5e5])
    first = parameters(surface, MODULUS, pressures)
    for heights in (np.roll(surface.heights, (17, 40), (0, 1)), np.rot90(surface.heights)):
        moved = parameters(Surface(heights, surface.pixel, True), MODULUS, pressures)
        for one_value, other in zip(first, moved, strict=True):
            assert other == pytest.approx(one_value, rel=1e-5)


def tilted(surface, degrees):
    slope = np.tan(np.radians(degrees))
    return surface.heights + slope * surface.pixel * np.arange(surface.heights.shape[1])


def free_height(surface, pressure=1e5):
    return float(parameters(surface, MODULUS, np.array([pressure])).H_V[0])


def test_tilt_is_removed():
    surface = rough(rms_height=3e-6)
    heights = tilted(surface, 1.1)
    level = free_height(levelled(Surface(surface.heights, surface.pixel, False)))
    removed = free_height(levelled(Surface(heights, surface.pixel, False)))
    left_in = free_height(Surface(heights, surface.pixel, True))
    assert removed == pytest.approx(level, rel=1e-6)
    assert left_in > 1.3 * level


def test_maps_that_are_not_periodic_are_mirrored():
    """Wrapped, the sides of a part that do not fit each other are a cliff that carries the load."""
    whole = rough(size=4e-3, pixels=256, shortest_wave=125e-6, rolloff=2e-3, hurst=0.8, skewness=0)
    part = levelled(Surface(whole.heights[:90, :100], whole.pixel, False))
    wrapped = replace(part, periodic=True)
    assert free_height(wrapped, 3e4) > 1.5 * free_height(part, 3e4)


@pytest.mark.parametrize("shape", [(90, 100), (61, 48)])
def test_a_mirrored_map_is_the_periodic_one_of_twice_its_sides(shape):
    heights = rough(rms_height=3e-6).heights[: shape[0], : shape[1]]
    part = low_passed(levelled(Surface(heights, 10e-6, False)), 50e-6)
    z = np.block(
        [[part.heights, part.heights[:, ::-1]], [part.heights[::-1], part.heights[::-1, ::-1]]]
    )
    whole = Surface(z, 10e-6, True)
    assert low_passed(whole, 50e-6).heights == pytest.approx(z, abs=1e-15)
    assert statistics(part) == pytest.approx(statistics(whole), rel=1e-9)
    rings, exact = spectrum(part), spectrum(whole)
    few = exact.q < 0.9 * pi / 10e-6
    assert rings.q[: few.sum()] == pytest.approx(exact.q[few], rel=1e-9)
    assert rings.density[: few.sum()] == pytest.approx(exact.density[few], rel=1e-6, abs=1e-40)
    pressures = np.array([0.5e5, 3e5])
    for ours, theirs in zip(
        parameters(part, MODULUS, pressures), parameters(whole, MODULUS, pressures), strict=True
    ):
        assert ours == pytest.approx(theirs, rel=2e-5)


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("shape", [(120, 160), (240, 240), (81, 135)])
def test_coarser_pixels_keep_the_waves_that_they_can_show(shape, periodic):
    def waves(rows, columns):
        y, x = (np.arange(n) / n if periodic else (np.arange(n) + 0.5) / n for n in (rows, columns))
        y, x = (2 if periodic else 1) * pi * y[:, None], (2 if periodic else 1) * pi * x
        phase = 0.3 if periodic else 0.0
        return 2e-6 * np.cos(3 * x + phase) * np.cos(5 * y) + 1e-6 * np.cos(4 * y - phase) + 1e-7

    fine = Surface(waves(*shape), 2e-6, periodic)
    coarse = coarsened(fine, 2e-6 * min(shape) / 33)
    rows, columns = coarse.heights.shape
    assert rows / columns == shape[0] / shape[1] and min(rows, columns) < 50
    assert coarse.size == pytest.approx(fine.size) and coarse.periodic is periodic
    assert coarse.heights == pytest.approx(waves(rows, columns), abs=1e-15)
    assert statistics(coarse)[:2] == pytest.approx(statistics(fine)[:2], rel=1e-9)
    assert coarsened(coarse, fine.pixel) is coarse


def test_sides_without_a_common_divisor_change_by_a_thousandth_at_most():
    fine = Surface(np.random.default_rng(1).normal(size=(509, 401)), 1e-6, False)
    coarse = coarsened(fine, 4e-6)
    assert coarse.size == pytest.approx(fine.size, rel=1.1e-3)
    assert 0.6 * 4e-6 < coarse.pixel <= 4e-6 * 1.001


def test_missing_heights_are_filled_up_to_a_tenth():
    surface = rough()
    random = np.random.default_rng(1)
    holes = surface.heights.copy()
    holes[random.random(holes.shape) < 0.09] = np.nan
    full = free_height(levelled(Surface(surface.heights, surface.pixel, False)))
    filled = free_height(levelled(Surface(holes, surface.pixel, False)))
    assert filled == pytest.approx(full, rel=0.03)
    holes[:20] = np.nan
    with pytest.raises(SceneError, match=r"2\d.\d% of the map's heights are missing; allowed: up"):
        levelled(Surface(holes, surface.pixel, False))
    corner = surface.heights.copy()
    corner[:25, :25] = np.nan  # in one piece, at the edge
    assert np.isfinite(levelled(Surface(corner, surface.pixel, False)).heights).all()


def test_short_waves_are_removed():
    surface = rough()
    smooth = low_passed(surface, 70e-6)
    ring = spectrum(smooth)
    assert (ring.density[ring.q > 2 * pi / 69e-6] < 1e-9 * ring.density.max()).all()
    assert statistics(smooth).rms_slope < 0.75 * statistics(surface).rms_slope
    assert low_passed(surface, 35e-6).heights == pytest.approx(surface.heights, abs=1e-15)


def test_maps_too_short_or_too_coarse_for_their_roll_off_are_said():
    """Half of a roll-off long, H_V is a third too small; without its shorter waves k is double."""
    spec = SurfaceSpec(rms_height=5e-6, hurst=0.8, rolloff=1e-4, shortest_wave=1.6e-5, size=8e-4,
                       pixels=256)  # fmt: skip
    whole = generate(spec)

    def doubts(surface, wave):
        return wave_doubts(spectrum_fit(spectrum(surface), wave), wave, surface.size)

    short = levelled(Surface(whole.heights[:16, :16], whole.pixel, periodic=False))
    coarse = low_passed(whole, 1e-4)
    assert doubts(whole, 1.6e-5) == []
    assert any("of the map's side, so longer waves are missing" in said
               for said in doubts(short, 1.6e-5))  # fmt: skip
    assert any("the shortest wave kept is" in said for said in doubts(coarse, 1e-4))
    true, small, smooth = (
        parameters(each, 4e6, np.array([1e5])) for each in (whole, short, coarse)
    )
    assert small.H_V[0] < 0.8 * true.H_V[0] and smooth.k[0] > 2.5 * true.k[0]
