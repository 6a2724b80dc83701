"""Seconds and error of the thesis_1bar case in 3-D and 2-D, with continuum ice.

The error is that of mu(t) over all 7 ms against a run with a mesh twice as fine and steps at
least four times as fine; references are kept in a folder and computed once. Each timed run is a
process of its own, started after its forms were compiled. A reference once made serves for any
`--refinement`: its own is printed.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from iceslide_fem.results import differences, read_run
from scripts.studies.common import ROOT, options, run_words, silently

LIMITS = {"slice": 5.0, "block": 180.0}
SCENE = ROOT / "cases" / "thesis_1bar.toml"


def make(model: str, out: Path, ranks: int, changes: list[str]) -> None:
    """Run the case."""
    common = (f"model={model}", "ice.heat=continuum")
    silently(run_words(SCENE, out, *common, *changes, ranks=ranks))


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--model", choices=("slice", "block"), default="slice")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--tolerances", nargs="+", default=["1e-2", "1e-3"])
    parser.add_argument("--refinement", type=float, default=1.0, help="of the timed runs' mesh")
    parser.add_argument("--references", type=Path, default=ROOT / "results" / "references")
    arguments = parser.parse_args()
    model = arguments.model
    reference = arguments.references / f"thesis_1bar_{model}"
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for tolerance in arguments.tolerances:
            for ranks in arguments.ranks:
                change = [
                    f"numerics.tolerance={tolerance}",
                    f"numerics.refinement={arguments.refinement}",
                ]
                make(model, Path(folder) / "warm", ranks, [*change, "load.duration=20us"])
                out = Path(folder) / f"{tolerance}_{ranks}"
                make(model, out, ranks, change)
                rows.append((tolerance, ranks, read_run(out)))
        if not (reference / "summary.json").is_file():
            # Steps are as tolerance^0.8 (docs/accuracy.md): four times as many at a sixth.
            # The longest step is bounded too.
            loose = max(float(tolerance) for tolerance in arguments.tolerances)
            steps = min(run.summary["steps"] for _, _, run in rows)
            longest = 7e-3 / (4 * steps)
            fine = [
                f"numerics.max_step={longest}",
                f"numerics.tolerance={loose / 6.0}",
                f"numerics.refinement={2.0 * arguments.refinement}",
            ]
            make(model, reference, 2, fine)
        fine_run = read_run(reference)
        print(
            f"reference: {fine_run.summary['steps']} steps, {fine_run.summary['dofs']} unknowns, "
            f"{fine_run.summary['wall_s']:.0f} s, refinement "
            f"{fine_run.summary['scene']['numerics']['refinement']:g}"
        )
        print(f"{'model':6} {'tolerance':>9} {'ranks':>5} {'unknowns':>8} {'steps':>5} "
              f"{'seconds':>8} {'largest':>8} {'rms':>8} {'mean':>8} "
              f"{'of mean mu':>10}")  # fmt: skip
        for tolerance, ranks, run in rows:
            error = np.abs(differences(run, fine_run))
            largest, rms, mean = error.max(), np.sqrt(np.mean(error**2)), error.mean()
            summary = run.summary
            print(
                f"{model:6} {tolerance:>9} {ranks:5d} {summary['dofs']:8d} {summary['steps']:5d} "
                f"{summary['wall_s']:8.1f} {largest:8.2%} {rms:8.2%} {mean:8.2%} "
                f"{summary['mu_mean'] / fine_run.summary['mu_mean'] - 1:10.2%}"
            )
        print(f"limit: {LIMITS[model]:g} s at 1 % (see docs/accuracy.md)")


if __name__ == "__main__":
    main()
