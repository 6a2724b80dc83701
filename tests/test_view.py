"""Pictures of runs, made by a process without DOLFINx, as `iceslide view` does."""

import os
import subprocess
import sys

import imageio.v3 as imageio
import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from runs import write_run  # noqa: E402
from written_fields import TIMES, in_parts, write_fields  # noqa: E402

from iceslide_fem.commands.view import view as view_command  # noqa: E402
from iceslide_fem.postprocess.report.field_drawings import fields_of  # noqa: E402
from iceslide_fem.postprocess.results import read_run  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402


def view(directory, *options):
    call = [sys.executable, "-m", "iceslide_fem.cli", "view", str(directory), *options]
    return subprocess.run(call, capture_output=True, text=True)


@pytest.mark.fe
@pytest.mark.parametrize(
    "cells, with_ice",
    [("quadrilateral", True), ("triangle", False), ("hexahedron", True), ("tetrahedron", False)],
)
def test_pictures_at_peak_and_end(tmp_path, cells, with_ice):
    model = "slice" if cells in ("quadrilateral", "triangle") else "block"
    write_run(tmp_path, model)
    write_fields(tmp_path, cells, with_ice)
    done = view(tmp_path)
    assert done.returncode == 0, done.stderr
    names = ["report.png", "view_peak.png", "view_end.png"]
    assert done.stdout.split() == [str(tmp_path / name) for name in names]
    peak, end = (imageio.imread(tmp_path / name)[..., :3] for name in names[1:])
    assert peak.shape == end.shape == (960, 1280, 3)
    assert (peak != end).any()
    for picture in (peak, end):
        colourful = np.ptp(picture.astype(int), axis=2) > 60
        assert 0.005 < colourful.mean() < 0.6


@pytest.mark.fe
@pytest.mark.parametrize("cells", ["quadrilateral", "hexahedron"])
def test_ice_that_ranks_wrote_in_parts_is_whole(tmp_path, cells):
    """In pictures and in pages, at the moments of all other fields."""
    pictures, drawn = [], []
    for parts in (1, 2):
        folder = tmp_path / str(parts)
        folder.mkdir()
        write_run(folder, "slice" if cells == "quadrilateral" else "block")
        write_fields(folder, cells, True)
        if parts == 2:
            in_parts(folder)
        done = view(folder)
        assert done.returncode == 0, done.stderr
        pictures.append(imageio.imread(folder / "view_end.png")[..., :3].astype(int))
        *_, fields = fields_of(read_run(folder))
        drawn.append([len(str(drawing)) for drawing in fields.drawings])
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.1
    assert len(drawn[0]) == len(drawn[1])
    np.testing.assert_allclose(*drawn, rtol=0.05)


@pytest.mark.fe
def test_animation_has_all_times(tmp_path):
    write_run(tmp_path, "slice")
    write_fields(tmp_path, "quadrilateral", True)
    done = view(tmp_path, "--animate")
    assert done.returncode == 0, done.stderr
    assert str(tmp_path / "view.gif") in done.stdout.split()
    assert imageio.improps(tmp_path / "view.gif").n_images == len(TIMES)


def test_a_folder_that_may_not_be_written_is_one_sentence(tmp_path, monkeypatch):
    write_run(tmp_path, "point", preload=False)
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write everywhere
    with pytest.raises(SceneError, match="cannot write to .* is not a directory one may write to"):
        view_command(tmp_path)


def test_point_has_a_report_only(tmp_path):
    write_run(tmp_path, "point", preload=False)
    done = view(tmp_path)
    assert done.stdout.split() == [str(tmp_path / "report.png")], done.stderr


@pytest.mark.quick
def test_directory_that_is_no_run_is_said_in_one_sentence(tmp_path):
    done = view(tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"iceslide: {tmp_path} holds no finished run")
    assert done.stderr.count("\n") == 1


def test_a_run_that_was_killed_says_how_it_goes_on(tmp_path):
    (tmp_path / "checkpoint").write_bytes(b"any")
    done = view(tmp_path)
    assert done.returncode == 2
    assert done.stderr == (
        f"iceslide: {tmp_path} holds no finished run (iceslide run --restart {tmp_path} goes on)\n"
    )


@pytest.mark.fe
def test_damaged_fields_are_one_sentence(tmp_path):
    """A cut grid, or list of grids: named, and no traceback."""
    write_run(tmp_path, "slice")
    write_fields(tmp_path, "quadrilateral", with_ice=True)
    for names, words in (
        ("rubber_*.vtu", "is not whole"),
        ("ice_*.vtu", "is not whole"),
        ("rubber.pvd", "not a list that a run wrote"),
    ):
        whole = {path: path.read_bytes() for path in (tmp_path / "fields").glob(names)}
        for path, content in whole.items():
            path.write_bytes(content[: 2 * len(content) // 3])
        done = view(tmp_path)
        assert done.returncode == 2, (names, done.stderr)
        assert words in done.stderr and done.stderr.count("\n") == 1, (names, done.stderr)
        for path, content in whole.items():
            path.write_bytes(content)


def test_a_history_that_is_cut_is_one_sentence(tmp_path):
    write_run(tmp_path, "slice")
    path = tmp_path / "history.csv"
    path.write_bytes(path.read_bytes()[:-5])
    with pytest.raises(SceneError, match="row of history.csv is not whole"):
        read_run(tmp_path)


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("history.csv", "0.5", "half"),
        ("history.csv", "time_s", "times"),
        ("summary.json", '"load"', '"lead"'),
        ("summary.json", '"scene"', '"scenery"'),
    ],
)
def test_results_that_no_run_wrote_are_one_sentence(file, old, new, tmp_path):
    write_run(tmp_path, "slice")
    path = tmp_path / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(SceneError, match="holds no finished run"):
        read_run(tmp_path)
