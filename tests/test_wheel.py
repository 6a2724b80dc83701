"""A wheel on ice: the brush against its closed forms, films under it, any law, slip angles."""

from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.laws.table import law_of
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.brush import Pattern, Rolling
from iceslide_fem.preprocess.wheel.contact import Onset
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.law_contact import LawContact
from iceslide_fem.preprocess.wheel.tread import Tread
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.contact_table import read_contact_table

pytestmark = pytest.mark.quick

FILE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
SURFACE = read_contact_table(FILE, "the surface")
V = 20.0 / 3.6  # m/s
COLD, STIFF, RIGID = 269.15, 68.25e6, 1e13  # K, Pa/m: B at 8 mm; no bristle is stretched


def coulomb(mu, speeds=None):
    """Contact with Coulomb's friction, a number or one at rest and one that slides."""
    given = mu if speeds is None else [list(pair) for pair in zip(speeds, mu, strict=True)]
    tables = {
        "name": "a", "model": "slice", "rubber": {"compound": "B"},
        "load": {"pressure": 1e5, "speed": 1.0, "duration": 1e-3},
        "friction": {"law": "coulomb", ("mu" if speeds is None else "table"): given},
    }  # fmt: skip
    return LawContact(law_of(scene_from_dict(tables)), COLD)


class Two:
    """Coulomb's friction with another coefficient at rest."""

    passes = 1

    def __init__(self, static, sliding):
        self._static, self._sliding = coulomb(static), coulomb(sliding)

    def onset(self, *args):
        begins, rests = (each.onset(*args) for each in (self._sliding, self._static))
        return Onset(begins.begins, rests.rests)

    def slid(self, *args):
        return self._sliding.slid(*args)

    def after(self, slid):
        return self


def parabola(cells, half=60e-3, force=3e3, width=0.1):
    """Mean pressures of cells of a patch 2 `half` long that carries `force`."""
    dx = 2.0 * half / cells
    x = half - (np.arange(cells) + 0.5) * dx
    line = 0.75 * force / half * (1.0 - (x**2 + dx**2 / 12.0) / half**2)
    return PressureMap(line[None] / width, dx, width)


def slick(pressure=2e5, length=0.12, cells=240):
    return PressureMap(np.full((1, cells), pressure), length / cells, 0.1)


def film(tolerance=1e-3, **ride):
    return FilmContact(Ride(V, V, COLD, **ride), SURFACE, tolerance)


def mus(footprint, slips, contact, stiffness=STIFF, speed=V, **more):
    rolls = [Rolling(speed, slip) for slip in slips]
    return [point.mu for point in friction(footprint, rolls, Tread(stiffness, **more), contact)]


@pytest.mark.parametrize(
    ("contact", "slips", "exact"),
    [
        (
            coulomb(0.2),
            [0.005, 0.01, 0.02, 0.03, 0.035],
            [0.071536, 0.124023, 0.182629, 0.199246, 0.2],
        ),
        (Two(0.25, 0.2), [0.005, 0.01, 0.02, 0.03], [0.071934, 0.125412, 0.186482, 0.203835]),
    ],
    ids=["one coefficient", "two"],
)
def test_a_parabolic_patch_is_the_closed_form(contact, slips, exact):
    assert mus(parabola(2000), slips, contact) == pytest.approx(exact, abs=1e-6)


def test_the_peak_and_full_sliding_of_two_coefficients():
    slips = np.linspace(0.0310, 0.0323, 14)
    found = mus(parabola(2000), slips, Two(0.25, 0.2))
    assert max(found) == pytest.approx(0.204082, abs=2e-6)
    assert slips[int(np.argmax(found))] == pytest.approx(0.03167, abs=1e-4)
    (before, after) = friction(
        parabola(2000), [Rolling(V, s) for s in (0.0437, 0.0439)], Tread(STIFF), Two(0.25, 0.2)
    )
    assert before.sliding < 0.999 and after.sliding == pytest.approx(1.0, abs=1e-4)


def test_a_uniform_patch_is_the_closed_form():
    slips = [0.002, 0.005, 0.01, 0.02, 0.1]
    exact = [0.164128, 0.411558, 0.697802, 0.850427, 0.972527]
    assert [_uniform(slip, 0.2) for slip in slips] == pytest.approx(exact, abs=1e-6)
    found = mus(slick(2.5e5, cells=2000), slips, coulomb(0.2))
    assert np.array(found) / 0.2 == pytest.approx(exact, abs=1e-6)


def _uniform(slip, mu, pressure=2.5e5, length=0.12):
    """F / (mu F_z): bristles stick until c sigma xi = mu p."""
    way = mu * pressure / (STIFF * slip / (1.0 - slip)) / length
    return 0.5 / way if way > 1.0 else 1.0 - 0.5 * way


def test_the_slope_at_rest_is_that_of_the_bristles():
    footprint, slip = slick(2.5e5), 1e-6
    (mu,) = mus(footprint, [slip], coulomb(0.2))
    due = 0.5 * STIFF * 0.12 / 2.5e5  # c L^2 / 2 over p L
    assert mu / slip == pytest.approx(due, rel=1e-5)


def test_a_film_slides_with_the_wheels_speed():
    found = mus(slick(), [0.01, 0.05, 0.2, 0.3, 0.5, 1.0], film(), RIGID)
    exact = [0.0139, 0.0694, 0.2367, 0.1919, 0.1594, 0.0872]
    assert found == pytest.approx(exact, rel=5e-3)
    # Bristles as soft as a tread's stick on the first fraction of a millimetre.
    assert mus(slick(), [0.2], film()) == pytest.approx([0.2367], rel=5e-3)


def test_a_locked_wheel_is_the_footprint():
    rows = np.random.default_rng(1).uniform(0.0, 3e5, (6, 60))
    footprint = PressureMap(np.where(rows > 1e5, rows, 0.0), 2e-3, 2e-3)
    (mu,) = mus(footprint, [1.0], film())
    films = film_map(footprint, Ride(V, V, COLD), SURFACE, 1e-3)
    assert mu == pytest.approx(films.mean_friction(footprint), rel=1e-9)


def test_the_film_as_one_of_the_laws_of_the_protocol():
    tables = {
        "name": "a", "model": "slice", "rubber": {"compound": "B"},
        "load": {"pressure": 2e5, "speed": 1.0, "duration": 1e-3},
        "film": {"contact": str(FILE)},
    }  # fmt: skip
    law = LawContact(law_of(scene_from_dict(tables)), COLD, tolerance=1e-3)
    slips = [0.05, 0.2, 1.0]
    by_law, own = (mus(slick(cells=120), slips, one) for one in (law, film()))
    assert by_law == pytest.approx(own, rel=3e-3)


@pytest.mark.parametrize("contact", [coulomb(0.2), film()], ids=["coulomb", "film"])
def test_driving_is_braking_the_other_way_round(contact):
    braked, driven = mus(slick(), [0.2, -0.2], contact)
    assert driven < 0.0
    assert abs(driven) == pytest.approx(braked, rel=2e-2)  # bristles pass faster when driven
    assert mus(slick(), [0.0], contact) == [0.0]


def test_a_slip_angle_turns_the_force_and_trails():
    contact, alpha = coulomb(0.2), np.radians(2.0)
    left, right = (
        friction(slick(2.5e5), [Rolling(V, 0.0, sign * alpha)], Tread(STIFF), contact)[0]
        for sign in (1.0, -1.0)
    )
    assert left.mu_across == pytest.approx(-right.mu_across) and left.mu_across > 0.0
    assert left.mu == pytest.approx(0.0, abs=1e-12)
    # As of braking with the stretch tan(alpha).
    slip = np.tan(alpha) / (1.0 + np.tan(alpha))
    assert left.mu_across == pytest.approx(mus(slick(2.5e5), [slip], contact)[0], rel=1e-6)
    assert left.trail == right.trail and 0.0 < left.trail < 0.02
    small = friction(slick(2.5e5), [Rolling(V, 0.0, 1e-6)], Tread(STIFF), contact)[0]
    assert small.trail == pytest.approx(0.12 / 6.0, rel=1e-2)  # of a triangle of stress


def test_both_slips_together_stay_in_the_circle_of_friction():
    points = friction(
        slick(2.5e5),
        [Rolling(V, S, 0.1) for S in (0.0, 0.05, 0.2, 1.0)],
        Tread(STIFF),
        coulomb(0.2),
    )
    size = [np.hypot(point.mu, point.mu_across) for point in points]
    assert max(size) <= 0.2 + 1e-9 and (np.diff([point.mu for point in points]) > 0.0).all()


def test_blocks_carry_the_load_and_cool_between():
    """A tread without grooves is smooth; under Coulomb's friction a pattern changes nothing."""
    thin = mus(slick(), [0.3], film(), pattern=Pattern(28e-3, 1e-5))
    assert thin == pytest.approx(mus(slick(), [0.3], film()), rel=1e-2)
    full = mus(slick(cells=60), [0.5], coulomb(0.2), RIGID, pattern=Pattern(28e-3, 8e-3))
    assert full == pytest.approx([0.2], rel=1e-6)


def test_finer_cells_change_little():
    coarse, fine = (np.array(mus(slick(cells=n), [0.05, 0.2, 0.5, 1.0], film())) for n in (60, 480))
    assert coarse == pytest.approx(fine, rel=1e-2)
