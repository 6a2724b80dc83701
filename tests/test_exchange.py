"""A wheel for other programs: Magic Formula files, functional mock-up units, UM-Bridge."""

import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
import urllib.error
import urllib.request
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from program import exit_code

from iceslide_fem.exchange.exported import wheel_in
from iceslide_fem.exchange.fmu import MODEL, VARIABLES, write_fmu
from iceslide_fem.exchange.magic_formula import MagicFormula, fitted, tyre_property_file
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.slip_table import SlipTable
from iceslide_fem.runtime.errors import SceneError

ROOT = Path(__file__).parent.parent
# A strength that does not fall with the temperature, which slices have.
CONSTANT = ("--set", "film.dry_softening=200K", "--set", "rubber.inertia=true")
COLD = ROOT / "cases" / "cold_point.toml"
SLIPS = np.concatenate([[0.0], np.geomspace(2e-3, 1.0, 60)])
TABLE = SlipTable(
    np.array([1.0, 4.0, 9.0]), np.array([0.0, 0.1, 0.4, 1.0]),
    np.array([[0.0, 0.4, 0.3, 0.2], [0.0, 0.3, 0.2, 0.1], [0.0, 0.2, 0.1, 0.05]]),
)  # fmt: skip


def entries(text):
    """Values of a tyre property file."""
    found = re.findall(r"^(\w+)\s*= ([-+.\deE]+)$", text, re.MULTILINE)
    return {key: float(value) for key, value in found}


def longitudinal(file, kappa):
    """F_x / F_z of MF 5.2 at the nominal load (H. B. Pacejka, 2nd ed., eq. 4.E9 to 4.E18)."""
    x = kappa + file["PHX1"]
    C, D, E = file["PCX1"], file["PDX1"], file["PEX1"]
    B = file["PKX1"] / (C * D)
    return D * np.sin(C * np.arctan(B * x - E * (B * x - np.arctan(B * x)))) + file["PVX1"]


def lateral(file, alpha):
    """F_y / F_z of the same (eq. 4.E19 to 4.E30) without camber."""
    x = np.tan(alpha) + file["PHY1"]
    C, D, E = file["PCY1"], file["PDY1"], file["PEY1"]
    K = file["PKY1"] * np.sin(2.0 * np.arctan(1.0 / file["PKY2"]))
    B = K / (C * D)
    return D * np.sin(C * np.arctan(B * x - E * (B * x - np.arctan(B * x)))) + file["PVY1"]


@pytest.mark.quick
def test_a_curve_of_the_formula_is_found_again():
    exact = MagicFormula(46.292, 2.0144, 0.2766, 0.8598)
    found = fitted(SLIPS, exact(SLIPS))
    assert found.error < 1e-4
    assert found(SLIPS) == pytest.approx(exact(SLIPS), abs=1e-4 * 0.2766)


@pytest.mark.quick
def test_the_file_has_the_curves_with_the_signs_of_its_convention():
    along = MagicFormula(46.0, 1.8, 0.28, 0.5, 1e-3, 2e-3)
    across = MagicFormula(30.0, 1.4, 0.25, 0.2, 5e-4, 1e-3)
    file = entries(tyre_property_file(along, across, 3432.0, 0.3, 5.0, ["about"]))
    braked = longitudinal(file, -SLIPS)
    assert braked == pytest.approx(-along(SLIPS), abs=1e-7)
    alpha = np.radians(np.linspace(0.0, 12.0, 20))
    assert lateral(file, alpha) == pytest.approx(-across(np.tan(alpha)), abs=1e-7)
    assert file["FNOMIN"] == 3432.0 and file["UNLOADED_RADIUS"] == 0.3


def test_another_program_has_the_same_forces():
    pacejka = pytest.importorskip("pacejka")
    one = MagicFormula(46.292, 2.0144, 0.2766, 0.8598)
    file = entries(tyre_property_file(one, one, 3432.0, 0.3, 5.0, []))
    B = file["PKX1"] / (file["PCX1"] * file["PDX1"])
    tire = pacejka.Tire.from_constants("ice", file["PDX1"], B, file["PCX1"], file["PEX1"])
    _, force = tire.calculate_forces(3432.0, 0.0, SLIPS, friction_circle=False)
    assert force == pytest.approx(3432.0 * one(SLIPS), rel=1e-7, abs=1e-4)


@pytest.mark.quick
def test_a_case_is_read_from_its_command():
    options = {
        "gaussian": "120mm,2bar,60mm", "slip": "0.1,1", "stiffness": "7e7 Pa/m",
        "vary": ["speed=5m/s,8m/s"], "dry_stress": "0.45 MPa", "dry_softening": "13.5 K",
    }  # fmt: skip
    case = WheelCase.of(options)
    assert WheelCase.of_command(case.as_command("wheel")) == case


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exchange") / "wheel"
    words = "--gaussian 120mm,2bar,60mm --slip 0.05,1 --stiffness 68.25MPa/m --speed 20km/h"
    assert exit_code("wheel", *words.split(), "--out", folder, "--no-report") == 0
    return folder


def test_a_wheel_becomes_a_tyre_property_file(wheel, tmp_path, capsys):
    path = tmp_path / "own.tir"
    assert exit_code("export", "tir", wheel, "--load", "3432N", "--out", path) == 0
    said = capsys.readouterr().out
    assert "largest error" in said and "its shape is none of this formula" in said
    file = entries(path.read_text())
    slip, mu = _row(wheel)
    assert -longitudinal(file, -slip) == pytest.approx(mu, abs=0.1 * mu)
    assert "largest error over the peak" in path.read_text()


def _row(folder):
    rows = np.genfromtxt(folder / "mu_slip.csv", delimiter=",", names=True)
    return float(rows["slip"][0]), float(rows["mu"][0])


def test_a_line_has_no_load_and_other_folders_no_wheel(wheel, tmp_path, capsys):
    assert exit_code("export", "tir", wheel) == 2
    assert "give --load" in capsys.readouterr().err
    assert exit_code("export", "tir", wheel, "--load", "5 bar") == 2
    assert "has the wrong unit" in capsys.readouterr().err
    with pytest.raises(SceneError, match="no results of iceslide wheel"):
        wheel_in(tmp_path)


@pytest.mark.quick
def test_the_unit_describes_itself(tmp_path):
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    write_fmu(tmp_path / "unit.fmu", TABLE, 'a "tyre" < ice')
    with zipfile.ZipFile(tmp_path / "unit.fmu") as unit:
        names = unit.namelist()
        described = ElementTree.fromstring(unit.read("modelDescription.xml"))
        source = unit.read(f"sources/{MODEL}.c").decode()
    assert any(name.startswith("binaries/") for name in names)
    found = {one.get("name"): one.get("causality") for one in described.iter("ScalarVariable")}
    assert found == {name: causality for name, causality, *_ in VARIABLES}
    assert described.get("guid") in source and "@" not in source


class _Unit:
    """A unit, called as an importer calls it."""

    def __init__(self, path, folder):
        with zipfile.ZipFile(path) as unit:
            unit.extractall(folder)
            guid = ElementTree.fromstring(unit.read("modelDescription.xml")).get("guid")
        (library,) = folder.glob("binaries/*/*.so")
        self.of = ctypes.CDLL(str(library))
        self.of.fmi2Instantiate.restype = ctypes.c_void_p
        name, guid = b"one", guid.encode()
        self.one = ctypes.c_void_p(self.of.fmi2Instantiate(name, 1, guid, b"", None, 0, 0))
        assert self.one.value

    def set(self, *values):
        numbers = (ctypes.c_double * 3)(*values)
        return self.of.fmi2SetReal(self.one, (ctypes.c_uint * 3)(0, 1, 2), 3, numbers)

    def get(self):
        out = (ctypes.c_double * 2)()
        status = self.of.fmi2GetReal(self.one, (ctypes.c_uint * 2)(3, 4), 2, out)
        return status, list(out)


@pytest.mark.quick
def test_the_unit_computes_the_table(tmp_path):
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    write_fmu(tmp_path / "unit.fmu", TABLE, "a tyre")
    unit = _Unit(tmp_path / "unit.fmu", tmp_path / "unit")
    rng = np.random.default_rng(5)
    for v, slip in zip(rng.uniform(1.0, 9.0, 200), rng.uniform(0.0, 1.0, 200), strict=True):
        assert unit.set(v, slip, 3000.0) == 0
        status, (mu, force) = unit.get()
        assert status == 0
        assert mu == pytest.approx(TABLE.inside(v, slip), abs=1e-12)
        assert force == pytest.approx(3000.0 * mu, rel=1e-15)
    for edge in ((1.0, 0.0), (9.0, 1.0)):
        assert unit.set(*edge, 1.0) == 0 and unit.get()[1][0] == pytest.approx(TABLE(*edge))
    assert unit.set(np.nan, 0.1, 1.0) != 0
    for outside in ((0.5, 0.1, 1.0), (2.0, 1.1, 1.0), (2.0, 0.1, -1.0)):
        assert unit.set(*outside) == 0 and unit.get()[0] != 0


def test_the_unit_is_valid_and_simulates(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    write_fmu(tmp_path / "unit.fmu", TABLE, "a tyre")
    assert not validate_fmu(tmp_path / "unit.fmu")
    time = np.linspace(0.0, 1.0, 101)
    given = np.zeros(101, dtype=[(name, float) for name in ("time", "speed_m_s", "slip", "load_N")])
    given["time"], given["speed_m_s"] = time, 5.0
    given["slip"], given["load_N"] = 0.2, 3000.0
    found = fmpy.simulate_fmu(
        str(tmp_path / "unit.fmu"), stop_time=1.0, input=given, output=["mu", "force_N"],
        step_size=0.01, output_interval=0.01,
    )  # fmt: skip
    assert found["mu"][1:] == pytest.approx(TABLE.inside(5.0, 0.2), abs=1e-12)


@pytest.fixture(scope="module")
def served():
    pytest.importorskip("starlette")
    pytest.importorskip("uvicorn")
    words = "--port 0 --input film.dry_stress --input film.dry_softening --input load.speed"
    more = "--input load.pressure --input ice.temperature --output mu_mean --output mu_peak"
    command = [sys.executable, "-m", "iceslide_fem.cli", "serve", str(COLD)]
    process = subprocess.Popen(
        [*command, *words.split(), *more.split(), "--output", "mu_end"],
        stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    address = process.stdout.readline().strip()
    yield address
    process.terminate()
    assert process.wait(20) == 0


def ask(address, path, **body):
    """Status and answer of a request."""
    request = urllib.request.Request(
        f"{address}/{path}", json.dumps(body).encode(), {"content-type": "application/json"}
    )
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)


ONE = [[0.45e6], [13.5], [0.1], [2e5], [258.15]]


def test_the_server_answers_by_the_protocol(served):
    with urllib.request.urlopen(f"{served}/Info", timeout=60) as answer:
        assert json.load(answer) == {"protocolVersion": 1.0, "models": ["point"]}
    assert ask(served, "ModelInfo", name="point")[1]["support"]["Evaluate"] is True
    assert ask(served, "InputSizes", name="point")[1] == {"inputSizes": [1] * 5}
    config = {"points": 3}
    assert ask(served, "OutputSizes", name="point", config=config)[1] == {"outputSizes": [3] * 3}
    status, found = ask(served, "Evaluate", name="point", input=ONE, config={})
    assert status == 200
    expected = [[0.8664123], [0.9292410], [0.7935939]]
    assert np.allclose(found["output"], expected, rtol=3e-3)
    many = [values * 3 for values in ONE]
    many[2] = [0.1, 0.3, 1.0]
    _, three = ask(served, "Evaluate", name="point", input=many, config=config)
    assert three["output"][0][0] == pytest.approx(found["output"][0][0], rel=1e-3)
    assert np.all(np.diff(three["output"][0]) < 0.0)


def test_wrong_requests_are_answered_with_a_sentence(served):
    def error(**body):
        status, found = ask(served, "Evaluate", **body)
        assert status == 400
        return found["error"]["type"], found["error"]["message"]

    assert error(name="other", input=ONE)[0] == "ModelNotFound"
    assert error(name="point", input=ONE[:2])[0] == "InvalidInput"
    assert "ice.temperature" in error(name="point", input=[*ONE[:4], [300.0]])[1]
    assert "points is 0" in error(name="point", input=ONE, config={"points": 0})[1]
    assert error(input=ONE)[0] == "InvalidInput"


def test_the_client_of_the_protocol_is_answered(served):
    umbridge = pytest.importorskip("umbridge")
    model = umbridge.HTTPModel(served, "point")
    assert model.get_input_sizes() == [1] * 5
    assert np.allclose(model(ONE), [[0.8664123], [0.9292410], [0.7935939]], rtol=3e-3)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "give --input"),
        (["--input", "film.x"], "film.x"),
        (["--input", "film.k"], "film.k is no number in this scene"),
        (["--input", "load.speed", "--output", "mu"], "--output mu is none"),
        (["--input", "load.speed", "--set", "model=slice", *CONSTANT], "is not served"),
        (["--input", "load.speed", "--input", "load.speed"], "is given twice"),
    ],
)
def test_what_cannot_be_served_is_one_sentence(words, sentence, capsys):
    pytest.importorskip("starlette")
    assert exit_code("serve", COLD, *words) == 2
    said = capsys.readouterr().err
    assert sentence in said and said.count("\n") == 1
