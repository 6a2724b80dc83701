"""Rough rubber that creeps into contact: closed forms, correspondence principle, the command."""

import json

import numpy as np
import pytest
from program import exit_code, rows_of
from surface_spec import SPEC

from iceslide_fem.preprocess.roughness.case import RoughnessCase, material
from iceslide_fem.preprocess.roughness.creep import STEP_TOLERANCE, hold, step_error, steps
from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.preprocess.roughness.parameters import measure
from iceslide_fem.preprocess.roughness.survey import survey
from iceslide_fem.relaxation.prony import Prony, delayed

pytestmark = pytest.mark.quick

SLS, G0 = Prony((0.3,), (5e-3,)), 546e3  # G_inf is 382.2 kPa
TIMES = np.logspace(-7.0, 2.0, 10)
TEN = Prony(tuple(0.9 * TIMES**-0.1 / (TIMES**-0.1).sum()), tuple(TIMES))
SURFACES = [
    {"rms_slope": 0.2, "hurst": 0.8, "rolloff": 2e-4, "shortest_wave": 5e-5},
    {"rms_slope": 0.4, "hurst": 0.3, "rolloff": 1e-4, "shortest_wave": 5e-5},
    {"rms_slope": 0.3, "hurst": 0.9, "rolloff": 2e-4, "shortest_wave": 5e-5, "skewness": -0.9},
]
SCENE = """\
name = "s"
model = "point"
[rubber]
compound = "B"
prony = [[0.3, "5 ms"]]
modulus_is = "long-term"
[load]
pressure = "1 bar"
speed = 3
duration = "1 ms"
"""


def test_a_wave_creeps_as_its_closed_form():
    """k = (2/pi) asin sqrt(p E_0 J / p*), p* = pi E* amplitude / length (Westergaard)."""
    n, ages, pressure = 1000, [0.0, 1e-3, 5e-3, 10.0], 50e3
    heights = np.tile(1e-6 * np.cos(2.0 * np.pi * np.arange(n) / n), (2, 1))
    (contacts,) = hold(heights, 50e-6 / n, 4.0 * G0, [pressure], SLS, ages)
    exact = [0.412557, 0.425974, 0.463619, 0.513069]
    full = np.pi * 4.0 * G0 * 1e-6 / 50e-6
    formula = 2.0 / np.pi * np.arcsin(np.sqrt(pressure * SLS.creep.compliance(ages) / full))
    assert formula == pytest.approx(exact, abs=1e-6)
    assert [(each.pressure > 0.0).mean() for each in contacts] == pytest.approx(exact, abs=2 / n)
    assert [each.pressure.mean() for each in contacts] == pytest.approx([pressure] * 4)


def test_a_sphere_creeps_as_its_closed_form():
    """a^3 = (3/16) R integral of J dF of an incompressible half-space (Lee and Radok)."""
    radius, force, creep = 1e-3, 10e-3, SLS.creep

    def contact(felt):
        return 1e6 * (3.0 / 16.0 * radius * felt / G0) ** (1.0 / 3.0)

    held = contact(force * creep.compliance([0.0, 1e-3, 5e-3, 20e-3]))
    assert held == pytest.approx([150.8700, 153.6347, 161.0216, 168.8774], abs=1e-4)
    arms, felt = np.zeros(len(creep.times)), []
    times, forces = [0.0, 2.5e-3, 5e-3, 20e-3], [0.0, 0.5 * force, force, force]
    for i in (1, 2, 3):
        x = (times[i] - times[i - 1]) / np.array(creep.times)
        arms = delayed(arms, np.array(forces[i - 1]), np.array(forces[i]), x)
        felt.append(forces[i] + float(np.array(creep.fractions) @ arms))
    ramp = contact(np.array(felt))
    assert ramp == pytest.approx([122.3610, 156.6950, 168.4072], abs=1e-4)


@pytest.mark.parametrize("given", SURFACES)
@pytest.mark.parametrize("prony", [SLS, TEN], ids=["one arm", "ten arms"])
def test_held_contact_is_elastic_contact_at_another_pressure(given, prony):
    ages, pixel, modulus = [1e-3, 5e-3, 0.1], 5e-4 / 48, 4.0 * G0
    spec = SurfaceSpec.model_validate(given | {"size": 5e-4, "pixels": 48})
    heights = generate(spec).heights
    pressures = [part * modulus * given["rms_slope"] for part in (0.05, 0.15, 0.4)]
    before = np.zeros(heights.shape, dtype=bool)
    for pressure, contacts in zip(
        pressures, hold(heights, pixel, modulus, pressures, prony, ages), strict=True
    ):
        effective = pressure * prony.creep.compliance(ages)
        for contact, other in zip(
            contacts, press(heights, pixel, modulus, effective.tolist()), strict=True
        ):
            here, there = (
                measure(each, pixel, "hydrodynamic", True)[:3] for each in (contact, other)
            )
            assert here[:2] == pytest.approx(there[:2], rel=0.01)  # k, D
            assert here[2] == pytest.approx(there[2], rel=0.01, abs=1e-10)
            assert contact.pressure.mean() == pytest.approx(pressure)
        touching = contacts[-1].pressure > 0.0
        assert (touching | ~before).all()  # it grows, with the pressure and with the age
        assert (touching | ~(contacts[0].pressure > 0.0)).all()
        before = touching


def test_steps_are_as_many_as_the_series_needs():
    ages = [1e-3, 5e-3]
    for prony, most in ((SLS, 6), (TEN, 25)):
        times = steps(prony, ages)
        assert step_error(prony, times, ages) <= STEP_TOLERANCE
        assert set(ages) <= set(times) and times[0] == 0.0 and len(times) <= most
    assert steps(SLS, [0.0]).tolist() == [0.0]
    fast = Prony((0.5,), (1e-12,))  # has relaxed long before
    assert len(steps(fast, [5e-3])) == 2


def test_tables_at_ages_from_the_command(tmp_path, capsys):
    (tmp_path / "surface.toml").write_text(SPEC, encoding="utf-8")
    out, surface = tmp_path / "out", tmp_path / "surface.toml"
    words = ["--realisations", 1, "--pressures", "0.5bar:4bar:3", "--out", out]
    relaxing = ["--prony", "0.3:5ms", "--modulus-is", "instantaneous"]
    assert exit_code("roughness", surface, *words, *relaxing, "--age", "5ms,0s") == 0
    printed = capsys.readouterr().out
    assert "iterations" in printed and "5 ms after loading" in printed
    assert not (out / "contact.csv").exists()

    def column(name, key="k"):
        return [float(row[key]) for row in rows_of(out / name)]

    early, late = column("contact_0ms.csv"), column("contact_5ms.csv")
    assert all(one < other for one, other in zip(early, late, strict=True))
    assert column("contact_5ms.csv", "age_s") == [5e-3] * 3
    assert json.loads((out / "surface.json").read_text())["ages_s"] == [0.0, 5e-3]
    given = {"surface": str(surface), "realisations": "1", "pressures": "0.5bar:4bar:3"}
    softer = f"{1.64e6 / SLS.creep.compliance(5e-3)}"
    assert survey(RoughnessCase.of(given | {"modulus": softer})).mean.k == pytest.approx(
        late, rel=0.01
    )
    cold = {"prony": "0.3:5ms", "modulus_is": "instantaneous", "wlf": "7.4005,121.6,20degC"}
    cold |= {"temperature": "-4degC", "ages": f"{5e-3 * 10**1.8197:.6g}s"}
    assert survey(RoughnessCase.of(given | cold)).mean.k == pytest.approx(late, rel=1e-3)


def test_rubber_that_relaxes_by_file_and_by_scene(tmp_path):
    (tmp_path / "surface.toml").write_text(SPEC, encoding="utf-8")
    (tmp_path / "s.toml").write_text(SCENE, encoding="utf-8")
    given = {"surface": str(tmp_path / "surface.toml"), "ages": "5ms"}
    scene = material(RoughnessCase.of(given | {"scene": str(tmp_path / "s.toml")}))
    assert scene.modulus == pytest.approx(1.64e6 / 0.75 / 0.7) and scene.prony == SLS
    fragment = SCENE.partition("[load]")[0].partition("[rubber]")
    (tmp_path / "rubber.toml").write_text("".join(fragment[1:]), encoding="utf-8")
    path = {"prony": str(tmp_path / "rubber.toml"), "modulus_is": "instantaneous"}
    found = material(RoughnessCase.of(given | path | {"modulus": "3 MPa"}))
    assert (found.modulus, found.prony) == (4e6, SLS)


AGED = ("--age", "5ms", "--prony", "0.3:5ms")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--prony", "0.3:5ms"], "--prony is of rubber that relaxes; give --age"),
        (["--age", "5ms"], "--age asks for rubber that relaxes"),
        (["--age", "5ms", "--prony", "0.3:5ms"], "--modulus-is is missing"),
        (["--age", "5ms", "--prony", "0.3", "MODULUS"], "arm 1 is no pair of g and tau"),
        (["--age", "5ms", "--prony", "1.3:5ms", "MODULUS"], "is out of range"),
        (["--age", "soon", "--prony", "0.3:5ms", "MODULUS"], '--age "soon"'),
        (["--age", "-1s", "--prony", "0.3:5ms", "MODULUS"], "is out of range"),
        (["--age", "5ms", "--prony", "none.toml", "MODULUS"], "none.toml"),
        (["--age", "5ms", "--scene", "elastic.toml"], "elastic.toml is elastic"),
        (["--age", "5ms", "--scene", "s.toml", "MODULUS"], "is of arms that are given; give --pro"),
        (["--age", "5ms", "--scene", "s.toml", "--temperature", "0degC"], "do not shift"),
        ([*AGED, "--wlf", "7,120,20degC", "MODULUS"], "--temperature is missing"),
        ([*AGED, "--wlf", "7,20,20degC", "--temperature", "-4degC", "MODULUS"], "no value at"),
        (["--age", "5ms", "--prony", "cut.toml", "MODULUS"], "rubber.prony"),
    ],
)  # fmt: skip
def test_wrong_input_gets_one_sentence(tmp_path, monkeypatch, capsys, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "surface.toml").write_text(SPEC, encoding="utf-8")
    (tmp_path / "s.toml").write_text(SCENE, encoding="utf-8")
    lines = [line for line in SCENE.splitlines() if not line.startswith(("prony", "modulus_is"))]
    (tmp_path / "elastic.toml").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "cut.toml").write_text('[rubber]\ncompound = "B"\nprony = 3\n', encoding="utf-8")
    given = [word for word in words if word != "MODULUS"]
    given += ["--modulus-is", "long-term"] * ("MODULUS" in words)
    assert exit_code("roughness", "surface.toml", *given, "--out", "out") == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()
