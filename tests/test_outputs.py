"""Histories, summary and fields as files, on any number of ranks."""

import errno
import json
import math
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple, get_args

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import trapezoid

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import meshio  # noqa: E402
from blocks import CELLS, SIZE, a_block, all_of, bend  # noqa: E402
from program import rows_of, run  # noqa: E402
from runs import a_scene  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.sliding import Sliding  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.mechanics.contact_surface import contact_surface  # noqa: E402
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody  # noqa: E402
from iceslide_fem.mechanics.press import press, start_sliding  # noqa: E402
from iceslide_fem.mechanics.stress import (  # noqa: E402
    SIX,
    Deformation,
    cauchy_stress,
    strain_energy,
    von_mises,
)
from iceslide_fem.output.block_fields import BlockFields  # noqa: E402
from iceslide_fem.output.fields import (
    Fields,  # noqa: E402
    write_vtu,  # noqa: E402
)
from iceslide_fem.output.grids import FacetGrid, Grid, RubberGrid, tensor_grid  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.output.probes import Probes  # noqa: E402
from iceslide_fem.output.summary import write_summary  # noqa: E402
from iceslide_fem.output.table import Table  # noqa: E402
from iceslide_fem.postprocess.results import field_files  # noqa: E402
from iceslide_fem.runs.schedule import FieldTimes  # noqa: E402
from iceslide_fem.runtime.errors import OutputError, SceneError  # noqa: E402
from iceslide_fem.scene import load_scene, scene_from_dict  # noqa: E402
from iceslide_fem.scene.fingerprint import fingerprint  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS  # noqa: E402
from iceslide_fem.scene.numerics import FIELDS  # noqa: E402

WORLD = MPI.COMM_WORLD
CASES = Path(__file__).parent.parent / "cases"
PRESSURE_AND_SHEAR = ("contact pressure", "friction stress")
# pyvista reads in a process of its own, away from DOLFINx.
READ_BACK = """
import json, sys
from pathlib import Path
from iceslide_fem.postprocess.results.snapshots import read_snapshot
s = read_snapshot(Path(sys.argv[1]), int(sys.argv[2]))
print(json.dumps({
    "time": s.time,
    "cells": s.rubber.n_cells,
    "area": s.rubber.area,
    "rubber": list(s.rubber.bounds),
    "facets": len(s.interface.corners),
    "undeformed": s.undeformed.tolist(),
    "ice": s.ice.area,
    "warmest": float(s.ice.point_data["temperature (degC)"].max()),
}))
"""


class PhaseRow(NamedTuple):
    phase: str
    time_s: float
    n: int


def test_table_is_complete_after_every_row(tmp_path):
    path = tmp_path / "table.csv"
    with Table(path, PhaseRow, rank=0) as table:
        table.row(PhaseRow("press", 1.0 / 3.0, 4))
        assert path.read_text() == "phase,time_s,n\npress,0.3333333333,4\n"
        table.row(PhaseRow("ramp", np.float64(np.nan), np.int64(5)))
    assert rows_of(path)[1] == {"phase": "ramp", "time_s": "nan", "n": "5"}


def test_other_ranks_write_no_table(tmp_path):
    with Table(tmp_path / "table.csv", PhaseRow, rank=1) as table:
        table.row(PhaseRow("press", 0.0, 1))
    assert not list(tmp_path.iterdir())


def test_summary_is_json_without_nan(tmp_path):
    path = tmp_path / "summary.json"
    path.write_text("an older one")
    values = {"a": math.nan, "b": np.float64(0.5), "c": np.int64(3), "d": [np.inf, 1], "e": True}
    write_summary(path, values | {"scene": a_scene("slice").as_dict(), "path": Path("x")})
    read = json.loads(path.read_text())
    assert [read[key] for key in "abcde"] == [None, 0.5, 3, [None, 1], True]
    assert read["path"] == "x" and read["scene"]["name"] == "invented"
    assert [file.name for file in tmp_path.iterdir()] == ["summary.json"]


def a_folder(tmp_path):
    """One directory for all ranks."""
    return Path(WORLD.bcast(str(tmp_path), root=0))


def a_state(cells):
    """A bent block and its contact surface."""
    rubber = HyperelasticBody(a_block(cells), all_of(a_scene("slice").mooney_rivlin))
    bend(rubber)
    return rubber, contact_surface(rubber.space, rubber.facets("contact"), 4)


@pytest.mark.fe
@pytest.mark.mpi
@pytest.mark.parametrize("cells", CELLS)
def test_interface_holds_every_facet_once(cells):
    rubber, surface = a_state(cells)
    dim, n_facets = rubber.mesh.geometry.dim, WORLD.allreduce(len(surface.weights), op=MPI.SUM)
    at = surface.positions(rubber.displacements)
    gap = np.where(at[..., 0] > 0.5 * SIZE, at[..., -1], np.nan)
    facets = FacetGrid(rubber, surface)
    bent = whole(facets.grid(rubber.displacements, {"x (m)": at[..., 0], "gap (m)": gap}))
    rubber.displacements[:] = 0.0
    at = surface.positions(rubber.displacements)
    own = facets.grid(rubber.displacements, {"x (m)": at[..., 0], "gap (m)": at[..., -1]})
    flat = whole(own)
    assert len(flat.cells) == n_facets
    corners = flat.points[flat.cells]
    assert corners.shape[1] == {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3}.get(cells, 4)
    # means of the undeformed, plane facets are their centres; neighbours share their corners
    np.testing.assert_allclose(flat.cell_data["x (m)"], corners[..., 0].mean(axis=1), atol=1e-15)
    height = corners[..., dim - 1].mean(axis=1)
    np.testing.assert_allclose(flat.cell_data["gap (m)"], height, atol=1e-15)
    if own is not None:
        assert len(np.unique(own.points.round(9), axis=0)) == len(own.points)
    assert len(flat.points) < corners[..., 0].size
    if cells == "hexahedron":  # around the facet, not across it
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        np.testing.assert_allclose(sides, SIZE / 4, rtol=1e-9)
    assert dim == 3 or not flat.points[:, 2].any()
    # points without a value don't count; facets without any have none
    gaps = bent.cell_data["gap (m)"]
    right = bent.points[bent.cells][..., 0]
    assert np.isnan(gaps[right.max(axis=1) < 0.4 * SIZE]).all()
    assert np.isfinite(gaps[right.min(axis=1) > 0.6 * SIZE]).all()


def whole(grid):
    """All ranks' parts of a grid, on every rank."""
    parts = [part for part in WORLD.allgather(grid) if part is not None]
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    cells = [part.cells + start for part, start in zip(parts, starts[:-1], strict=True)]
    at_points, at_cells = (
        {
            name: np.concatenate([getattr(part, of)[name] for part in parts])
            for name in getattr(parts[0], of)
        }
        for of in ("point_data", "cell_data")
    )
    points = np.concatenate([part.points for part in parts])
    return Grid(points, parts[0].kind, np.concatenate(cells), at_points, at_cells)


def a_rotation():
    turn = np.radians(25.0)
    return np.array(
        [
            [np.cos(turn), 0.0, np.sin(turn)],
            [0.0, 1.0, 0.0],
            [-np.sin(turn), 0.0, np.cos(turn)],
        ]
    )


def test_stress_of_incompressible_uniaxial_tension():
    """sigma = 2 (l^2 - 1/l) (C10 + C01/l), whatever the orientation and with any pressure."""
    rubber, turn = a_scene("slice").mooney_rivlin, a_rotation()
    stretch = np.array([0.7, 0.9, 1.0, 1.3, 2.0])
    F = np.zeros((5, 3, 3))
    F[:, 0, 0], F[:, 1, 1], F[:, 2, 2] = stretch, stretch**-0.5, stretch**-0.5
    stress = turn.T @ cauchy_stress(Deformation.of(turn @ F), rubber) @ turn
    expected = 2.0 * (stretch**2 - 1.0 / stretch) * (rubber.C10 + rubber.C01 / stretch)
    np.testing.assert_allclose(stress[:, 0, 0] - stress[:, 2, 2], expected, rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(np.trace(stress, axis1=1, axis2=2), 0.0, atol=1e-6)
    energy = rubber.C10 * (stretch**2 + 2.0 / stretch - 3.0)
    energy += rubber.C01 * (2.0 * stretch + stretch**-2 - 3.0)
    np.testing.assert_allclose(
        strain_energy(Deformation.of(F), rubber), energy, rtol=1e-12, atol=1e-9
    )


def test_stress_of_simple_shear():
    """Shear stress 2 (C10 + C01) g; sigma_xx - sigma_zz = g times it (Rivlin's relation)."""
    rubber, shear = a_scene("slice").mooney_rivlin, np.array([0.0, 0.1, 0.5, 1.5])
    F = np.tile(np.eye(3), (4, 1, 1))
    F[:, 0, 2] = shear
    stress = cauchy_stress(Deformation.of(F), rubber)
    modulus = 2.0 * (rubber.C10 + rubber.C01)
    np.testing.assert_allclose(stress[:, 0, 2], modulus * shear, rtol=1e-12, atol=1e-9)
    difference = stress[:, 0, 0] - stress[:, 2, 2]
    np.testing.assert_allclose(difference, shear * stress[:, 0, 2], rtol=1e-12, atol=1e-8)
    volume = 1.02 * np.eye(3)
    J = 1.02**3
    np.testing.assert_allclose(
        cauchy_stress(Deformation.of(volume), rubber),
        2.0 * (J - 1.0) / rubber.D1 * np.eye(3),
        rtol=1e-9,
        atol=1e-6,
    )
    six = np.array([3.0, -1.0, 2.0, 0.5, 0.25, -2.0])
    tensor = np.zeros((3, 3))
    for value, (row, column) in zip(six, SIX, strict=True):
        tensor[row, column] = tensor[column, row] = value
    deviator = tensor - np.trace(tensor) / 3.0 * np.eye(3)
    assert von_mises(six) == pytest.approx(np.sqrt(1.5 * (deviator**2).sum()))


@pytest.mark.fe
@pytest.mark.mpi
@pytest.mark.parametrize("cells", CELLS)
def test_stress_and_energy_of_a_block(cells):
    """Uniform where the strain is; the integral of a bent block's energy is its elastic energy."""
    rubber, _ = a_state(cells)
    dim = rubber.mesh.geometry.dim
    grid = RubberGrid(rubber)
    bent = whole(grid.grid(rubber.displacements, None, True))
    elastic = rubber.elastic_energy()
    gradient = np.array([[0.05, 0.02, 0.3], [0.01, -0.04, 0.02], [-0.02, 0.03, 0.08]])
    gradient = gradient[np.ix_([0, 1, 2][3 - dim :], [0, 1, 2][3 - dim :])]
    x = rubber.space.tabulate_dof_coordinates()[:, :dim]
    rubber.displacements[:] = x @ gradient.T
    uniform = whole(grid.grid(rubber.displacements, 2.0 * rubber.displacements, True))
    F = np.eye(3)
    F[:dim, :dim] += gradient
    expected = cauchy_stress(Deformation.of(F), COMPOUNDS["B"])
    six = [expected[row, column] for row, column in SIX]
    found = uniform.point_data["Cauchy stress (Pa)"]
    np.testing.assert_allclose(found, np.tile(six, (len(found), 1)), rtol=1e-9, atol=1e-3)
    hydrostatic = uniform.point_data["hydrostatic stress (Pa)"]
    np.testing.assert_allclose(hydrostatic, np.trace(expected) / 3.0, rtol=1e-9)
    energy = uniform.point_data["strain energy density (J/m^3)"]
    np.testing.assert_allclose(energy, strain_energy(Deformation.of(F), COMPOUNDS["B"]), rtol=1e-9)
    np.testing.assert_allclose(
        uniform.point_data["velocity (m/s)"], 2.0 * uniform.point_data["displacement"]
    )
    moved = uniform.points[:, :dim] @ gradient.T
    np.testing.assert_allclose(
        uniform.point_data["displacement"][:, :dim], moved, rtol=1e-9, atol=1e-18
    )
    # linear between the vertices: the integral is that of the corners, by the trapezoidal rule
    density = bent.point_data["strain energy density (J/m^3)"][bent.cells]
    corners = {"triangle": 3, "quadrilateral": 4, "tetrahedron": 4, "hexahedron": 8}[cells]
    size = SIZE**dim / len(bent.cells)
    assert size * density[:, :corners].mean(axis=1).sum() == pytest.approx(elastic, rel=1e-9)


# The reference coordinates of VTK's cells against what is written for a reference cell.
NODE_ORDER = """
import json, sys
import numpy as np, pyvista as pv
grid = pv.read(sys.argv[1])
wrong = 0.0
for number in range(grid.n_cells):
    cell = grid.GetCell(number)
    count, place = cell.GetNumberOfPoints(), cell.GetParametricCoords()
    reference = np.array([place[i] for i in range(3 * count)]).reshape(-1, 3)
    points = np.array([grid.points[cell.GetPointId(i)] for i in range(count)])
    rows = np.hstack([reference, np.ones((len(reference), 1))])
    affine = np.linalg.lstsq(rows, points, rcond=None)[0]
    wrong = max(wrong, float(np.abs(rows @ affine - points).max()))
sizes = grid.compute_cell_sizes()
extent = sizes["Area" if grid.bounds.z_max == 0.0 else "Volume"]
print(json.dumps({"wrong": wrong, "extent": float(extent.sum()), "least": float(extent.min())}))
"""


@pytest.mark.quick
@pytest.mark.fe
@pytest.mark.skipif(WORLD.size > 1, reason="one rank is enough")
@pytest.mark.parametrize("cells", CELLS)
def test_nodes_are_in_the_order_of_vtk(tmp_path, cells):
    rubber, _ = a_state(cells)
    rubber.displacements[:] = 0.0
    grid = RubberGrid(rubber).grid(rubber.displacements, None, False)
    Fields(tmp_path, MPI.COMM_SELF).write(0.0, {"rubber": grid})
    call = [sys.executable, "-c", NODE_ORDER, str(tmp_path / "rubber_000000.vtu")]
    read = json.loads(subprocess.run(call, capture_output=True, text=True, check=True).stdout)
    assert read["wrong"] < 1e-9 * SIZE and read["least"] > 0.0
    assert read["extent"] == pytest.approx(SIZE**rubber.mesh.geometry.dim)


@pytest.mark.fe
@pytest.mark.mpi
@pytest.mark.parametrize("cells", CELLS)
def test_fields_are_read_back_whole(tmp_path, cells):
    rubber, surface = a_state(cells)
    directory = a_folder(tmp_path)
    pressure = {"contact pressure (Pa)": np.ones_like(surface.weights)}
    fields = Fields(directory / "fields", WORLD)
    nodes, facets = RubberGrid(rubber), FacetGrid(rubber, surface)
    lines = [np.linspace(0.0, SIZE, 5)] * (rubber.mesh.geometry.dim - 1)
    lines.append(np.array([-SIZE, -0.5 * SIZE, 0.0]))
    rubber.displacements[:] = 0.0
    last = WORLD.rank == WORLD.size - 1
    for time, celsius in ((0.0, -4.0), (1.5e-3, 0.0)):
        ice = np.full([line.size for line in lines], celsius)
        grids = {
            "rubber": nodes.grid(rubber.displacements, None, True),
            "interface": facets.grid(rubber.displacements, pressure),
            "ice": tensor_grid(lines, {"temperature (degC)": ice}) if last else None,
        }
        fields.write(time, grids)
        rubber.displacements[:, [0, -1]] = 0.1 * SIZE
        if WORLD.rank == 0:
            lists = sorted((directory / "fields").glob("*.pvd"))
            assert [path.stem for path in lists] == ["ice", "interface", "rubber"]
            for path in lists:
                entries = list(ET.parse(path).iter("DataSet"))
                assert float(entries[-1].attrib["timestep"]) == time
                assert all((path.parent / entry.attrib["file"]).is_file() for entry in entries)
    if WORLD.rank:
        return
    call = [sys.executable, "-c", READ_BACK, str(directory), "1"]
    read = json.loads(subprocess.run(call, capture_output=True, text=True, check=True).stdout)
    assert read["time"] == 1.5e-3 and read["warmest"] == pytest.approx(0.0, abs=1e-12)
    moved = [0.1 * SIZE, 1.1 * SIZE]
    if cells in ("triangle", "quadrilateral"):
        np.testing.assert_allclose(read["rubber"], [*moved, *moved, 0.0, 0.0], atol=1e-9)
        assert read["area"] == pytest.approx(SIZE**2)
        assert read["cells"] == (32 if cells == "triangle" else 16)
    else:  # with the mirror image of the half
        np.testing.assert_allclose(read["rubber"], [*moved, -SIZE, SIZE, *moved], atol=1e-9)
        undeformed = [[0.0, -SIZE, 0.0], [SIZE, SIZE, SIZE]]
        np.testing.assert_allclose(read["undeformed"], undeformed, atol=1e-15)
        assert read["area"] == pytest.approx(12 * SIZE**2)
        assert read["cells"] == 12 * 16 * (2 if cells == "tetrahedron" else 1)
    assert read["ice"] == pytest.approx(SIZE**2)


@pytest.mark.parametrize(("kind", "nodes"), [("line", 2), ("wedge", 6), ("hexahedron27", 27)])
def test_a_grid_is_read_as_it_was_written(tmp_path, kind, nodes):
    numbers = np.random.default_rng(1)
    points = numbers.random((3000, 3))  # more bytes than are packed together
    cells = numbers.integers(0, 3000, (400, nodes))
    name, vectors, shares = "p and more (Pa)", numbers.random((3000, 3)), numbers.random(400)
    grid = Grid(points, kind, cells, {name: points[:, 0], "u": vectors}, {"share (1)": shares})
    path = tmp_path / "grid.vtu"
    write_vtu(path, grid)
    read = meshio.read(path)
    assert (read.points == points).all()
    assert (read.cells_dict[kind] == cells).all()
    assert (read.point_data[name] == points[:, 0].astype(np.float32)).all()
    assert (read.point_data["u"] == vectors.astype(np.float32)).all()
    assert (read.cell_data["share (1)"][0] == shares.astype(np.float32)).all()


@pytest.mark.fe
@pytest.mark.skipif(WORLD.size > 1, reason="one rank raises alone")
def test_fields_that_a_full_disk_cuts_are_not_listed(tmp_path, monkeypatch):
    rubber, surface = a_state("quadrilateral")
    values = {"x (m)": surface.positions(rubber.displacements)[..., 0]}
    grid = FacetGrid(rubber, surface).grid(rubber.displacements, values)
    fields = Fields(tmp_path, MPI.COMM_SELF)
    fields.write(0.0, {"interface": grid})
    listed = (tmp_path / "interface.pvd").read_text()

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OutputError, match="interface_000001.vtu: No space left"):
        fields.write(1.0, {"interface": grid})
    assert (tmp_path / "interface.pvd").read_text() == listed
    assert listed.count("DataSet") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "interface.pvd",
        "interface_000000.vtu",
    ]


@pytest.mark.fe
@pytest.mark.mpi
@pytest.mark.parametrize(
    "case",
    [
        "thesis_1bar ice.heat=column",
        "thesis_1bar ice.heat=continuum",
        "thesis_sliding_1bar ice.heat=column ice.trail=1mm",
        "thesis_sliding_1bar ice.heat=continuum film.carrier=rubber",
    ],
)
def test_integrals_of_the_fields_are_the_rows_of_the_history(case):
    """Tractions add up to the forces, energy densities to the elastic energy, heat to its total."""
    name, *changes = case.split()
    small = ["model=slice", "numerics.refinement=0.25", "numerics.tolerance=1e-2"]
    scene = load_scene(CASES / f"{name}.toml", [*small, "load.duration=0.05ms", *changes])
    block = build_block(scene, WORLD)
    press(block, lambda point: None)
    start_sliding(block, lambda point: None)
    sliding = Sliding(block)
    ledger = Ledger(sliding)
    for accepted in sliding.steps():
        ledger.add(accepted)
    row = slide_row(sliding, ledger, accepted)
    grids = BlockFields(sliding, get_args(FIELDS)).grids(accepted)
    elastic, stored = block.rubber.elastic_energy(), block.scale
    heat = ledger.ice_heat
    grids = {name: whole(grid) for name, grid in grids.items()}
    interface, points = grids["interface"], grids["contact_points"]
    ends = interface.points[interface.cells]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    force = stored * (length[:, None] * interface.cell_data["traction (Pa)"]).sum(axis=0)
    expected = [-row.friction_force_N, row.normal_force_N, 0.0]
    np.testing.assert_allclose(force, expected, rtol=1e-9, atol=1e-12)
    area = points.point_data["area (m)"]
    carried = [stored * area @ points.point_data[f"{n} (Pa)"] for n in PRESSURE_AND_SHEAR]
    np.testing.assert_allclose(carried, expected[1::-1] * np.array([1.0, -1.0]), rtol=1e-9)
    rubber = grids["rubber"]
    corners = rubber.points[rubber.cells[:, :4], :2]
    size = (corners[:, 2] - corners[:, 0]).prod(axis=1)
    density = rubber.point_data["strain energy density (J/m^3)"][rubber.cells[:, :4]]
    assert size @ density.mean(axis=1) == pytest.approx(elastic, rel=1e-6)
    ice = grids["ice"]
    assert ice.points[:, 1].max() == 0.0 and ice.points[:, 1].min() < -1e-5
    warm = ice.point_data["temperature (degC)"]
    assert warm.min() == pytest.approx(-4.0, abs=0.02) and -3.9 < warm.max() <= 0.0
    if "sliding" in case:
        trail = grids["trail"]
        x, stored_heat = trail.points[:, 0], trail.point_data["heat (J/m^2)"]
        within = block.scene.rubber.width * trapezoid(stored_heat, x)
        assert within == pytest.approx(heat, rel=2e-2)
        assert ("film height (m)" in trail.point_data) == (scene.film.carrier == "ice")
    else:
        assert "trail" not in grids


@pytest.mark.fe
@pytest.mark.mpi
@pytest.mark.parametrize("model", ["slice", "block"])
def test_probes_of_a_known_field(model):
    """Everywhere the gradient that was given, on any number of ranks, in either half of a block."""
    places = {"a": [1e-4, -2e-4, 6.3e-4], "corner": [5e-4, 5e-4, 1e-3], "foot": [1e-4, 2e-4, 0.0]}
    small = {"refinement": 0.5, "tolerance": 1e-2}
    scene = a_scene(model).as_dict() | {"numerics": small, "output": {"probes": places}}
    block = build_block(scene_from_dict(scene), WORLD)
    rubber, dim = block.rubber, block.rubber.mesh.geometry.dim
    gradient = np.array([[0.05, 0.0, 0.3], [0.0, -0.04, 0.0], [-0.02, 0.0, 0.08]])
    axes = [0, 2] if dim == 2 else [0, 1, 2]
    inner = gradient[np.ix_(axes, axes)]
    rubber.displacements[:] = rubber.space.tabulate_dof_coordinates()[:, :dim] @ inner.T
    motion = SimpleNamespace(velocity=3.0 * rubber.u.x.array)
    sliding = SimpleNamespace(current=SimpleNamespace(motion=motion, relaxed=None, time=1e-3))
    probes = Probes(block)
    probes.touches_ice = False  # there is no film yet
    contact = [probe.contact for probe in probes.places]
    assert WORLD.allreduce(contact[2] is not None) == 1 and contact[:2] == [None, None]
    probes.places = [probe._replace(contact=None) for probe in probes.places]
    rows = probes.rows(sliding, None)
    assert len(rows) == (3 if WORLD.rank == 0 else 0)
    F = np.eye(3)
    F[:dim, :dim] += inner
    six = np.array([cauchy_stress(Deformation.of(F), COMPOUNDS["B"])[at] for at in SIX])
    for row in rows:
        moved = gradient @ places[row.probe]
        found = np.array(row[2:5])
        if dim == 2:
            assert np.isnan(found[1])
        np.testing.assert_allclose(found[axes], moved[axes], rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(np.array(row[5:8])[axes], 3.0 * moved[axes], atol=1e-15)
        assert row.von_mises_Pa == pytest.approx(float(von_mises(six)), rel=1e-9)
        assert row.hydrostatic_Pa == pytest.approx(six[:3].mean(), rel=1e-9)
        energy = float(strain_energy(Deformation.of(F), COMPOUNDS["B"]))
        assert row.energy_density_J_per_m3 == pytest.approx(energy, rel=1e-9)
    scene["output"] = {"probes": {"off": [2e-3, 0.0, 1e-4]}}
    with pytest.raises(SceneError, match="output.probes.off = .* is neither in the undeformed"):
        Probes(build_block(scene_from_dict(scene), WORLD))


@pytest.mark.fe
def test_a_run_without_fields_leaves_no_folder_for_them(tmp_path):
    changes = ["model=slice", "numerics.refinement=0.25", "numerics.tolerance=1e-2"]
    changes += ["load.duration=0.1ms", "ice.heat=column", "output.fields=[]"]
    run(load_scene(CASES / "thesis_1bar.toml", changes), tmp_path)
    assert (tmp_path / "history.csv").is_file() and not (tmp_path / "fields").exists()


@pytest.mark.fe
@pytest.mark.mpi
def test_fields_probes_and_log_of_a_run(tmp_path):
    """They agree with each other, and the folder tells what happened."""
    out = a_folder(tmp_path)
    changes = ["model=slice", "numerics.refinement=0.25", "numerics.tolerance=1e-2"]
    changes += ["load.duration=0.3ms", "ice.heat=column", 'output.times=["0.1ms", "0.25ms"]']
    changes += ["output.probes.foot=[0, 0, 0]", 'output.probes.ice=[0, 0, "-10um"]']
    changes += ["output.probes.plate=[0, 0, 1e-3]", 'output.fields=["rubber", "interface"]']
    summary = run(load_scene(CASES / "thesis_1bar.toml", changes), out)
    WORLD.Barrier()
    if WORLD.rank:
        return
    assert sorted(path.name for path in (out / "fields").glob("*.pvd")) == [
        "interface.pvd",
        "rubber.pvd",
    ]
    times = [time for time, _ in field_files(out, "rubber")]
    assert len(times) == 2 and 1e-4 <= times[0] < 1.5e-4 and 2.5e-4 <= times[1] < 3e-4
    probes = pd.read_csv(out / "probes.csv").set_index(["probe", "time_s"])
    history = pd.read_csv(out / "history.csv")
    assert len(probes) == 3 * len(history) == 3 * (summary["steps"] + 1)
    plate = probes.loc["plate"]
    np.testing.assert_allclose(plate.displacement_z_m, -history.plate_displacement_m, rtol=1e-6)
    assert plate.contact_pressure_Pa.isna().all() and plate.temperature_C.isna().all()
    foot, ice = probes.loc["foot"], probes.loc["ice"]
    assert 5e4 < foot.contact_pressure_Pa.iloc[-1] < 2e5
    assert foot.film_height_m.iloc[0] == pytest.approx(70e-9)
    warm = [foot.temperature_C.iloc[-1], ice.temperature_C.iloc[-1]]
    assert ice.temperature_C.iloc[0] == pytest.approx(-4.0) and warm[0] > warm[1] > -3.999
    log = pd.read_json(out / "log.jsonl", lines=True)
    events = log.event.tolist()
    assert (
        events[0] == "begin"
        and events[-1] == "end"
        and events.index("ramp") < events.index("slide")
    )
    assert events.count("fields") == 2 and events.count("press") + events.count("ramp") == len(
        pd.read_csv(out / "preload.csv")
    )
    assert events.count("refused") == summary["rejected_steps"]


@pytest.mark.parametrize(
    "times, expected",
    [
        (4, [0.0, 0.3, 0.5, 0.8, 1.0]),
        (0, []),
        (0.5, [0.0, 0.5, 1.0]),
        ((0.25, 0.26, 0.8), [0.3, 0.8]),
        ((0.0, 1.0), [0.0, 1.0]),
    ],
)
def test_times_of_fields(times, expected):
    steps = [0.1 * number for number in range(11)]
    due = FieldTimes(times, 1.0, None)
    assert [time for time in steps if due(time)] == pytest.approx(expected)
    after = FieldTimes(times, 1.0, 0.4)
    late = [time for time in expected if time > 0.4]
    assert [time for time in steps[5:] if after(time)] == pytest.approx(late)


@pytest.mark.parametrize(
    "output, sentence",
    [
        ({"times": -1}, "output.times = -1 is out of range"),
        ({"times": "1 bar"}, 'output.times = "1 bar" has the wrong unit'),
        ({"times": ["8 ms"]}, "output.times has 8 ms, after the end of the run"),
        ({"fields": ["rubbr"]}, 'output.fields.0 = "rubbr" is not available'),
        ({"probes": {"a": [0, 0]}}, "output.probes.a.2 is missing"),
        ({"probes": {"a": [0, 0, "3 s"]}}, 'output.probes.a.2 = "3 s" has the wrong unit'),
    ],
)
def test_wrong_outputs_are_one_sentence(output, sentence):
    with pytest.raises(SceneError, match=re.escape(sentence)):
        scene_from_dict(a_scene("slice").as_dict() | {"output": output})


def test_outputs_do_not_make_a_result_another():
    scene = a_scene("slice")
    other = scene_from_dict(
        scene.as_dict() | {"output": {"times": 3, "probes": {"a": [0, 0, "1 mm"]}}}
    )
    assert fingerprint(other) == fingerprint(scene)
    assert scene_from_dict(other.as_dict()) == other
