"""Work of `iceslide wheel`: read, determine the tread's stiffness, compute, write."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.wheel.braking_figure import braking_figure
from iceslide_fem.preprocess.wheel.braking_output import history_table, stop_figures
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.curve import curves
from iceslide_fem.preprocess.wheel.figures import draw
from iceslide_fem.preprocess.wheel.law import contact_of_case
from iceslide_fem.preprocess.wheel.output import columns, summary, table
from iceslide_fem.preprocess.wheel.stiffness import stiffness_of
from iceslide_fem.preprocess.wheel.stopping import stops_of
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.files import replace_file, writing
from iceslide_fem.runtime.folders import claimed, clear_results, other_case
from iceslide_fem.runtime.progress import LongTask
from iceslide_fem.scene.fingerprint import versions

WRITTEN = ("mu_slip.csv", "mu_slip.png", "summary.json")
OF_STOPS = ("stops.csv", "stops.png")


def run(
    values: Mapping[str, Any], out: Path, force: bool = False
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Friction over slip of the wheel that `values` describe (see `WheelCase`), written to `out`.

    Writes the files in `WRITTEN`, and for stops in `OF_STOPS`; returns the columns of mu_slip.csv
    and the content of summary.json. Earlier results of the same wheel are replaced, with `force`
    any results. Raises SceneError, before anything is written, if the input is invalid or `out`
    must not be used, SimulationStopped if a step of the law fails, and OutputError if a file cannot
    be written.
    """
    begun = time.perf_counter()
    case = WheelCase.of(values)
    here = case.model_dump(mode="json")
    with claimed(out, partial(other_case, "summary.json", here), force, case.files):
        read = read_source(case)
        contact_of_case(case.members[0], read.pressure_map.contact_length)
        with LongTask(1.0) as shown:
            stiffness = stiffness_of(case, read.pressure_map, lambda words: shown.show(0.0, words))
            found = curves(
                case,
                read.pressure_map,
                stiffness.value,
                lambda part: shown.show(part, f"{part:.0%} of the slip ratios"),
            )
            stops = stops_of(case, read.pressure_map, stiffness.value) if case.abs else {}
        figures = summary(case, read, stiffness, found) | {"stops": stop_figures(stops)}
        with writing(out):
            clear_results(out)
            draw(f"{case.source.stem}: friction over slip", found, out)
            if stops:
                title = f"{case.source.stem}: a quarter car brakes"
                figure = braking_figure(stops, case.car(read.pressure_map.load), title)
                figure.savefig(out / OF_STOPS[1], dpi=110)
        slipping = columns(found, read.pressure_map.load)
        replace_file(out / "mu_slip.csv", table(slipping))
        if stops:
            replace_file(out / OF_STOPS[0], history_table(stops))
        figures |= {"wall_s": time.perf_counter() - begun, "versions": versions()}
        replace_file(out / "summary.json", json.dumps(figures, indent=2) + "\n")
        return slipping, figures
