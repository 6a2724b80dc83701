"""The names of `iceslide_fem` for scripts and notebooks: light to import, with units."""

import ast
import inspect
import re
import subprocess
import sys
import time
import types
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from runs import write_run

import iceslide_fem
from iceslide_fem.api.errors import in_python
from iceslide_fem.api.runs import read_run as read_dataset
from iceslide_fem.runtime.columns import label_and_unit
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.terminal import LongTask
from iceslide_fem.scene import as_toml
from iceslide_fem.scene.cases import cases_folder

POINT = {"model": "point", "load.duration": "2 ms"}
GAUSSIAN = "120mm,2bar,30mm"


@pytest.fixture(scope="module")
def point_scene():
    return iceslide_fem.load_scene(case="thesis_1bar", overrides=POINT)


def all_have_units(dataset):
    """Whether each variable that is a number has a unit, but indices of rows."""
    names = [name for name, part in dataset.variables.items() if part.dtype.kind in "if"]
    return all("units" in dataset[name].attrs for name in names if name != "time_share")


@pytest.mark.quick
def test_the_package_is_light_until_a_name_is_asked_for():
    heavy = "{'numpy', 'xarray', 'pydantic', 'dolfinx', 'mpi4py'}"
    program = (
        f"import sys, iceslide_fem; print(sorted({heavy} & set(sys.modules))); dir(iceslide_fem); "
        "iceslide_fem.run, iceslide_fem.sweep; import iceslide_fem.simulate; "
        "print(iceslide_fem.run.__module__, 'dolfinx' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.splitlines() == ["[]", "iceslide_fem.api.runs False"], done.stderr


@pytest.mark.quick
@pytest.mark.parametrize("name", iceslide_fem.__all__)
def test_every_public_name_is_there_and_described(name):
    found = getattr(iceslide_fem, name)
    assert name in dir(iceslide_fem) and found.__doc__


@pytest.mark.quick
def test_public_names_are_known_to_programs_that_only_read_sources():
    tree = ast.parse(Path(iceslide_fem.__file__).read_text("utf-8"))
    (typed,) = (node for node in tree.body if isinstance(node, ast.If))
    named = {alias.name for node in typed.body for alias in node.names}
    assert named == set(iceslide_fem.__all__)


@pytest.mark.quick
def test_an_unknown_name_is_none():
    with pytest.raises(AttributeError, match="no attribute 'simulation'"):
        iceslide_fem.simulation  # noqa: B018


@pytest.mark.quick
@pytest.mark.parametrize(
    "column, expected",
    [
        ("film_height_m", ("film height", "m")),
        ("surface_temperature_C", ("surface temperature", "degC")),
        ("speed_m_per_s", ("speed", "m/s")),
        ("deceleration_m_s2", ("deceleration", "m/s^2")),
        ("film_viscosity_Pa_s", ("film viscosity", "Pa s")),
        ("water_left_m3", ("water left", "m^3")),
        ("energy_density_J_per_m3", ("energy density", "J/m^3")),
        ("H_V_std_m", ("H V std", "m")),
        ("mu", ("mu", "1")),
        ("melted_fraction", ("melted fraction", "1")),
    ],
)
def test_a_columns_name_says_its_unit(column, expected):
    assert label_and_unit(column) == expected


@pytest.mark.quick
def test_overrides_are_texts_or_values_by_keys(tmp_path):
    by_key = iceslide_fem.load_scene(case="thesis_1bar", overrides={"load.pressure": "3 bar"})
    by_text = iceslide_fem.load_scene(case="thesis_1bar", overrides=["load.pressure=3bar"])
    assert by_key == by_text and by_key.load.pressure == 3e5
    with pytest.raises(SceneError, match="load.pressure = -1 is out of range"):
        iceslide_fem.load_scene(case="thesis_1bar", overrides={"load.pressure": -1})
    nested = iceslide_fem.load_scene(
        case="thesis_1bar", overrides={"load": {"pressure": np.float64(3e5)}}
    )
    assert nested == by_key
    for wrong in ({}, {"path": "a.toml", "case": "thesis_1bar"}, {"path": {}, "case": "paper"}):
        with pytest.raises(SceneError, match="give a scene file or the name of a case; given: "):
            iceslide_fem.load_scene(**wrong)


def run_example(name, monkeypatch):
    """Run the example in the description of a public name."""
    monkeypatch.setenv("MPLBACKEND", "Agg")
    text = inspect.getdoc(getattr(iceslide_fem, name))
    (example,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(example, {})


@pytest.mark.parametrize(
    "name, file",
    [("roughness", "compound_B/contact.csv"), ("rubber", "synthetic_dma/rubber.toml")],
)
def test_examples_with_files_of_the_cases_run(name, file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cases").symlink_to(cases_folder())
    run_example(name, monkeypatch)
    assert (tmp_path / "results" / file).is_file()


EXAMPLES = (
    "load_scene info run read_run difference report sweep Conditions simulate_points footprint "
    "wheel Law"
).split()


@pytest.mark.quick
def test_the_examples_of_the_descriptions_run(tmp_path, monkeypatch):
    """In their order: one reads what another has written."""
    monkeypatch.chdir(tmp_path)
    for name in EXAMPLES:
        run_example(name, monkeypatch)
    assert {path.name for path in (tmp_path / "results").iterdir()} == {
        *("thesis_point", "slow", "fast", "thesis_1bar-sweep", "gaussian", "gaussian_wheel")
    }


@pytest.mark.quick
def test_a_scene_in_a_notebook_shows_what_differs_from_the_defaults(point_scene):
    html = point_scene._repr_html_()
    shown = dict(re.findall(r"<code>([^<]*)</code></td><td[^>]*>([^<]*)<", html))
    assert shown["load.pressure"] == "100 kPa" and shown["load.duration"] == "2 ms"
    assert shown["model"] == "point" and "load.passes" not in shown
    assert "<b>thesis_1bar</b>" in html


@pytest.mark.quick
def test_a_run_is_a_dataset_over_time(point_scene, tmp_path):
    found = iceslide_fem.run(point_scene, tmp_path / "run", pictures=False)
    assert (tmp_path / "run" / "history.csv").is_file()
    assert found["mu"].dims == ("time_s",) and found["time_s"].attrs["units"] == "s"
    assert found["film_height_m"].attrs == {"long_name": "film height", "units": "m"}
    assert all_have_units(found)
    assert found.attrs["name"] == "thesis_1bar" and found.attrs["model"] == "point"
    assert f"iceslide_fem {iceslide_fem.__version__}" in found.attrs["versions"]
    assert found.attrs["mu_peak"] == pytest.approx(float(found["mu"].max()))
    xr.testing.assert_identical(found, iceslide_fem.read_run(tmp_path / "run"))
    (tmp_path / "again.toml").write_text(found.attrs["scene"], encoding="utf-8")
    assert iceslide_fem.load_scene(tmp_path / "again.toml") == point_scene
    found.to_netcdf(tmp_path / "run.nc", engine="scipy")
    other = iceslide_fem.load_scene(case="thesis_5bar", overrides=POINT)
    with pytest.raises(SceneError, match="a run of another scene"):
        iceslide_fem.run(other, tmp_path / "run")


TABLES = {
    "name": "tables",
    "model": "point",
    "rubber": {"compound": "B", "length": "2 mm"},
    "load": {"pressure": np.array([[0, 1e5], [1e-3, 2e5]]), "speed": 2, "duration": "1 ms"},
}


@pytest.mark.quick
def test_a_scene_is_a_dictionary_or_a_file_wherever_a_scene_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = iceslide_fem.load_scene(TABLES, {"load.speed": "3 m/s"})
    assert scene.load.speed == 3.0 and scene.load.pressures.largest == pytest.approx(2e5)
    assert TABLES["load"]["speed"] == 2
    (tmp_path / "scene.toml").write_text(as_toml(scene.as_dict()), encoding="utf-8")
    found = iceslide_fem.run("scene.toml", pictures=False)
    again = iceslide_fem.run(TABLES | {"name": "again"}, pictures=False)
    assert found.attrs["mu_mean"] != again.attrs["mu_mean"]
    assert Path(again.attrs["folder"]) == tmp_path / "results" / "again"
    assert iceslide_fem.info("scene.toml").rows == iceslide_fem.info(scene).rows
    swept = iceslide_fem.sweep(tmp_path / "scene.toml", {"load.speed": [3.0]})
    assert float(swept["mu_mean"].squeeze()) == pytest.approx(found.attrs["mu_mean"])


@pytest.mark.quick
def test_what_is_known_of_a_scene_prints_as_a_table(point_scene):
    known = iceslide_fem.info(point_scene)
    lines = repr(known).splitlines()
    assert lines[0] == "thesis_1bar (point)"
    (line,) = (line for line in lines if line.strip().startswith("friction at t = 0"))
    assert (
        known["friction at t = 0"] in line and "<td>friction at t = 0</td>" in known._repr_html_()
    )
    assert list(known.to_dataframe().columns) == ["group", "quantity", "value", "meaning"]
    with pytest.raises(KeyError, match="sipes"):
        known["sipes"]


@pytest.mark.quick
def test_two_runs_differ_on_the_times_of_both(point_scene, tmp_path):
    longer = point_scene.replace({"load": {"speed": "4 m/s", "duration": "3 ms"}, "name": "longer"})
    slow, fast = (
        iceslide_fem.run(scene, tmp_path / scene.name, pictures=False)
        for scene in (point_scene, longer)
    )
    apart = iceslide_fem.difference(fast, slow)
    times = apart["time_s"].values
    assert set(slow["time_s"].values) <= set(times) and times[-1] == slow["time_s"].values[-1]
    assert (fast.mu - slow.mu).sizes["time_s"] < 5 < apart.sizes["time_s"]
    expected = fast["mu"].interp(time_s=times).values - slow["mu"].interp(time_s=times).values
    np.testing.assert_allclose(apart["mu"], expected, atol=1e-12)
    assert apart["surface_temperature_C"].attrs["units"] == "K" and all_have_units(apart)
    assert apart["mu"].attrs["long_name"] == "difference of mu"
    assert apart.attrs["name"] == "longer - thesis_1bar"
    np.testing.assert_array_equal(iceslide_fem.difference(slow, slow)["mu"], 0.0)
    with pytest.raises(SceneError, match="is no run over time_s"):
        iceslide_fem.difference(slow, slow.isel(time_s=0))
    with pytest.raises(SceneError, match="do not rise: it has several passes; take one"):
        iceslide_fem.difference(slow, xr.concat([slow, slow], "time_s", join="override"))
    with pytest.raises(SceneError, match="no time is common"):
        iceslide_fem.difference(slow, slow.assign_coords(time_s=slow["time_s"] + 1.0))


@pytest.mark.quick
def test_errors_of_python_name_arguments(point_scene, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    iceslide_fem.run(point_scene, "taken", pictures=False)
    other = point_scene.replace({"load.speed": 1.0})
    sentences = {
        "or force=True to replace": lambda: iceslide_fem.run(other, "taken"),
        "give another folder with out,": lambda: iceslide_fem.run(other, "taken"),
        "^out taken.txt is no page": lambda: iceslide_fem.report("taken", out="taken.txt"),
        "^over = ": lambda: iceslide_fem.calibrate(
            "a.csv", "a.toml", {"film.k": "0.1:1"}, over="nowhere"
        ),
        "^fit film.k=": lambda: iceslide_fem.calibrate(
            tmp_path / "a.csv", tmp_path / "a.toml", {"film.k": "nonsense"}
        ),
        "give abs=True, too": lambda: iceslide_fem.wheel(gaussian=GAUSSIAN, measure="20km/h:5km/h"),
        "may let it go on": lambda: iceslide_fem.run(point_scene, "taken", restart=True),
    }
    (tmp_path / "a.csv").write_text("pressure (bar),mu\n1,0.1\n2,0.2\n", encoding="utf-8")
    (tmp_path / "a.toml").write_text(as_toml(point_scene.as_dict()), encoding="utf-8")
    for words, act in sentences.items():
        with pytest.raises(iceslide_fem.SceneError, match=words) as caught:
            act()
        assert "--" not in str(caught.value) and "iceslide run" not in str(caught.value)


@pytest.mark.quick
@pytest.mark.parametrize(
    "sentence, expected",
    [
        ("iceslide run --restart a/b goes on", 'run(scene, "a/b", restart=True) goes on'),
        ("/tmp/a--b/c is not a file", "/tmp/a--b/c is not a file"),
        ("as by iceslide rubber --strain", "as by iceslide_fem.rubber strain"),
        ("--height-unit says otherwise", "height_unit says otherwise"),
    ],
)
def test_a_sentence_for_python(sentence, expected):
    with pytest.raises(SceneError) as caught, in_python():
        raise SceneError(sentence)
    assert str(caught.value) == expected


@pytest.mark.quick
def test_preload_passes_and_fields_of_a_run(tmp_path, monkeypatch):
    write_run(tmp_path, "slice")
    (tmp_path / "fields").mkdir()
    (tmp_path / "fields" / "rubber.pvd").write_text("", encoding="utf-8")
    found = read_dataset(tmp_path)
    assert len(found.to_dataframe()) == found.sizes["time_s"]
    preload = read_dataset(tmp_path, "preload")
    assert preload["normal_force_N"].dims == ("preload_step",)
    assert list(preload["phase"].values[[0, -1]]) == ["press", "ramp"]
    monkeypatch.chdir(tmp_path)
    found = read_dataset(".")
    assert found.attrs["fields_rubber"] == str(tmp_path / "fields" / "rubber.pvd")
    assert np.isnan(found.attrs["saturation_s"]) and found.attrs["stopped"] == ""
    again = {"load.passes": 2, "load.period": "1 s"}
    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides=POINT | again)
    found = iceslide_fem.run(scene, tmp_path / "passes", pictures=False)
    passes = read_dataset(tmp_path / "passes", "passes")
    assert list(passes["pass"].values) == [1, 2] and passes["mu_mean"].dims == ("pass",)
    assert found["pass"].dims == ("time_s",)
    with pytest.raises(SceneError, match="has no preload.csv"):
        read_dataset(tmp_path / "passes", "preload")
    with pytest.raises(SceneError, match='"probes"; allowed: history, preload, passes'):
        read_dataset(tmp_path, "probes")


@pytest.mark.quick
def test_no_run_in_a_folder(tmp_path):
    with pytest.raises(SceneError, match="holds no finished run"):
        iceslide_fem.read_run(tmp_path)


@pytest.mark.fe
def test_a_slice_is_a_dataset_with_its_fields(tmp_path):
    pytest.importorskip("iceslide_fem.fenics.compat")
    small = {"model": "slice", "numerics.refinement": 0.5, "numerics.tolerance": 1e-2}
    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides=small | {"load.duration": 2e-5})
    found = iceslide_fem.run(scene, tmp_path / "slice", pictures=False)
    assert found.sizes["time_s"] == found.attrs["steps"] + 1
    assert found.attrs["fields_rubber"].endswith("rubber.pvd")
    assert "dolfinx" in found.attrs["versions"]


@pytest.mark.fe
def test_a_run_that_was_stopped_goes_on(tmp_path):
    pytest.importorskip("iceslide_fem.fenics.compat")
    small = {"model": "slice", "numerics.refinement": 0.5, "numerics.tolerance": 1e-2}
    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides=small | {"load.duration": 2e-5})
    with pytest.raises(iceslide_fem.Interrupted, match=r'run\(scene, ".*", restart=True\) goes on'):
        iceslide_fem.run(scene, tmp_path, pictures=False, progress=lambda row: "mu" not in row)
    with pytest.raises(SceneError, match="is of another scene: load.speed"):
        other = scene.replace({"load.speed": 1.0})
        iceslide_fem.run(other, tmp_path, restart=True)
    found = iceslide_fem.run(scene, tmp_path, restart=True, pictures=False)
    assert found["time_s"].values[-1] == pytest.approx(2e-5) and found.attrs["stopped"] == ""


@pytest.mark.quick
def test_a_sweep_from_values(point_scene, tmp_path):
    lines = []
    vary = {"load.pressure": ["1 bar", "2 bar"], "load.speed": np.array([1, 3])}
    found = iceslide_fem.sweep(point_scene, vary, tmp_path, say=lines.append)
    assert found["mu_mean"].dims == ("load.pressure", "load.speed")
    assert found["mu_mean"].attrs == {"long_name": "mu mean", "units": "1"}
    assert found["load.pressure"].attrs["units"] == "Pa"
    assert (found["status"] == "done").all() and all_have_units(found)
    assert lines[0] == "4 cases, 0 of them done before"
    iceslide_fem.sweep(point_scene, vary, tmp_path, say=lines.append)
    assert lines[-2] == "4 cases, 4 of them done before"
    again = iceslide_fem.read_sweep(tmp_path)["mu_mean"]
    np.testing.assert_array_equal(again, found["mu_mean"])
    alone = iceslide_fem.run(point_scene, tmp_path / "alone", pictures=False)
    one = found["mu_mean"].sel({"load.pressure": 1e5, "load.speed": 3.0})
    assert float(one) == pytest.approx(alone.attrs["mu_mean"])


@pytest.mark.quick
@pytest.mark.parametrize(
    "vary, words",
    [
        ({"load.pressure": "1 bar"}, "vary has '1 bar' for load.pressure; allowed: a list"),
        ({"load.pressure": []}, r"vary has \[\] for load.pressure"),
        ({"load.presure": [1.0]}, "did you mean load.pressure"),
        ({"name": ["a", "b"]}, "name cannot be varied"),
        ({"load.speed": ["1 m/s", 1.0]}, "load.speed = 1.0 is given twice"),
        ({}, "a sweep varies something"),
    ],
)
def test_a_sweep_of_nothing_possible(point_scene, tmp_path, vary, words):
    with pytest.raises(SceneError, match=words):
        iceslide_fem.sweep(point_scene, vary, tmp_path / "sweep")
    assert not (tmp_path / "sweep").exists()


@pytest.mark.quick
def test_points_are_those_of_the_point_level():
    given = dict(pressure=1e5, temperature=269.15, k=0.3, D=6e-4, H_V=2e-6, initial_height=7e-8)
    conditions = iceslide_fem.Conditions.of(**given, speed=[1.0, 3.0, 5.0], duration=7e-3)
    times = np.linspace(0.0, 7e-3, 5)
    found = iceslide_fem.simulate_points(conditions, times=times)
    plain = iceslide_fem.point.simulate(conditions, times=times)
    np.testing.assert_array_equal(found["mu_peak"], plain.mu_peak)
    np.testing.assert_array_equal(found["melt_onset_s"], plain.melt_onset)
    np.testing.assert_array_equal(found["mu"], plain.samples)
    assert found["mu"].dims == ("time_s", "point") and found["time_s"].attrs["units"] == "s"
    np.testing.assert_array_equal(found["speed_m_per_s"], [1.0, 3.0, 5.0])
    assert all_have_units(found) and "mu" not in iceslide_fem.simulate_points(conditions)
    with pytest.raises(ValueError, match='ice = "steel" is unknown; allowed: column, half-space'):
        iceslide_fem.simulate_points(conditions, ice="steel")


@pytest.mark.quick
def test_a_line_and_an_area_of_a_footprint(tmp_path):
    line = iceslide_fem.footprint(gaussian=GAUSSIAN, temperature="-4 degC", out=tmp_path / "line")
    assert line["film_height_m"].dims == ("x_m",) and all_have_units(line)
    assert line.attrs["name"] == "gaussian" and (tmp_path / "line" / "line.csv").is_file()
    pressure = np.full((4, 30), 2e5)
    np.savetxt(tmp_path / "map.csv", pressure, delimiter=",")
    size = {"length": 0.1, "width": "20 mm"}
    area = iceslide_fem.footprint(
        pressure_map=tmp_path / "map.csv", out=tmp_path / "area", temperature="-4 degC", **size
    )
    assert area["mu"].dims == ("y_m", "x_m") and area["mu"].shape == (4, 30)
    np.testing.assert_allclose(area["pressure_Pa"], pressure)
    assert area["surface_temperature_C"].attrs["units"] == "degC" and all_have_units(area)
    assert area.attrs["footprint.load_N"] == pytest.approx(2e5 * 0.1 * 0.02)
    with pytest.raises(SceneError, match="^length = -1.0 is out of range"):
        iceslide_fem.footprint(gaussian=GAUSSIAN, length=-1.0, out=tmp_path / "none")


@pytest.mark.quick
def test_a_footprint_on_wet_ice(tmp_path):
    np.savetxt(tmp_path / "map.csv", np.full((4, 30), 2e5), delimiter=",")
    wet = {
        "water": "20 um",
        "lug": "6 mm",
        "contact": cases_folder() / "surfaces" / "compound_B.csv",
    }
    size = {"length": 0.1, "width": "20 mm"}
    maps = iceslide_fem.footprint(
        pressure_map=tmp_path / "map.csv", out=tmp_path / "area", **size, **wet
    )
    line = iceslide_fem.footprint(gaussian=GAUSSIAN, out=tmp_path / "line", **wet)
    for found, dimensions in ((maps, ("y_m", "x_m")), (line, ("x_m",))):
        assert all_have_units(found)
        assert found["water_height_m"].dims == dimensions and found["water_height_m"].max() > 0.0
        assert (found["water_pressure_Pa"] <= found["pressure_Pa"]).all()


@pytest.mark.quick
def test_a_wheel_over_slip_and_its_family(tmp_path):
    found = iceslide_fem.wheel(
        gaussian=GAUSSIAN,
        slip=[0.1, 0.05, 1.0],
        stiffness="1e8 Pa/m",
        vary={"speed": ["50 km/h", "20 km/h"]},
        out=tmp_path,
    )
    assert found["mu"].dims == ("speed_m_s", "temperature_C", "slip")
    assert found["mu"].shape == (2, 1, 3) and all_have_units(found)
    rows = np.genfromtxt(tmp_path / "mu_slip.csv", delimiter=",", names=True)
    for row in rows:
        one = found["mu"].sel(slip=row["slip"]).sel(speed_m_s=row["speed_m_s"], method="nearest")
        assert float(one.squeeze()) == pytest.approx(row["mu"])


@pytest.mark.quick
def test_contact_parameters_over_pressure(tmp_path):
    n = 32
    phase = 2.0 * np.pi * np.arange(n) / n
    np.savetxt(tmp_path / "waves.txt", 2e-5 * np.cos(phase)[:, None] * np.cos(phase))
    options = {"pixel": "20 um", "pressures": "0.5bar:2bar:3", "definition": "thesis"}
    found = iceslide_fem.roughness(tmp_path / "waves.txt", out=tmp_path / "waves", **options)
    assert found["k"].dims == ("pressure_Pa",) and found["D_m"].attrs["units"] == "m"
    assert (np.diff(found["k"]) > 0.0).all() and all_have_units(found)
    assert found.attrs["name"] == "waves" and (tmp_path / "waves" / "contact.csv").is_file()


class Kernel:
    """What IPython shows in a notebook, without a notebook."""

    def __init__(self, monkeypatch):
        self.shown, self.updates = [], 0
        ipython, display = types.ModuleType("IPython"), types.ModuleType("IPython.display")
        ipython.get_ipython = lambda: types.SimpleNamespace(kernel=self)
        display.display = self.display
        monkeypatch.setitem(sys.modules, "IPython", ipython)
        monkeypatch.setitem(sys.modules, "IPython.display", display)

    def display(self, content, raw, display_id):
        self.shown.append(content["text/plain"])
        return self

    def update(self, content, raw):
        self.shown[-1] = content["text/plain"]
        self.updates += 1


@pytest.mark.quick
def test_progress_in_a_notebook_is_one_line(monkeypatch, capfd):
    kernel, now = Kernel(monkeypatch), [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    with LongTask(10.0) as task:
        for second in range(1, 11):
            now[0] = float(second)
            task.show(float(second), f"{second} of 10", "mu 0.3")
        assert kernel.shown == ["10 of 10, mu 0.3, 0 s left"]
    assert kernel.shown == ["done in 10 s"] and kernel.updates == 10
    with LongTask(10.0) as task:
        task.show(10.0, "all at once")
    assert len(kernel.shown) == 1 and capfd.readouterr() == ("", "")
