"""From pictures, maps, surfaces and DMA tables to friction, for scripts."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from iceslide_fem.api.errors import in_python
from iceslide_fem.api.runs import Variables, plain_attributes, variables
from iceslide_fem.preprocess.footprint import command as footprints
from iceslide_fem.preprocess.footprint.survey import Survey
from iceslide_fem.preprocess.hysteresis import command as rough_ice
from iceslide_fem.preprocess.hysteresis import survey as losses
from iceslide_fem.preprocess.roughness import command as surfaces
from iceslide_fem.preprocess.roughness.survey import columns
from iceslide_fem.preprocess.rubber import command as rubbers
from iceslide_fem.preprocess.rubber.output import relaxation_columns
from iceslide_fem.preprocess.wheel import command as wheels
from iceslide_fem.preprocess.wheel.output import columns as slip_columns
from iceslide_fem.preprocess.work import Done, Preprocessor, run
from iceslide_fem.runtime.columns import attributes_of
from iceslide_fem.scene import flat
from iceslide_fem.scene.fingerprint import versions_in_words


def footprint(
    image: Path | str | None = None,
    *,
    out: Path | str | None = None,
    force: bool = False,
    **options: Any,
) -> xr.Dataset:
    """Temperature, water film and friction below a tyre's footprint, as `iceslide footprint`.

    `image` is the picture; other sources are options (`pressure_map`, `line`, `gaussian`). Options
    have the command's names with underscores, and texts with units or numbers in SI as values.
    Writes to `out` what the command writes, by default to `results/<name of the picture>`.

    Of an area all maps are over `y_m` and `x_m`, (ny, nx), x along the direction of travel and y
    from the lower edge: `pressure_Pa`, `surface_temperature_C`, `film_height_m`, `mu`, ... Of a
    line they are the columns of `line.csv` over `x_m`. Attributes: the figures of `summary.json`
    by dotted names.

    Raises `SceneError` with one sentence, before anything is written, where the input is wrong.

    ```python
    import iceslide_fem

    found = iceslide_fem.footprint(gaussian="120mm,2bar,30mm", speed="3 m/s", temperature="-4 degC")
    found["film_height_m"].plot()
    ```
    """
    done = done_by(footprints.FOOTPRINT, {"image": image, **options}, out, force)
    return xr.Dataset(_maps(done.found), attrs=attributes_of_done("footprint", done))


def _maps(survey: Survey) -> Variables:
    if survey.case.one_line:
        return variables(footprints.line_columns(survey), "x_m")
    pixels = survey.read.pressure_map
    data = variables({"y_m": pixels.y}, "y_m") | variables({"x_m": pixels.x}, "x_m")
    return data | variables(footprints.all_maps(survey), ("y_m", "x_m"))


def roughness(
    surface: Path | str, *, out: Path | str | None = None, force: bool = False, **options: Any
) -> xr.Dataset:
    """Contact parameters over pressure of a rough surface, as `iceslide roughness`.

    `surface` is a height map, or a TOML file of a surface to generate. Options have the command's
    names with underscores, but `ages` for `--age`. Writes to `out` what the command writes, by
    default to `results/<name of the surface>`.

    `k`, `D_m` and `H_V_m`, means over realisations, their standard deviations (`k_std`, ...) and
    the other columns of `contact.csv` are over `pressure_Pa`, with several ages over `age_s`, too.
    Attributes: the figures of `surface.json` by dotted names.

    Raises `SceneError` with one sentence, before anything is written, where the input is wrong.

    ```python
    import iceslide_fem

    found = iceslide_fem.roughness("cases/surfaces/compound_B.toml", realisations=2)
    found["k"].plot(xscale="log")
    ```
    """
    done = done_by(surfaces.ROUGHNESS, {"surface": surface, **options}, out, force)
    attributes = attributes_of_done("roughness", done)
    parts = [xr.Dataset(variables(columns(each), "pressure_Pa")) for each in done.found]
    if len(parts) > 1:
        ages = [each.age for each in done.found]
        parts = [part.drop_vars("age_s") for part in parts]
        over = xr.Variable("age_s", ages, {"long_name": "age", "units": "s"})
        return xr.concat(parts, over).assign_attrs(attributes)
    return parts[0].assign_attrs(attributes)


def hysteresis(
    scene: Path | str, *, out: Path | str | None = None, force: bool = False, **options: Any
) -> xr.Dataset:
    """What rubber loses on the waves of rough ice, as `iceslide hysteresis`.

    `scene` has `ice.roughness` and rubber that relaxes. Options have the command's names. Writes to
    `out` what the command writes, by default to `results/<name of the scene>_hysteresis`.

    The columns of `hysteresis.csv` are over `condition`, the first the scene's own, those of
    `waves.csv` over `q_rad_m`, with the prefix `wave_`. Attributes: the figures of `summary.json`
    by dotted names.

    Raises `SceneError` with one sentence, before anything is written, where the input is wrong.

    ```python
    import iceslide_fem

    found = iceslide_fem.hysteresis("cases/rough_ice.toml", speed="1mm/s:10m/s:25")
    found["mu_hysteresis"][1:].plot()
    ```
    """
    done = done_by(rough_ice.HYSTERESIS, {"scene": scene, **options}, out, force)
    rows, waves = losses.columns(done.found), losses.spectrum_columns(done.found)
    data = variables({"condition": np.arange(len(rows["k"])), **rows}, "condition")
    q = waves.pop("q_rad_m")
    data |= variables({"q_rad_m": q} | {f"wave_{key}": v for key, v in waves.items()}, "q_rad_m")
    return xr.Dataset(data, attrs=attributes_of_done("hysteresis", done))


def rubber(
    source: Path | str, *, out: Path | str | None = None, force: bool = False, **options: Any
) -> xr.Dataset:
    """Rubber that relaxes, from a DMA table, as `iceslide rubber`.

    `source` is the table, or a scene, whose rubber is shown. Options have the command's names with
    underscores, but `kind` for `--of`. Writes to `out` what the command writes, `rubber.toml` for a
    scene among it, by default to `results/<name of the table>`.

    The columns of `rubber.csv`, moduli over `time_s` and dynamic moduli at its inverse, are over
    `time_s`; the fractions `g` and the times `tau_s` of the Prony series over `arm`. Attributes:
    the figures of `rubber.json` by dotted names.

    Raises `SceneError` with one sentence, before anything is written, where the input is wrong.

    ```python
    import iceslide_fem

    found = iceslide_fem.rubber("cases/rubber/synthetic_dma.csv", reference="20 degC")
    found["E_Pa"].plot(xscale="log")
    ```
    """
    done = done_by(rubbers.RUBBER, {"source": source, **options}, out, force)
    prony = done.found.relaxation.prony
    arms = {"arm": np.arange(1, len(prony.times) + 1), "g": prony.fractions, "tau_s": prony.times}
    data = variables(relaxation_columns(done.found), "time_s") | variables(arms, "arm")
    return xr.Dataset(data, attrs=attributes_of_done("rubber", done))


def wheel(
    image: Path | str | None = None,
    *,
    vary: Mapping[str, Any] | None = None,
    out: Path | str | None = None,
    force: bool = False,
    **options: Any,
) -> xr.Dataset:
    """Friction over slip of a wheel from its footprint, as `iceslide wheel`.

    `image` and options as for `footprint`; `vary` has lists of speeds and temperatures, `{"speed":
    ["20 km/h", "50 km/h"]}`. Writes to `out` what the command writes, by default to
    `results/<name of the source>_wheel`.

    The columns of `mu_slip.csv` are over `speed_m_s`, `temperature_C` and `slip`; of stops, with
    `abs=True`, `stop_distance_m` and the like over `control`. Attributes: the figures of
    `summary.json` by dotted names.

    Raises `SceneError` with one sentence, before anything is written, where the input is wrong,
    `SimulationStopped` where the law finds no step.

    ```python
    import iceslide_fem

    found = iceslide_fem.wheel(gaussian="120mm,2bar,30mm", slip=[0.05, 0.1, 0.2, 1.0],
                               stiffness="1e8 Pa/m", vary={"speed": ["20 km/h", "50 km/h"]})
    found["mu"].plot(hue="speed_m_s")
    ```
    """
    done = done_by(wheels.WHEEL, {"image": image, "vary": vary, **options}, out, force)
    slipping = slip_columns(done.found.curves, done.found.read.pressure_map.load)
    table = pd.DataFrame(slipping).set_index(["speed_m_s", "temperature_C", "slip"])
    result = xr.Dataset.from_dataframe(table)
    for name, variable in result.variables.items():
        variable.attrs = attributes_of(str(name))
    if stops := done.figures["stops"]:
        controls = {"control": list(stops)}
        of_stops = pd.DataFrame(list(stops.values()))
        ends = list(zip(*of_stops.pop("measured_between_m_s"), strict=True))
        of_stops["measured_from_m_s"], of_stops["measured_to_m_s"] = ends
        stopped = variables({f"stop_{name}": of_stops[name] for name in of_stops}, "control")
        result = result.assign_coords(controls).assign(stopped)
    return result.assign_attrs(attributes_of_done("wheel", done))


def done_by(
    kind: Preprocessor, options: Mapping[str, Any], out: Path | str | None, force: bool
) -> Done:
    """What the `options` of a command give: lists are texts with commas there."""
    values = {name: as_text(value) for name, value in options.items()}
    with in_python(kind.case):
        return run(kind, values, None if out is None else Path(out), force)


def as_text(value: Any) -> Any:
    """A list as a text with commas, as options take it; a path as its text, several as they are."""
    if isinstance(value, tuple) and value and all(isinstance(part, Path) for part in value):
        return value
    if isinstance(value, list | tuple | np.ndarray):
        return ",".join(str(part) for part in value)
    return str(value) if isinstance(value, Path) else value


def attributes_of_done(kind: str, done: Done) -> dict[str, Any]:
    """Attributes of a dataset of the `kind`: figures that are numbers or texts, and versions."""
    figures, left_out = done.figures, ("case", "versions", "shown")
    return {
        "iceslide_fem": kind,
        "name": done.case.source.stem,
        "folder": str(done.folder),
        "versions": versions_in_words(figures["versions"]),
        **plain_attributes(flat({key: v for key, v in figures.items() if key not in left_out})),
    }
