"""A block of two compounds: the same numbers as one if both are alike, else those of a series."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from blocks import CELLS, SIZE, a_block  # noqa: E402
from dolfinx import mesh as dolfinx_mesh  # noqa: E402
from scipy.optimize import brentq  # noqa: E402
from slides import slide, started  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.heat.elements import QuadraticElements  # noqa: E402
from iceslide_fem.heat.equation import HeatEquation, of_regions  # noqa: E402
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody  # noqa: E402
from iceslide_fem.mechanics.materials import Material  # noqa: E402
from iceslide_fem.mechanics.stress import CellPoints, Deformation, cauchy_stress  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.grid import tensor_grid  # noqa: E402
from iceslide_fem.mesh.rubber import tagged_rubber  # noqa: E402
from iceslide_fem.relaxation.prony import Prony, Relaxation  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene import load_scene, scene_from_dict  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS, MooneyRivlin, Solid  # noqa: E402

pytestmark = pytest.mark.fe
B, HARD = COMPOUNDS["B"], MooneyRivlin(0.9e6, 0.6e6, 0.02e-6)
ONE = Relaxation(Prony((0.3,), (5e-3,)))
WHOLE = {"rubber", "base"}


def layered(cells, n=4):
    """The block of `a_block` with its upper half as the region "base"."""
    block = a_block(cells, n)
    dim, middles = block.mesh.topology.dim, compat.cell_midpoints(block.mesh)
    ghosts = block.mesh.topology.index_map(dim).num_ghosts
    every = np.arange(len(middles) + ghosts, dtype=np.int32)
    middles = dolfinx_mesh.compute_midpoints(block.mesh, dim, every)
    if middles.shape[0] == 3 != len(every):
        middles = middles.T
    number = np.where(middles[:, dim - 1] > 0.5 * SIZE, 2, 1).astype(np.int32)
    tags = dolfinx_mesh.meshtags(block.mesh, dim, every, number)
    return block._replace(cell_tags=tags, regions={"rubber": 1, "base": 2})


def bent(rubber, upper, lower):
    """Deform the halves by the gradients `upper` and `lower` (d, d), which fit at the middle; the
    nodal forces that hold it (n, d), N, and the nodes (n, d), m, of this rank.
    """
    dim = rubber.mesh.geometry.dim
    X = rubber.space.tabulate_dof_coordinates()[:, :dim]
    above = np.maximum(X[:, -1:] - 0.5 * SIZE, 0.0) * (upper - lower)[:, -1]
    rubber.displacements[:] = X @ (lower - np.eye(dim)).T + above
    forces = rubber.create_vector()
    rubber.internal_forces(forces)
    compat.sum_ghosts(forces)
    owned = forces.array.reshape(-1, dim)
    return owned, X[: len(owned)]


def piola(F, material):
    """First Piola stress (3, 3), Pa, of a gradient (3, 3)."""
    sigma = cauchy_stress(Deformation.of(F), material)
    return np.linalg.det(F) * sigma @ np.linalg.inv(F).T


@pytest.mark.mpi
@pytest.mark.parametrize("cells", ["quadrilateral", "hexahedron", "tetrahedron"])
def test_layers_in_series_are_in_balance_by_the_closed_form(cells):
    """Pressed between walls, and sheared: the stretch and the shear of each layer follow from one
    stress. No force is left at the nodes inside.
    """
    rubber = HyperelasticBody(layered(cells), {"rubber": Material(B), "base": Material(HARD)})
    dim = rubber.mesh.geometry.dim

    def gradient(stretch=1.0, shear=0.0):
        F = np.eye(3)
        F[2, 2], F[0, 2] = stretch, shear
        return F

    def share(make, soft, component, low, high):
        wanted = piola(make(soft), B)[component]
        hard = brentq(lambda x: piola(make(x), HARD)[component] - wanted, low, high, xtol=1e-15)
        kept = [0, 1, 2] if dim == 3 else [0, 2]
        upper, lower = (make(x)[np.ix_(kept, kept)] for x in (hard, soft))
        forces, x = bent(rubber, upper, lower)
        inside = (np.abs(x[:, -1] / SIZE - 0.5) < 0.49) & (np.abs(x[:, 0] / SIZE - 0.5) < 0.49)
        if dim == 3:
            inside &= np.abs(x[:, 1] / SIZE - 0.5) < 0.49
        axis = [0, None, dim - 1][component[0]]
        top = rubber.mesh.comm.allreduce(forces[x[:, -1] > 0.999 * SIZE, axis].sum())
        assert top == pytest.approx(wanted * SIZE ** (dim - 1), rel=1e-9)
        assert np.abs(forces[inside, axis]).max(initial=0.0) < 1e-9 * abs(top)

    share(lambda x: gradient(stretch=x), 0.97, (2, 2), 0.97, 1.0)
    share(lambda x: gradient(shear=x), 0.05, (0, 2), 0.0, 0.05)


@pytest.mark.parametrize("cells", CELLS)
def test_stress_and_energy_are_those_of_each_cells_compound(cells):
    rubber = HyperelasticBody(layered(cells, 2), {"rubber": Material(B), "base": Material(HARD)})
    dim = rubber.mesh.geometry.dim
    F = np.eye(3)
    F[:dim, :dim] += np.array([[0.1, -0.2, 0.05], [0.3, -0.15, 0.1], [-0.1, 0.2, 0.05]])[:dim, :dim]
    bent(rubber, F[:dim, :dim], F[:dim, :dim])
    every = np.arange(len(compat.cell_midpoints(rubber.mesh)))
    points, _ = compat.quadrature(compat.cell_name(rubber.mesh), 2)
    found = CellPoints(rubber, every, points).stress_and_energy(rubber.displacements)
    base = compat.cell_midpoints(rubber.mesh)[:, dim - 1] > 0.5 * SIZE
    for here, material in ((~base, B), (base, HARD)):
        expected = cauchy_stress(Deformation.of(F), material)
        np.testing.assert_allclose(found[here, :, 0], expected[0, 0], rtol=1e-9)
    total = 0.5 * SIZE**dim * sum(found[here, 0, 6][0] for here in (~base, base))
    assert rubber.elastic_energy() == pytest.approx(total)


def test_each_layer_relaxes_as_its_compound():
    """A shear that is held: stress falls by the arms of a cell's own compound, or not at all."""
    slow = Relaxation(Prony((0.2, 0.3), (1e-3, 20e-3)))
    for base, kept in ((None, 1.0), (slow, slow.prony.modulus(5e-3))):
        materials = {"rubber": Material(B, ONE), "base": Material(HARD, base)}
        rubber = HyperelasticBody(layered("quadrilateral", 2), materials)
        relaxing = rubber.viscoelasticity
        sheared = np.array([[1.0, 0.05], [0.0, 1.0]])
        bent(rubber, sheared, sheared)
        start = relaxing.at_rest()
        relaxing.begin_step(start, 5e-3, 270.0)
        after, heat, _ = relaxing.end_step(start, 5e-3, 270.0)
        upper = compat.cell_midpoints(rubber.mesh)[:, 1] > 0.5 * SIZE
        left = 1.0 - after.relaxed[..., 3].sum(axis=0) / after.strained.stress[..., 3]
        np.testing.assert_allclose(left[upper], kept, rtol=1e-12)
        np.testing.assert_allclose(left[~upper], ONE.prony.modulus(5e-3), rtol=1e-12)
        assert (heat[~upper] > 0.0).all() and np.all((heat[upper] > 0.0) == (base is not None))
        at = np.full(relaxing.volume.shape, 270.0)
        again = relaxing.end_step(start, 5e-3, at).after
        np.testing.assert_allclose(again.relaxed, after.relaxed, rtol=1e-14)


def test_mass_and_heat_are_those_of_each_layer():
    rubber = HyperelasticBody(
        layered("hexahedron", 2),
        {"rubber": Material(B, density=1000.0), "base": Material(B, density=1500.0)},
    )
    velocity = np.ones_like(rubber.displacements).ravel()
    assert rubber.momentum(velocity) == pytest.approx(1250.0 * SIZE**3)
    block = layered("hexahedron", 2)
    solids = {"rubber": Solid(0.2, 1000.0, 1500.0), "base": Solid(0.3, 1500.0, 1800.0)}
    equation = HeatEquation(block, QuadraticElements(block.mesh), of_regions(block, solids))
    total = block.mesh.comm.allreduce(equation.capacity.sum())
    assert total == pytest.approx(0.5 * (1.5e6 + 2.7e6) * SIZE**3)


LINES = [np.linspace(-1e-3, 1e-3, 13), np.linspace(0.0, 1e-3, 9)]
PARTS = {"contact": lambda c: c[:, -1] < 0.5e-3, "plate": lambda c: c[:, -1] > 0.999e-3}
BASE = {"name": "base", "C10": 0.9e6, "C01": 0.6e6, "D1": 0.02e-6}
SAME = {"name": "base", "compound": "B"}


@pytest.fixture
def drawn(tmp_path):
    """A mesh of 2 x 1 mm whose upper half has the name "base"; files of it in three formats."""
    tagged = tensor_grid(LINES, "rubber", PARTS)
    upper = tagged.points[tagged.cells][..., -1].mean(axis=1) > 0.5e-3
    split = {"rubber": np.flatnonzero(~upper), "base": np.flatnonzero(upper)}
    gmsh_model.save(tagged, tmp_path / "one.msh")
    gmsh_model.save(tagged._replace(regions=split), tmp_path / "two.msh")
    lines = ["*NODE"]
    lines += [f"{n}, {x!r}, {z!r}" for n, (x, z) in enumerate(tagged.points.tolist(), 1)]
    for name, cells in (("cap", split["rubber"]), ("base", split["base"])):
        lines.append(f"*ELEMENT, TYPE=CPE4H, ELSET={name}")
        lines += [f"{n + 1}, {', '.join(map(str, tagged.cells[n] + 1))}" for n in cells]
    lines += ["*ELSET, ELSET=rubber", "cap, base"]
    for name, facets in tagged.facets.items():
        lines += [f"*NSET, NSET={name}", *map(str, np.unique(facets) + 1)]
    for name, material in (("cap", "soft"), ("base", "hard")):
        lines += [
            f"*SOLID SECTION, ELSET={name}, MATERIAL={material}",
            f"*MATERIAL, NAME={material}",
        ]
    (tmp_path / "two.inp").write_text("\n".join(lines) + "\n")
    return tmp_path


def a_scene(mesh, *layers, penalty=None, **rubber):
    return scene_from_dict(
        {
            "name": "layers",
            "model": "slice",
            "rubber": {"compound": "B", "mesh": str(mesh), "layers": list(layers), **rubber},
            "load": {"pressure": "1 bar", "speed": "3 m/s", "duration": "0.2 ms"},
            "numerics": {"tolerance": 1e-2, "penalty": penalty},
        }
    )


RELAXES = {"prony": [[0.2, 1e-4], [0.1, 1e-3]], "modulus_is": "instantaneous"}


@pytest.mark.parametrize("more", [{}, RELAXES], ids=["elastic", "relaxes"])
def test_two_equal_rubbers_are_one_to_the_last_digit(drawn, more):
    one = slide(a_scene(drawn / "one.msh", **more))
    for file, layer in (("two.msh", {}), ("one.msh", {"above": "0.5 mm"}), ("two.inp", {})):
        both = slide(a_scene(drawn / file, {**SAME, **more, **layer}, **more))
        for column, values in one.items():
            np.testing.assert_array_equal(values, both[column], err_msg=f"{file} {column}")


def test_a_stiffer_base_is_the_same_by_sets_groups_and_height(drawn):
    found = [
        slide(a_scene(drawn / file, {**BASE, **layer}))
        for file, layer in (("two.msh", {}), ("one.msh", {"above": "0.5 mm"}), ("two.inp", {}))
    ]
    soft = slide(a_scene(drawn / "one.msh"))
    assert found[0]["plate_displacement_m"][0] < 0.75 * soft["plate_displacement_m"][0]
    for other in found[1:]:
        for column, values in found[0].items():
            np.testing.assert_array_equal(values, other[column], err_msg=column)


def test_a_metal_insert_is_a_plate(drawn):
    """Below a base of steel the rubber behaves as below a plate at that height."""
    steel = {"name": "base", "C10": "40000 MPa", "C01": 0, "nu": 0.3}
    insert = slide(a_scene(drawn / "two.msh", steel, penalty=1e11))
    low = [LINES[0], LINES[1][:5]]
    parts = PARTS | {"plate": lambda c: c[:, -1] > 0.499e-3}
    gmsh_model.save(tensor_grid(low, "rubber", parts), drawn / "low.msh")
    bonded = slide(a_scene(drawn / "low.msh", penalty=1e11))
    for column in ("mu", "plate_displacement_m"):
        np.testing.assert_allclose(insert[column][-1], bonded[column][-1], rtol=5e-4)


def test_springs_in_series_by_the_whole_program():
    """Poisson's ratio 0, small strain: the plate sinks by p sum h/E and the contact's own."""
    rubber = {"C10": "30 MPa", "C01": 0, "nu": 0, "length": "2 mm", "height": "1 mm"}
    base = {"name": "base", "C10": "120 MPa", "C01": 0, "nu": 0, "above": "0.6 mm"}
    scene = scene_from_dict(
        {
            "name": "series",
            "model": "slice",
            "rubber": {**rubber, "layers": [base]},
            "load": {"pressure": "1 bar", "speed": "3 m/s", "duration": "0.2 ms"},
            "film": {"k": 0.3, "D": "29 um", "H_V": "2.86 um"},
            "numerics": {"penalty": 1e13},
        }
    )
    block = started(scene).block
    top = block.rubber.displacements[block.rubber.plate, -1]
    moduli = 4.0 * 30e6, 4.0 * 120e6  # E = 2 G
    expected = 1e5 * (0.6e-3 / moduli[0] + 0.4e-3 / moduli[1]) + 1e5 / 1e13
    np.testing.assert_allclose(-top, expected, rtol=3e-3)


def test_the_built_in_mesh_has_a_line_at_every_layer():
    sipe = "rubber.sipes=1", "rubber.sipe_width=0.1mm", "rubber.sipe_depth=0.4mm"
    round_edge = "rubber.edge_radius=20um"
    for changes in ((), sipe, (round_edge,), ("model=block", round_edge)):
        layers = "rubber.layers=[{name='base', compound='B', above='0.37 mm'}]"
        scene = load_scene("cases/thesis_1bar.toml", ["model=slice", *changes, layers])
        tagged = tagged_rubber(scene)
        z = tagged.points[tagged.cells][..., -1]
        assert set(tagged.regions) == WHOLE
        assert z[tagged.regions["base"]].min() == pytest.approx(0.37e-3)
        assert z[tagged.regions["rubber"]].max() == pytest.approx(0.37e-3)


REFUSED = {
    "touches the ice": ([{**SAME, "name": "lower"}], {}),
    "inside cells of rubber.mesh": ([{**SAME, "above": "0.45 mm"}], {}),
    "leaves nothing to": ([{**SAME, "above": "3 mm"}], {}),
    "has the name .base. twice": ([SAME, SAME], {}),
    "not in order": ([{**SAME, "above": "0.5 mm"}, {**SAME, "name": "c", "above": "0.2 mm"}], {}),
    "rubber.layers needs compound": ([{"name": "base"}], {}),
    "rubber.layers.prony": ([{**SAME, "modulus_is": "long-term"}], {}),
    "no cells tagged .cord.; tags found": ([{**SAME, "name": "cord"}], {}),
    "mesh_tags.cord is not a known name": ([SAME], {"mesh_tags": {"cord": 3}}),
    "rubber.layers and model": ([SAME], {"model": "point"}),
}


@pytest.mark.parametrize("said", REFUSED)
def test_layers_that_cannot_be_are_refused(drawn, said):
    layers, more = REFUSED[said]
    tagged = tensor_grid(LINES, "rubber", PARTS)
    upper = tagged.points[tagged.cells][..., -1].mean(axis=1) > 0.5e-3
    split = {"rubber": np.flatnonzero(upper), "lower": np.flatnonzero(~upper)}
    gmsh_model.save(tagged._replace(regions=split), drawn / "lower.msh")
    name = {"touches the ice": "lower.msh"}.get(said, "one.msh")
    model = more.pop("model", "slice") if "model" in more else "slice"
    with pytest.raises(SceneError, match=said):
        scene = scene_from_dict(
            {**a_scene(drawn / "one.msh").as_dict(), "model": model,
             "rubber": {"compound": "B", "mesh": str(drawn / name), "layers": layers, **more}}
        )  # fmt: skip
        tagged_rubber(scene)


@pytest.mark.mpi
def test_two_rubbers_on_several_ranks_are_those_on_one():
    layers = "rubber.layers=[{name='base', C10='0.9 MPa', C01='0.6 MPa', nu=0.49, above='0.5 mm'}]"
    changes = ["model=slice", "numerics.refinement=0.5", "load.duration=0.2ms", layers]
    scene = load_scene("cases/thesis_1bar.toml", changes)
    alone, together = slide(scene), slide(scene, MPI.COMM_WORLD)
    np.testing.assert_allclose(together["mu"], alone["mu"], rtol=1e-6)
