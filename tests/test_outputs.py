"""Histories, summary and fields as files, on any number of ranks."""

import json
import math
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import meshio  # noqa: E402
from blocks import CELLS, SIZE, a_block, bend  # noqa: E402
from runs import a_scene, rows_of  # noqa: E402

from iceslide_fem.errors import OutputError  # noqa: E402
from iceslide_fem.fenics.compat import MPI, VtkSeries, fem, scalar_space  # noqa: E402
from iceslide_fem.output.fields import Fields  # noqa: E402
from iceslide_fem.output.summary import write_summary  # noqa: E402
from iceslide_fem.output.table import Table  # noqa: E402
from iceslide_fem.rubber.contact_surface import contact_surface  # noqa: E402
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody  # noqa: E402

WORLD = MPI.COMM_WORLD
# pyvista reads in a process of its own, away from DOLFINx.
READ_BACK = """
import json, sys
from pathlib import Path
from iceslide_fem.results.snapshots import read_snapshot
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody  # noqa: E402
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
    """A bent block, its contact surface and an ice temperature on the same mesh."""
    rubber = HyperelasticBody(a_block(cells), a_scene("slice").mooney_rivlin)
    bend(rubber)
    surface = contact_surface(rubber.space, rubber.facets("contact"), 4)
    return rubber, surface, fem.Function(scalar_space(rubber.mesh, 1), name="T")


@pytest.mark.fe
@pytest.mark.mpi
@pytest.mark.parametrize("cells", CELLS)
def test_interface_holds_every_facet_once(tmp_path, cells):
    rubber, surface, _ = a_state(cells)
    dim, n_facets = rubber.mesh.geometry.dim, WORLD.allreduce(len(surface.weights), op=MPI.SUM)
    at = surface.positions(rubber.displacements)
    folder = a_folder(tmp_path)
    gap = np.where(at[..., 0] > 0.5 * SIZE, at[..., -1], np.nan)
    with Fields(folder, rubber, surface) as fields:
        fields.write(0.0, {"x (m)": at[..., 0], "gap (m)": gap})
        rubber.displacements[:] = 0.0
        at = surface.positions(rubber.displacements)
        fields.write(1e-3, {"x (m)": at[..., 0], "gap (m)": at[..., -1]})
        assert not (folder / "ice.pvd").exists()
    if WORLD.rank:
        return
    bent = meshio.read(folder / "interface_000000.vtu")
    flat = meshio.read(folder / "interface_000001.vtu")
    assert len(flat.cells[0].data) == n_facets
    corners = flat.points[flat.cells[0].data]
    assert corners.shape[1] == {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3}.get(cells, 4)
    # means of the undeformed, plane facets are their centres; neighbours share their corners
    np.testing.assert_allclose(flat.cell_data["x (m)"][0], corners[..., 0].mean(axis=1), atol=1e-15)
    height = corners[..., dim - 1].mean(axis=1)
    np.testing.assert_allclose(flat.cell_data["gap (m)"][0], height, atol=1e-15)
    assert len(np.unique(flat.points.round(9), axis=0)) == len(flat.points) < corners[..., 0].size
    if cells == "hexahedron":  # around the facet, not across it
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        np.testing.assert_allclose(sides, SIZE / 4, rtol=1e-9)
    assert dim == 3 or not flat.points[:, 2].any()
    # points without a value don't count; facets without any have none
    gaps = bent.cell_data["gap (m)"][0]
    right = bent.points[bent.cells[0].data][..., 0]
    assert np.isnan(gaps[right.max(axis=1) < 0.4 * SIZE]).all()
    assert np.isfinite(gaps[right.min(axis=1) > 0.6 * SIZE]).all()


@pytest.mark.fe
@pytest.mark.mpi
@pytest.mark.parametrize("cells", CELLS)
def test_fields_are_read_back_whole(tmp_path, cells):
    rubber, surface, ice = a_state(cells)
    directory = a_folder(tmp_path)
    pressure = {"contact pressure (Pa)": np.ones_like(surface.weights)}
    fields = Fields(directory / "fields", rubber, surface, ice)
    rubber.displacements[:] = 0.0
    for time, kelvin in ((0.0, 269.15), (1.5e-3, 273.15)):
        ice.x.array[:] = kelvin
        fields.write(time, pressure)
        rubber.displacements[:, [0, -1]] = 0.1 * SIZE
        if WORLD.rank == 0:  # an interrupted run never closes them
            lists = sorted((directory / "fields").glob("*.pvd"))
            assert [path.stem for path in lists] == ["ice", "interface", "rubber"]
            for path in lists:
                entries = list(ET.parse(path).iter("DataSet"))
                assert float(entries[-1].attrib["timestep"]) == time
                assert all((path.parent / entry.attrib["file"]).is_file() for entry in entries)
    fields.close()
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


@pytest.mark.fe
@pytest.mark.skipif(WORLD.size > 1, reason="one rank raises alone")
def test_fields_that_a_full_disk_cuts_are_not_listed(tmp_path, monkeypatch):
    rubber, surface, _ = a_state("quadrilateral")
    values = {"x (m)": surface.positions(rubber.displacements)[..., 0]}
    fields = Fields(tmp_path, rubber, surface)
    fields.write(0.0, values)
    listed = (tmp_path / "rubber.pvd").read_text()
    write = VtkSeries.write

    def half(series, time):
        write(series, time)
        for path in tmp_path.glob("rubber*000001.vtu"):
            path.write_bytes(path.read_bytes()[:100])

    monkeypatch.setattr(VtkSeries, "write", half)
    with pytest.raises(OutputError, match="not whole; the disk may be full"):
        fields.write(1.0, values)
    monkeypatch.undo()
    del fields  # DOLFINx writes its own lists once more
    assert (tmp_path / "rubber.pvd").read_text() == listed
    assert listed.count("DataSet") == 1
