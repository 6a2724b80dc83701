"""Water in the voids that carries: load sharing, squeezing, wet ice at points."""

from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.film.carrying import Carried
from iceslide_fem.film.conditions import varied_conditions
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.loads import film_loads
from iceslide_fem.film.rubber_heat import INSULATED
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.voids import Voids
from iceslide_fem.runs.notes import notes
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.contact_table import read_contact_table
from iceslide_fem.scene.materials import CONTACT_TABLES
from iceslide_fem.workflow.sweep.points import simulate_points

pytestmark = pytest.mark.quick

FILE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
MESH = FILE.parents[2] / "meshes" / "siped_block.msh"
TABLE = read_contact_table(FILE, "the surface")


def scene(water="0 um", **changes):
    tables = {
        "rubber": {"compound": "B", "length": 20e-3, "width": 20e-3, "height": 8e-3},
        "load": {"pressure": 5e5, "speed": 6.0, "duration": 5e-3},
        "ice": {"temperature": "-1 degC", "water": water},
        "film": {"voids": "carry", "contact": str(FILE)},
        "numerics": {"tolerance": 1e-3},
    }
    for name, table in changes.items():
        tables[name] = tables[name] | table if isinstance(table, dict) else table
    return scene_from_dict({"name": "wet", "model": "point"} | tables)


def carrying(lug, pressure, speed):
    """Loads of contact over voids below a lug."""
    k, D, H_V, _ = TABLE(pressure)
    voids = Carried(Voids(TABLE, lug), pressure, np.ones_like(pressure), 1.8e-3)
    return film_loads(pressure, speed, k, D, H_V, carried=voids)


@pytest.mark.parametrize(
    ("water", "bar", "solid", "k"),
    [(3.0, 2.0, 0.857, 0.226), (2.0, 5.0, 1.619, 0.358), (2.0, 2.0, 1.619, 0.358),
     (1.0, 5.0, 3.295, 0.560)],
)  # fmt: skip
def test_full_voids_share_the_load(water, bar, solid, k):
    voids = Voids(TABLE)
    found = voids.contact_pressure(np.array([bar * 1e5]), np.array([water * 1e-6]))
    assert found / 1e5 == pytest.approx(solid, abs=5e-4)
    assert voids.contact(found)[0] == pytest.approx(k, abs=5e-4)
    assert voids.held(found) == pytest.approx(water * 1e-6)


def test_voids_that_are_not_full_bear_nothing():
    p = np.array([2e5, 2e5, 0.0])
    water = np.array([1.5e-6, 0.0, 1e-6])
    assert Voids(TABLE).contact_pressure(p, water).tolist() == p.tolist()


def test_more_pressure_never_rubs_less():
    """At one amount of water: below the table, within it, and where voids are full."""
    p = np.geomspace(1e3, 1e6, 200)
    for table in (TABLE, CONTACT_TABLES["B"]):
        k, D, H_V, _ = table(p)
        voids = Carried(Voids(table), p, np.ones_like(p), 1.8e-3)
        loads = film_loads(p, np.ones_like(p), k, D, H_V, carried=voids)
        nothing = np.zeros((0, p.size))
        for water in (0.0, 1e-6, 3e-6, 2e-5):
            films = np.full_like(p, np.log(5e-8)), np.full_like(p, water)
            tau = loads.shear(InterfaceState(*films, nothing), Column(270.0, 1.0))
            assert (np.diff(tau) >= -1e-12 * tau[1:]).all(), water


@pytest.mark.parametrize("table", [TABLE, CONTACT_TABLES["B"]], ids=["surface", "published"])
def test_voids_hold_what_carries(table):
    voids, water = Voids(table), np.geomspace(1e-8, 1e-3, 50)
    solid = voids.carried(water)
    assert voids.held(solid) == pytest.approx(water, rel=1e-10)
    assert (np.diff(solid) < 0.0).all() and (np.diff(voids.contact(solid)[0]) <= 0.0).all()


@pytest.mark.parametrize(("lug", "left"), [(20e-3, 18.641), (5.5e-3, 5.211), (2e-3, 1.897)])
def test_a_lug_squeezes_thick_water_as_reynolds_has_it(lug, left):
    """From 100 um at 2 bar in 5 ms; no asperity bears anything meanwhile."""
    voids, n = Voids(TABLE, lug), 1
    stiff = voids.table(np.array([2e5]))  # so deep water that its own roughness does not tell
    assert stiff.H_V[0] < 2e-6
    p, k, speed = np.full(n, 2e5), stiff.k, np.full(n, 1e-3)
    loads = film_loads(
        p, speed, k, stiff.D, stiff.H_V, carried=Carried(voids, p, np.ones(n), 1.8e-3)
    )
    ice = Column(np.full(n, 270.0), 5e-3)
    state = InterfaceState(np.full(n, np.log(70e-9)), np.full(n, 100e-6), ice.initial(n))
    times = np.concatenate([[0.0], np.geomspace(1e-8, 5e-3, 1500)])
    for dt in np.diff(times):
        state = advance(state, loads, loads, dt, ice, INTEGRATORS["sdirk2"]).state
    if left > 5.0:  # thinner water shares the load with asperities
        assert state.squeezed_height[0] * 1e6 == pytest.approx(left, rel=2e-2)
    assert state.squeezed_height[0] * 1e6 >= left * 0.999


@pytest.mark.parametrize("name", ["sdirk2", "sdirk3"])
@pytest.mark.filterwarnings("error")
def test_a_step_that_squeezes_out_more_than_there_is_is_refused(name):
    one = np.ones(1)
    loads = carrying(2e-3, 1e6 * one, 4.0 * one)
    ice = Column(270.0 * one, 5e-3)
    state = InterfaceState(np.log(70e-9 * one), 5e-3 * one, ice.initial(1))
    step = advance(state, loads, loads, 5e-3, ice, INTEGRATORS[name])
    assert loads.local_error(step, ice, INSULATED, one)[0] > 1.0


@pytest.mark.filterwarnings("error")
def test_voids_without_water_beside_full_ones():
    """Points of one step, one of which has no water: nothing is divided by that."""
    one = np.ones(2)
    still = carrying(2e-3, np.array([0.0, 2e5]), 4.0 * one)
    ice = Column(270.0 * one, 5e-3)
    water = np.array([0.0, 5e-6])
    state = InterfaceState(np.log(70e-9 * one), water, ice.initial(2))
    step = advance(state, still, still, 1e-6, ice, INTEGRATORS["implicit-euler"])
    assert step.state.squeezed_height[0] == 0.0 < step.state.squeezed_height[1] < 5e-6


def test_friction_no_longer_dies_when_voids_are_full():
    rows, entries = point_history(scene())
    stopped, _ = point_history(scene(film={"voids": "stop"}))
    assert entries["saturation_s"] is not None
    assert rows[-1].mu > 1.5 * stopped[-1].mu and rows[-1].film_height_m < stopped[-1].film_height_m
    assert abs(rows[-1].energy_imbalance) < 1e-4
    before = [row for row in rows if not row.saturated_fraction]
    due = np.array([(row.time_s, row.mu) for row in stopped])
    mu = np.interp([row.time_s for row in before], *due.T)
    assert [row.mu for row in before] == pytest.approx(mu, rel=2e-3)


def test_wet_ice_carries_the_block_at_first():
    thick, _ = point_history(scene("20 um", load={"pressure": 2e5, "speed": 4.0}))
    dry, _ = point_history(scene(load={"pressure": 2e5, "speed": 4.0}))
    assert thick[0].mu < 0.003 < 0.1 < dry[0].mu
    water = [row.squeezed_height_m for row in thick]
    assert (np.diff(water) < 0.0).all()
    assert thick[-1].mu > thick[0].mu


@pytest.mark.parametrize(("water", "doubted"), [("0 um", True), ("20 um", False)])
def test_ice_that_does_not_melt_is_doubted_unless_it_is_wet(water, doubted):
    cold = {"load": {"duration": 1e-4, "speed": 0.5}, "rubber": {"sipes": 2}}
    given = scene(water, **cold)
    _, entries = point_history(given)
    assert (entries["melt_onset_s"] is None) == doubted  # water holds the surface at T_m
    assert any("does not melt" in found for found in entries["warnings"]) == doubted
    assert not [note for note in notes(given) if "rubber.sipes" in note]  # they end the lug


def test_a_sweep_has_the_water_of_its_scenes():
    wet = [scene(f"{water} um", load={"pressure": 2e5, "speed": 4.0}) for water in (0, 20)]
    found = [outcome.summary["mu_mean"] for outcome in simulate_points(wet)]
    assert found == [point_history(one)[1]["mu_mean"] for one in wet]
    assert found[1] < 0.05 * found[0]


def test_varied_conditions_cannot_carry():
    with pytest.raises(ValueError, match="no voids that carry"):
        varied_conditions(scene(), speed=[1.0, 2.0])


def test_steps_keep_their_order():
    due, _ = point_history(scene(numerics={"tolerance": 1e-5}))
    off = []
    for tolerance in (1e-2, 1e-3):
        rows, _ = point_history(scene(numerics={"tolerance": tolerance}))
        off.append(abs(rows[-1].mu / due[-1].mu - 1.0))
    assert off[0] < 1e-2 and off[1] < 1e-3


def test_a_sweep_of_points_is_the_points():
    scenes = [scene(water, load={"pressure": 2e5, "speed": 4.0}) for water in ("0 um", "20 um")]
    found = [result.summary["mu_mean"] for result in simulate_points(scenes)]
    assert found == pytest.approx([point_history(one)[1]["mu_mean"] for one in scenes])
    assert found[1] < 0.1 * found[0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"film": {"voids": "stop"}, "water": "5 um"},
            'ice.water and film.voids = "stop" contradict',
        ),
        ({"film": {"contact": None, "k": 0.3, "D": 3e-5, "H_V": 2e-6}}, "film.k contradict"),
        ({"model": "slice", "rubber": {"mesh": str(MESH)}}, "rubber.mesh contradict"),
    ],
)
def test_what_cannot_carry_gets_one_sentence(changes, said):
    with pytest.raises(SceneError, match=said):
        scene(**changes)
