"""Squeezed-out water that moves below the rubber: exact solutions, conservation, gaps, ranks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad_vec

pytest.importorskip("dolfinx")
from slides import slide  # noqa: E402
from test_passing import passing  # noqa: E402

from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.film.loads import squeeze_rate  # noqa: E402
from iceslide_fem.film.runge_kutta import INTEGRATORS  # noqa: E402
from iceslide_fem.interface.film_frame import ContactLoads, Travel  # noqa: E402
from iceslide_fem.interface.ice_columns import GridColumns  # noqa: E402
from iceslide_fem.interface.moving_water import moved, moved_by_a_cell  # noqa: E402
from iceslide_fem.interface.on_ice import OnIce  # noqa: E402
from iceslide_fem.interface.surface_grid import SurfaceGrid  # noqa: E402
from iceslide_fem.laws.film import FilmLaw  # noqa: E402
from iceslide_fem.mesh.ice import window_cell  # noqa: E402
from iceslide_fem.scene.contact_table import ConstantContact  # noqa: E402

pytestmark = pytest.mark.fe
LENGTH, SPEED, H0, P, D = 10e-3, 4.0, 70e-9, 2e5, 36e-6
K3 = squeeze_rate(P, D)


class EvenBlock:
    """Points of an even block that slides over films without friction, so that all is known."""

    def __init__(self, share, cells, H_V=1e-4, gap=None, trail=0.0, speed=SPEED):
        cell = LENGTH / cells
        x = -0.5 * LENGTH - trail + cell * np.arange(-4, cells + 5 + round(trail / cell))
        grid = SurfaceGrid([x], np.arange(x.size), MPI.COMM_SELF)
        friction = FilmLaw(ConstantContact(1e-9, D, H_V), None, 1.0)
        ice = GridColumns(grid, 269.15, 1e-2)
        self.frame = OnIce(friction, ice, H0, water_speed=share)
        n = 8 * cells
        points = ((np.arange(n) + 0.5) / n - 0.5) * LENGTH
        touching = np.ones(n, dtype=bool)
        if gap is not None:
            touching[(points > gap[0]) & (points < gap[1])] = False
        pressure, area = np.where(touching, P, 0.0), np.full(n, LENGTH / n)
        self.loads = ContactLoads(points[:, None], pressure, area, np.full(n, speed), 0.0)
        self.state = self.frame.start(H0, n)
        self.way = self.squeezed = self.lost = 0.0
        self.dt, self.speed = 0.5 * cell / speed, speed

    def slide(self, way):
        while self.way < way * (1.0 - 1e-9):
            drift = self.speed * self.dt
            loads = replace(self.loads, offset=self.loads.offset + drift)
            step = self.frame.advance(self.state, self.loads, loads, self.dt, INTEGRATORS["sdirk2"])
            rise = step.step.state.squeezed_height - self.state.squeezed_height
            self.squeezed += float(rise @ step.area)
            moved, scraped = self.frame.water_moved(step.step.state, self.loads, loads, self.way)
            self.way += drift
            shifted = self.frame.shift_window(moved, Travel(loads.offset, self.way))
            self.state, self.lost = shifted.state, self.lost + scraped.sum() + shifted.left
            self.loads = replace(loads, offset=shifted.offset)
        return self

    def heights(self):
        """Places behind the leading edge of the nodes below the rubber, and H_s there."""
        below = self.frame.water_areas(self.loads)[0] > 0.0
        x = self.frame.ice.grid.lines[0] - self.loads.offset
        return 0.5 * LENGTH - x[below], self.state.squeezed_height[below]


def exact(x, share, time):
    """H_s on the characteristics of an even block: each parcel of water has moved at s v."""
    back = np.full_like(x, time) if share == 0.0 else np.minimum(time, x / (share * SPEED))

    def rate(part):
        since = part * back
        age = np.minimum((x - share * SPEED * since) / SPEED, time - since)
        return back * K3 * (H0 / np.sqrt(1.0 + 2.0 * K3 * H0**2 * np.maximum(age, 0.0))) ** 3

    return quad_vec(rate, 0.0, 1.0, epsrel=1e-9, limit=2000)[0]


def error(share, way, cells):
    x, height = EvenBlock(share, cells).slide(way).heights()
    expected = exact(np.clip(x, 0.0, LENGTH), share, way / SPEED)
    return np.abs(height - expected).mean() / expected.mean()


@pytest.mark.parametrize(
    ("share", "way", "bound"),
    [(1.0, 3.0, 1e-3), (0.5, 0.8, 0.025), (0.5, 3.0, 0.035), (0.0, 0.8, 0.045), (0.0, 3.0, 0.05)],
)
def test_an_even_block_follows_the_characteristics_of_its_water(share, way, bound):
    """Under way, with a front between old and new, and steady where that comes; of first order."""
    coarse, fine = (error(share, way * LENGTH, cells) for cells in (50, 100))
    assert coarse < bound
    assert fine < 0.6 * coarse


@pytest.mark.parametrize("share", [1.0, 0.7, 0.5, 0.0])
def test_water_is_conserved_to_rounding_also_across_a_sipe(share):
    block = EvenBlock(share, 50, gap=(-1e-3, 0.0), trail=3e-3).slide(4.0 * LENGTH)
    below, beside = (area @ block.state.squeezed_height for area in
                     block.frame.water_areas(block.loads))  # fmt: skip
    assert block.squeezed == pytest.approx(below + beside + block.lost, rel=1e-12, abs=0.0)
    if share > 0.0:
        assert block.lost > 0.1 * block.squeezed
    else:  # what a step squeezes out that touches a node first is scraped off at once
        assert beside + block.lost < 0.01 * block.squeezed
    assert below > 0.0 and (block.state.squeezed_height >= 0.0).all()


def test_water_that_stays_with_the_rubber_fills_its_voids():
    """How far a block has to slide: H_V is full everywhere, and nothing more is squeezed out."""
    H_V = 1e-7
    block = EvenBlock(0.0, 50, H_V).slide(8.0 * LENGTH)
    _, height = block.heights()
    assert height == pytest.approx(H_V, rel=1e-6)
    before = block.squeezed
    block.slide(9.0 * LENGTH)
    fresh = H0 - H0 / np.sqrt(1.0 + 2.0 * K3 * H0**2 * LENGTH / 50 / SPEED)
    assert block.squeezed - before < fresh * LENGTH  # of the cell that comes below the rubber
    carried = EvenBlock(1.0, 50, H_V).slide(8.0 * LENGTH).heights()[1]
    assert carried.max() < 0.7 * H_V


@pytest.mark.parametrize("share", [1.0, 0.7, 0.5])
@pytest.mark.parametrize("cells", [60, 61])  # odd or even numbers of cells in a sipe
def test_a_sipe_drains_what_the_next_edge_scrapes_off(share, cells):
    """Steady: H_s = Q / s before the sipe, s times that behind it, plus the further rise of Q / s;
    Q(age) is what is squeezed out of a film."""
    block = EvenBlock(share, cells, gap=(-1e-3, 1e-3)).slide(6.0 * LENGTH)
    x, height = block.heights()

    def Q(x):
        return H0 - H0 / np.sqrt(1.0 + 2.0 * K3 * H0**2 * x / SPEED)

    at_sipe = Q(4e-3)
    expected = np.where(x < 5e-3, Q(x), share * at_sipe + Q(np.maximum(x - 2e-3, 0.0)) - at_sipe)
    inside = ((x > 1e-3) & (x < 3.8e-3)) | ((x > 6.2e-3) & (x < 9.8e-3))
    np.testing.assert_allclose(height[inside].mean(), (expected / share)[inside].mean(), rtol=0.04)
    behind = x > 6.2e-3
    np.testing.assert_allclose(height[behind].mean(), (expected / share)[behind].mean(), rtol=0.04)


def test_one_move_by_hand():
    height = np.array([5.0, 1.0, 2.0, 3.0, 4.0, 7.0])
    covered = np.array([False, False, True, True, True, False])
    moved, lost = moved_by_a_cell(height, covered, np.full(6, 6.0))
    np.testing.assert_array_equal(moved, [5.0, 0.0, 1.0, 2.0, 6.0, 7.0])
    np.testing.assert_array_equal(lost, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    rows = np.stack([height, height], axis=1), np.stack([covered, ~covered], axis=1)
    moved, lost = moved_by_a_cell(*rows, np.full((6, 2), 10.0))
    np.testing.assert_array_equal(moved[:, 0], [5.0, 0.0, 1.0, 2.0, 7.0, 7.0])
    assert lost.sum() == 1.0  # of the last node's behind
    assert moved.sum() + lost.sum() == 2.0 * height.sum()


def test_water_flows_by_parts_of_cells():
    """To the last drop, and as whole cells do; a front stays sharp."""
    height, covered = np.array([5.0, 1.0, 2.0, 3.0, 4.0, 7.0]), np.array([0, 0, 1, 1, 1, 0]) > 0
    np.testing.assert_array_equal(moved(height, covered, 1.0), [5.0, 1.0, 0.0, 2.0, 7.0, 7.0])
    half = moved(height, covered, 0.5)
    np.testing.assert_allclose(half, [5.0, 1.0, 1.0, 2.375, 5.625, 7.0])
    front, everywhere = np.where(np.arange(200) < 40, 2.0, 1.0), np.ones(200, dtype=bool)
    for _ in range(200):
        front = moved(front, everywhere, 0.5)
    assert front.sum() == pytest.approx(240.0, rel=1e-14)
    steep = np.flatnonzero((front[115:] > 1.05) & (front[115:] < 1.95)) + 115
    assert 133 < steep.min() and steep.max() < 147


def test_of_a_run_the_history_has_all_water():
    """Squeezed out is what lies below, beside, and is lost; films feel it where voids fill."""
    small = dict(rubber__length="1 mm", load__duration="1 ms", film__H_V="0.04 um")
    scene = passing(**small)  # whose steps shall be those of water that lags behind
    small["numerics__max_step"] = window_cell(scene) / scene.load.speed
    rows = {s: slide(passing(film__water_speed=s, **small)) for s in (1.0, 0.5, 0.0)}
    for share, found in rows.items():
        squeezed, below, left = (found[f"water_{w}_m3"] for w in ("squeezed", "below", "left"))
        np.testing.assert_allclose(squeezed, below + left, rtol=1e-9, atol=1e-30)
        assert (np.diff(squeezed) >= 0.0).all() and (left >= 0.0).all()
        assert abs(found["energy_imbalance"][-1]) < 1e-4, share
    # Nothing fills but what goes with the rubber: until then films do not know where water is.
    ends = [{name: column[-1] for name, column in found.items()} for found in rows.values()]
    assert ends[0]["mu"] == pytest.approx(ends[1]["mu"], rel=1e-9)
    assert ends[1]["water_below_m3"] == pytest.approx(2.0 * ends[0]["water_below_m3"], rel=0.02)
    assert ends[2]["saturated_fraction"] > 0.9 and ends[2]["mu"] < 0.95 * ends[1]["mu"]
    assert ends[2]["water_left_m3"] < 0.05 * ends[2]["water_squeezed_m3"]
