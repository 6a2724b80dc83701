"""Directories of runs with invented numbers, for the tests of what reads them."""

import numpy as np

from iceslide_fem.output.summary import write_summary
from iceslide_fem.output.table import HistoryRow, PreloadRow, Table
from iceslide_fem.scene import scene_from_dict

DURATION = 7e-3  # s


def a_scene(model):
    """A scene of compound B at 1 bar and 3 m/s."""
    return scene_from_dict(
        {
            "name": "invented",
            "model": model,
            "rubber": {"compound": "B"},
            "load": {"pressure": "1 bar", "speed": "3 m/s", "duration": DURATION},
        }
    )


def write_run(directory, model, saturation=None, preload=True):
    """Write history, preload and summary as a run does; mu peaks at 3 ms with 0.5."""
    time = np.linspace(0.0, DURATION, 29)
    mu = np.interp(time, [0.0, 3e-3, DURATION], [0.2, 0.5, 0.25])
    with Table(directory / "history.csv", HistoryRow, rank=0) as history:
        for t, m in zip(time, mu, strict=True):
            row = dict.fromkeys(HistoryRow._fields, 0.0)
            row |= {"time_s": t, "mu": m, "film_height_m": 5e-8, "contact_fraction": 0.9}
            row |= {"surface_temperature_C": min(0.0, -4.0 + t / 1e-3), "friction_work_J": t * m}
            history.row(HistoryRow(**row))
    if preload:
        with Table(directory / "preload.csv", PreloadRow, rank=0) as table:
            for load, speed in [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0)]:
                row = dict.fromkeys(PreloadRow._fields, 0.0)
                row |= {"phase": "ramp" if speed else "press", "load_fraction": load}
                row |= {"speed_fraction": speed, "normal_force_N": load * 0.1}
                row |= {"friction_force_N": 0.1 * load * 0.2 * speed}
                table.row(PreloadRow(**row))
    summary = {"mu_peak": 0.5, "mu_peak_time_s": 3e-3, "mu_mean": float(mu.mean())}
    summary |= {"mu_end": 0.25, "melt_onset_s": 2e-3, "saturation_s": saturation}
    write_summary(directory / "summary.json", summary | {"scene": a_scene(model).as_dict()})
