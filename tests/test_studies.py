"""The study scripts run in their quick forms and print their tables."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("iceslide_fem.fenics.compat")

pytestmark = pytest.mark.fe

SCRIPTS = Path(__file__).parent.parent / "scripts"


def printed(script, *options):
    done = subprocess.run(
        [sys.executable, SCRIPTS / script, "--quick", *options],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in done.stdout.splitlines()
        if line.startswith("|")
    ]


def test_press_of_the_elements(tmp_path):
    rows = printed("press_elements", "--chart", str(tmp_path / "chart.png"))
    errors = {(row[0], row[1]): row[4] for row in rows if row[4:] and row[4].endswith("%")}
    assert all(error.startswith("-") for error in errors.values())  # too stiff, all of them
    error = {key: abs(float(text.strip("%"))) for key, text in errors.items()}
    assert error["P1 tetrahedra", "4"] > 10 > error["Q2", "4"] > error["Q2/P1 mixed", "4"]
    assert (tmp_path / "chart.png").stat().st_size > 10_000


def test_penalty_moves_the_plate_little():
    rows = printed("penalty_effect")
    changes = {row[1]: float(row[3].strip("%")) for row in rows if row[0] == "pressed"}
    assert 0.0 < changes["penalty x 0.5"] < 2.0
    assert -1.0 < changes["penalty x 2"] < 0.0
    assert all(row[2] != "not found in one solve" for row in rows)


def test_sliding_variants(tmp_path):
    picture = tmp_path / "sliding.png"
    options = ["--quick", "--out", str(picture), "--runs", str(tmp_path / "runs")]
    script = SCRIPTS / "compare_sliding"
    done = subprocess.run(
        [sys.executable, script, *options], capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    rows = [line for line in done.stdout.splitlines() if line.startswith("1bar  ")]
    assert len(rows) == 6 + 4
    shares = [float(row.split()[-5].strip("%")) for row in rows[:6]]
    assert [share > 2.0 for share in shares] == [False, True] * 3
    assert picture.stat().st_size > 10_000


def test_maps_of_the_film_law_have_no_failure(tmp_path):
    rows = printed("stability_atlas", "--maps", "film-weather", "--charts", str(tmp_path))
    cells = {(row[0], number): cell for row in rows for number, cell in enumerate(row)}
    assert not any(cell.split()[-1:] in (["F"], ["r"]) for cell in cells.values())
    assert cells["-40", 1] == "dry" and cells["-0.1", 8].startswith("m ")
    assert len(list(tmp_path.glob("film_weather_*.png"))) == 2


def test_stiffer_penalty_is_more_accurate_and_takes_as_many_iterations(tmp_path):
    rows = printed("accuracy_cost", "--questions", "contact", "--charts", str(tmp_path))
    found = {(row[0], row[1]): row for row in rows if row[0].startswith(("penalty", "augmented"))}
    soft, stiff = (found["penalty (default)", f"{x} x default"] for x in ("1", "10"))
    assert float(stiff[2]) < 0.2 * float(soft[2])
    assert int(stiff[6]) <= 1.5 * int(soft[6])
    assert (tmp_path / "contact_1bar.png").stat().st_size > 10_000
