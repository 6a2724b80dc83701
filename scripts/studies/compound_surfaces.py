"""Compounds A, B and C on the surface found for B: tables, point friction, slices with B's table.

The tables are those of cases/surfaces, compound_A.csv, _B.csv and _C.csv, which --update-tables
makes anew; the cases rough_1bar and rough_5bar take B's. The surfaces of A and C are not published:
what is printed for them is a prediction with B's surface. With --slices the two cases run as
slices, too, beside thesis_1bar and thesis_5bar, which take the published table.
"""

from __future__ import annotations

import csv
import io
import shutil
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.preprocess.roughness.case import RoughnessCase
from iceslide_fem.preprocess.roughness.figures import draw as draw_survey
from iceslide_fem.preprocess.roughness.survey import Survey, survey
from iceslide_fem.preprocess.roughness.survey import table as csv_text
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.contact_file import read_contact_table
from iceslide_fem.scene.contact_table import ContactTable
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES
from scripts.studies.common import ROOT, draw, options, picture_options, table

SURFACES = ROOT / "cases" / "surfaces"
PRESSURES = "0.02bar:20bar:19"
TIMES = np.linspace(0.0, 7e-3, 351)
REMARKS = {
    "A": "# predicted: compound A with the surface of compound_B.toml",
    "B": "# compound B with the surface of compound_B.toml",
    "C": "# predicted: compound C with the surface of compound_B.toml",
}


def surveyed(name: str, realisations: str, pressures: str) -> Survey:
    """The compound on the surface found for B."""
    given = {"surface": str(SURFACES / "compound_B.toml"), "compound": name}
    return survey(RoughnessCase.of(given | {"realisations": realisations, "pressures": pressures}))


def friction(contact: ContactTable, bar: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean mu over 7 ms and mu at `TIMES`: 3 m/s, -4 degC, over pressure."""
    k, D, H_V, _ = contact(bar * BAR)
    result = simulate(
        Conditions.of(
            pressure=bar * BAR, speed=3.0, temperature=269.15, k=k, D=D, H_V=H_V,
            initial_height=70e-9, duration=7e-3,
        ),
        times=TIMES,
    )  # fmt: skip
    return result.mu_mean, result.samples


def check_scaling(tables: dict[str, ContactTable]) -> float:
    """Largest relative difference of k_A(p) and k_C(p) from k_B(p E_B / E)."""
    from iceslide_fem.scene.materials import YOUNGS_MODULUS

    p, worst = np.geomspace(0.1, 8.0, 50) * BAR, 0.0
    for name in "AC":
        other = tables["B"](p * YOUNGS_MODULUS["B"] / YOUNGS_MODULUS[name]).k
        worst = max(worst, float(np.abs(tables[name](p).k / other - 1.0).max()))
    return worst


def slices() -> None:
    """Slices with the published table and with that of the surface."""
    from iceslide_fem.simulate import run

    rows = []
    for bar in ("1bar", "5bar"):
        for name in (f"thesis_{bar}", f"rough_{bar}"):
            scene = load_scene(
                ROOT / "cases" / f"{name}.toml",
                ["model=slice", "ice.heat=column", "numerics.tolerance=1e-2"],
            )
            with tempfile.TemporaryDirectory() as folder:
                found = run(scene, Path(folder))
            row = [name] + [f"{found[key]:.3f}" for key in ("mu_peak", "mu_mean", "mu_end")]
            rows.append([*row, f"{found['outside_table_fraction']:.1%}"])
    table(("slice", "peak mu", "mean", "at 7 ms", "outside the table"), rows)


def main() -> None:
    """Print the tables, draw the picture, run the slices."""
    parser = options(__doc__)
    picture_options(parser)
    parser.add_argument("--update-tables", action="store_true", help="write cases/surfaces anew")
    parser.add_argument("--slices", action="store_true", help="run the cases as slices")
    parser.add_argument("--quick", action="store_true", help="one realisation")
    given = parser.parse_args()
    tables = {"published": CONTACT_TABLES["B"]}
    realisations = "1" if given.quick else "8"
    with tempfile.TemporaryDirectory() as folder:
        for name, remark in REMARKS.items():
            path = SURFACES / f"compound_{name}.csv"
            if given.update_tables:
                text = csv_text(surveyed(name, realisations, PRESSURES))
                path.write_text(f"{remark}\n{text}", encoding="utf-8")
            tables[name] = read_contact_table(path, "table")
        default = surveyed("B", realisations, "0.2bar:20bar:12")
        draw_survey([default], Path(folder))
        given.pictures.mkdir(parents=True, exist_ok=True)
        for name in ("contact", "parameters"):
            shutil.copyfile(Path(folder) / f"{name}.png", given.pictures / f"roughness_{name}.png")
    columns = ("pressure_Pa", "k", "D_m", "H_V_m", "k_std", "D_median_m", "open_area_below_h0")
    rows = [
        [f"{float(row[name] or 'nan'):.3g}" for name in columns]
        for row in csv.DictReader(io.StringIO(csv_text(default)))
    ]
    table(columns, rows)
    print()
    at = np.array([0.5, 1.0, 2.0, 3.0, 5.0])
    head = ["table of", *(f"{bar:g} bar" for bar in at)]
    table(head, [[name, *np.round(friction(one, at)[0], 3)] for name, one in tables.items()])
    print(
        "Mean mu over 7 ms, point level, 3 m/s, -4 degC; A and C: predicted, surface of B assumed."
    )
    print(f"k of A and C is that of B at p E_B / E within {check_scaling(tables):.1e}.")

    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    left, *right = figure.subplots(1, 3)
    bars = np.geomspace(0.3, 8.0, 25)
    labels = {
        "published": "B, published table",
        "A": "A, predicted",
        "B": "B, surface found",
        "C": "C, predicted",
    }
    for (name, one), style in zip(tables.items(), ("k--", "C0-", "C1-", "C2-"), strict=True):
        left.plot(bars, friction(one, bars)[0], style, label=labels[name])
        for axes, bar in zip(right, (1.0, 5.0), strict=True):
            axes.plot(1e3 * TIMES, friction(one, np.array([bar]))[1][:, 0], style)
    left.set(xscale="log", xlabel="pressure (bar)", ylabel="mean µ over 7 ms", title="point level")
    left.set_xticks([0.3, 0.5, 1, 2, 5], ["0.3", "0.5", "1", "2", "5"])
    left.xaxis.set_minor_formatter("")
    left.axvspan(1.0, 5.0, color="0.9", label="range of the published table")
    left.legend(fontsize=8)
    for axes, bar in zip(right, (1.0, 5.0), strict=True):
        axes.set(xlabel="time (ms)", ylabel="µ", title=f"{bar:g} bar, 3 m/s, -4 °C")
    for axes in (left, *right):
        axes.grid(alpha=0.3)
        axes.set_ylim(bottom=0.0)
    draw(figure, given.pictures / "compounds.png")
    if given.slices:
        slices()


if __name__ == "__main__":
    main()
