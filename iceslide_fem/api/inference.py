"""From measured friction to parameters, what doubt in inputs means, comparisons; for scripts."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from iceslide_fem.api.preprocessors import attributes_of_done, done_by
from iceslide_fem.inference.calibrate.command import CALIBRATE
from iceslide_fem.inference.calibrate.output import Calibration
from iceslide_fem.inference.compare.command import COMPARE
from iceslide_fem.inference.uncertainty.command import UNCERTAINTY
from iceslide_fem.inference.uncertainty.propagate import Spread


def calibrate(
    data: Path | str,
    scene: Path | str,
    fit: Mapping[str, str],
    *,
    out: Path | str | None = None,
    force: bool = False,
    **options: Any,
) -> xr.Dataset:
    """Parameters of a scene from measured friction, as `iceslide calibrate`.

    `data` is a table of loads and mu, `scene` a scene file, `fit` has bounds "low:high" by keys.
    Options have the command's names (`over`, `output`, `noise`, `level`, `change`). Writes to `out`
    what the command writes, by default to `results/<name of the data>_calibration`.

    `estimate`, `low` and `high` (NaN where a profile does not close) and `standard_error_of_ln` are
    over `parameter`, `covariance_of_ln` over `parameter` and `other`; `mu_measured`, `mu_computed`
    and `mu_left_out` over `row`. Attributes: the figures of `calibration.json` by dotted names.

    Raises `SceneError` with one sentence, before anything is written, where the input is wrong,
    `SimulationStopped` where the law finds no step.

    ```python
    import iceslide_fem

    found = iceslide_fem.calibrate("tester.csv", "scene.toml",
                                   {"film.dry_stress": "10kPa:10MPa"}, over="20 mm")
    found["estimate"].sel(parameter="film.dry_stress")
    ```
    """
    given = {"source": data, "scene": scene, "fit": dict(fit), **options}
    done = done_by(CALIBRATE, given, out, force)
    found: Calibration = done.found
    parts = done.figures["parameters"]
    numbers = {
        name: ("parameter", [np.nan if one[name] is None else one[name] for one in parts.values()])
        for name in ("estimate", "low", "high", "standard_error_of_ln")
    }
    rows = {
        "mu_measured": found.problem.mu_measured,
        "mu_computed": found.mu_computed,
        "mu_left_out": found.mu_left_out,
    }
    return xr.Dataset(
        {
            **numbers,
            "covariance_of_ln": (("parameter", "other"), found.fit.covariance),
            **{name: ("value", values) for name, values in rows.items()},
        },
        {
            "parameter": list(parts),
            "other": list(parts),
            "unit": ("parameter", [one["unit"] for one in parts.values()]),
            "row": ("value", found.problem.row_of_value + 1),
        },
        attributes_of_done("calibration", done),
    )


def uncertainty(
    scene: Path | str,
    input: Mapping[str, str] | None = None,
    *,
    calibration: Path | str | None = None,
    out: Path | str | None = None,
    force: bool = False,
    **options: Any,
) -> xr.Dataset:
    """What uncertain inputs mean for mu, as `iceslide uncertainty`.

    `input` has spreads by keys, beside those of the scene's table `[uncertainty]`: "0.3+-10%",
    "1bar..2bar", "~10%"; `calibration` is a calibration.json, or its folder. Options have the
    command's names (`samples`, `runs`, `output`, `change`). Writes to `out` what the command
    writes, by default to `results/<name of the file>_uncertainty`.

    `mu` and every input are over `sample`, `first_order` and `total` (Sobol indices) over `input`.
    Attributes: the figures of `uncertainty.json` by dotted names.

    Raises `SceneError` with one sentence, before anything is computed, where the input is wrong,
    `SimulationStopped` where more than 5 % of the samples fail.

    ```python
    import iceslide_fem

    found = iceslide_fem.uncertainty("scene.toml", {"film.k_scale": "~10%"})
    found["mu"].quantile([0.025, 0.975])
    ```
    """
    given = {"source": scene, "input": dict(input or {}), "calibration": calibration, **options}
    done = done_by(UNCERTAINTY, given, out, force)
    found: Spread = done.found
    keys = done.case.inputs.keys
    data: dict[str, Any] = {"mu": ("sample", found.mu)}
    data |= {
        key: ("sample", values) for key, values in zip(keys, found.samples.values.T, strict=True)
    }
    first, total = zip(*found.indices.values(), strict=True)
    data |= {"first_order": ("input", list(first)), "total": ("input", list(total))}
    return xr.Dataset(data, {"input": list(found.indices)}, attributes_of_done("uncertainty", done))


def compare(
    reference: Path | str,
    *others: Path | str,
    input: Mapping[str, str] | None = None,
    out: Path | str | None = None,
    force: bool = False,
    **options: Any,
) -> xr.Dataset:
    """Which of some compounds, patterns or tyres is better, by how much, as `iceslide compare`.

    `reference` and `others` are files of scenes, of wheels or of variations; `input` has spreads by
    keys, as for `uncertainty`. Options have the command's names (`temperature`, `water`, `stop`,
    `measure`, `output`, `own`); several values are a list or a text with commas. Writes to `out`
    what the command writes, by default to `results/<name of the reference>_comparison`.

    `value`, `ratio`, and their half widths `..._numerical` and `..._inputs` (NaN where inputs are
    exact) are over `condition` and `candidate`, `verdict` too; `temperature_C` and `water_m` over
    `condition`. Attributes: the figures of `compare.json` by dotted names.

    Raises `SceneError` with one sentence, before anything is computed, where the input is wrong,
    `SimulationStopped` where nothing could be compared.

    ```python
    import iceslide_fem

    found = iceslide_fem.compare("REF.toml", "A.toml", temperature=["-8 degC", "-4 degC"])
    found["ratio"].sel(candidate="A").plot()
    ```
    """
    given = {"source": reference, "input": dict(input or {}), **options}
    done = done_by(COMPARE, given | {"others": tuple(map(Path, others))}, out, force)
    places = done.figures["conditions"]
    names = list(places[0]["candidates"])
    keys = [key for key in places[0]["candidates"][names[0]] if key != "verdict"]
    table = {
        key: [
            [
                np.nan if (value := place["candidates"][name][key]) is None else value
                for name in names
            ]
            for place in places
        ]
        for key in keys
    }
    verdicts = [[str(place["candidates"][name]["verdict"]) for name in names] for place in places]
    over = "condition", "candidate"
    data: dict[str, Any] = {key: (over, values) for key, values in table.items()}
    of_places = {
        key: ("condition", [np.nan if place[key] is None else place[key] for place in places])
        for key in ("temperature_C", "water_m")
    }
    return xr.Dataset(
        data | {"verdict": (over, verdicts)},
        {"condition": [place["name"] for place in places], "candidate": names, **of_places},
        attributes_of_done("compare", done),
    )
