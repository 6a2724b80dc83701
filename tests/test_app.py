"""`iceslide app` without a browser: who is answered, and that the answers are the library's."""

import contextlib
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
import tomllib
import urllib.request
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from app_server import fixtures, stop

import iceslide_fem
from iceslide_fem.app import form, line, point, wheel
from iceslide_fem.app.answers import Answers
from iceslide_fem.app.runs import Runs
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.jaeger import TABLE_1_ICE
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic, heat_model
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap, as_map, gaussian_profile
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.footprint.survey import summary, survey
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.tread import Tread
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene import load_scene, scene_from_dict
from iceslide_fem.scene.materials import CONTACT_TABLES

open_app, served = fixtures()
CASES = Path(__file__).parent.parent / "cases"
TEXTS = {slider.key: slider.text(slider.start) for slider in point.SLIDERS}
SLICE = {
    "name": "slice",
    "model": "slice",
    "rubber.compound": "B",
    "load.pressure": "1 bar",
    "load.speed": "3 m/s",
    "load.duration": "50 ms",
    "numerics.tolerance": "1e-2",
    "numerics.refinement": "0.5",
}


@pytest.fixture
def in_a_folder(tmp_path, monkeypatch):
    """Lines of Python write results below the working folder."""
    monkeypatch.chdir(tmp_path)


# Who is answered


@pytest.mark.parametrize("path", ["/", "/x/", "/index.html", "/x/api/start", "//", "/%00/"])
def test_without_the_token_nothing_is_answered(served, path):
    status, headers, text = served.get(path)
    assert status == 403 and "iceslide app" in text and served.root.strip("/") not in text
    assert headers["referrer-policy"] == "no-referrer"


def test_nearly_the_token_is_refused(served):
    for path in (served.root[:-1] + "/", served.root + "x/", served.root.lower() + "/"):
        assert served.get(path)[0] == 403, path


def test_the_page_is_answered_and_may_fetch_from_here_only(served):
    status, headers, text = served.get(served.root + "/")
    assert status == 200 and "<title>iceslide</title>" in text
    assert "default-src 'self'" in headers["content-security-policy"]
    assert "http://" not in text and "https://" not in text


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example"])
def test_a_page_elsewhere_whose_name_leads_here_is_refused(served, host):
    assert served.get(served.root + "/", host=host)[0] == 400
    assert served.get(served.root + "/", host="localhost")[0] == 200


@pytest.mark.parametrize(
    "path",
    ["../server.py", "..%2fserver.py", "%2e%2e/%2e%2e/cli.py", "//etc/passwd", "uplot/../.."],
)
def test_nothing_beside_the_page_is_reached(served, path):
    status, _, text = served.get(f"{served.root}/{path}")
    assert status in (403, 404) and "import" not in text and "root:" not in text


def test_requests_that_are_none_of_the_page_are_refused(served):
    api = served.root + "/api/point"
    assert served.get(api)[0] == 404
    post = {"method": "POST"}
    assert served.get(api, **post, body=b"{}", kind="text/plain")[0] == 415
    assert served.get(api, **post, body=b"[1]")[0] == 400
    assert served.get(api, **post, body=b"[" * 50_000)[0] == 400
    assert served.get(api, **post, body=b" " * 200_000)[0] == 413
    for texts in (None, [], {"load.pressure": 1}, {"load.pressure": "x" * 20_000}):
        assert served.ask("point", texts=texts)[0] == 422, texts
    assert served.ask("cancel", number=99) == (422, {"sentence": "there is no run 99", "keys": []})
    assert served.get(served.root + "/runs/99/report")[0] == 404


def test_the_page_listens_on_this_machine_only_unless_it_is_told_otherwise(served, open_app):
    assert served.address.startswith("http://127.0.0.1:")
    other = open_app("--host", "0.0.0.0")
    assert stop(other._replace(process=_told(other, "Warning: with --host 0.0.0.0"))) == 0


def _told(page, words):
    os.set_blocking(page.process.stderr.fileno(), False)
    assert words in page.process.stderr.read()
    return page.process


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["missing.toml"], "missing.toml"),
        (["--host", "no.such.host.example"], "cannot listen on --host no.such.host.example"),
        (["--out", "file/below"], "cannot write to file/below"),
    ],
)
def test_wrong_options_are_one_sentence(words, sentence, tmp_path):
    (tmp_path / "file").touch()
    command = [sys.executable, "-m", "iceslide_fem.cli", "app", "--no-browser", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and sentence in done.stderr and done.stderr.count("\n") == 1
    assert done.stdout == ""


def test_without_its_packages_the_command_says_what_to_install(tmp_path):
    code = (
        "import sys; sys.modules['starlette'] = None\n"
        "from iceslide_fem.cli import main; main(['app', '--no-browser'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and "scripts/setup --app" in done.stderr
    assert done.stderr.count("\n") == 1


# What is answered


@pytest.mark.quick
def test_curves_of_a_point_are_those_of_the_library(served, in_a_folder):
    status, answer = served.ask("point", texts=TEXTS)
    scene = scene_from_dict(tomllib.loads(answer["toml"]))
    rows, results = point_history(scene)
    assert status == 200 and answer["series"]["mu"] == [row.mu for row in rows]
    assert answer["numbers"]["mu_mean"] == results["mu_mean"]
    found: dict = {}
    exec(answer["python"], found)
    assert np.allclose(found["mu"], answer["series"]["mu"], rtol=1e-9)
    # the fluxes carry the energies, and (5.6) lies above what half-space ice takes before it melts
    area, step = 1e-6, np.diff([row.time_s for row in rows])
    assert np.isclose(
        (np.array(answer["series"]["ice_flux"]) * step).sum() * area, rows[-1].ice_heat_J
    )
    half = served.ask("half-space", texts=TEXTS)[1]
    other = point_history(load_as(scene, "half-space"))[1]
    assert half["numbers"]["mu_mean"] == other["mu_mean"] != results["mu_mean"]
    curves = half["series"]  # fluxes are means over a step, of which the last is a long one
    closed = np.interp(curves["middle"][-1], curves["closed_time"], curves["closed_flux"])
    assert np.isclose(curves["ice_flux"][-1], closed, rtol=0.01)


def load_as(scene, heat):
    data = scene.as_dict()
    data["ice"]["heat"] = heat
    return scene_from_dict(data)


@pytest.mark.parametrize("contact", ["compound B", "constants"])
def test_maps_are_those_of_their_lines_of_python(contact, in_a_folder):
    along = ("load.pressure", "ice.temperature")
    found = point.friction_map(TEXTS | {"contact": contact}, along, "mu_mean")
    here: dict = {}
    exec(found["python"], here)
    assert np.allclose(here["z"], found["z"], rtol=1e-4)
    wrong = ("film.k", "film.k") if contact == "constants" else ("film.k", "load.speed")
    with pytest.raises(SceneError, match=r"film\.k"):
        point.friction_map(TEXTS | {"contact": contact}, wrong, "mu_mean")


def test_a_map_is_of_the_water_and_the_ice_of_its_curves(in_a_folder):
    own = {"ice.conductivity": "1 W/(m K)"}
    own["film.initial_height"] = '[["-10 degC", "50 nm"], ["0 degC", "100 nm"]]'
    own["water.viscosity"] = '[["-10 degC", "4 mPa*s"], ["0 degC", "1 mPa*s"]]'
    texts = TEXTS | own
    corner = texts | {"load.pressure": "0.1 bar", "load.speed": "0.05 m/s"}
    found = point.friction_map(texts, ("load.pressure", "load.speed"), "mu_mean")
    expected = point.curves(corner)
    assert found["z"][0][0] == pytest.approx(expected["numbers"]["mu_mean"], rel=1e-2)
    colder = point.curves(corner | {"load.speed": "3 m/s", "ice.temperature": "-30 degC"})
    found = point.friction_map(texts, ("load.pressure", "ice.temperature"), "mu_mean")
    assert found["z"][0][0] == pytest.approx(colder["numbers"]["mu_mean"], rel=1e-2)
    assert expected["values"]["film.initial_height"] == pytest.approx(80e-9)
    half = [point.half_space_curves(each)["series"]["closed_flux"][-1] for each in (texts, TEXTS)]
    assert half[0] / half[1] == pytest.approx((1.0 / 2.25) ** 0.5)


@pytest.mark.quick
def test_dry_contact_along_a_line_is_that_of_its_lines_and_its_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    texts = {"slip": "1", "dry_stress": "2 bar", "initial_height": "0 nm"}
    texts["temperature"] = "-20 degC"
    for given in (texts, texts | {"dry_stress": "0", "initial_height": "1000 nm"}):
        answer = line.curves(given)
        found: dict = {}
        exec(answer["python"].replace("gaussian=", "force=True, gaussian="), found)
        mean = found["found"].attrs["film.mu_mean"]
        assert answer["numbers"]["mu_mean"] == pytest.approx(mean, rel=1e-9)
        words = shlex.split(answer["command"].replace("\\\n", " "))[2:]
        names = (word.removeprefix("--").replace("-", "_") for word in words[::2])
        case = FootprintCase.of(dict(zip(names, words[1::2], strict=True)))
        stress, height = (2e5, 0.0) if given is texts else (None, 1e-6)
        assert case.dry_stress == stress and case.initial_height == pytest.approx(height)
    slow = {"slip": "1e-3", "temperature": "-20 degC"}
    for more, doubted in (({}, True), ({"dry_stress": "2 bar"}, False)):
        notes = line.curves(slow | more)["notes"]
        assert any("does not melt" in note for note in notes) == doubted
    with pytest.raises(SceneError, match="--initial-height = 0 m is out of range"):
        line.curves({"initial_height": "0"})


@pytest.mark.quick
def test_the_wheel_is_that_of_the_library():
    texts = {"speed": "20 km/h", "temperature": "-8 degC", "stiffness": "40 MPa/m"}
    answer = wheel.curves(texts)
    _, even = gaussian_profile(0.12, 2e5, sigma=wheel.EVEN)
    pressure = PressureMap(even.reshape(1, 20, -1).mean(axis=2), 6e-3, 1.0)
    assert pressure.pressure == pytest.approx(2e5, rel=1e-4)
    contact = FilmContact(Ride(5.0, 5.0, 265.15), CONTACT_TABLES["B"], 2e-2)
    rolls = [Rolling(20 / 3.6, slip) for slip in answer["series"]["slip"]]
    points = friction(pressure, rolls, Tread(40e6), contact)
    assert len(points) == 21 and np.allclose(answer["series"]["mu"], [one.mu for one in points])
    numbers = answer["numbers"]
    assert numbers["mu_peak"] == max(answer["series"]["mu"]) > numbers["mu_locked"] > 0.0
    assert (
        answer["series"]["slip"][answer["series"]["mu"].index(numbers["mu_peak"])]
        == (numbers["peak_slip"])
    )
    assert answer["series"]["film"][0] is None and json.dumps(answer, allow_nan=False)
    (note,) = answer["notes"]
    assert note.startswith("up to a slip ratio of ") and "less than half of the contact" in note


WHEELS = {
    "slick": {},
    "blocks": {"shape": "gaussian", "tread": "blocks", "speed": "20 km/h", "gaussian.2": "25 mm"},
    "dry": {"dry_stress": "3.3 bar", "initial_height": "0 nm", "dry_softening": "8 K"},
}


@pytest.mark.quick
@pytest.mark.parametrize("texts", WHEELS.values(), ids=WHEELS)
def test_lines_of_python_and_command_of_a_wheel(texts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer, found = wheel.curves(texts), {}
    exec(answer["python"], found)
    finer = found["found"]["mu"].to_numpy().ravel()
    assert np.allclose(finer, answer["series"]["mu"], atol=0.1 * finer.max())
    words = shlex.split(answer["command"].replace("\\\n", ""))
    assert words[:2] == ["iceslide", "wheel"]
    options = dict(zip(words[2::2], words[3::2], strict=True))
    assert float(options["--slip"].split(",")[0]) == 0.0
    assert [float(slip) for slip in options["--slip"].split(",")] == answer["series"]["slip"]
    assert ("--pitch" in options) == ("tread" in texts)
    assert ("--dry-stress" in options) == ("dry_stress" in texts)
    # The command's even pressure is a Gaussian that is wide.
    length, peak, sigma = map(float, options["--gaussian"].split(","))
    ends = gaussian_profile(length, peak, 540, sigma)[1][[0, -1]]
    assert ("gaussian.2" in texts) == bool((ends < 0.99 * peak).all())


def test_every_slider_of_the_wheel_changes_it():
    blocks = {"shape": "gaussian", "tread": "blocks"}
    dry = {"dry_stress": "2 bar", "temperature": "-1 degC"}
    of_curves = [slider for slider in wheel.TAB.sliders if slider.key not in wheel.OF_STOPS]
    for slider in of_curves:
        texts = blocks | (dry if slider.key.startswith("dry") else {})
        values = (1.0, 2.0) if slider.key == "dry_stress" else (slider.start, 0.8 * slider.start)
        before, after = (
            wheel.curves(texts | {slider.key: slider.text(value)})["series"] for value in values
        )
        assert before["mu"] != after["mu"], slider.key


DRY = {"film.dry_stress": "3.3 bar", "film.initial_height": "0 nm", "ice.temperature": "-1 degC"}


@pytest.mark.quick
def test_dry_contact_is_that_of_the_library(in_a_folder):
    answer = point.curves(TEXTS | DRY)
    film = tomllib.loads(answer["toml"])["film"]
    assert film["dry_stress"] == "3.3 bar" and film["dry_softening"] == "10 K"
    assert answer["series"]["film"][0] == 0.0 and answer["notes"] == []
    found: dict = {}
    exec(answer["python"], found)
    assert np.allclose(found["mu"], answer["series"]["mu"], rtol=1e-9)
    assert answer["values"]["film.dry_stress"] == pytest.approx(3.3e5)
    for off in ({}, {"film.dry_stress": ""}, {"film.dry_stress": "0"}):
        texts = TEXTS | off
        assert "dry" not in point.curves(texts)["toml"]
        with pytest.raises(SceneError, match=r"film\.initial_height = 0"):
            point.curves(texts | {"film.initial_height": "0 nm"})
    rows = {"film.dry_stress": '[["-9.5 degC", "3.3 bar"], ["0 degC", "0.165 bar"]]'}
    table = point.curves(TEXTS | DRY | rows)
    assert table["numbers"]["mu_mean"] == pytest.approx(answer["numbers"]["mu_mean"], rel=1e-6)


@pytest.mark.parametrize("texts", [TEXTS, TEXTS | DRY], ids=["off", "on"])
def test_maps_of_dry_contact_are_those_of_their_lines_of_python(texts, in_a_folder):
    low, high = ({s.key: s.text(getattr(s, end)) for s in point.SLIDERS} for end in ("low", "high"))
    for along in (("film.dry_stress", "load.speed"), ("ice.temperature", "film.dry_stress")):
        found = point.friction_map(texts, along, "mu_mean")
        here: dict = {}
        exec(found["python"], here)
        assert np.allclose(here["z"], found["z"], rtol=1e-4)
        for end, ends in ((0, low), (-1, high)):
            single = point.curves(texts | {key: ends[key] for key in along})["numbers"]["mu_mean"]
            assert found["z"][end][end] == pytest.approx(single, rel=1e-2)
    softening = "film.dry_softening", "film.dry_residual"
    if texts is TEXTS:
        with pytest.raises(SceneError, match=r"no effect without a number of film\.dry_stress"):
            point.friction_map(texts, softening, "mu_mean")
        return
    corner = texts | {"film.dry_softening": "50 K", "film.dry_residual": "0 K"}
    single = point.curves(corner)["numbers"]["mu_mean"]
    found = point.friction_map(texts, softening, "mu_mean")
    assert found["z"][0][-1] == pytest.approx(single, rel=1e-2)


def test_a_table_of_ones_own(tmp_path, served):
    (tmp_path / "contact.csv").write_text(
        "pressure_Pa,k,D_m,H_V_m\n1e5,0.266,29e-6,2.86e-6\n5e5,0.405,46.5e-6,0.56e-6\n"
    )
    own = {"contact": "table", "film.contact": str(tmp_path / "contact.csv")}
    assert point.curves(TEXTS | own)["series"] == point.curves(TEXTS)["series"]
    status, answer = served.ask("point", texts=TEXTS | own | {"film.contact": "none.csv"})
    assert (status, answer["keys"]) == (422, ["film.contact"])


@pytest.mark.quick
def test_the_line_is_that_of_the_library(served, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    texts = {"thesis_slip": "2e-5", "temperature": "-6 degC", "model": "next pixel"}
    status, answer = served.ask("line", texts=texts | {"thesis_balance": "yes"})
    x, pressure = gaussian_profile(0.18, 4e5, sigma=0.03)
    parameters = Macroscopic(slip=2e-5, ice_temperature=267.15)
    expected = heat_model(as_map(pressure, x[1] - x[0]), parameters)
    assert status == 200 and np.allclose(answer["series"]["model_mu"], expected.mu[0], rtol=1e-12)
    assert np.allclose(answer["series"]["model_flux"], expected.flux[0], rtol=1e-12)
    found: dict = {}
    exec(answer["python"], found)
    assert np.allclose(found["found"]["mu_thesis"], expected.mu[0], rtol=1e-12)


def test_friction_of_the_printed_slip_is_in_doubt_and_shown_if_asked_for():
    """The page begins with the film law, and says no friction that nothing has."""
    untouched = line.curves({})
    case = FootprintCase.of({"gaussian": "180mm,4bar,30mm"})
    warnings = summary(survey(case, read_footprint(case)))["warnings"]
    assert untouched["notes"] == [line.TAB.worded(one) for one in warnings]
    assert not any("mu" in note.split() for note in untouched["notes"])
    assert 0.02 < untouched["numbers"]["mu_mean"] < 0.5
    assert set(untouched["numbers"]) == {"mu_mean", "leading", "trailing"}
    assert not any("model" in name for name in untouched["series"])
    printed = {"thesis_balance": "yes", "model": "next pixel"}
    assert any("mu by (4.7) to (4.9) is 35" in note for note in line.curves(printed)["notes"])


def test_sliders_of_the_line_begin_with_the_data_as_printed():
    texts = {slider.key: slider.text(slider.start) for slider in line.TAB.sliders}
    texts |= {"thesis_balance": "yes", "model": "next pixel"}
    texts.pop("air_temperature")  # empty at first: that of the ice
    case = FootprintCase.of(line.TAB.options(texts))
    assert case.thesis == Macroscopic(effusivity=TABLE_1_ICE.effusivity)
    assert case.moving == replace(case.thesis, slip=1.0, source="moving")
    assert not case.law.film.dry_stress


@pytest.mark.study
def test_every_slider_of_the_line_changes_it():
    picture = str(CASES.parent / "docs" / "pictures" / "footprint_picture.jpg")
    boxes = {"legend": "556,42,583,378", "crop": "0,0,540,420", "image": picture, "row": "210"}
    for slider in line.TAB.sliders:
        texts = dict(boxes, source="image") if slider.key in line.OF_PICTURE else {}
        if slider.key == "initial_height" or slider.key.startswith("dry_"):
            texts = {"slip": "1", "dry_stress": "2 bar"}
        else:
            texts |= {"thesis_balance": "yes", "model": "next pixel"}
        if slider.key == "water_conductivity":
            texts |= {"temperature": "-1 degC"}
        before, after = (
            line.curves(texts | {slider.key: slider.text(value)})
            for value in (slider.start or 1.0, slider.start * 0.9)
        )
        assert before["series"] != after["series"], slider.key
    picture = boxes | {"source": "image"}
    middle, other = (line.curves(picture | {"row": row})["series"] for row in ("", "240"))
    assert middle == line.curves(picture | {"row": "210"})["series"] != other


@pytest.mark.parametrize("model", ["next pixel", "moving"])
@pytest.mark.parametrize("source", ["gaussian", "line", "image"])
def test_the_command_of_a_line_computes_the_line(source, model, tmp_path):
    picture = str(CASES.parent / "docs" / "pictures" / "footprint_picture.jpg")
    (tmp_path / "line.csv").write_text("x_mm,pressure_bar\n1,0\n3,2\n5,3\n7,1\n")
    texts = {
        "gaussian": {"gaussian.1": "3 bar", "gaussian.2": "20 mm"},
        "line": {"line": str(tmp_path / "line.csv")},
        "image": {"image": picture, "crop": "0,0,540,420", "row": "280"}
        | {"legend": "556,42,583,378"},
    }[source]
    texts |= {"source": source, "model": model, "slip": "0.3", "ice_material.1": "900"}
    texts |= {"thesis_balance": "yes", "thesis_slip": "2e-5"}
    texts |= {"air_temperature": "-10 degC", "tread_material.0": "0.3", "thesis_time": "2 s"}
    answer = line.curves(texts)
    words = shlex.split(answer["command"].replace("\\\n", ""))[2:]
    words.remove("--thesis-balance")
    given = {"image": words.pop(0)} if source == "image" else {}
    given["thesis_balance"] = True
    names = (word.removeprefix("--").replace("-", "_") for word in words[::2])
    case = FootprintCase.of(given | dict(zip(names, words[1::2], strict=True)))
    assert case.depth == 1e-4 and case.ice_material == (2.22, 900.0, 2020.0)
    parameters = case.moving if model == "moving" else case.thesis
    read = read_footprint(case).pressure_map
    model = heat_model(read, parameters)
    assert answer["series"]["model_mu"] == model.mu[0].tolist()


def test_lines_of_python_of_a_row_of_a_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    picture = str(CASES.parent / "docs" / "pictures" / "footprint_picture.jpg")
    texts = {"source": "image", "image": picture, "crop": "0,0,540,420", "row": "210"}
    texts |= {"thesis_balance": "yes", "legend": "556,42,583,378"}
    answer, found = line.curves(texts), {}
    exec(answer["python"], found)
    pressure = np.array(answer["series"]["pressure"]) * 1e5
    assert np.allclose(pressure, found["found"]["pressure_Pa"])
    assert np.allclose(answer["series"]["model_mu"], found["found"]["mu_moving"])


def test_lines_of_python_of_a_profile_in_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "line.csv").write_text("cell_mm,pressure_bar\n1,0\n3,2\n5,3\n7,1\n")
    texts = {"source": "line", "line": str(tmp_path / "line.csv"), "thesis_balance": "yes"}
    answer, found = line.curves(texts), {}
    exec(answer["python"], found)
    assert answer["series"]["pressure"] == [0.0, 2.0, 3.0, 1.0]
    assert np.allclose(answer["series"]["model_mu"], found["found"]["mu_moving"])


ICE_FIELDS = ["ice_material.0", "ice_material.1", "ice_material.2"]
GAUSSIAN_FIELDS = ["gaussian.1", "gaussian.0", "gaussian.2"]


@pytest.mark.parametrize(
    ("name", "texts", "keys", "words"),
    [
        ("point", {"load.pressure": "1 mbar"}, ["load.pressure"], "is out of range; allowed"),
        ("point", {"load.speed": "3 bar"}, ["load.speed"], "wrong unit"),
        (
            "point",
            {"load.speed": '[["0 s", "1 m/s"], ["5 ms", "2 m/s"]]'},
            ["load.speed"],
            "slider",
        ),
        ("point", {"load.duration": ""}, ["load.duration"], "is missing"),
        (
            "point",
            {"contact": "constants", "film.D": ""},
            ["film.k", "film.D", "film.H_V"],
            "together",
        ),
        ("point", {"ice.temperature": "-4"}, ["ice.temperature"], "out of range"),
        ("line", {"speed": "fast"}, ["speed"], "not a number with a unit"),
        ("line", {"source": "image"}, ["image"], "is missing"),
        ("line", {"source": "line", "line": "none.csv"}, ["line"], "is not a file"),
        ("line", {"thesis_balance": "yes", "ice_material.1": "9"}, ICE_FIELDS, "a density that is"),
        ("line", {"ice_temperature": "-4 degC"}, [], "ice_temperature is not a known key"),
        ("wheel", {"speed": "50 km"}, ["speed"], "wrong unit"),
        ("wheel", {"tread": "blocks", "groove": "28 mm"}, ["pitch", "groove"], "leaves no block"),
        (
            "wheel",
            {"shape": "gaussian", "gaussian.2": "0.1 mm"},
            GAUSSIAN_FIELDS,
            "is out of range",
        ),
        ("wheel", {"tread": "round"}, ["tread"], "is not available; allowed"),
        ("wheel", {"initial_height": "0 nm"}, ["initial_height"], "is out of range"),
        ("scene", {"name": "a/b"}, ["name"], "is not a name"),
        ("scene", {"model": "cube"}, ["model"], "is not available; allowed"),
        ("scene", {"film.k": "0.3"}, ["film.k", "film.D", "film.H_V"], "film has k only"),
        ("scene", {"rubber.C10": "1 MPa"}, ["rubber.compound", "rubber.C10"], "contradict"),
    ],
)
def test_wrong_input_names_its_fields_and_has_the_words_of_the_page(
    served,
    name,
    texts,
    keys,
    words,
):
    whole = {"point": TEXTS, "scene": SLICE}.get(name, {})
    status, answer = served.ask(name, texts=whole | texts)
    assert status == 422 and words in answer["sentence"]
    assert answer["keys"] == keys
    assert "--" not in answer["sentence"]


@pytest.mark.quick
@pytest.mark.parametrize("case", sorted(CASES.glob("*.toml")), ids=lambda path: path.stem)
def test_scene_files_survive_the_fields(case):
    from iceslide_fem.scene import read_scene

    texts = form.texts_of(read_scene(case))
    assert set(texts) <= set(form.keys())
    assert form.scene_of(texts) == load_scene(case)


def test_info_and_python_of_a_scene(served):
    status, answer = served.ask("info", texts=SLICE)
    assert status == 200 and {row["group"] for row in answer["rows"]} >= {"heat", "film", "cost"}
    status, answer = served.ask("scene", texts=SLICE)
    assert scene_from_dict(tomllib.loads(answer["toml"])) == form.scene_of(SLICE)
    compile(answer["python"], "python", "exec")
    assert served.ask("read", text=answer["toml"])[1]["texts"] == form.texts_of(
        tomllib.loads(answer["toml"])
    )
    assert served.ask("read", text="pressure = 1 bar")[0] == 422


def test_lines_of_python_use_public_names_only(in_a_folder):
    scene = SLICE | {"model": "point"}
    answers = [point.curves(TEXTS), wheel.curves({}), line.curves({})]
    answers += [point.friction_map(TEXTS, ("load.pressure", "load.speed"), "mu_mean")]
    answers += [Answers(Runs(Path("results")), {}).scene({"texts": scene})]
    for answer in answers:
        imported = [row for row in answer["python"].splitlines() if "import" in row]
        assert set(imported) <= {"import iceslide_fem as ice", "import numpy as np"}
        names = set(re.findall(r"\bice\.(\w+)", answer["python"]))
        assert names and names <= set(iceslide_fem.__all__)
    found: dict = {}
    exec(answers[-1]["python"], found)
    assert found["found"].attrs["name"] == "slice" and 0.0 < found["found"].attrs["mu_mean"] < 1.0


@pytest.mark.quick
@pytest.mark.parametrize(
    ("typed", "read"),
    [
        ("1,5 bar", "1.5 bar"),
        ("0,266", "0.266"),
        ("-4,5 degC", "-4.5 degC"),
        ("1,5e-3", "1.5e-3"),
        ("1,25 kg/m^3", "1.25 kg/m^3"),
        ("1,500 Pa", "1,500 Pa"),  # perhaps 1500 Pa
        ("556,42,583,378", "556,42,583,378"),
        ("[1,5]", "[1,5]"),
        ("1,5 bar.csv", "1,5 bar.csv"),
    ],
)
def test_a_decimal_comma_is_a_point_but_in_lists(typed, read):
    assert form.checked_texts({"key": typed}) == {"key": read}


def test_a_decimal_comma_gives_the_curves_of_a_point(served):
    comma, dot = (served.ask("point", texts=TEXTS | {"load.pressure": text})[1]
                  for text in ("1,5 bar", "1.5 bar"))  # fmt: skip
    assert comma["series"] == dot["series"] and 'pressure = "1.5 bar"' in comma["toml"]
    status, answer = served.ask("point", texts=TEXTS | {"load.pressure": "100,000 Pa"})
    assert status == 422 and "decimal comma" in answer["sentence"]


@pytest.mark.quick
def test_every_field_says_what_it_means(served):
    start = served.ask("start")[1]
    assert all(field["help"] for field in start["fields"])
    assert start["point"]["help"].keys() >= {slider.key for slider in point.SLIDERS}
    for tab in (line.TAB, wheel.TAB):
        said = start["line" if tab is line.TAB else "wheel"]["help"]
        own = {"source", "shape", "tread", "model"}  # of the page, no options
        assert {key for key, text in said.items() if not text} <= own


def test_stops_of_the_wheel_are_those_of_the_command(served, in_a_folder):
    texts = {"abs": "yes", "speed": "20 km/h", "end_speed": "5 km/h", "mass": "300 kg"}
    status, answer = served.ask("stops", texts=texts)
    assert status == 200 and answer["ends"] == pytest.approx([20.0, 5.0])
    found: dict = {}
    exec(wheel.curves(texts)["python"], found)
    stops = found["found"]
    assert np.allclose(stops["stop_measured_from_m_s"] * 3.6, answer["measured"][0])
    for name, one in answer["controls"].items():
        of_command = stops.sel(control=name)
        assert one["distance"] == pytest.approx(float(of_command["stop_distance_m"]), rel=0.05)
        assert one["way"][-1] == pytest.approx(one["distance"], rel=1e-6)
        assert one["speed"][0] == pytest.approx(20.0) and one["deceleration"] > 0.0
    far = [answer["controls"][name]["distance"] for name in ("locked", "threshold", "ideal")]
    assert far == sorted(far, reverse=True)
    status, answer = served.ask("stops", texts=texts | {"speed": "4 km/h"})
    assert status == 422 and answer["keys"] == ["speed", "end_speed"]


@pytest.mark.quick
def test_every_default_is_one_that_a_user_can_type():
    fields = {field["key"]: field for field in form.fields()}
    for key, field in fields.items():
        if field["unit"] and field["default"]:
            value, low, high = (
                to_si(field[name], field["unit"]) for name in ("default", "low", "high")
            )
            assert low <= value <= high, key
    assert fields["ice.temperature"]["default"] == "-4 degC"
    assert fields["film.dry_residual"]["default"] == "0.5 K"


# Runs


@pytest.mark.fe
def test_a_run_ends_with_its_server_however_that_ends_and_keeps_what_it_has(tmp_path, open_app):
    pytest.importorskip("iceslide_fem.fenics.compat")
    page, out = open_app(), tmp_path / "results" / "slice"
    assert page.ask("run", texts=SLICE) == (200, {"number": 1})
    with _followed(page, rows=4):
        status, answer = page.ask("run", texts=SLICE)
        assert status == 422 and "is in use" in answer["sentence"]
        page.process.send_signal(signal.SIGKILL)
        _wait(lambda: not (out / ".lock").exists())
    assert "SIGTERM" in read_run(out).summary["stopped"] and (out / "checkpoint").is_file()


@pytest.mark.fe
def test_a_run_that_no_page_follows_any_more_is_stopped_and_keeps_what_it_has(tmp_path, open_app):
    pytest.importorskip("iceslide_fem.fenics.compat")
    page, out = open_app(), tmp_path / "results" / "slice"
    page.ask("run", texts=SLICE | {"numerics.tolerance": "1e-4"})  # longer than its page is missed
    with _followed(page, rows=4):
        pass
    _wait(lambda: not (out / ".lock").exists())
    assert "SIGTERM" in read_run(out).summary["stopped"] and (out / "checkpoint").is_file()


@contextlib.contextmanager
def _followed(page, rows):
    """Follow the page's first run, as its tab does; begin when it has so many rows."""
    with urllib.request.urlopen(f"{page.address}api/runs/1/news", timeout=120) as news:
        for text in news:
            if text.startswith(b"data:") and json.loads(text[5:])["count"] >= rows:
                break
        yield


def _wait(true):
    end = time.monotonic() + 60.0
    while not true():
        assert time.monotonic() < end, "waited for too long"
        time.sleep(0.05)
