"""Fields of a run over time for the page: block, contact, ice.

They are read with meshio and thinned, because a page should be small and is written after every
run. VTK is not used, because it cannot share a process with DOLFINx, whose run has just ended.
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.postprocess.report.field_drawings import CELLS, drawings_of
from iceslide_fem.postprocess.report.field_grids import read_grid
from iceslide_fem.postprocess.report.page import Fields, Text
from iceslide_fem.postprocess.results import Run, field_parts
from iceslide_fem.postprocess.results.quantities import ROBUST
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError

MOMENTS = 13  # at most
MS = 1e3


def fields_of(run: Run) -> list[Text | Fields]:
    """Rubber, interface and ice at some of the written times, if any."""
    try:
        files = {name: field_parts(run.directory, name) for name in ("rubber", "interface", "ice")}
        if not files["interface"] or not files["rubber"]:
            return []
        times = np.array([time for time, _ in files["interface"][: len(files["rubber"])]])
        chosen = _moments(times, float(run.summary["mu_peak_time_s"]))
        grids = {
            name: [read_grid(parts[number][1]) for number in chosen if number < len(parts)]
            for name, parts in files.items()
        }
        drawings = drawings_of(run, grids["rubber"], grids["interface"], grids["ice"])
    except (SceneError, LookupError, OSError, TypeError, ValueError) as error:
        return [Text(f"The fields are there but could not be read ({error}).", "warning")]
    if not drawings:
        return [Text(f"More than {CELLS} cells are not drawn here: iceslide view does that.")]
    said = [
        f"t = {MS * times[number]:.3g} ms, mu = {run.at('mu', times[number]):.4g}"
        for number in chosen
    ]
    others = "; the others are in its folder" if times.size > len(chosen) else ""
    about = Text(
        f"{len(chosen)} of the {times.size} moments that the run wrote{others}. Colours end where "
        f"{100.0 - ROBUST:g} % of the values of all moments lie beyond."
    )
    return [about, Fields([MS * times[number] for number in chosen], said, drawings)]


def _moments(times: Array, peak: float) -> list[int]:
    """Indices of at most `MOMENTS` times, with first, last and nearest to `peak` (s)."""
    some = np.linspace(0, times.size - 1, min(MOMENTS, times.size)).round().astype(int)
    nearest = int(np.abs(times - peak).argmin())
    inner = some[1:-1]
    if nearest not in some and inner.size:
        some[1 + int(np.abs(inner - nearest).argmin())] = nearest
    return np.unique(some).tolist()
