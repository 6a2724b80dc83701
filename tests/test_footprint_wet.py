"""Wet ice below footprints and wheels: against a point that passes, and what cannot be combined."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from program import rows_of

from iceslide_fem.cli import main
from iceslide_fem.film.voids import lugs_of
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap, gaussian_profile
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.ride import Ride, WetIce
from iceslide_fem.preprocess.footprint.survey import summary, survey
from iceslide_fem.preprocess.footprint.synthetic import Tread
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.contact_table import read_contact_table
from iceslide_fem.scene.materials import MELTING_ENTHALPY

pytestmark = pytest.mark.quick

FILE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
SURFACE = read_contact_table(FILE, "the surface")
PIXELS, LENGTH, SPEED = 60, 20e-3, 4.0
ICE = {"temperature": "-1degC", "contact": str(FILE)}


def ride(water, lug=LENGTH, **changes):
    return Ride(SPEED, SPEED, 272.15, wet=WetIce(water, lug))._replace(**changes)


def strip(pressure):
    """A line of one pressure."""
    return PressureMap(np.full((1, PIXELS), pressure), LENGTH / PIXELS, 1e-3)


def mean_mu(water, lug=LENGTH):
    footprint = strip(2e5)
    return film_map(footprint, ride(water, lug), SURFACE).mean_friction(footprint)


@pytest.fixture
def line(tmp_path):
    """Options of a Gaussian, 40 mm long, on few pixels."""
    x, pressure = gaussian_profile(40e-3, 2e5, 80, 20e-3)
    rows = "".join(f"{a:.6g},{b:.6g}\n" for a, b in zip(x, pressure, strict=True))
    (tmp_path / "line.csv").write_text(f"cell_m,pressure_Pa\n{rows}", encoding="utf-8")
    return ICE | {"line": str(tmp_path / "line.csv")}


def words_of(options):
    return [word for key, value in options.items() for word in ("--" + key, value)]


def command(*words):
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return end.value.code


@pytest.mark.parametrize(("water", "bar", "sipes"), [(0.0, 5.0, 0), (2e-5, 2.0, 4), (3e-6, 2.0, 2)])
def test_a_uniform_line_is_a_point_that_passes(water, bar, sipes):
    passes = LENGTH / SPEED
    scene = scene_from_dict(
        {
            "name": "wet",
            "model": "point",
            "rubber": {"compound": "B", "length": LENGTH, "height": 8e-3, "sipes": sipes},
            "load": {"pressure": bar * 1e5, "speed": SPEED, "duration": passes},
            "ice": {"temperature": "-1 degC", "water": water},
            "film": {"voids": "carry", "contact": str(FILE)},
            "numerics": {"tolerance": 1e-4},
        }
    )
    rows, entries = point_history(scene)
    footprint = strip(bar * 1e5)
    here = ride(water, lugs_of(scene.rubber, wide=True).longest, refreeze=scene.refreeze)
    found = film_map(footprint, here, SURFACE, tolerance=1e-3)
    leaves = passes * np.arange(1, PIXELS + 1) / PIXELS
    times, heights, waters, mu = np.array(
        [(row.time_s, row.film_height_m, row.squeezed_height_m, row.mu) for row in rows]
    ).T
    assert found.height[0, ::-1] == pytest.approx(np.interp(leaves, times, heights), rel=1e-3)
    assert found.squeezed[0, ::-1] == pytest.approx(np.interp(leaves, times, waters), rel=1e-3)
    middles = leaves - 0.5 * passes / PIXELS
    of_pixels = found.friction(footprint)[0, ::-1]
    steady = np.arange(PIXELS) > 5  # before, mu bends within a pixel
    due = np.interp(middles, times, mu)
    assert of_pixels[steady] == pytest.approx(due[steady], rel=2e-2)
    assert found.mean_friction(footprint) == pytest.approx(entries["mu_mean"], rel=1e-4)
    assert found.saturated[0, 0]


def test_more_water_and_longer_lugs_have_less_friction():
    by_water = [mean_mu(1e-6 * water, 5e-3) for water in (0.0, 3.0, 20.0)]
    by_lug = [mean_mu(20e-6, 1e-3 * lug) for lug in (3.0, 6.0, 20.0)]
    assert (np.diff(by_water) < 0.0).all() and (np.diff(by_lug) < 0.0).all()


def test_without_full_voids_it_is_the_film_law():
    """1 bar leaves the voids unfilled on this way."""
    footprint = strip(1e5)
    wet, film = (
        film_map(footprint, one, SURFACE, 1e-4) for one in (ride(0.0), ride(0.0, wet=None))
    )
    assert not film.saturated.any()
    for one, other in zip(wet, film, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-12)


def test_energy_is_conserved_and_water_stays_across_gaps():
    footprint = Tread().footprint((6, 80))
    found = film_map(footprint, ride(20e-6, 3e-3), SURFACE, tolerance=1e-3)
    work = found.shear * SPEED * footprint.dx / SPEED
    assert work == pytest.approx(found.ice_heat + found.latent_heat, abs=1e-9)
    melted = found.latent_heat.sum(axis=1) / MELTING_ENTHALPY
    assert (found.squeezed[:, 0] <= 20e-6 + melted).all() and (found.squeezed >= 0.0).all()
    gap = np.flatnonzero(~footprint.contact.any(axis=0))
    for column in gap[gap < 79]:
        before = found.squeezed[:, column + 1]
        assert (found.squeezed[:, column] == before).all()
    ahead = ~footprint.contact[:, ::-1].cumsum(axis=1).astype(bool)[:, ::-1]
    assert (found.squeezed[ahead] == 20e-6).all()


def test_the_summary_says_what_the_water_bears(line):
    def figures(**values):
        case = FootprintCase.of(line | values)
        return summary(survey(case, read_footprint(case)))

    dry, carries, wet, siped = (
        figures(**values)
        for values in ({}, {"water": 0}, {"water": "20um"}, {"water": "20um", "lug": "3mm"})
    )
    assert "water_borne_share" not in dry["film"]
    shares = [one["film"]["water_borne_share"] for one in (carries, siped, wet)]
    assert 0.0 <= shares[0] < shares[1] < shares[2] <= 1.0
    assert carries["film"]["mean_water_height_m"] < 5e-6 < wet["film"]["mean_water_height_m"]
    assert [one["film"]["lug_m"] for one in (wet, siped)] == pytest.approx([40e-3, 3e-3])
    assert not any("does not melt" in said for said in wet["warnings"])
    mu = [one["film"]["mu_mean"] for one in (wet, siped, carries)]
    assert mu == sorted(mu)


def test_the_command_prints_and_writes_the_water(line, tmp_path, capsys):
    out = tmp_path / "a"
    wet = "--water", "20 um", "--lug", "6 mm"
    assert command("footprint", *words_of(line), *wet, "--out", out) == 0
    said = capsys.readouterr().out
    assert "load borne by water" in said and "6 mm" in said
    rows = list(csv.DictReader((out / "line.csv").read_text(encoding="utf-8").splitlines()))
    water = [float(row["water_height_m"]) for row in rows]
    assert 0.0 < min(water) and water[0] < 5e-6 < 15e-6 < water[-1] < 20e-6
    assert (out / "report.html").is_file()


def test_a_uniform_line_of_all_components_is_a_point_that_passes():
    """Water, a strength, and a viscosity over temperature; the water stays with the ice."""
    passes = LENGTH / SPEED
    scene = scene_from_dict(
        {
            "name": "all", "model": "point",
            "rubber": {"compound": "B", "length": LENGTH, "width": LENGTH, "height": 8e-3},
            "load": {"pressure": 2e5, "speed": SPEED, "duration": passes},
            "ice": {"temperature": "-6 degC", "water": 4e-6},
            "water": {"viscosity": [[253.15, 4e-3], [273.15, 1.8e-3]]},
            "film": {
                "voids": "carry", "contact": str(FILE), "dry_stress": 4e5, "dry_softening": 13.5,
                "initial_height": 0.0,
            },
            "numerics": {"tolerance": 1e-3},
        }
    )  # fmt: skip
    rows, entries = point_history(scene)
    here = Ride.of(scene, SPEED, SPEED, scene.ice.temperature, LENGTH)._replace(water_speed=1.0)
    footprint = strip(2e5)
    found = film_map(footprint, here, scene.contact_parameters, tolerance=1e-3)
    assert found.mean_friction(footprint) == pytest.approx(entries["mu_mean"], rel=3e-3)
    assert found.squeezed[0, 0] == pytest.approx(rows[-1].squeezed_height_m, rel=3e-3)
    assert found.height[0, 0] == pytest.approx(rows[-1].film_height_m, rel=1e-2, abs=1e-10)


def test_the_map_has_the_water(tmp_path):
    from iceslide_fem.preprocess.footprint.command import all_maps

    np.save(tmp_path / "p.npy", Tread().footprint((8, 40)).pressure)
    size = {"length": "100mm", "width": "100mm", "contact": str(FILE)}
    case = FootprintCase.of(
        {"pressure_map": str(tmp_path / "p.npy"), "water": "20um", "lug": "6mm", **size}
    )
    maps = all_maps(survey(case, read_footprint(case)))
    contact = maps["contact"] > 0
    assert (maps["water_height_m"][contact] > 0.0).all()
    borne = maps["water_pressure_Pa"]
    assert (borne[~contact] == 0.0).all() and (borne <= maps["pressure_Pa"]).all()


def test_a_locked_wheel_is_the_footprint(line, tmp_path):
    options = words_of(line) + [
        "--speed",
        "20km/h",
        "--water",
        "20um",
        "--lug",
        "6mm",
        "--no-report",
    ]
    assert command("footprint", *options, "--out", tmp_path / "f") == 0
    assert command("wheel", *options, "--slip", "0.1,1", "--out", tmp_path / "w") == 0
    film, wheel = (
        json.loads((tmp_path / name / "summary.json").read_text(encoding="utf-8"))
        for name in ("f", "w")
    )
    assert wheel["curves"][0]["locked_mu"] == pytest.approx(film["film"]["mu_mean"], rel=1e-6)


def test_a_wheel_with_water_is_that_of_a_wet_scene(line, tmp_path):
    (tmp_path / "law.toml").write_text(
        'name = "law"\nmodel = "slice"\n[rubber]\ncompound = "B"\nlength = "6 mm"\n'
        '[load]\npressure = "2 bar"\nspeed = 1.0\nduration = "1 ms"\n'
        '[ice]\ntemperature = "-1 degC"\nwater = "20 um"\n'
        f'[film]\nvoids = "carry"\ncontact = "{FILE}"\n',
        encoding="utf-8",
    )
    source = ["--line", line["line"], "--slip", "0.3,1", "--stiffness", "7e7Pa/m"]
    source += ["--speed", "20km/h", "--no-report", "--tolerance", "1e-3"]
    assert command("wheel", *source, "--scene", tmp_path / "law.toml", "--out", tmp_path / "s") == 0
    given = ["--contact", FILE, "--temperature", "-1degC", "--water", "20um", "--lug", "6mm"]
    assert command("wheel", *source, *given, "--out", tmp_path / "o") == 0
    by_scene, own = (
        [float(row["mu"]) for row in rows_of(tmp_path / name / "mu_slip.csv")]
        for name in ("s", "o")
    )
    assert own == pytest.approx(by_scene, rel=1e-2)


def test_the_lug_is_that_of_a_block_or_the_footprint(line):
    pattern = {"pitch": "28mm", "groove": "8mm"}
    lugs = [
        WheelCase.of(line | values).ride_at(1.0, 1.0, 0.04).wet.lug
        for values in (
            {"water": 0}, {"water": 0} | pattern, {"water": 0, "lug": "3mm"} | pattern,
        )
    ]  # fmt: skip
    assert lugs == pytest.approx([40e-3, 20e-3, 3e-3])
    assert WheelCase.of(line).ride_at(1.0, 1.0, 0.04).wet is None


@pytest.mark.parametrize(
    ("kind", "values", "words"),
    [
        (FootprintCase, {"water": "-1um"}, "--water"),
        (FootprintCase, {"water": "6mm"}, "--water"),
        (FootprintCase, {"water": "20degC"}, "--water"),
        (FootprintCase, {"water": "nan"}, "--water"),
        (FootprintCase, {"water": "20um", "lug": "0mm"}, "--lug"),
        (FootprintCase, {"lug": "6mm"}, "give --water, too"),
        (FootprintCase, {"water": 0, "water_speed": 0}, "--water-speed"),
        (WheelCase, {"water": "20um", "scene": "a.toml"}, "--scene and --water contradict"),
        (WheelCase, {"lug": "6mm", "scene": "a.toml"}, "--lug"),
    ],
)
def test_what_cannot_carry_gets_one_sentence(kind, values, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("eta.csv").write_text("T (degC), eta (mPa*s)\n-9, 3\n0, 1\n", encoding="utf-8")
    Path("a.toml").write_text(
        'name = "a"\nmodel = "point"\n[rubber]\ncompound = "B"\nprony = [[0.3, "5 ms"]]\n'
        'modulus_is = "instantaneous"\n'
        '[load]\npressure = "2 bar"\nspeed = 1.0\nduration = "1 ms"\n[film]\ncontact_age = true\n',
        encoding="utf-8",
    )
    with pytest.raises(SceneError) as refusal:
        kind.of({"gaussian": "40mm,2bar,20mm"} | values)
    assert words in str(refusal.value) and "\n" not in str(refusal.value)
