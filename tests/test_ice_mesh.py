"""Meshes of the ice and what lies below it: regions, lines, users' own, pictures."""

import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import ufl  # noqa: E402
from dolfinx import fem  # noqa: E402
from mesh_writers import WRITERS, write_mesh  # noqa: E402
from mpi4py import MPI  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.film.ice_heat import Column  # noqa: E402
from iceslide_fem.heat.elements import LayeredElements  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.grid import tensor_grid  # noqa: E402
from iceslide_fem.mesh.ice import patch_lines, window_lines  # noqa: E402
from iceslide_fem.mesh.ice_body import (  # noqa: E402
    covered,  # noqa: E402
    ice_body,
    ice_nodes,
    upright_edges,  # noqa: E402
)
from iceslide_fem.mesh.rubber import block_shape  # noqa: E402
from iceslide_fem.mesh.size import check_memory, unknowns  # noqa: E402
from iceslide_fem.mesh.user_mesh import load_user_ice  # noqa: E402
from iceslide_fem.runs.notes import notes  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from iceslide_fem.workflow.planning.cost import estimate  # noqa: E402
from iceslide_fem.workflow.planning.info import describe  # noqa: E402
from iceslide_fem.workflow.planning.mesh_picture import draw_mesh  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.versions]
ROOT = Path(__file__).parent.parent
WORLD = MPI.COMM_WORLD


def two_regions(dim):
    """6 x (2 x) 4 cells of 1 (by 1) by 1 mm; what is below 2 mm of ice is steel."""
    lines = [np.linspace(0, 6e-3, 7), np.linspace(0, 2e-3, 3), np.linspace(-4e-3, 0, 5)]
    chosen = lines if dim == 3 else [lines[0], lines[2]]
    grid = tensor_grid(chosen, "ice", {"surface": lambda centre: centre[:, -1] == 0.0})
    deep = grid.points[grid.cells, -1].mean(axis=1) < -2e-3
    return grid._replace(regions={"ice": np.flatnonzero(~deep), "steel": np.flatnonzero(deep)})


def volumes(meshed):
    """Of the regions by their names."""
    one = fem.Constant(meshed.mesh, 1.0)
    inside = ufl.Measure("dx", meshed.mesh, subdomain_data=meshed.cell_tags)
    return {
        name: compat.assemble_scalar(compat.form(one * inside(number)), WORLD)
        for name, number in meshed.regions.items()
    }


# --- regions in DOLFINx


@pytest.mark.mpi
@pytest.mark.parametrize("dim", [2, 3])
def test_regions_and_facets_have_their_tags_on_every_rank(dim):
    meshed = gmsh_model.distribute(two_regions(dim), WORLD)
    width = 2e-3 if dim == 3 else 1.0
    assert volumes(meshed) == pytest.approx({"ice": 12e-6 * width, "steel": 12e-6 * width})
    outer = ufl.Measure("ds", meshed.mesh, subdomain_data=meshed.facet_tags)
    surface = fem.Constant(meshed.mesh, 1.0) * outer(meshed.tags["surface"])
    assert compat.assemble_scalar(compat.form(surface), WORLD) == pytest.approx(6e-3 * width)
    cells = meshed.mesh.topology.index_map(dim)
    assert len(meshed.cell_tags.indices) == cells.size_local + cells.num_ghosts


@pytest.mark.mpi
def test_columns_of_cells_stay_on_one_rank():
    meshed = gmsh_model.distribute(two_regions(3), WORLD)
    places = np.round(1e3 * compat.cell_midpoints(meshed.mesh)[:, :2], 6)
    columns, counts = np.unique(places, axis=0, return_counts=True)
    assert (counts == 4).all()
    assert sum(WORLD.allgather(len(columns))) == 12


def test_one_body_is_one_region():
    grid = two_regions(2)._replace(regions={})
    assert gmsh_model.distribute(grid, MPI.COMM_SELF).regions == {"ice": 1}
    assert grid.named_cells["ice"].tolist() == list(range(24))


# --- the generated mesh

SCENE = """
name = "glazed"
model = "{model}"
[rubber]
compound = "B"
[load]
pressure = "1 bar"
speed = "3 m/s"
duration = "7 ms"
[ice]
temperature = "-4 degC"
heat = "mesh"
"""
LAYER = """
[[ice.layers]]
name = "{name}"
conductivity = "50 W/m/K"
density = "7800 kg/m^3"
heat_capacity = "460 J/kg/K"
"""


def a_scene(folder, model, *changes, thickness=None, layers=()):
    """Ice on `layers`, each of that `thickness`."""
    text = SCENE.format(model=model)
    for name in layers:
        text += LAYER.format(name=name)
        text += f'thickness = "{thickness}"\n' if thickness else ""
    ground = {"ice.depth=0.2mm"} if thickness else set()
    (folder / "glazed.toml").write_text(text)
    return load_scene(folder / "glazed.toml", [*ground, *changes])


@pytest.mark.parametrize("motion", ["attached", "sliding"])
@pytest.mark.parametrize("model", ["slice", "block"])
def test_meshed_ice_has_the_surface_of_continuum_ice(model, motion, tmp_path):
    scene = a_scene(tmp_path, model, "ice.margin=0.3mm", f"ice.motion={motion}")
    footprint = block_shape(scene).ranges
    lines = (patch_lines if motion == "attached" else window_lines)(scene, footprint)
    points = ice_body(scene).points
    top = points[points[:, -1] == 0.0]
    for axis, line in enumerate(lines):
        np.testing.assert_allclose(np.unique(top[:, axis]), line, atol=1e-12)


@pytest.mark.parametrize("model", ["slice", "block"])
def test_cells_stand_upright(model, tmp_path):
    tagged = ice_body(a_scene(tmp_path, model))
    edges = tagged.points[upright_edges(tagged)]
    np.testing.assert_array_equal(edges[:, 0, :-1], edges[:, 1, :-1])
    assert (edges[:, 0, -1] != edges[:, 1, -1]).all()


def test_layers_of_a_half_space_are_those_of_columns(tmp_path):
    scene = a_scene(tmp_path, "slice")
    z = np.unique(ice_body(scene).points[:, -1])
    depths = Column(269.15, 7e-3, solid=scene.ice.solid).depths
    np.testing.assert_allclose(-z[::-1], depths[::2], rtol=1e-9)


def test_layers_that_heat_does_not_reach_are_left_out_unless_the_base_is_held(tmp_path):
    for changes, regions in (
        ([], {"ice", "glue"}),
        (["ice.base=held", "ice.base_temperature=-9degC"], {"ice", "glue", "steel"}),
    ):
        scene = a_scene(tmp_path, "slice", *changes, thickness="5 mm", layers=("glue", "steel"))
        assert set(ice_body(scene).regions) == regions


def test_ice_has_the_layers_of_the_time_that_it_is_warmed(tmp_path):
    scene = a_scene(tmp_path, "slice")
    both = np.unique(ice_body(scene, None, [1e-3, 7e-3]).points[:, -1])
    first = np.unique(ice_body(scene, None, 1e-3).points[:, -1])
    np.testing.assert_allclose(both[-len(first) :], first, rtol=1e-9)
    assert both[0] < 1.5 * first[0]


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["slice", "block"])
def test_regions_are_the_layers_and_parts_their_faces(model, tmp_path):
    held = "ice.base=held", "ice.base_temperature=-9degC"
    scene = a_scene(tmp_path, model, *held, thickness="1 mm", layers=("glue", "steel"))
    meshed = gmsh_model.distribute(ice_body(scene), WORLD)
    width, depth = (1.0, 2.2e-3) if model == "slice" else (0.5e-3, 2.2e-3)
    layers = {"ice": 0.2e-6 * width, "glue": 1e-6 * width, "steel": 1e-6 * width}
    assert volumes(meshed) == pytest.approx(layers, rel=1e-6)
    outer = ufl.Measure("ds", meshed.mesh, subdomain_data=meshed.facet_tags)
    areas = {
        name: compat.assemble_scalar(
            compat.form(fem.Constant(meshed.mesh, 1.0) * outer(tag)), WORLD
        )
        for name, tag in meshed.tags.items()
    }
    flat = {"surface": 1e-3 * width, "base": 1e-3 * width}
    upright = {"sides": 2 * depth * width}
    if model == "block":
        upright = {"sides": depth * (2 * width + 1e-3), "symmetry": 1e-3 * depth}
    assert areas == pytest.approx(flat | upright, rel=1e-6)


@pytest.mark.parametrize("motion", ["attached", "sliding"])
@pytest.mark.parametrize("model", ["slice", "block"])
def test_the_number_of_nodes_is_known_before_it_is_meshed(model, motion, tmp_path):
    changes = (f"ice.motion={motion}", "ice.cell=20um" if motion == "sliding" else "ice.margin=0mm")
    scene = a_scene(tmp_path, model, *changes, thickness="1 mm", layers=["steel"])
    mesh = gmsh_model.distribute(ice_body(scene), MPI.COMM_SELF).mesh
    nodes = LayeredElements(mesh).numbering.dofs.size
    assert unknowns(scene).ice == ice_nodes(scene) == nodes
    assert estimate(scene).ice_unknowns == nodes


def test_ice_that_needs_too_much_memory_is_refused(tmp_path):
    changes = ("numerics.refinement=8", "ice.margin=1m")
    with pytest.raises(SceneError, match=r"of ice\), and there are"):
        check_memory(a_scene(tmp_path, "block", *changes))


def test_the_mesh_is_written_with_its_names(tmp_path):
    scene = a_scene(tmp_path, "slice", thickness="1 mm", layers=["steel"])
    path = write_mesh(scene, tmp_path)[1]
    found, made = load_user_ice(path, 2, "m", ["steel"]), ice_body(scene)
    assert set(found.facets) == set(made.facets)
    for name, cells in made.regions.items():
        assert len(found.regions[name]) == len(cells)


# --- users' own meshes


def own_ice(dim, x=(-1e-3, 1e-3), y=(0.0, 1e-3)):
    """0.2 mm of ice on as much of steel; all below the rubber of a scene here."""
    lines = [np.linspace(*x, 5), np.linspace(*y, 3), np.linspace(-0.4e-3, 0, 5)]
    parts = {
        "surface": lambda centre: centre[:, -1] == 0.0,
        "base": lambda centre: centre[:, -1] < -0.39e-3,
    }
    grid = tensor_grid(lines if dim == 3 else [lines[0], lines[2]], "ice", parts)
    deep = grid.points[grid.cells, -1].mean(axis=1) < -0.2e-3
    return grid._replace(regions={"ice": np.flatnonzero(~deep), "Steel": np.flatnonzero(deep)})


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("suffix", WRITERS)
def test_regions_of_every_format_are_read(suffix, dim, tmp_path):
    mesh = own_ice(dim)
    WRITERS[suffix](mesh._replace(points=1e3 * mesh.points), tmp_path / f"own{suffix}")
    found = load_user_ice(tmp_path / f"own{suffix}", dim, "mm", ["Steel"])
    assert (len(found.cells), found.cell_type) == (len(mesh.cells), mesh.cell_type)
    assert set(found.facets) == {*mesh.facets, "sides"}
    for name, cells in mesh.regions.items():
        middles = [
            np.sort(np.round(1e9 * one.points[one.cells[some]].mean(axis=1), 3), axis=0)
            for one, some in ((mesh, cells), (found, found.regions[name]))
        ]
        np.testing.assert_allclose(*middles)


def triangles():
    grid = own_ice(2)
    cells = np.concatenate([grid.cells[:, :3], grid.cells[:, [0, 2, 3]]])
    count = len(grid.cells)
    regions = {name: np.append(some, some + count) for name, some in grid.regions.items()}
    return grid._replace(cell_type="triangle", cells=cells, regions=regions)


def renamed(**names):
    grid = own_ice(2)
    facets = {names.get(name, name): facets for name, facets in grid.facets.items()}
    regions = {names.get(name, name): cells for name, cells in grid.regions.items()}
    return grid._replace(facets=facets, regions=regions)


def moved(**places):
    grid = own_ice(2)
    points = grid.points.copy()
    for axis, by in places.items():
        points[:, {"x": 0, "z": 1}[axis]] += by
    return grid._replace(points=points)


def on_steel():
    """Its ice ends at x = 0, where steel reaches up to the surface."""
    grid = own_ice(2)
    right = grid.points[grid.cells, 0].mean(axis=1) > 0.0
    kept = grid.regions["ice"][~right[grid.regions["ice"]]]
    rest = np.setdiff1d(np.arange(len(grid.cells)), kept)
    return grid._replace(regions={"ice": kept, "Steel": rest})


def twice():
    grid = own_ice(2)
    return grid._replace(regions={**grid.regions, "ice": np.arange(len(grid.cells))})


def bare():
    grid = own_ice(2)
    return grid._replace(facets={**grid.facets, "surface": grid.facets["surface"][1:]})


BAD = {
    "is made of triangle cells": triangles,
    'has no facets tagged "surface"; tags found: top, base': lambda: renamed(surface="top"),
    'has no cells tagged "ice"; tags found: Steel, base, snow, surface': lambda: renamed(
        ice="snow"
    ),
    'has no cells tagged "Steel"; tags found: base, brass, ice': lambda: renamed(Steel="brass"),
    'facets tagged "surface" are at 0.001 m; move the mesh by -0.001 m': lambda: moved(z=1e-3),
    'facets tagged "surface" are not on cells tagged "ice"': on_steel,
    'a cell is tagged "ice" and "Steel"': twice,
    'is part of the top of the ice and not tagged "surface"': bare,
}


@pytest.mark.parametrize("message", BAD)
def test_what_is_wrong_with_a_mesh_is_said_in_a_sentence(message, tmp_path):
    path = tmp_path / "bad.inp"
    WRITERS[".inp"](BAD[message](), path)
    with pytest.raises(SceneError) as refusal:
        load_user_ice(path, 2, "m", ["Steel"])
    said = str(refusal.value)
    assert said.startswith(f"ice.mesh {path}") and message in said and said.isprintable()


def test_a_layer_that_the_scene_does_not_have_is_refused(tmp_path):
    """It would be left out, and the ice insulated; sets of cells that have a name do no harm."""
    gmsh_model.save(own_ice(2), tmp_path / "own.msh")
    with pytest.raises(SceneError, match='has cells tagged "Steel", a name that the scene does no'):
        load_user_ice(tmp_path / "own.msh", 2)
    mesh = own_ice(2)
    every = mesh._replace(regions={**mesh.regions, "all": np.arange(len(mesh.cells))})
    WRITERS[".inp"](every, tmp_path / "all.inp")
    assert set(load_user_ice(tmp_path / "all.inp", 2, "m", ["Steel"]).regions) == {"ice", "Steel"}


def test_rubber_in_the_same_file_is_left_out(tmp_path):
    mesh = own_ice(2)
    rubber = mesh._replace(regions={"ice": mesh.regions["ice"], "rubber": mesh.regions["Steel"]})
    facets = {"surface": mesh.facets["surface"]}
    WRITERS[".inp"](rubber._replace(facets=facets), tmp_path / "both.inp")
    found = load_user_ice(tmp_path / "both.inp", 2)
    assert len(found.cells) == 8 and set(found.named_cells) == {"ice"}


@pytest.mark.parametrize("model", ["slice", "block"])
def test_a_scene_takes_its_own_mesh(model, tmp_path):
    dim = 2 if model == "slice" else 3
    gmsh_model.save(own_ice(dim), tmp_path / "own.msh")
    mesh = f"ice.mesh={tmp_path / 'own.msh'}"
    scene = a_scene(tmp_path, model, mesh, "ice.base=held", layers=["Steel"])
    tagged = ice_body(scene)
    assert set(tagged.regions) == {"ice", "Steel"}
    nodes = 5 * 9 * (3 if dim == 3 else 1)
    assert unknowns(scene).ice == estimate(scene).ice_unknowns == nodes
    noted = notes(a_scene(tmp_path, model, mesh, "ice.margin=1mm", layers=["Steel"]))
    assert noted == ["ice.margin has no effect on ice.mesh, which reaches as far as it does"]


def unheld():
    grid = own_ice(2)
    return grid._replace(facets={"surface": grid.facets["surface"]})


def half_tagged():
    grid = own_ice(3)
    return grid._replace(facets={name: grid.facets[name] for name in ("surface", "base")})


UNFIT = {
    'has no facets tagged "base", where ice.base = "held"': unheld,
    "leave 25 % of the rubber's footprint, x from -0.5 to 0.5 mm, without": lambda: moved(
        x=0.75e-3
    ),
    'has no facets tagged "symmetry", and the rubber is the half of a block': half_tagged,
    "leave 50 % of the rubber's footprint, x from -0.5 to 0.5 mm and y from 0 to 0.5 mm": (
        lambda: own_ice(3, y=(0.0, 0.25e-3))
    ),
}


@pytest.mark.parametrize("message", UNFIT)
def test_a_mesh_that_does_not_fit_the_scene_is_refused(message, tmp_path):
    mesh = UNFIT[message]()
    gmsh_model.save(mesh, tmp_path / "unfit.msh")
    model = "slice" if mesh.points.shape[1] == 2 else "block"
    changes = (f"ice.mesh={tmp_path / 'unfit.msh'}", "ice.base=held")
    with pytest.raises(SceneError) as refusal:
        ice_body(a_scene(tmp_path, model, *changes, layers=["Steel"]))
    assert str(refusal.value).startswith("ice.mesh ") and message in str(refusal.value)


def test_halves_of_ice_below_whole_rubber_are_refused(tmp_path):
    lines = [np.linspace(-1e-3, 1e-3, 5), np.linspace(-5e-4, 5e-4, 4), np.linspace(0, 1e-3, 5)]
    low, top = (lambda c: c[:, 2] < 1e-9), (lambda c: c[:, 2] > 0.999e-3)
    gmsh_model.save(
        tensor_grid(lines, "rubber", {"contact": low, "plate": top}), tmp_path / "rubber.msh"
    )
    gmsh_model.save(own_ice(3), tmp_path / "ice.msh")
    changes = [f"{body}.mesh={tmp_path / f'{body}.msh'}" for body in ("rubber", "ice")]
    with pytest.raises(SceneError, match="rubber.mesh is a whole block"):
        ice_body(a_scene(tmp_path, "block", *changes, layers=["Steel"]))


def test_shares_of_a_rectangle_are_found():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    ranges = [(0.0, 1.0), (0.0, 1.0)]
    turned = 0.5 + (square - 0.5) @ np.array([[1.0, 1.0], [-1.0, 1.0]])  # its middles are corners
    assert covered(np.array([square]), ranges) == pytest.approx(1.0)
    assert covered(np.array([turned]), ranges) == pytest.approx(1.0)
    assert covered(np.array([0.5 * turned]), ranges) == pytest.approx(0.5 - 0.125)
    assert covered(np.array([square + 0.5, square - [0.5, 0.0], square + 5.0]), ranges) == 0.75
    assert covered(np.array([[[0.0], [0.25]], [[0.75], [2.0]]]), [(0.0, 1.0)]) == 0.5


# --- the example and the picture


def test_the_example_is_what_its_script_makes(tmp_path):
    script = ROOT / "meshes" / "make_ice_on_steel.py"
    subprocess.run([sys.executable, str(script), str(tmp_path)], check=True)
    for name, dim in (("ice_on_steel", 2), ("ice_on_steel_half", 3)):
        made, kept = (
            load_user_ice(folder / f"{name}.msh", dim, "m", ["steel"])
            for folder in (tmp_path, ROOT / "meshes")
        )
        np.testing.assert_array_equal(made.cells, kept.cells)
        np.testing.assert_allclose(made.points, kept.points, atol=1e-12)
        z = np.unique(np.round(kept.points[:, -1], 10))[::-1]
        assert z[-1] == -11e-3 and 1.7e-6 < -z[1] < 2.2e-6
        assert ("symmetry" in kept.facets) == (dim == 3)
        steel = kept.points[kept.cells[kept.regions["steel"]], -1]
        assert steel.max() == pytest.approx(-1e-3)


@pytest.mark.parametrize("model", ["slice", "block"])
def test_the_picture_shows_ice_and_layers(model, tmp_path):
    name = "ice_on_steel" + ("_half" if model == "block" else "")
    own = f"ice.mesh={ROOT / 'meshes' / name}.msh"
    draw_mesh(a_scene(tmp_path, model, own, layers=["steel"]), tmp_path / "mesh.png")
    picture = matplotlib.image.imread(tmp_path / "mesh.png")[..., :3]
    for colour in ("c6e5f5", "ead6a8", "d55e00"):  # ice, steel, contact
        wanted = np.array([int(colour[n : n + 2], 16) for n in (0, 2, 4)]) / 255
        assert (np.abs(picture - wanted).max(axis=2) < 0.01).sum() > 500


def test_info_tells_the_cells_of_regions(tmp_path):
    own = f"ice.mesh={ROOT / 'meshes' / 'ice_on_steel.msh'}"
    rows = {
        row.quantity: row for row in describe(a_scene(tmp_path, "slice", own, layers=["steel"]))
    }
    assert rows["cells of ice"].value == "828"
    assert rows["cells of ice"].meaning.startswith("576 of ice, 252 of steel")
    assert rows["topmost cells of ice"].value == "1.85 µm"
