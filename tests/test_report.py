"""The report of a run, drawn from its files alone."""

import subprocess
import sys

import matplotlib.image
import numpy as np
import pytest

from iceslide_fem.postprocess.report.curves import draw_run, energy_unit
from iceslide_fem.postprocess.results import differences, field_files, read_run
from iceslide_fem.runtime.errors import SceneError

pytest.importorskip("iceslide_fem.fenics.compat")  # the outputs' writers need it

from program import rows_of  # noqa: E402
from runs import write_run  # noqa: E402

pytestmark = pytest.mark.quick


@pytest.mark.parametrize("saturation", [None, 5e-3])
@pytest.mark.parametrize("model, preload", [("point", False), ("block", True)])
def test_report_is_a_picture(tmp_path, model, preload, saturation):
    write_run(tmp_path, model, saturation, preload)
    path = draw_run(tmp_path)
    assert path == tmp_path / "report.png"
    image = matplotlib.image.imread(path)[..., :3]
    assert image.shape[0] > 800 and image.shape[1] > 1000
    assert 0.02 < (image < 0.9).any(axis=2).mean() < 0.5  # neither empty nor a blot


@pytest.mark.parametrize("joules, unit", [(0.4, "mJ"), (2.0, "J"), (3e-5, "µJ"), (0.0, "nJ")])
def test_energies_have_digits_that_one_can_read(joules, unit):
    assert energy_unit(joules) == unit


def test_run_is_read_as_it_was_written(tmp_path):
    write_run(tmp_path, "slice")
    run = read_run(tmp_path)
    rows = rows_of(tmp_path / "history.csv")
    np.testing.assert_array_equal(run.history["mu"], [float(row["mu"]) for row in rows])
    assert list(run.preload["phase"]) == ["press", "press", "press", "ramp", "ramp"]
    assert run.at("mu", 1.5e-3) == pytest.approx(0.35)
    assert run.title == "invented: slice, 1 bar, 3 m/s, attached ice at -4 °C (column)"
    assert field_files(tmp_path, "rubber") == []


@pytest.mark.parametrize("missing", ["summary.json", "history.csv"])
def test_directory_that_is_no_run_is_named(tmp_path, missing):
    write_run(tmp_path, "slice")
    (tmp_path / missing).unlink()
    with pytest.raises(SceneError, match=f"holds no finished run.*{missing}"):
        read_run(tmp_path)


@pytest.mark.parametrize("text", ["{", "{}", "[1]", "5"])
def test_summary_of_something_else_is_refused(tmp_path, text):
    write_run(tmp_path, "slice")
    (tmp_path / "summary.json").write_text(text)
    with pytest.raises(SceneError, match="holds no finished run"):
        read_run(tmp_path)


@pytest.mark.parametrize("table", ["history.csv", "preload.csv"])
def test_a_table_with_half_a_row_is_refused(tmp_path, table):
    write_run(tmp_path, "slice")
    with open(tmp_path / table, "a") as file:
        file.write("0.1,0.2\n")
    with pytest.raises(SceneError, match=f"holds no finished run .a row of {table} is not whole"):
        read_run(tmp_path)


def test_differences_are_relative_and_at_the_times_of_the_other_run(tmp_path):
    write_run(tmp_path, "slice")
    run = read_run(tmp_path)
    higher = run._replace(history=run.history | {"mu": 1.02 * run.history["mu"]})
    assert differences(higher, run) == pytest.approx(0.02)
    assert differences(run, higher, 7).shape == (7,)


def test_no_dolfinx_is_needed():
    modules = "iceslide_fem.postprocess.report.curves, iceslide_fem.postprocess.results.view"
    code = f"import sys, {modules}; print('dolfinx' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize("damage", ["[" * 100_000, '"mu_peak": "x"', '"mu_peak_time_s": null'])
def test_a_summary_that_no_run_wrote_is_refused(damage, tmp_path):
    write_run(tmp_path, "point", preload=False)
    path = tmp_path / "summary.json"
    whole = path.read_text()
    path.write_text(damage if damage[0] == "[" else whole.rstrip()[:-1] + f", {damage}}}")
    with pytest.raises(SceneError, match="holds no finished run"):
        read_run(tmp_path)
