"""Pictures of a finished run: the deformed block, its contact, the film and the ice below.

It needs no display. Run it in a process without DOLFINx (see `snapshots`).
"""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from iceslide_fem.postprocess.report.curves import draw_run
from iceslide_fem.postprocess.results import Run, read_run
from iceslide_fem.postprocess.results.picture import DPI, Scales, draw, scales_of
from iceslide_fem.postprocess.results.snapshots import read_snapshot, times
from iceslide_fem.runtime.terminal import LongTask

FRAMES_PER_SECOND = 10


def view(directory: Path | str, animate: bool = False) -> list[Path]:
    """Draw `report.png`, `view_peak.png` and `view_end.png` in a run's directory; their paths.

    With `animate` also `view.gif` and `view.mp4` of all times. A run without fields has a report
    only. Raises SceneError if the directory holds no finished run.
    """
    run = read_run(directory)
    paths = [draw_run(directory)]
    written = times(run.directory)
    if not written.size:
        return paths
    scales = scales_of(run, written.size)
    peak = int(np.argmin(abs(written - run.summary["mu_peak_time_s"])))
    for name, number in (("peak", peak), ("end", written.size - 1)):
        paths.append(run.directory / f"view_{name}.png")
        figure = draw(run, read_snapshot(run.directory, number), scales)
        figure.savefig(paths[-1], dpi=DPI)
    return paths + _animate(run, scales, written.size) if animate else paths


def _animate(run: Run, scales: Scales, n_times: int) -> list[Path]:
    """Animation of all times as GIF and as MP4."""
    options: dict[str, dict[str, Any]] = {
        "gif": {"loop": 0, "duration": 1000.0 / FRAMES_PER_SECOND},
        "mp4": {"fps": FRAMES_PER_SECOND},
    }
    paths = [run.directory / f"view.{kind}" for kind in options]
    with contextlib.ExitStack() as stack, LongTask(n_times) as shown:
        movies: list[Any] = [
            stack.enter_context(imageio.get_writer(path, **options[path.suffix[1:]]))
            for path in paths
        ]
        for number in range(n_times):
            canvas = FigureCanvasAgg(draw(run, read_snapshot(run.directory, number), scales))
            canvas.figure.set_dpi(DPI)
            canvas.draw()
            for movie in movies:
                movie.append_data(np.asarray(canvas.buffer_rgba())[..., :3])
            shown.show(number + 1, f"{number + 1} of {n_times} pictures of the film")
    return paths
