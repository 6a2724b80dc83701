"""The studies run in their quick forms and print their tables."""

import importlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")

from iceslide_fem import simulate
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.preprocess.footprint.synthetic import Tread
from iceslide_fem.preprocess.roughness.generate import generate
from iceslide_fem.surfaces.surface import low_passed
from scripts.studies import (
    dry_calibration,
    footprint_findings,
    friction_drum,
    ice_layers,
    limits,
    peers_calculix,
    poor_maps,
    sensitivity,
)
from scripts.studies.common import ROOT, case
from scripts.studies.peers_calculix import displacement
from scripts.studies.press_elements import DEFAULT, MATERIAL, half_cube, in_tetrahedra

pytestmark = [pytest.mark.fe, pytest.mark.study]

DRUM_ROWS = tuple(friction_drum.NAMES.values())


def output(study, *options, timeout=300):
    """What a study prints on a process of its own, as one runs it."""
    done = subprocess.run(
        [sys.executable, "-m", f"scripts.studies.{study}", *options],
        cwd=ROOT,
        env=dict(os.environ),  # without what MPI, started in this process, adds to the system's
        capture_output=True,
        text=True,
        timeout=timeout,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def printed(study, *options):
    """Cells of the Markdown tables that the quick form prints."""
    return [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in output(study, "--quick", *options).splitlines()
        if line.startswith("|")
    ]


def test_pictures_of_the_pages_change_only_when_asked(tmp_path):
    before = {path: path.stat().st_mtime_ns for path in (ROOT / "docs").rglob("*.png")}
    output("thesis_trends", "--pictures", str(tmp_path))
    assert (tmp_path / "trends.png").stat().st_size > 10_000
    assert before == {path: path.stat().st_mtime_ns for path in (ROOT / "docs").rglob("*.png")}


def test_press_of_the_elements(tmp_path):
    rows = printed("press_elements", "--pictures", str(tmp_path))
    errors = {(row[0], row[1]): row[4] for row in rows if row[4:] and row[4].endswith("%")}
    assert all(error.startswith("-") for error in errors.values())  # too stiff, all of them
    error = {key: abs(float(text.strip("%"))) for key, text in errors.items()}
    assert error["P1 tetrahedra", "4"] > 10 > error["Q2", "4"] > error[DEFAULT, "4"]
    assert error[DEFAULT, "4"] > error["Q2/P1 mixed", "4"]
    assert (tmp_path / "elements.png").stat().st_size > 10_000


def test_blocks_of_two_rubbers():
    rows = printed("layers", "--quick")
    change = {row[0]: float(row[-2].strip("%")) for row in rows if row[-2].endswith("%")}
    assert abs(float(next(row[-1] for row in rows if row[0] == "program").strip("%"))) < 0.3
    assert abs(change["the same rubber"]) < 0.01
    assert abs(change["steel"] - change["a plate at 2 mm"]) < 0.3


def test_slides_by_two_elements():
    rows = [row for row in printed("slide_elements", "--cases", "thesis_5bar") if row[0][:1] == "Q"]
    error = {tuple(row[:2]): row[6:] for row in rows}
    full, default = error["Q2", "0.35"], error[DEFAULT, "0.35"]
    percent = [abs(float(plate.strip("%"))) for plate, *_ in (full, default)]
    assert full[0].startswith("-") and percent[0] > 2.0 * percent[1]  # Q2 locks
    assert error[DEFAULT, "0.7"][:3] == ["+0.00%", "0.00%", "0.00%"]  # of itself
    assert all(float(row[-1].strip("+-%")) < 5.0 for row in error.values())


def test_cube_beside_the_programs_that_are_here(tmp_path):
    rows = [row for row in printed("peers", "--pictures", str(tmp_path)) if len(row) == 8]
    errors = {(row[1], row[2]): float(row[5].strip("%")) for row in rows if row[2] in "24"}
    assert -1.2 < errors[f"{DEFAULT}, the default", "4"] < -1.0  # percent
    assert -4.0 < errors["Q2", "4"] < -3.0
    assert -0.8 < errors["Q2/P1 mixed", "4"] < -0.3
    assert -5.0 < errors.get(("C3D20R", "4"), -2.6) < -2.0
    assert (tmp_path / "peers.png").stat().st_size > 10_000


def test_input_of_calculix_has_all_faces_that_may_touch():
    mesh = half_cube(2)
    cube = peers_calculix.Cube(mesh, "C3D20R", MATERIAL, 1e5, 0.5, 1e12)
    text, unknowns = peers_calculix.written(cube)
    assert unknowns == 3 * 51
    assert len(peers_calculix.faces(mesh)) == len(mesh.facets["contact"])
    cut = in_tetrahedra(mesh)
    assert len(peers_calculix.faces(cut)) == 2 * len(mesh.facets["contact"])
    assert "*HYPERELASTIC, MOONEY-RIVLIN\n0.1662,0.1068,0.0737\n" in text


def test_answer_of_calculix_is_that_of_the_whole_load(tmp_path):
    def lines(time):
        head = f" displacements (vx,vy,vz) for set FIRST and time  {time}\n\n"
        return head + "         3  0.000000E+00  0.000000E+00 -1.972171E-01\n\n"

    path = tmp_path / "cube.dat"
    assert np.isnan(displacement(path))
    path.write_text(lines("0.9000000E+00"), encoding="utf-8")
    assert np.isnan(displacement(path))
    path.write_text(lines("0.9000000E+00") + lines("0.1000000E+01"), encoding="utf-8")
    assert displacement(path) == pytest.approx(1.972171e-4)


def test_penalty_moves_the_plate_little():
    rows = printed("penalty_effect")
    changes = {row[1]: float(row[3].strip("%")) for row in rows if row[0] == "slice, 1 bar"}
    assert 0.0 < changes["penalty x 0.5"] < 2.0
    assert -1.0 < changes["penalty x 2"] < 0.0


def test_two_ranks_change_no_result():
    _, _, one, two = printed("ranks", "--cases", "thesis_1bar")
    assert (one[1], two[1]) == ("1", "2")
    assert one[2] == two[2]  # unknowns
    assert float(one[10]) == 0.0 <= float(two[10]) < 1e-2  # of mu(t): below the tolerance
    assert abs(float(two[11])) < 1e-4


def test_sliding_variants(tmp_path):
    options = ["--quick", "--pictures", str(tmp_path), "--runs", str(tmp_path / "runs")]
    lines = output("compare_sliding", *options, timeout=600).splitlines()
    rows = [line for line in lines if line.startswith("1bar  ")]
    assert len(rows) == 6 + 4
    shares = [float(row.split()[-5].strip("%")) for row in rows[:6]]
    assert [share > 2.0 for share in shares] == [False, True] * 3
    assert (tmp_path / "sliding.png").stat().st_size > 10_000


def test_maps_of_the_film_law_have_no_failure(tmp_path):
    asked = ("--questions", "maps", "--maps", "film-weather", "--pictures", str(tmp_path))
    rows = printed("limits", *asked)
    cells = {(row[0], number): cell for row in rows for number, cell in enumerate(row)}
    assert not any(cell.split()[-1:] in (["F"], ["r"]) for cell in cells.values())
    assert cells["-40", 1] == "dry" and cells["-0.1", 8].startswith("m ")
    assert len(list(tmp_path.glob("film_weather_*.png"))) == 2


def test_stiffer_penalty_is_more_accurate_as_an_update_of_multipliers_is(tmp_path):
    """And takes as many iterations; an update finds the plate, and takes some more."""
    rows = printed("accuracy_cost", "--questions", "contact", "--pictures", str(tmp_path))
    found = {(row[1], row[2]): row for row in rows if row[0] == "press by 1 bar"}
    soft, stiff = (found["penalty (default)", f"{x} E/H"] for x in ("100", "1000"))
    assert float(stiff[3]) < 0.2 * float(soft[3])
    assert int(stiff[7]) <= 1.5 * int(soft[7])
    updated = found["augmented Lagrangian, 1 update", "100 E/H"]
    assert float(updated[3]) < 1e-2 * float(soft[3]) and int(updated[7]) > int(soft[7])
    assert 0.0 < float(updated[5]) < float(soft[5])
    assert (tmp_path / "contact_1bar.png").stat().st_size > 10_000


def test_cost_of_a_step_is_shared_out_among_its_parts(tmp_path):
    path = tmp_path / "1.json"
    output("limits", "--child", str(path), "--set", "model=slice",
           "--set", "numerics.refinement=0.25", "--set", "load.duration=0.5ms")  # fmt: skip
    found = json.loads(path.read_text(encoding="utf-8"))
    parts = found["parts"]
    # Sampled each millisecond of a run of a second: a small part may be met by no sample.
    assert set(parts) <= set(limits.PARTS)
    mechanics = sum(parts.get(part, 0.0) for part in limits.MECHANICS)
    assert mechanics > parts.get("heat", 0.0)  # ten times as much
    assert 0.0 < sum(parts.values()) <= found["seconds"]
    modules = {"rubber.tangent": "solves", "rubber.self_contact": "contact",
               "film.law": "film", "film.ice_heat": "heat",
               "interface.film_frame": "transfer", "output.fields": "output"}  # fmt: skip
    assert all(limits.part_of(f"iceslide_fem.{name}") == part for name, part in modules.items())
    assert limits.part_of("numpy.linalg") is None


def test_a_film_that_conducts_badly_melts_earlier():
    factors = np.ones((2, len(sensitivity.NAMES)))
    factors[:, -1] = 0.0, -6.0  # conductance: half a film of 50 nm, and a 64th of that
    peaks = sensitivity.friction(factors, 1.0)["peak"]
    assert peaks[0] == pytest.approx(0.530, abs=2e-3)
    assert peaks[1] == pytest.approx(0.503, abs=2e-3)


def test_surfaces_are_found_and_cost_what_is_expected(tmp_path):
    questions = ("--questions", "fit", "cost", "--definition", "thesis")
    rows = printed("rough_surfaces", *questions, "--pictures", str(tmp_path))
    assert float(rows[2][3].strip("%")) < 40.0
    assert rows[5][3] == "0.19482, 0.33154, 0.78076"
    assert 50.0 < float(rows[-1][3]) < 400.0  # bytes per pixel


def test_rough_contact_finds_what_closed_forms_say():
    rows = printed("roughness", "--questions", "forms", "creep")
    sphere = next(row for row in rows if row[0].startswith("sphere"))
    assert sphere[1] == "+0.84%, with its rim -0.41%"
    off = [row[3:5] for row in rows if " arm" in row[1]]
    assert len(off) == 6  # rubber that creeps has the contact of softer rubber
    assert all(float(cell.strip(" %")) < 1.0 for row in off for cell in row)  # of k and D


def test_readings_of_k_are_drawn(tmp_path):
    lines = output("readings_of_k", "--pictures", str(tmp_path)).splitlines()
    rows = {tuple(line.split(" | ")[:2]): line.split(" | ") for line in lines if line[:3] == "| 0"}
    assert rows["| 0.405", "3.0"][2] == "0.1200" and rows["| 0.605", "3.0"][5] == "5.30"
    assert (tmp_path / "readings_of_k.png").stat().st_size > 10_000


def test_other_data_change_mu_as_the_page_says():
    rows = {row[0]: row[1:] for row in printed("own_data")}
    share = {name: float(row[0].split("(")[1].strip("%)")) for name, row in list(rows.items())[2:]}
    assert share["defaults"] == 0.0 and abs(share["nu = 0.495 instead of D1"]) < 1.0
    assert share["viscosity 2.1 mPa s"] > 1.0 > share["ice of table 1"]
    pressed = float(rows["nu = 0.495 instead of D1"][3].split("(")[1].strip("%)"))
    assert -3.0 < pressed < -0.5


def test_a_step_in_load_is_run_and_drawn(tmp_path):
    options = ["--pictures", str(tmp_path), "--runs", str(tmp_path / "runs")]
    (row,) = [row for row in printed("loads_in_time", *options) if row[0] == "load_step"]
    assert float(row[1]) > float(row[3]) > 0.0 and float(row[6]) < 1e-3
    assert (tmp_path / "loads.png").stat().st_size > 10_000


def test_hostile_scenes_are_told_apart():
    hostile = importlib.import_module("scripts.studies.hostile")
    scenes = dict(hostile.scenes())
    assert len(scenes) >= 250
    expected = {
        "point, attached: film.k=0.266": "refused well",
        "point, attached: load.pressure=100bar": "finished well",
        "slice, attached: C10=0.05MPa nu=0.49 load.pressure=5bar": "stopped with its cause",
    }
    for name, kind in expected.items():
        assert hostile.outcome(scenes[name]).kind == kind, name


def test_a_hostile_scene_without_a_sentence_or_with_wrong_numbers_is_wrong(tmp_path, monkeypatch):
    hostile = importlib.import_module("scripts.studies.hostile")
    tables = dict(hostile.scenes())["point, attached: load.pressure=100bar"]
    run = simulate.run

    def spoilt(scene, folder):
        summary = run(scene, folder)
        history = Path(folder) / "history.csv"
        head, first, *others = history.read_text().splitlines()
        history.write_text("\n".join([head, "nan," + first.partition(",")[2], *others]))
        return summary

    def failing(scene, folder):
        raise ZeroDivisionError("division by zero")

    for faulty in (spoilt, failing):
        monkeypatch.setattr(simulate, "run", faulty)
        assert hostile.outcome(tables).kind == "wrong"


def test_hostile_inputs_are_many_and_none_ends_badly():
    from scripts.studies.hostile_inputs import inputs

    assert len(inputs(ROOT)) >= 600
    counted = output("hostile_inputs", "--quick").splitlines()[-5:]
    assert counted[-1] == "wrong: 0"
    assert int(counted[0].split()[0]) >= 15


def test_constants_of_the_cost_are_found_from_runs_that_have_them(capsys):
    study = importlib.import_module("scripts.studies.accuracy_cost")
    cost = importlib.import_module("iceslide_fem.workflow.planning.cost")
    chosen = ["model=point ice.heat=column"]
    for rubber, model in enumerate(["slice", "slice", "block"]):
        for ice in ("continuum", "column", "mesh"):
            chosen.append(f"model={model} ice.heat={ice} numerics.refinement={0.5 + 0.25 * rubber}")
    runs = []
    for changes in chosen:
        scene = case("thesis_1bar", "numerics.tolerance=1e-2", *changes.split())
        expected = cost.estimate(scene)
        steps = expected.steps // 2
        dimensions = 2 if scene.model == "slice" else 3
        of_steps = cost.step_seconds(dimensions, *expected[1:3], scene.ice.heat)
        share = steps + cost.START_STEPS if scene.model != "point" else 0.0
        seconds = 2.0 * (cost.START_SECONDS + share * of_steps)
        runs.append(study.Run(scene, expected, steps, seconds))
    study.fit(runs)
    printed = capsys.readouterr().out
    assert f"START_SECONDS = {2 * cost.START_SECONDS:.2g}" in printed
    for name in ("PLANE", "SPACE", "ICE", "MESHED"):
        fixed, work = getattr(cost, f"{name}_SECONDS")
        if name != "SPACE":  # of one mesh: one of the two is left free
            told = re.search(rf"^{name}_SECONDS = (.*), (.*)$", printed, re.MULTILINE)
            expected = pytest.approx([2 * fixed, 2 * work], rel=0.05, abs=1e-12)
            assert [float(text) for text in told.groups()] == expected
    assert "over measured: 1.00, 1.00, 1.00" in printed


def test_the_grip_index_of_a_compound_and_a_pattern_is_that_of_another_program():
    _, row = printed("ice_grip", "--questions", "settings")[0:3:2]
    deceleration, ideal, one, phases, of_ideal = (float(cell) for cell in row[1:6])
    assert deceleration == pytest.approx(1.3622, rel=2e-3)
    assert ideal == pytest.approx(2.4947, rel=2e-3)
    assert one == pytest.approx(1.1388, rel=3e-3) and of_ideal == pytest.approx(1.1781, rel=3e-3)
    assert phases < one - 0.02  # one start is no mean
    assert float(row[6]) == pytest.approx(0.9470, rel=2e-3)


def test_hysteresis_is_worth_what_another_program_found():
    rows = printed("rough_ice", "--questions", "worth")
    (row,) = (one for one in rows if one[:3] == ["1", "-5", "3"])
    assert [float(cell) for cell in row[3:]] == pytest.approx(
        [0.012, 0.018, 0.026, 0.041, 0.064], abs=6e-4
    )


def test_dry_stress_is_predicted_before_it_is_compared():
    text = output("dry_calibration", "--quick")
    assert "Film law alone, 20 mm, 2 bar, 4 m/s, -4 degC: mean mu 0.208." in text
    assert f"rounded: {dry_calibration.CALIBRATED}." in text
    assert f"All bands with {dry_calibration.OF_ALL}, calibrated on all" in text
    assert text.index("Prediction of the other bands") < text.index("All bands with")
    lines = [line for line in text.splitlines() if line.startswith("| ") and " m/s, " in line]
    rows = [line.strip("|").split(" | ") for line in lines]
    predicted, compared = rows[:8], rows[8:19]
    assert [row[1] for row in predicted] == [row[4] for row in compared[3:]]
    assert all(0.5 < float(row[6]) < 2.0 for row in compared[:3])  # what it is calibrated on


def test_dry_contact_gives_way_to_films(tmp_path):
    text = output("dry_to_wet", "--quick", "--pictures", str(tmp_path))
    rows = [line.strip("|").split(" | ") for line in text.splitlines() if line.startswith("|")][2:6]
    assert "grows by e in 0.42 ms" in text and "grows by e in 0.18 ms" in text
    coldest, warmest = rows[0], rows[-1]
    assert coldest[1].startswith("0.929 dry") and float(coldest[1].split(", ")[1]) < 1e-3
    assert all(" dry" in cell for cell in coldest[1:]) and "limited" in " ".join(warmest)
    assert (tmp_path / "dry_to_wet.png").stat().st_size > 10_000


def test_water_bears_more_below_longer_lugs(tmp_path):
    rows = printed("wet_ice", "--pictures", str(tmp_path))
    shared = [row for row in rows if row[0].endswith(" um") and " bar, " in row[4]]
    assert len(shared) == 4 and all(row[4] == f"{row[2]}, {row[3]}" for row in shared)
    passes = [row for row in rows if row[0] in "024" and row[1].endswith(" mm")]
    assert [row[7] for row in passes[:2]] == ["never", "never"] and passes[2][7].endswith(" ms")
    afloat = [row[-2] for row in rows if row[-1].endswith(" m/s") and row[0] in "024"]
    assert len(afloat) == 3
    for cell in afloat:
        found, closed = (float(part.split()[0]) for part in cell.split(","))
        assert found == pytest.approx(closed, rel=3e-2)
    rests = [row for row in rows if row[1] in ("keep", "drain", "freeze")]
    again = {tuple(row[:3]): [float(mu) for mu in row[3:7]] for row in rests}
    kept, drained = (again["0", between, "0.007 s"] for between in ("keep", "drain"))
    assert all(np.diff(kept) > 0.0) and kept[-1] < 0.01 < 0.1 < drained[1]
    assert again["0", "freeze", "1 s"][1] < again["0", "freeze", "60 s"][1]
    assert (tmp_path / "wet_ice.png").stat().st_size > 10_000


def test_contact_age_of_points():
    rows = printed("contact_age")
    one, wide = rows[2:5], rows[5:8]
    assert [row[0] for row in (*one, *wide)] == ["one arm"] * 3 + ["wide"] * 3
    for row in (*one, *wide):
        as_it_is, at_once, aged = (float(mu) for mu in row[2:5])
        assert at_once < aged < as_it_is


def test_friction_over_passes_of_a_drum(tmp_path):
    text = printed("friction_drum", "--pictures", str(tmp_path))
    means = {row[0]: [float(cell) for cell in row[1:]] for row in text if row[0] in DRUM_ROWS}
    assert list(means) == list(DRUM_ROWS)
    assert all(row[0] == means["water freezes"][0] for row in means.values())
    assert means["water freezes"][-1] < means["water freezes"][0]
    after = {row[0]: row for row in text if len(row) == 4 and row[0].isdigit()}
    assert after["1"][1:3] == ["0.2113", "0.2113"]
    frozen = {row[0]: row for row in text if len(row) == 5 and row[0] in ("1", "10")}
    assert all(abs(float(row[3].strip("%"))) < 2.0 for row in frozen.values())
    assert {row[4] for row in frozen.values()} == {"-1.7%"}
    assert (tmp_path / "friction_drum.png").stat().st_size > 10_000


def test_layers_of_ice_are_compared_with_a_finer_column():
    here, _ = ice_layers.melting(1e-3)
    layers = (0.8, 3.0), (0.05, 1.4)  # the first of them, and how they grow
    thick, thin = (
        ice_layers.errors(here, Column(here.temperature, 1e-3, *one), 1e-4) for one in layers
    )
    assert thin[0] < 1e-4 < 1e-3 < thick[0] < 0.1
    assert thin[1] < thick[1]


def test_braking_is_shorter_with_control(tmp_path):
    rows = printed("braking", "--pictures", tmp_path)
    distance = {row[0]: float(row[1]) for row in rows if row[0] in ("locked", "threshold", "ideal")}
    assert distance["ideal"] < distance["threshold"] < distance["locked"] < 150.0
    assert (tmp_path / "braking.png").is_file()


def test_poor_maps_are_poor():
    for name, cut, *changes in poor_maps.saturated():
        load, mu, loaded = map(float, changes)
        if cut == "0.5":
            assert load < -5.0 and mu > 5.0 and abs(loaded) < 5.0, name
    spec = poor_maps.SPEC.model_copy(update={"pixels": 256, "size": 8e-4})
    whole = generate(spec, 0)
    true, short, smooth, holed = (
        poor_maps.found(surface)
        for surface in (
            whole,
            poor_maps.part(whole, 0.5),
            low_passed(whole, poor_maps.ROLLOFF),
            poor_maps.missing(whole, 0.15, patches=False, filled=False),
        )
    )
    assert short[2] < 0.8 * true[2] and smooth[0] > 1.99 * true[0] and holed[2] < 0.9 * true[2]


def test_footprint_findings_know_both_models(capsys):
    footprint_findings.friction_by_balance(Tread().footprint((42, 54)))
    said = capsys.readouterr().out
    assert "Balance, d = 0.1 mm" in said and "Moving source over slip" in said


def test_blocks_with_sipes_touch_less_ice_under_higher_pressure(tmp_path):
    options = ["--runs", str(tmp_path / "runs"), "--pictures", str(tmp_path)]
    _, _, whole, siped = printed("siped_tread", *options)
    names = ("sipes", "mu", "area", "pressure")
    plain, cut = (
        dict(zip(names, (float(row[n]) for n in (2, 6, 7, 8)), strict=True))
        for row in (whole, siped)
    )
    assert (plain["sipes"], cut["sipes"]) == (0, 4)
    assert cut["mu"] < plain["mu"] and cut["area"] < plain["area"]
    assert cut["pressure"] > 1.3 * plain["pressure"]
    assert float(siped[9]) > 0.0  # um: open
    assert (tmp_path / "siped_tread.png").stat().st_size > 10_000


def test_two_lugs_press_on_each_other_as_in_calculix(tmp_path):
    _, _, ours, *theirs = printed("walls_calculix", "--pictures", str(tmp_path))
    assert float(ours[2]) > 0.1  # N/mm
    for row in theirs:  # where it is
        assert float(row[2]) == pytest.approx(float(ours[2]), rel=2e-2)
        assert float(row[5].removesuffix("%")) < 10.0
    assert (tmp_path / "walls_calculix.png").stat().st_size > 10_000


def test_solvers_of_the_heat_equation_find_the_same():
    rows = [row for row in printed("heat_solvers") if row[0] in ("mesh", "continuum")]
    assert len(rows) == 4
    assert all(float(row[6]) < 1e-3 for row in rows[:-1])


def test_outputs_of_one_tree_are_the_same(tmp_path):
    for _ in range(2):
        first, second = printed("same_outputs", str(tmp_path))[-2:]
        assert first[3] == second[3] == "" and int(first[2]) >= 1 and int(second[2]) >= 2
    (tmp_path / "footprint_1" / "line.csv").write_text("x_m\n")
    with pytest.raises(AssertionError, match=r"line\.csv"):
        printed("same_outputs", str(tmp_path))


def test_a_wheel_is_a_brush_and_slides_on_films():
    rows = printed("wheel")
    exact = [row for row in rows if row[0].startswith(("parabola", "even"))]
    assert len(exact) == 15 and all(abs(float(row[4])) < 3e-6 for row in exact)
    film = [row for row in rows if len(row) == 5 and row[3].endswith("%")]
    assert len(film) == 6 and all(abs(float(row[3].strip("%"))) < 0.7 for row in film)
