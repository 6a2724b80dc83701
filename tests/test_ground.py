"""Ice of a depth on layers and a base, below single points: elements, closed forms, scenes."""

import json
import math

import numpy as np
import pytest

from iceslide_fem.cli import main
from iceslide_fem.film.conditions import ice_model
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.reference import held_layer_rise, layered_rise
from iceslide_fem.runs.model_levels import cheapest
from iceslide_fem.runs.notes import notes
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.materials import HEATED_LAYERS, ICE, Ground, Layer, Solid
from iceslide_fem.scene.thermal_layers import (
    FIRST_LAYER,
    LAST_STRETCH,
    LAYER_RATIO,
    stacked_layers,
)
from iceslide_fem.workflow.sweep.points import simulate_points

pytestmark = pytest.mark.quick

STEEL = Solid(50.0, 7850.0, 470.0)
FOAM = Solid(0.035, 30.0, 1400.0)
DURATION = 0.3  # s
T_0 = 263.15
ON_STEEL = {
    "name": "steel",
    "thickness": "10 mm",
    "conductivity": "50 W/m/K",
    "density": "7850 kg/m^3",
    "heat_capacity": "470 J/kg/K",
}
NAMELESS = {key: value for key, value in ON_STEEL.items() if key != "name"}
THIN = {"temperature": "-4 degC", "depth": "1 mm", "layers": [ON_STEEL]}


def a_stack(*parts):
    """Layers of (thickness, solid), downwards."""
    return [Layer(f"layer {i}", *part) for i, part in enumerate(parts)]


@pytest.mark.parametrize("duration", [1e-4, 0.3, (1e-3, 0.3)])
def test_a_half_space_has_growing_elements_as_deep_as_heat_reaches(duration):
    found = stacked_layers(a_stack((np.inf, ICE)), duration)
    first = FIRST_LAYER * np.sqrt(ICE.diffusivity * np.min(duration))
    total = HEATED_LAYERS * np.sqrt(ICE.diffusivity * np.max(duration))
    count = math.ceil(np.log1p(total / first * (LAYER_RATIO - 1.0)) / np.log(LAYER_RATIO))
    np.testing.assert_array_equal(found.thickness, first * LAYER_RATIO ** np.arange(count))
    assert not found.layer.any() and not found.base


@pytest.mark.parametrize("to_base", [False, True])
@pytest.mark.parametrize(
    "parts",
    [
        [(1e-3, ICE), (10e-3, STEEL)],
        [(10e-6, ICE), (10e-3, STEEL)],
        [(1e-3, ICE), (1e-6, FOAM), (3e-3, STEEL)],
        [(0.4e-3, ICE), (0.3e-3, ICE), (0.3e-3, ICE)],
    ],
)
def test_elements_end_on_interfaces_and_grow_no_faster_than_in_one_solid(parts, to_base):
    found = stacked_layers(a_stack(*parts), DURATION, to_base=to_base)
    for place, (thickness, _) in enumerate(parts[: None if found.base else -1]):
        assert found.thickness[found.layer == place].sum() == pytest.approx(thickness, rel=1e-9)
    thermal = found.thickness / np.sqrt([parts[i][1].diffusivity for i in found.layer])
    above = np.cumsum(thermal) - thermal
    below = above[-1] + thermal[-1] - above - thermal
    nearest = np.minimum(above, below) if to_base else above
    grown = FIRST_LAYER * DURATION**0.5 + (LAYER_RATIO - 1.0) * nearest
    assert (thermal <= grown * LAYER_RATIO**LAST_STRETCH * 1.01).all()
    assert found.base == (to_base or above[-1] + thermal[-1] < 4.0 * DURATION**0.5)


def test_a_stack_is_cut_where_heat_does_not_reach():
    found = stacked_layers(a_stack((1e-3, ICE), (1.0, STEEL), (1.0, ICE)), DURATION)
    assert not found.base
    assert found.layer[-1] == 1
    alpha = np.where(found.layer == 0, ICE.diffusivity, STEEL.diffusivity)
    assert 4.0 < np.sum(found.thickness / np.sqrt(alpha * DURATION)) < 4.0 * LAYER_RATIO
    whole = stacked_layers(a_stack((1e-3, ICE), (1.0, STEEL)), DURATION, to_base=True)
    assert whole.base
    assert whole.thickness.sum() == pytest.approx(1.001)


def ground(depth, *below, held=None):
    return Ground(depth, tuple(a_stack(*below)), held)


def heated(column, flux, time):
    """Content after a constant `flux` (W/m2) from t = 0 to `time` (s), exactly."""
    rates = column.rates[:, None]
    lasting = np.where(rates > 0.0, rates, 1.0)
    of_flux = np.where(rates > 0.0, -np.expm1(-rates * time) / lasting, time)
    return column.cooled(column.initial(1), [time]) + flux * of_flux


def warmth(column, flux, times):
    """Temperature (K) of the surface at `times` (s) under a constant flux (W/m2)."""
    return np.array([column.surface_temperature(heated(column, flux, t))[0] for t in times])


@pytest.mark.parametrize("below", [STEEL, FOAM])
@pytest.mark.parametrize("depth", [20e-6, 0.1e-3, 1e-3])
def test_ice_on_another_solid_warms_as_the_closed_form(below, depth):
    column = Column(T_0, DURATION, ground=ground(depth, (1.0, below)))
    times = np.geomspace(1e-3 * DURATION, DURATION, 20)
    rise = warmth(column, 1e4, times) - T_0
    np.testing.assert_allclose(rise, layered_rise(1e4, times, depth, below), rtol=1e-4)


def test_a_layer_on_a_held_base_becomes_steady():
    column = Column(T_0, 100.0, ground=ground(1e-3, held=T_0))
    assert (column.rates > 0.0).all()
    assert warmth(column, 1e4, [100.0]) - T_0 == pytest.approx(held_layer_rise(1e4, 1e-3), rel=1e-6)
    on_steel = Column(T_0, 100.0, ground=ground(1e-3, (10e-3, STEEL), held=T_0))
    rise = held_layer_rise(1e4, [1e-3, 10e-3], [ICE.conductivity, STEEL.conductivity]).sum()
    assert warmth(on_steel, 1e4, [100.0]) - T_0 == pytest.approx(rise, rel=1e-6)
    profile = on_steel.at_depths(heated(on_steel, 1e4, 100.0))[:, 0]
    interface = np.argmin(abs(on_steel.depths - 1e-3))
    assert profile[interface] - T_0 == pytest.approx(held_layer_rise(1e4, 10e-3, 50.0), rel=1e-6)
    assert profile[-1] == pytest.approx(T_0)


@pytest.mark.parametrize("depth", [0.1e-3, 1e-3, 3e-3])
def test_the_cold_of_a_base_comes_through(depth):
    """Fourier's series of a plate, insulated above, whose base jumps by 10 K."""
    column = Column(T_0, DURATION, ground=ground(depth, held=T_0 - 10.0))
    assert column.surface_temperature(column.initial(1)) == pytest.approx(T_0, abs=1e-3)
    times = np.geomspace(0.02, 3.0, 12) * depth**2 / ICE.diffusivity
    n = np.arange(200)
    k = (n + 0.5) * np.pi
    decay = np.exp(-np.multiply.outer(ICE.diffusivity * times / depth**2, k**2))
    left = decay @ (2.0 * (-1.0) ** n / k)
    np.testing.assert_allclose(warmth(column, 0.0, times), T_0 - 10.0 + 10.0 * left, atol=1.5e-3)
    gone = column.heat(column.cooled(column.initial(1), [1e3]))
    assert gone == pytest.approx(-10.0 * depth * ICE.density * ICE.heat_capacity, rel=1e-9)


@pytest.mark.parametrize("error", [None, 1e-5])
def test_an_insulated_base_keeps_all_heat(error):
    column = Column(T_0, DURATION, ground=ground(0.3e-3, (0.5e-3, STEEL)))
    column = column if error is None else column.condensed(error)
    heat_state = heated(column, 1e4, DURATION)
    assert column.heat(heat_state) == pytest.approx(1e4 * DURATION, rel=1e-12)
    capacity = 0.3e-3 * ICE.density * ICE.heat_capacity + 0.5e-3 * 7850.0 * 470.0
    even = column.at_depths(column.cooled(heat_state, [1e4]))
    assert even == pytest.approx(T_0 + 1e4 * DURATION / capacity)


def test_a_layer_of_ice_below_ice_changes_no_more_than_the_mesh_errs():
    """Interfaces move elements: 1.3e-5 of the rise, where the mesh itself is within 4e-5."""
    times = np.geomspace(1e-2 * DURATION, DURATION, 20)
    one = warmth(Column(T_0, DURATION), 1e4, times) - T_0
    for depth, *below in ((0.2e-3, (0.1, ICE)), (0.2e-3, (0.1e-3, ICE), (0.1, ICE))):
        split = Column(T_0, DURATION, ground=ground(depth, *below))
        np.testing.assert_allclose(warmth(split, 1e4, times) - T_0, one, rtol=2e-5)


@pytest.mark.parametrize("held", [None, T_0, T_0 - 5.0])
def test_saved_content_is_restored_by_a_column_for_longer(held):
    below = ground(1e-3, (10e-3, STEEL), held=held)
    short, long = (Column(T_0, (0.1, end), ground=below) for end in (0.1, 3.0))
    heat_state = heated(short, 1e4, 0.1)
    restored = long.restored(short.saved(heat_state))
    depth = short.depths.size
    after = long.at_depths(restored)
    np.testing.assert_allclose(after[:depth], short.at_depths(heat_state), atol=1e-9)
    np.testing.assert_allclose(after[depth:], T_0, atol=1e-9)


def test_points_of_one_solid_share_a_ground_and_others_do_not():
    cold = np.array([T_0, T_0 - 5.0])
    column = Column(cold, DURATION, ground=ground(1e-3, held=T_0))
    start = column.initial(2)
    np.testing.assert_allclose(column.surface_temperature(start), cold, atol=1e-4)
    np.testing.assert_allclose(column.take(np.array([1])).initial(1)[:, 0], start[:, 1])
    solids = ICE._replace(conductivity=np.array([2.0, 2.2]))
    with pytest.raises(ValueError, match="half-space"):
        Column(cold, DURATION, solid=solids, ground=ground(1e-3))


def mu_of(ice):
    times = np.linspace(1e-4, 7e-3, 30)
    here = Conditions.of(
        pressure=1e5,
        speed=3.0,
        temperature=269.15,
        k=0.3,
        D=3e-5,
        H_V=1e-6,
        initial_height=70e-9,
        duration=7e-3,
    )
    return simulate(here, ice, times=times).samples[:, 0]


def test_depth_that_heat_does_not_reach_changes_no_friction():
    deep = mu_of("column")
    np.testing.assert_allclose(mu_of(ground(1e-3)), deep, rtol=1e-6)
    np.testing.assert_allclose(mu_of(ground(1e-3, (1e-3, STEEL), held=269.15)), deep, rtol=1e-6)
    assert np.abs(mu_of(ground(1e-3, held=263.15)) / deep - 1.0).max() < 1e-4  # of another mesh
    assert mu_of(ground(20e-6, (5e-3, STEEL)))[-1] > 1.1 * deep[-1]


def a_scene(**ice):
    return {
        "name": "thin",
        "model": "point",
        "rubber": {"compound": "B", "length": "10 mm", "width": "10 mm", "height": "8 mm"},
        "load": {"pressure": "1 bar", "speed": "0.3 m/s", "duration": "5 s"},
        "ice": ice,
    }


def test_thin_ice_on_cold_steel_runs_as_a_point(tmp_path):
    scene = tmp_path / "thin.toml"
    scene.write_text(
        """
name = "thin"
model = "point"
[rubber]
compound = "B"
[load]
pressure = "1 bar"
speed = "0.3 m/s"
duration = "5 s"
[ice]
temperature = "-4 degC"
depth = "1 mm"
base = "held"
base_temperature = "-10 degC"
[[ice.layers]]
name = "steel"
thickness = "10 mm"
conductivity = "50 W/m/K"
density = "7850 kg/m^3"
heat_capacity = "470 J/kg/K"
""",
        encoding="utf-8",
    )
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as done:
        main(["run", str(scene), "--out", str(out)])
    assert done.value.code == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["scene"]["ice"]["layers"][0]["name"] == "steel"
    results = summary.get("results", summary)
    assert abs(results["energy_imbalance"]) < 1e-4
    held = {"base": "held", "base_temperature": "-10 degC"}
    thin, deep = simulate_points(
        [scene_from_dict(a_scene(**THIN, **held)), scene_from_dict(a_scene(temperature="-4 degC"))]
    )
    assert thin.summary["mu_end"] == pytest.approx(results["mu_end"], rel=2e-3)
    assert thin.summary["mu_end"] > 4.0 * deep.summary["mu_end"]


def test_points_on_grounds_of_their_own_are_those_of_single_calls():
    ices = [
        THIN,
        THIN | {"depth": "0.1 mm"},
        THIN | {"temperature": "-6 degC"},
        THIN | {"conductivity": "2 W/m/K"},
        {"temperature": "-4 degC"},
    ]
    scenes = [scene_from_dict(a_scene(**ice)) for ice in ices]
    together = [outcome.summary["mu_end"] for outcome in simulate_points(scenes)]
    alone = [simulate_points([scene])[0].summary["mu_end"] for scene in scenes]
    assert together == pytest.approx(alone, rel=1e-3)
    assert len({round(mu, 5) for mu in alone}) == 5


@pytest.mark.parametrize(
    "ice, words",
    [
        (
            THIN | {"base": "held", "base_temperature": "1 degC"},
            ["ice.base_temperature = 1 degC", "ice.melting_temperature"],
        ),
        (THIN | {"layers": [NAMELESS]}, ["layer 1 of ice.layers", "name"]),
        ({"layers": [ON_STEEL]}, ["ice.depth is missing", '"steel"']),
        ({"base": "held"}, ['ice.base = "held" needs ice.depth']),
        ({"conductivity": [[250.0, 2.4], [270.0, 2.2]]}, ["ice.conductivity", 'heat = "column"']),
        ({"depth": "1 mm", "heat": "continuum"}, ['ice.heat = "continuum"', "ice.depth"]),
        ({"depth": "1 mm", "heat": "half-space"}, ['ice.heat = "half-space"', "ice.depth"]),
        (
            THIN | {"base": "held", "base_temperature": "-9 degC", "motion": "sliding"},
            ["ice.base_temperature", 'ice.motion = "sliding"'],
        ),
        ({"mesh": __file__, "heat": "mesh"}, ["ice.mesh", 'model = "point"']),
    ],
)
def test_what_ice_cannot_lie_on_is_refused_in_one_sentence(ice, words):
    with pytest.raises(SceneError) as caught:
        scene_from_dict(a_scene(**ice))
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in words), message


def test_a_point_on_a_mesh_is_a_column_and_says_so():
    scene = scene_from_dict(a_scene(**THIN, heat="mesh"))
    assert ice_model(scene) == scene_from_dict(a_scene(**THIN)).ice.ground
    assert any('a column, the nearest to ice.heat = "mesh"' in note for note in notes(scene))


def test_keys_without_effect_are_named_and_those_of_the_ground_have_one():
    data = a_scene(**THIN, mesh_unit="mm") | {"model": "slice"}
    data["rubber"]["plate"] = "held"
    found = " ".join(notes(scene_from_dict(data)))
    assert "ice.mesh_unit has no effect without ice.mesh" in found
    assert 'rubber.plate has no effect without rubber.heat = "mesh"' in found
    assert "ice.depth" not in found and "ice.layers" not in found


def test_auto_does_not_take_thin_ice_for_a_half_space():
    data = a_scene(**THIN) | {"model": "auto"}
    assert cheapest(scene_from_dict(data)).heat in ("column", "mesh")
