"""Tables of `footprint`, `wheel`, `roughness` and `rubber`: the reference has all columns."""

import csv
import tomllib
from pathlib import Path

import pytest
from surface_spec import SPEC

from iceslide_fem.cli import main

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parent.parent
DESCRIBED = tomllib.loads((ROOT / "docs" / "reference" / "columns.toml").read_text("utf-8"))
SLICK = ("--gaussian", "120mm,2bar,30mm", "--speed", "20km/h")
SURFACE = ROOT / "cases" / "surfaces" / "compound_B.csv"
DMA = ROOT / "cases" / "rubber" / "synthetic_dma.csv"
ONE = ("--realisations", "1")
LINE = (*SLICK, "--thesis-balance")
TABLES = {
    "line": (
        "line.csv",
        "footprint",
        *SLICK,
        "--thesis-balance",
        "--water",
        "20um",
        "--contact",
        SURFACE,
    ),
    "wheel": ("mu_slip.csv", "wheel", *SLICK, "--slip", "0:1:3"),
    "stops": ("stops.csv", "wheel", *SLICK, "--slip", "0:1:3", "--abs", "--end-speed", "18km/h"),
    "hysteresis": ("hysteresis.csv", "hysteresis", ROOT / "cases" / "rough_ice.toml"),
    "waves": ("waves.csv", "hysteresis", ROOT / "cases" / "rough_ice.toml"),
    "roughness": ("contact.csv", "roughness", "surface.toml", *ONE, "--pressures", "1bar:2bar:2"),
    "rubber": ("rubber.csv", "rubber", DMA),
    "shift": ("shift_factors.csv", "rubber", DMA),
}


@pytest.mark.parametrize("table", TABLES)
def test_every_column_is_described(table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("surface.toml").write_text(SPEC, encoding="utf-8")
    name, command, *words = map(str, TABLES[table])
    page = ["--no-report"] if command in ("footprint", "wheel") else []
    with pytest.raises(SystemExit) as ended:
        main([command, *words, *page, "--out", "out"])
    assert ended.value.code == 0
    with open(Path("out") / name, encoding="utf-8", newline="") as file:
        lines = [line for line in file if not line.startswith("#")]
    assert next(csv.reader(lines)) == list(DESCRIBED[table])
