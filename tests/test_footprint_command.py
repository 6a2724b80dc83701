"""`iceslide footprint`: what it writes, and one sentence for everything that is wrong."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from matplotlib.figure import Figure
from PIL import Image
from program import exit_code

from iceslide_fem.preprocess.footprint.map_file import write_maps
from iceslide_fem.preprocess.footprint.synthetic import Tread, coloured_picture, grey_picture, save
from iceslide_fem.scene.fingerprint import sources_hash

ROOT = Path(__file__).parent.parent
SHAPE, HIGH = (84, 108), 4e5
TRUTH = Tread(ribs=3, pitch=36e-3, sipe=4e-3).footprint(SHAPE)
OPTIONS = ["--length", "0.18", "--width", "140 mm", "--max-pressure", "4bar"]
MAPS = ("pressure", "temperature", "wet_dry", "mu", "comparison")


def iceslide(*arguments):
    return exit_code(*arguments, "--no-report")


@pytest.fixture(scope="module")
def surveyed(tmp_path_factory):
    """A grey footprint at a given load."""
    folder = tmp_path_factory.mktemp("footprint")
    picture = save(grey_picture(TRUTH, HIGH), folder / "grey.png")
    out = folder / "out"
    code = iceslide("footprint", picture, *OPTIONS, "--load", "3kN", "--out", out)
    assert code == 0
    return out


@pytest.mark.parametrize("shape", [(1, 1), (9, 1), (1, 9)])
def test_a_picture_of_a_line_of_pixels_is_a_footprint(shape, tmp_path):
    picture = save(np.full(shape, 255, dtype=np.uint8), tmp_path / "line.png")
    words = *OPTIONS, "--max-pressure", "40bar", "--dark-is", "low", "--out", tmp_path / "out"
    assert iceslide("footprint", picture, *words) == 0
    assert (tmp_path / "out" / "mu.png").is_file()


def test_pictures_of_all_maps_are_written(surveyed):
    for name in MAPS:
        with Image.open(surveyed / f"{name}.png") as image:
            image.load()
            assert min(image.size) > 500
            assert np.ptp(np.asarray(image.convert("L"))) > 200


def test_pyvista_opens_the_maps(surveyed):
    grid = pv.read(surveyed / "footprint.vti")
    assert grid.dimensions == (SHAPE[1] + 1, SHAPE[0] + 1, 1)
    assert grid.bounds[1::2][:2] == pytest.approx((0.18, 0.14))
    load = grid.cell_data["pressure (Pa)"].sum() * np.prod(grid.spacing[:2])
    assert load == pytest.approx(3000.0)
    contact = grid.cell_data["contact"] == 1
    assert (grid.cell_data["mu"][contact] > 0.0).all()
    assert (grid.cell_data["surface temperature (degC)"] <= 0.0).all()
    assert set(np.unique(grid.cell_data["state (0 none, 1 dry, 2 mixed, 3 wet)"])) <= {0, 1, 2, 3}


def test_maps_that_do_not_fit_on_the_disk_are_no_success(capfd):
    with pytest.raises(OSError, match="No space left"):
        write_maps(Path("/dev/full"), {"pressure (Pa)": np.ones((2, 3))}, (1e-3, 1e-3))
    assert "ERR" in capfd.readouterr().err  # VTK's own words


def test_summary_has_the_load_its_factor_and_the_means(surveyed):
    figures = json.loads((surveyed / "summary.json").read_text())
    footprint, film = figures["footprint"], figures["film"]
    assert footprint["load_N"] == pytest.approx(3000.0)
    assert footprint["load_factor"] == pytest.approx(3000.0 / TRUTH.load, rel=0.01)
    assert footprint["contact_area_m2"] == pytest.approx(TRUTH.contact_area, rel=0.01)
    assert 0.03 < film["mu_mean"] < 0.3
    assert film["dry_share"] + film["mixed_share"] + film["wet_share"] == pytest.approx(1.0)
    assert not {"thesis", "moving_source"} & set(figures) and figures["warnings"] == []
    assert figures["versions"]["sources"] == sources_hash()
    grid = pv.read(surveyed / "footprint.vti")
    shear, pressure = (grid.cell_data[name] for name in ("shear stress (Pa)", "pressure (Pa)"))
    assert film["mu_mean"] == pytest.approx(shear.sum() / pressure.sum())


def test_the_thesis_s_balance_is_computed_and_shown_if_it_is_asked_for(tmp_path, capsys):
    np.save(tmp_path / "map.npy", np.full((3, 30), 2e5))
    words = ["--pressure-map", tmp_path / "map.npy", "--length", "180mm", "--width", "100mm"]
    shown = {}
    for more in ((), ("--thesis-balance",)):
        out = tmp_path / f"out{len(more)}"
        assert iceslide("footprint", *words, *more, "--out", out) == 0
        said = capsys.readouterr().out + (out / "summary.json").read_text()
        names = {path.name for path in out.iterdir()}
        shown[len(more)] = "mu_balance" in said, "thesis.png" in names, "(3.3)" in said
        maps = pv.read(out / "footprint.vti").cell_data
        assert ("rise by (3.3) (K)" in maps) == bool(more) and "outside the table" in maps
    assert shown == {0: (False, False, False), 1: (True, True, True)}
    figures = json.loads((tmp_path / "out1" / "summary.json").read_text())
    assert figures["moving_source"]["peak_rise_K"] > 4.0
    assert any(said.startswith("(3.3) as printed: mu by (4.7)") for said in figures["warnings"])


def test_pressures_outside_the_table_are_counted_and_said(tmp_path):
    """Of compound B it has 1 to 5 bar. mu there is no largest value that the program warns of."""
    np.save(tmp_path / "map.npy", np.tile(np.geomspace(2e3, 3e5, 40), (2, 1)))
    words = ["--pressure-map", tmp_path / "map.npy", "--length", "180mm", "--width", "100mm"]
    assert iceslide("footprint", *words, "--out", tmp_path / "out", "--no-report") == 0
    figures = json.loads((tmp_path / "out" / "summary.json").read_text())
    low = np.geomspace(2e3, 3e5, 40) < 1e5
    assert figures["film"]["outside_table_share"] == pytest.approx(low.mean())
    assert any(
        said.startswith(f"{low.mean():.0%} of the contact, with ")
        and "outside the table of k, D and H_V" in said
        for said in figures["warnings"]
    )
    assert not any("mu rises to" in said for said in figures["warnings"])


def test_a_coloured_picture_gives_the_same_as_the_grey_one(surveyed, tmp_path):
    picture, legend = coloured_picture(TRUTH, HIGH, "viridis")
    path = save(picture, tmp_path / "coloured.png")
    box = ",".join(str(edge) for edge in legend)
    crop = f"0,0,{SHAPE[1]},{SHAPE[0]}"
    reading = ["--legend", box, "--crop", crop, "--load", "3kN"]
    assert iceslide("footprint", path, *OPTIONS, *reading, "--out", tmp_path / "out") == 0
    grey, coloured = (
        json.loads((out / "summary.json").read_text())["film"]["mu_mean"]
        for out in (surveyed, tmp_path / "out")
    )
    assert coloured == pytest.approx(grey, rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.png", *OPTIONS], "cannot read the picture nowhere.png"),
        (["grey.png", *OPTIONS[2:]], "--length is missing"),
        (["grey.png", *OPTIONS, "--min-pressure", "5bar"], "is not above --min-pressure"),
        (["grey.png", *OPTIONS[:-1], "4"], 'in Pa, say "4bar" for bar'),
        (["grey.png", *OPTIONS, "--threshold", "3.99bar"], "no pixel is in contact"),
        (["grey.png", *OPTIONS, "--legend", "0,0,999,9"], "is outside the picture"),
        (["grey.png", *OPTIONS, "--colormap", "jet"], "are not those of the bar"),
        (["grey.png", *OPTIONS, "--out", "grey.png"], "is not a directory one may write to"),
    ],
)
def test_wrong_input_is_a_sentence_and_exit_code_2(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    save(grey_picture(TRUTH, HIGH), tmp_path / "grey.png")
    assert iceslide("footprint", *arguments) == 2
    said = capsys.readouterr()
    assert words in said.err and said.err.startswith("iceslide: ") and said.err.count("\n") == 1
    assert said.out == ""
    assert [path.name for path in tmp_path.iterdir()] == ["grey.png"]


def test_results_of_an_earlier_run_go_and_what_cannot_be_written_is_named(
    tmp_path, capsys, monkeypatch
):
    picture = save(grey_picture(TRUTH, HIGH), tmp_path / "grey.png")
    out = tmp_path / "out"
    assert iceslide("footprint", picture, *OPTIONS, "--out", out) == 0
    (out / "mine.toml").write_text("a scene of one's own")

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    assert iceslide("footprint", picture, *OPTIONS, "--force", "--out", out) == 3
    assert "cannot write" in capsys.readouterr().err
    assert [path.name for path in out.glob("*.png")] == []
    assert (out / "mine.toml").read_text() == "a scene of one's own"


def test_only_rank_0_works(tmp_path):
    save(grey_picture(TRUTH, HIGH), tmp_path / "grey.png")
    command = [sys.executable, "-m", "iceslide_fem.cli", "footprint", "grey.png", *OPTIONS]
    environment = os.environ | {"OMPI_COMM_WORLD_RANK": "1"}
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert [path.name for path in tmp_path.iterdir()] == ["grey.png"]


def test_no_part_of_the_package_loads_fenics_or_gmsh():
    folder = ROOT / "iceslide_fem" / "preprocess" / "footprint"
    names = [path.stem for path in folder.glob("[!_]*.py")]
    code = "".join(f"import iceslide_fem.preprocess.footprint.{name}\n" for name in names)
    code += "import sys\n"
    code += (
        "print([m for m in ('dolfinx', 'petsc4py', 'mpi4py', 'ufl', 'gmsh') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


def test_the_example_runs(tmp_path):
    script = ROOT / "cases" / "footprint" / "synthetic_tread.py"
    command = [sys.executable, str(script), "--pixels", "160", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "truth" in done.stdout
