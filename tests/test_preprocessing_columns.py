"""Tables of `footprint`, `wheel`, `roughness` and `rubber`: the reference has all columns."""

import csv
import tomllib
from pathlib import Path

import pytest

from iceslide_fem.cli import main

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parent.parent
DESCRIBED = tomllib.loads((ROOT / "docs" / "reference" / "columns.toml").read_text("utf-8"))
SLICK = ("--gaussian", "120mm,2bar,30mm", "--speed", "20km/h")
SURFACE = ROOT / "cases" / "surfaces" / "compound_B.csv"
COMMANDS = {
    "line": ("footprint", *SLICK, "--water", "20um", "--contact", SURFACE),
    "wheel": ("wheel", *SLICK, "--slip", "0:1:3"),
    "stops": ("wheel", *SLICK, "--slip", "0:1:3", "--abs", "--end-speed", "18km/h"),
    "roughness": ("roughness", "surface.toml", "--pressures", "1bar:2bar:2", "--realisations", "1"),
    "rubber": ("rubber", ROOT / "cases" / "rubber" / "synthetic_dma.csv"),
    "shift": ("rubber", ROOT / "cases" / "rubber" / "synthetic_dma.csv"),
}  # fmt: skip
WAVES = """\
rms_height = "5.8 um"
hurst = 0.2
rolloff = "175 um"
shortest_wave = "70 um"
size = "1 mm"
pixels = 64
"""
FILES = {
    "line": "line.csv", "wheel": "mu_slip.csv", "stops": "stops.csv",
    "roughness": "contact.csv", "rubber": "rubber.csv", "shift": "shift_factors.csv",
}  # fmt: skip


@pytest.mark.parametrize("table", COMMANDS)
def test_every_column_is_described(table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("surface.toml").write_text(WAVES, encoding="utf-8")
    command, *words = map(str, COMMANDS[table])
    page = ["--no-report"] if command in ("footprint", "wheel") else []
    with pytest.raises(SystemExit) as ended:
        main([command, *words, *page, "--out", "out"])
    assert ended.value.code == 0
    with open(Path("out") / FILES[table], encoding="utf-8", newline="") as file:
        lines = [line for line in file if not line.startswith("#")]
    assert next(csv.reader(lines)) == list(DESCRIBED[table])
