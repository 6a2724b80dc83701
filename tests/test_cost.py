"""Cost estimates against the measured runs that they were made from, and what they count."""

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")
from program import run  # noqa: E402

from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.film.ice_heat import Column  # noqa: E402
from iceslide_fem.interface.ice_continuum import Continuum  # noqa: E402
from iceslide_fem.mesh.ice import heating_times, ice_shape, patch_lines, window_lines
from iceslide_fem.mesh.rubber import (  # noqa: E402
    block_size,
    divisions,
    rubber_mesh,
    tagged_rubber,
)
from iceslide_fem.mesh.size import (  # noqa: E402
    Unknowns,
    check_memory,
    memory_needed,
)
from iceslide_fem.mesh.tagged import mesh_size  # noqa: E402
from iceslide_fem.runs.doubts import before_run  # noqa: E402
from iceslide_fem.runs.point import point_history  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.runtime.launch import memory_of_machine  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from iceslide_fem.workflow.planning import cost  # noqa: E402
from iceslide_fem.workflow.planning.cost import (  # noqa: E402
    estimate,
    expected,  # noqa: E402
    expected_steps,
    step_seconds,
)
from iceslide_fem.workflow.planning.info import covered_load, describe  # noqa: E402

pytestmark = pytest.mark.fe
ROOT = Path(__file__).parent.parent
# Runs of thesis_1bar, all 7 ms: model, ice, tolerance, unknowns of both, steps, CPU seconds, MB
# (scripts.studies.accuracy_cost)
MEASURED = [
    row.split()
    for row in (
        "slice column 1e-3 4346 0 234 6.3 279",
        "slice continuum 1e-3 4346 1431 237 11.5 275",
        "slice continuum 1e-2 4346 1431 69 4.9 273",
        "block column 1e-2 12987 0 60 11.8 442",
        "block continuum 1e-2 12987 6075 61 14.9 404",
        "block continuum 1e-3 12987 6075 199 39.5 431",
        "slice mesh 1e-3 4346 1431 251 14.3 277",
        "slice mesh 1e-2 4346 1431 63 5.1 275",
        "block mesh 1e-2 12987 6075 61 21.5 435",
    )
]


def thesis(*changes):
    return load_scene(ROOT / "cases" / "thesis_1bar.toml", changes)


@pytest.mark.quick
@pytest.mark.parametrize("row", MEASURED, ids="-".join)
def test_estimates_are_within_a_factor_of_two_of_measured_runs(row):
    model, heat, tolerance, *measured = row
    rubber, ice, steps, seconds, megabytes = (float(number) for number in measured)
    expected = expected_steps(
        thesis(f"model={model}", f"ice.heat={heat}", f"numerics.tolerance={tolerance}")
    )
    assert 0.5 < expected / steps < 2.0
    size = Unknowns(2 if model == "slice" else 3, int(rubber), int(ice), 0)
    memory = memory_needed(size)
    time = cost.START_SECONDS + (expected + cost.START_STEPS) * step_seconds(*size[:3], heat)
    assert 0.5 < time / seconds < 2.0
    assert 0.8 < memory / (1e6 * megabytes) < 1.25


def test_time_and_memory_of_a_run_follow_from_its_steps_and_unknowns():
    scene = thesis("numerics.tolerance=1e-2")
    found = estimate(scene)
    size = Unknowns(3, found.rubber_unknowns, found.ice_unknowns, 0)
    assert found.memory == memory_needed(size)
    seconds = found.steps * step_seconds(*size[:3], scene.ice.heat)
    assert seconds < found.time < 1.3 * seconds + 2.0


def a_continuum(scene, surface):
    heated = heating_times(scene, float(np.ptp(surface[0])), scene.load.duration)
    return Continuum(
        surface,
        MPI.COMM_SELF,
        Column(scene.ice.temperature, heated),
        interface_resistance=1e-5,
        agreement=1e-6,
    )


@pytest.mark.parametrize("model", ["slice", "block"])
def test_unknowns_are_those_of_the_meshes(model):
    scene = thesis(f"model={model}", "ice.margin=0.2mm")
    ice = a_continuum(scene, patch_lines(scene))
    assert math.prod(ice_shape(scene)) == ice.n_dofs
    rubber = rubber_mesh(scene, MPI.COMM_SELF).mesh
    dim = 2 if model == "slice" else 3
    assert estimate(scene).rubber_unknowns > dim * rubber.topology.index_map(0).size_global


def test_size_of_a_block_is_its_own_or_its_meshs():
    assert block_size(thesis("rubber.length=2mm")) == pytest.approx((2e-3, 1e-3, 1e-3))
    assert block_size(thesis("model=slice", "rubber.height=3mm")) == pytest.approx((1e-3, 3e-3))
    half = f"rubber.mesh={ROOT / 'meshes' / 'siped_block_half.msh'}"
    assert block_size(thesis(half)) == pytest.approx((6e-3, 6e-3, 4e-3))


def test_steps_of_a_point_are_exact():
    scene = thesis("model=point", "ice.heat=half-space")
    rows, _ = point_history(scene)
    assert estimate(scene)[:3] == (len(rows) - 1, 0, 0)


def test_sliding_ice_passes_by_four_cells_in_a_step_and_one_by_one_under_water_that_lags():
    sliding = ["model=slice", "ice.motion=sliding", "ice.heat=column", "ice.cell=5um"]
    assert expected_steps(thesis(*sliding)) == 1050
    assert expected_steps(thesis(*sliding, "film.water_speed=0.5")) == 4200
    continuum = thesis("model=slice", "ice.motion=sliding", "load.duration=0.7ms")
    window = window_lines(continuum, [(-0.5e-3, 0.5e-3)])
    ice = a_continuum(continuum, window)
    assert estimate(continuum).ice_unknowns == ice.n_dofs


def test_given_steps_are_counted():
    assert expected_steps(thesis("numerics.max_step=1us")) == 7000
    euler = "numerics.film_integrator=implicit-euler"
    assert expected_steps(thesis(euler, "numerics.max_step=0.1ms")) == 70
    assert expected_steps(thesis(euler)) == 40


@pytest.mark.parametrize(
    "changes",
    [
        ["model=slice", "rubber.length=1m", "rubber.height=10um", "numerics.refinement=8"],
        ["rubber.length=1m", "rubber.height=10um"],
        ["numerics.refinement=8", "ice.margin=1m"],
        ["model=slice", "ice.motion=sliding", "ice.cell=0.1um", "rubber.length=1m"],
        ["rubber.sipes=8", "rubber.sipe_width=10um", "rubber.sipe_depth=10um", "rubber.length=1m"],
    ],
)
def test_what_cannot_fit_the_machine_is_refused_before_it_is_meshed(changes, tmp_path):
    scene = thesis(*changes)
    assert estimate(scene).memory > memory_of_machine()
    with pytest.raises(SceneError, match="GB of memory .* and there are"):
        run(scene, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_usual_scenes_fit():
    for changes in ([], ["numerics.refinement=2"], ["model=slice", "numerics.refinement=8"]):
        assert estimate(thesis(*changes)).memory < 8e9


def test_nodes_of_sipes_are_counted_without_a_mesh():
    for model in ("slice", "block"):
        scene = load_scene(ROOT / "cases" / "siped_block.toml", [f"model={model}"])
        found, built = divisions(scene), mesh_size(tagged_rubber(scene))
        assert {name: found[name] for name in built} == pytest.approx(built)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["rubber.length=1m", "rubber.height=10um"], "a run is refused"),
        (
            ["load.pressure=0.2bar", "load.speed=30", "film.initial_height=1nm"],
            "friction of a point",
        ),
        (["ice.motion=sliding", "load.duration=0.1ms"], "before an ice point has passed the block"),
        (["film.initial_height=2um"], "films of a point get"),
    ],
)
def test_info_warns_of_what_it_knows(changes, words):
    scene = thesis(*changes)
    said = before_run(scene) + expected(scene)
    assert any(words in warning for warning in said), said


@pytest.mark.parametrize("case", ["wet_slick", "wet_siped"])
def test_info_describes_wet_ice(case):
    """Films of points begin at the scene's height under this law, too."""
    rows = {
        row.quantity: row.value for row in describe(load_scene(ROOT / "cases" / f"{case}.toml"))
    }
    assert rows["friction"] == "film beside voids that carry" and "inertia left out" in rows


def test_info_expects_no_warnings_of_the_cases():
    for case in sorted((ROOT / "cases").glob("*.toml")):
        assert expected(load_scene(case)) == []


def test_more_modes_of_ice_than_can_be_found_are_refused():
    """A metre of trail in cells of 20 um: it took 20 GB and no signal ended it."""
    sliding = ["model=slice", "ice.motion=sliding", "ice.trail=1", "ice.cell=20um"]
    scene = load_scene(ROOT / "cases" / "thesis_1bar.toml", [*sliding, "ice.heat=continuum"])
    with pytest.raises(SceneError, match="nodes in a line, and continuum ice may have 3000"):
        check_memory(scene)


def test_load_that_the_table_covers():
    table = thesis().contact_parameters
    assert covered_load(table, 2e5, 0.0) == 1.0 and covered_load(table, 0.9e5, 0.0) == 0.0
    assert covered_load(table, 1e5, 0.6) == pytest.approx(0.65, abs=1e-3)  # (1 + 0.6 / 2) / 2
    rows = {row.quantity: row.value for row in describe(thesis("model=slice", "ice.heat=column"))}
    assert rows["load within the table"] == "60%"
    constant = thesis("film.k=0.3", "film.D=30um", "film.H_V=3um")
    assert "load within the table" not in {row.quantity for row in describe(constant)}
