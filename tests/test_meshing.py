"""Meshes of rubber and ice, and users' own meshes."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import ufl  # noqa: E402
from dolfinx import fem  # noqa: E402
from mesh_writers import write_mesh  # noqa: E402
from mpi4py import MPI  # noqa: E402
from program import run  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.film.ice_heat import Column  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.mesh import box, gmsh_model  # noqa: E402
from iceslide_fem.mesh import ice as ice_meshing
from iceslide_fem.mesh import rubber as rubber_meshing
from iceslide_fem.mesh.gmsh_model import owners  # noqa: E402
from iceslide_fem.mesh.grid import graded, tensor_grid  # noqa: E402
from iceslide_fem.mesh.named_cells import rubber_file  # noqa: E402
from iceslide_fem.mesh.tagged import mesh_size  # noqa: E402
from iceslide_fem.mesh.user_mesh import load_user_mesh  # noqa: E402
from iceslide_fem.runs.notes import notes  # noqa: E402
from iceslide_fem.runtime.curve import Curve  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.runtime.ranks import from_root  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from iceslide_fem.scene.course import Course  # noqa: E402
from iceslide_fem.scene.materials import ICE, Layer  # noqa: E402

SPEEDS = Course(Curve.of(3.0), 7e-3)
HALF_SPACE = Layer("ice", np.inf, ICE)
CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"

pytestmark = [pytest.mark.fe, pytest.mark.versions]

ROOT = Path(__file__).parent.parent
WORLD = MPI.COMM_WORLD


def a_scene(model, length=1e-3, width=1e-3, height=1e-3, refinement=1.0, mesh=None, margin=0.3e-3):
    return SimpleNamespace(
        name="a-scene",
        model=model,
        rubber=SimpleNamespace(
            length=length,
            width=width,
            height=height,
            mesh=mesh,
            step=None,
            is_drawn=mesh is not None,
            layers=(),
            heights=(),
            mesh_unit="m",
            mesh_tags={},
            heat=False,
            outline=None,
            cuts=(),
            grooves=(),
            edge_radius=0.0,
            chamfer=0.0,
            draft_angle=0.0,
        ),
        load=SimpleNamespace(duration=7e-3, speed=3.0, speeds=SPEEDS),
        ice=SimpleNamespace(
            margin=margin, motion="attached", heat="continuum", solid=ICE, stack=(HALF_SPACE,)
        ),
        numerics=SimpleNamespace(refinement=refinement, tolerance=1e-3),
    )


def distributed_ice(lines):
    """The ice on grid `lines` in DOLFINx."""
    tagged = from_root(lambda: ice_meshing.tagged_ice(lines, [HALF_SPACE]), WORLD)
    return gmsh_model.distribute(tagged, WORLD)


def measures(meshed):
    """Volume, and area of every tagged part."""
    one = fem.Constant(meshed.mesh, 1.0)
    outer = ufl.Measure("ds", meshed.mesh, subdomain_data=meshed.facet_tags)
    volume = compat.assemble_scalar(compat.form(one * ufl.dx(meshed.mesh)), WORLD)
    return volume, {
        name: compat.assemble_scalar(compat.form(one * outer(tag)), WORLD)
        for name, tag in meshed.tags.items()
    }


# --- grids


def test_graded_lines_reach_the_end_and_grow_as_asked():
    lines = graded(1.0, first=0.01, slope=0.2, largest=0.08)
    sizes = np.diff(lines)
    assert lines[0] == 0.0 and lines[-1] == 1.0
    assert sizes[0] == pytest.approx(0.01, rel=0.15)
    assert sizes[-1] == pytest.approx(0.08, rel=0.05)
    assert (np.diff(sizes) > -1e-12).all()
    assert (sizes[1:] / sizes[:-1]).max() < np.exp(0.2) + 1e-9


def test_graded_lines_double_in_number_under_refinement():
    coarse, fine = graded(1.0, 0.02, 0.2, 0.1), graded(1.0, 0.01, 0.1, 0.05)
    assert len(fine) - 1 == pytest.approx(2 * (len(coarse) - 1), abs=1)


def test_one_cell_where_there_is_no_room():
    np.testing.assert_array_equal(graded(1.0, 5.0, 0.1, 10.0), [0.0, 1.0])
    np.testing.assert_array_equal(graded(1.0, 5.0, 0.1, 2.0), [0.0, 1.0])


@pytest.mark.parametrize(
    "scene, counts",
    [
        (a_scene("slice"), {"nx": 26, "nz": 20}),
        (a_scene("block"), {"nx": 18, "ny": 4, "nz": 6}),
        (a_scene("block", length=20e-3, height=6e-3, width=10e-3), {"nx": 14, "ny": 5, "nz": 6}),
        (a_scene("slice", refinement=2.0), {"nx": 50, "nz": 42}),
        (a_scene("block", refinement=2.0), {"nx": 36, "ny": 8, "nz": 12}),
    ],
)
def test_divisions_of_a_cube(scene, counts):
    found = rubber_meshing.divisions(scene)
    assert {name: found[name] for name in counts} == counts


def test_divisions_of_thin_and_long_blocks():
    thin = rubber_meshing.divisions(a_scene("slice", height=0.05e-3))
    assert 2 <= thin["nz"] <= 6 and 20 <= thin["nx"] <= 40
    long = rubber_meshing.divisions(a_scene("slice", length=20e-3, height=6e-3))
    assert long["largest_m"] <= 4.2 * 6e-3 / long["nz"]


def test_cells_are_smallest_at_the_contact_edges():
    x, y, z = box.box_lines(rubber_meshing.block_shape(a_scene("block")), 1.0)
    assert np.allclose(x, -x[::-1])
    assert np.diff(x)[0] == pytest.approx(np.diff(x).max() / 2.5, rel=0.25)
    assert np.argmin(np.diff(y)) == len(y) - 2
    assert np.allclose(np.diff(z), np.diff(z)[::-1]) and np.argmin(np.diff(z)) in (0, len(z) - 2)


# --- rubber and ice in DOLFINx


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["slice", "block"])
def test_every_rank_gets_its_share_of_cells_and_contact(model):
    block = rubber_meshing.rubber_mesh(load_scene(CASE, [f"model={model}"]), WORLD)
    topology, comm = block.mesh.topology, WORLD
    contact = block.facet_tags.indices[block.facet_tags.values == block.tags["contact"]]
    low = compat.midpoints(block.mesh, contact)[:, topology.dim - 1] < 1e-9
    bottom = len(compat.facet_cell_pairs(block.mesh, contact[low])[0])
    cells = topology.index_map(topology.dim).size_local
    for count in (cells, bottom):
        counts = comm.allgather(count)
        assert max(counts) - min(counts) <= 0.1 * sum(counts) / comm.size + 1
    alone = rubber_meshing.rubber_mesh(load_scene(CASE, [f"model={model}"]), MPI.COMM_SELF)
    shared, whole = (one.mesh.topology.index_map(0).size_global for one in (block, alone))
    assert shared == whole


def test_cells_are_shared_out_in_columns():
    x, z = np.meshgrid(np.arange(6.0), np.arange(4.0), indexing="ij")
    found = owners(x.ravel()[:, None], 3).reshape(x.shape)
    assert (found == np.repeat([0, 1, 2], 2)[:, None]).all()
    assert owners(np.zeros((0, 2)), 3).size == 0


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["slice", "block"])
def test_rubber_has_its_volume_and_parts(model):
    meshed = rubber_meshing.rubber_mesh(a_scene(model, 2e-3, 1.5e-3, 1e-3), WORLD)
    volume, areas = measures(meshed)
    sides = areas["contact"]
    if model == "slice":
        assert volume == pytest.approx(2e-6)
        assert areas["plate"] == pytest.approx(2e-3)
        assert 2e-3 + 2 * 0.35e-3 < sides < 2e-3 + 2 * 0.6e-3
    else:
        assert volume == pytest.approx(1.5e-9)
        assert areas["plate"] == pytest.approx(1.5e-6)
        assert areas["symmetry"] == pytest.approx(2e-6)
        assert 1.5e-6 + 3.5e-3 * 0.35e-3 < sides < 1.5e-6 + 3.5e-3 * 0.6e-3


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["slice", "block"])
def test_ice_covers_the_footprint_and_its_margin(model):
    scene = a_scene(model)
    lines = ice_meshing.ice_lines(scene)
    thermal = (1.105e-6 * 7e-3) ** 0.5
    length, depth = 1.6e-3, -lines[-1][0]
    assert 4 * thermal < depth < 6 * thermal
    width = 1.0 if model == "slice" else 0.8e-3
    volume, areas = measures(distributed_ice(lines))
    assert volume == pytest.approx(length * width * depth, rel=2e-3)
    assert areas["surface"] == pytest.approx(length * width, rel=2e-3)
    assert ("symmetry" in areas) == (model == "block")
    below = lines[0][(lines[0] >= -0.5e-3) & (lines[0] <= 0.5e-3)]
    along, *across = box.box_lines(rubber_meshing.block_shape(scene), 1.0)[:-1]
    of_ice, of_rubber = (2, 1) if model == "slice" else (4, 3)  # whose cells are short along x
    np.testing.assert_allclose(below[::of_ice], along[::of_rubber])
    for line in across:
        inside = lines[1][lines[1] <= line[-1] * (1.0 + 1e-9)]
        np.testing.assert_allclose(inside[::2], line[line >= 0.0])


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["slice", "block"])
def test_ice_lines_locate_the_nodes(model):
    lines = ice_meshing.ice_lines(a_scene(model))
    nodes = distributed_ice(lines).mesh.geometry.x
    for axis, line in enumerate(lines):
        assert np.isin(nodes[:, axis], line).all()


@pytest.mark.parametrize(
    ("duration", "motion", "heated"),
    [
        (7e-3, "attached", 7e-3),
        (1e-5, "attached", 1e-5),
        (7e-3, "sliding", 1e-3 / 3.0),  # below 1 mm at 3 m/s for a third of a millisecond
        (1e-4, "sliding", 1e-4),
    ],
)
def test_layers_are_those_of_the_time_that_ice_is_heated(duration, motion, heated):
    scene = a_scene("slice", margin=0.0)
    scene.load.duration, scene.ice.motion = duration, motion
    z = ice_meshing.ice_lines(scene)[-1]
    np.testing.assert_allclose(-z[::-1], Column(269.15, heated).depths, rtol=1e-9)


def test_a_run_that_goes_on_slower_has_the_layers_of_the_one_before():
    scene = a_scene("slice", margin=0.0)
    scene.ice.motion = "sliding"
    scene.load.speeds = Course(Curve((0.0, 10e-3), (4.0, 0.2)), 10e-3)  # m/s
    first, longer = ice_meshing.heating_times(scene, 1e-3, [5e-3, 10e-3])
    scene.load.speeds = Course(Curve((0.0, 10e-3), (4.0, 0.2)), 5e-3)
    assert first == ice_meshing.heating_times(scene, 1e-3, 5e-3) == pytest.approx(1e-3 / 2.1)
    assert longer == pytest.approx(1e-3 / 0.2)


def test_ice_footprint_can_be_given():
    lines = ice_meshing.patch_lines(a_scene("block", margin=0.0), [(-1e-3, 0.5e-3), (0, 0.7e-3)])
    ends = [(line[0], line[-1]) for line in lines]
    np.testing.assert_allclose(ends, [(-1e-3, 0.5e-3), (0, 0.7e-3)])


# --- files


def test_meshes_are_written_on_request(tmp_path):
    paths = write_mesh(a_scene("block"), tmp_path / "meshes")
    assert [path.name for path in paths] == ["a-scene_rubber.msh", "a-scene_ice.msh"]
    written = gmsh_model.load(rubber_file(paths[0], 3))
    assert len(written.cells) == 18 * 4 * 6
    assert list(written.facets) == ["contact", "plate", "symmetry"]


# --- users' own meshes


def a_block(dim=2, **changed):
    """A rubber block of 2 x (1 x) 1 mm with all its parts; keywords replace or drop (None) some."""
    lines = [np.linspace(-1e-3, 1e-3, 5), np.linspace(0, 1e-3, 4), np.linspace(0, 1e-3, 5)]
    parts = {
        "contact": lambda centre: (centre[:, -1] < 0.6e-3) & (centre[:, dim - 2] != 0.0),
        "plate": lambda centre: centre[:, -1] == 1e-3,
    }
    if dim == 2:
        parts["contact"] = lambda centre: centre[:, -1] < 0.6e-3
    parts |= changed
    chosen = {name: choose for name, choose in parts.items() if choose is not None}
    return tensor_grid(lines if dim == 3 else [lines[0], lines[2]], "rubber", chosen)


def test_a_good_mesh_is_read(tmp_path):
    for dim in (2, 3):
        gmsh_model.save(a_block(dim), tmp_path / "block.msh")
        tagged = load_user_mesh(tmp_path / "block.msh", dim)
        assert len(tagged.cells) == 16 * (3 if dim == 3 else 1)
        assert ("symmetry" in tagged.facets) == (dim == 3)


def test_the_size_of_a_users_mesh(tmp_path):
    for dim, nodes in ((2, 9 * 9), (3, 9 * 7 * 9)):
        size = mesh_size(a_block(dim))
        assert size["quadratic_nodes"] == nodes
        assert size["smallest_m"] == pytest.approx(0.25e-3)


def raised(by=0.0, scaled=1.0, **changed):
    block = a_block(**changed)
    return block._replace(points=scaled * block.points + [0.0, by])


def round_below(block):
    x, z = block.points.T
    return block._replace(points=np.stack([x, z + 0.2 * abs(x) * (1.0 - z / 1e-3)], axis=1))


def twice(block):
    return block._replace(facets={**block.facets, "symmetry": block.facets["plate"][:1]})


BAD = {
    'no facets tagged "plate"; tags found: contact': a_block(plate=None),
    'no facets tagged "contact"; tags found: plate': a_block(contact=None),
    'no cells tagged "rubber"; tags found: contact, gum, plate': a_block()._replace(body="gum"),
    '"plate" are not flat, they reach from 0.0005 m to 0.001 m': a_block(
        contact=lambda centre: centre[:, -1] == 0.0, plate=lambda centre: centre[:, -1] > 0.6e-3
    ),
    '"plate" are at 0 m; they must lie on the top at 0.001 m': a_block(
        contact=lambda centre: centre[:, -1] > 0.3e-3, plate=lambda centre: centre[:, -1] == 0.0
    ),
    'near (-0.00075, 0) m: the facet there lies on the ice and is not tagged "contact"': a_block(
        contact=lambda centre: (centre[:, -1] < 0.6e-3) & ((centre[:, -1] > 0) | (centre[:, 0] > 0))
    ),
    '"contact" begin at 0.0006 m; they must include the lowest points': round_below(
        a_block(contact=lambda centre: (centre[:, -1] > 0.5e-3) & (centre[:, -1] < 0.9e-3))
    ),
    '"contact" lie on the top': a_block(
        contact=lambda centre: (centre[:, -1] == 0.0) | (centre[:, 0] > 0.5e-3),
        plate=lambda centre: (centre[:, -1] == 1e-3) & (centre[:, 0] < 0.5e-3),
    ),
    "lowest point is at 0.002 m; move the mesh by -0.002 m": raised(by=2e-3),
    'is 2 m large; allowed: 1e-05 to 0.3 m; rubber.mesh_unit = "m" says': raised(scaled=1e3),
    'a facet is tagged "plate" and "symmetry"': twice(a_block()),
    "has no height; a slice lies in the plane of x and y": a_block()._replace(
        points=a_block().points * [1.0, 0.0]
    ),
}


@pytest.mark.parametrize("message", BAD)
def test_a_bad_mesh_is_refused_with_the_reason(message, tmp_path):
    gmsh_model.save(BAD[message], tmp_path / "bad.msh")
    with pytest.raises(SceneError) as refusal:
        load_user_mesh(tmp_path / "bad.msh", 2)
    assert message in str(refusal.value)
    assert str(tmp_path / "bad.msh") in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_run_on_a_bad_mesh_leaves_what_was_there(tmp_path):
    gmsh_model.save(a_block(plate=None), tmp_path / "bad.msh")
    scene = load_scene(CASE, ["model=slice", f"rubber.mesh={tmp_path / 'bad.msh'}"])
    with pytest.raises(SceneError, match='no facets tagged "plate"'):
        run(scene, tmp_path / "new")
    assert not (tmp_path / "new").exists()
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "summary.json").write_text("{}")
    with pytest.raises(SceneError, match='no facets tagged "plate"'):
        run(scene, tmp_path / "old", force=True)
    assert (tmp_path / "old" / "summary.json").read_text() == "{}"


def test_a_penalty_too_soft_for_the_height_of_a_mesh_is_refused(tmp_path):
    gmsh_model.save(a_block(), tmp_path / "own.msh")
    changes = [f"rubber.mesh={tmp_path / 'own.msh'}", "numerics.penalty=0.01MPa/mm"]
    scene = load_scene(CASE, ["model=slice", "rubber.mesh_unit=m", *changes])
    assert not any("penalty" in note for note in notes(scene))
    with pytest.raises(SceneError, match="too soft: the block would sink 10 mm into the ice"):
        run(scene, tmp_path / "new")


def test_symmetry_must_be_at_the_middle(tmp_path):
    block = a_block(3)
    gmsh_model.save(block._replace(points=block.points + [0, 1e-3, 0]), tmp_path / "bad.msh")
    with pytest.raises(SceneError, match='"symmetry" must be at y = 0'):
        load_user_mesh(tmp_path / "bad.msh", 3)


def test_a_mesh_of_the_wrong_dimension(tmp_path):
    gmsh_model.save(a_block(2), tmp_path / "flat.msh")
    with pytest.raises(SceneError, match="must be made of 3-dimensional cells"):
        load_user_mesh(tmp_path / "flat.msh", 3)


ONE_CELL_MU = {"attached": 0.22210, "sliding": 0.22530}  # mean, on one rank
ONE_CELL = """\
*NODE
1, -0.5, 0
2, 0.5, 0
3, 0.5, 1
4, -0.5, 1
*ELEMENT, TYPE=CPE4H, ELSET=rubber
1, 1, 2, 3, 4
*SURFACE, NAME=contact
rubber, S1
rubber, S2
rubber, S4
*SURFACE, NAME=plate
rubber, S3
"""


@pytest.mark.mpi
@pytest.mark.parametrize("motion", ["attached", "sliding"])
def test_a_mesh_with_fewer_cells_than_ranks_runs(motion, tmp_path):
    """All ranks but one have neither cells nor contact: mu(t) is that of one rank."""
    path = Path(WORLD.bcast(str(tmp_path)))
    if WORLD.rank == 0:
        (path / "one.inp").write_text(ONE_CELL)
    WORLD.barrier()
    changes = ["model=slice", f"rubber.mesh={path / 'one.inp'}", "rubber.mesh_unit=mm"]
    changes += [f"ice.motion={motion}", "load.duration=0.2ms", "numerics.tolerance=0.02"]
    summary = run(load_scene(CASE, changes), path / "out")
    assert summary["mu_mean"] == pytest.approx(ONE_CELL_MU[motion], rel=1e-3)
    if WORLD.rank == 0:
        rows = (path / "out" / "history.csv").read_text().splitlines()
        force = rows[0].split(",").index("normal_force_N")
        assert float(rows[-1].split(",")[force]) == pytest.approx(0.1, rel=1e-5)  # 1 bar, 1 mm2


@pytest.mark.mpi
def test_a_bad_mesh_is_refused_on_every_rank(tmp_path):
    (tmp_path / "bad.msh").write_text("this is no mesh")
    with pytest.raises(SceneError, match="bad.msh"):
        rubber_meshing.rubber_mesh(a_scene("slice", mesh=tmp_path / "bad.msh"), WORLD)


@pytest.mark.mpi
@pytest.mark.parametrize("model, name", [("slice", "siped_block"), ("block", "siped_block_half")])
def test_the_example_mesh(model, name):
    scene = a_scene(model, mesh=ROOT / "meshes" / f"{name}.msh")
    volume, areas = measures(rubber_meshing.rubber_mesh(scene, WORLD))
    width = 1.0 if model == "slice" else 3e-3
    corners, sipe = 2 * (1 - np.pi / 4) * 0.4e-3**2, 0.4e-3 * 2.6e-3 + np.pi / 2 * 0.2e-3**2
    assert volume == pytest.approx(width * (24e-6 - corners - sipe), rel=2e-3)
    assert areas["plate"] == pytest.approx(6e-3 * width)
    x, *y, _ = ice_meshing.ice_lines(scene)
    assert x[0] <= -3e-3 < 3e-3 <= x[-1]
    assert model == "slice" or y[0][0] == 0.0


def test_the_case_of_the_example_mesh():
    scene = load_scene(ROOT / "cases" / "user_mesh.toml")
    assert rubber_meshing.divisions(scene)["cells"] > 100


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["slice", "block"])
def test_sipes_are_cut_out_of_the_box(model):
    sizes = "length=20mm width=10mm height=6mm sipes=2 sipe_width=0.6mm sipe_depth=4mm".split()
    changes = [f"model={model}", "numerics.refinement=1", *(f"rubber.{size}" for size in sizes)]
    scene = load_scene(ROOT / "cases" / "tread_block.toml", changes)
    rubber = rubber_meshing.rubber_mesh(scene, WORLD)
    half_width = 1.0 if model == "slice" else 5e-3

    def integral(measure):
        one = fem.Constant(rubber.mesh, 1.0) * measure
        return compat.assemble_scalar(compat.form(one), WORLD) / half_width

    ds = ufl.Measure("ds", domain=rubber.mesh, subdomain_data=rubber.facet_tags)
    assert integral(ufl.dx) == pytest.approx(20e-3 * 6e-3 - 2 * 0.6e-3 * 4e-3)
    # Bottom, sides up to the first line beyond half the height, and the walls of the sipes.
    bottom = 20e-3 - 2 * 0.6e-3
    walls = integral(ds(rubber.tags["contact"])) - bottom + integral(ds(rubber.tags["walls"]))
    if model == "block":  # the outer side
        walls -= (20e-3 - 2 * 0.6e-3) * 3e-3 / half_width
    assert walls == pytest.approx(2 * 3e-3 + 4 * 4e-3, rel=0.1)
    assert integral(ds(rubber.tags["plate"])) == pytest.approx(20e-3)


def test_opening_of_the_sipes_follows_the_displacements():
    scene = load_scene(ROOT / "cases" / "siped_block.toml", ["numerics.refinement=0.5"])
    block = build_block(scene, WORLD)
    assert block.smallest_opening() == pytest.approx(0.6e-3)
    u = block.rubber.displacements
    x = block.rubber.space.tabulate_dof_coordinates()[:, 0]
    u[:, 0] = -0.5 * x
    assert block.smallest_opening() == pytest.approx(0.3e-3)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["rubber.sipes=3", "rubber.sipe_width=3mm"], "rubber.sipe_width = 3 mm"),
        (["rubber.sipes=1", "rubber.sipe_depth=5.5mm"], "rubber.sipe_depth = 5.5 mm"),
        (["rubber.sipes=9"], "rubber.sipes"),
    ],
)
def test_sipes_that_do_not_fit_are_refused(changes, said):
    with pytest.raises(SceneError, match=said):
        load_scene(ROOT / "cases" / "tread_block.toml", changes)
