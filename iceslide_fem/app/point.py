"""The tab of the point: friction over time under one pressure, and a map of it over two parameters.

The curves equal those of `iceslide run` for the same scene with `model = "point"`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import tomlkit

from iceslide_fem.app.form import (
    Slider,
    Texts,
    chosen,
    dry_without_meaning,
    scene_lines,
    scene_of,
    tables,
)
from iceslide_fem.film.conditions import (
    ice_model,
    scene_conditions,
    scene_loading,
    varied_conditions,
)
from iceslide_fem.film.point import PointResult, simulate
from iceslide_fem.output.table import HistoryRow
from iceslide_fem.runs.doubts import before_run
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene

T_0 = ZERO_CELSIUS
SLIDERS = (
    Slider("load.pressure", "pressure", "bar", 1e5, 0.1, 20.0, 1.0),
    Slider("load.speed", "sliding speed", "m/s", 1.0, 0.05, 20.0, 3.0),
    Slider("ice.temperature", "ice temperature", "degC", 1.0, -30.0, -0.1, -4.0, False, T_0),
    Slider("film.k", "k, relative contact area", "", 1.0, 0.01, 1.0, 0.266),
    Slider("film.D", "D, asperity diameter", "um", 1e-6, 1.0, 500.0, 29.0),
    Slider("film.H_V", "H_V, free height", "um", 1e-6, 0.05, 50.0, 2.86),
    Slider(
        "film.initial_height", "h₀, first film height", "nm", 1e-9, 5.0, 1000.0, 70.0, zero=True
    ),
    Slider("film.dry_stress", "dry contact: stress, or 0", "bar", 1e5, 0.1, 20.0, 0.0, zero=True),
    Slider("film.dry_softening", "dry contact: softens over", "K", 1.0, 0.5, 50.0, 10.0),
    Slider("film.dry_residual", "dry contact: 0 above melting by", "K", 1.0, 0.0, 10.0, 0.5, False),
    Slider("load.duration", "duration", "ms", 1e-3, 0.1, 100.0, 7.0),
)
DRY_STRESS, *SOFTENING = (slider.key for slider in SLIDERS if slider.key.startswith("film.dry_"))
CONSTANTS = ("film.k", "film.D", "film.H_V")
# Source of k, D and H_V: the compound's table, the three sliders, or a file.
CONTACTS = ("compound B", "constants", "table")
NUMBERS = "mu_mean mu_peak mu_peak_time_s mu_end melt_onset_s saturation_s steps".split()
QUANTITIES = {"mu_mean": "mean μ", "mu_peak": "peak μ", "mu_end": "μ at the end"}
# Sliders -> names of conditions of a point.
CONDITIONS = {slider.key: slider.key.rpartition(".")[2] for slider in SLIDERS}
TOLERANCE = "5e-3"  # of mu(t): below the width of a line
MAP_SIZE = 21  # values along each side of a map
MAP_TOLERANCE = 1e-2
POINT_LINES = """\
import iceslide_fem as ice

{scene}
found = ice.run(scene, "results/point", force=True, pictures=False)
time, mu = found["time_s"], found["mu"]
print(found.attrs["mu_mean"])
"""
MAP_LINES = """\
import numpy as np

import iceslide_fem as ice

{scene}
along = {{
    "{x}": {values_x},  # SI
    "{y}": {values_y},
}}
found = ice.sweep(scene, along, "results/map", force=True)
z = found["{quantity}"].transpose("{y}", "{x}")
"""


def scene_texts(texts: Texts) -> dict[str, str]:
    """The texts of the tab as texts of a point scene, with the chosen k, D and H_V.

    A dry stress of 0 means none. Without a dry stress, or with a table of it, softening is removed.
    Raises SceneError if the choice is not in `CONTACTS`.
    """
    contact = chosen(texts, "contact", CONTACTS)
    left_out = {"contact", *CONSTANTS, "film.contact"}
    left_out -= {"constants": {*CONSTANTS}, "table": {"film.contact"}}.get(contact, set())
    left_out |= dry_without_meaning(texts, "film.")
    fixed = {"name": "point", "model": "point", "rubber.compound": "B", "ice.heat": "column"}
    fixed["numerics.tolerance"] = TOLERANCE
    return fixed | {key: text for key, text in texts.items() if key not in left_out}


def curves(texts: Texts) -> dict[str, Any]:
    """Curves over time (ms) with resolved conduction in the ice, and their texts.

    values: of the sliders, SI. Raises SceneError, SimulationStopped.
    """
    given = scene_texts(texts)
    scene = _constant(given)
    rows, results = point_history(scene)
    return {
        "series": _series(scene, rows),
        "numbers": {name: results[name] for name in NUMBERS},
        "values": _values(scene),
        "notes": [*before_run(scene), *results["warnings"]],
        "toml": tomlkit.dumps(tables(given)),
        "python": POINT_LINES.format(scene=scene_lines(tables(given))),
    }


def half_space_curves(texts: Texts) -> dict[str, Any]:
    """Curves of the same point with the thesis's closed-form flux (5.6), and this flux."""
    scene = _constant(scene_texts(texts) | {"ice.heat": "half-space"})
    rows, results = point_history(scene)
    return {
        "series": _series(scene, rows) | _closed_form(scene),
        "numbers": {name: results[name] for name in NUMBERS},
    }


def friction_map(texts: Texts, along: Sequence[str], quantity: str) -> dict[str, Any]:
    """`quantity` of the point over two sliders `along` x and y, the others as in `texts`.

    x, y: in the sliders' units, (`MAP_SIZE`,); z: rows of y. Raises SceneError.
    """
    x, y = (_slider(key, texts) for key in along)
    if x.key == y.key:
        raise SceneError(f"a map needs two parameters; given: {x.key} twice")
    if quantity not in QUANTITIES:
        raise SceneError(f'"{quantity[:60]}" is not drawn; allowed: {", ".join(QUANTITIES)}')
    dry = {s.key: s.text(s.high) for s in (x, y) if s.key == DRY_STRESS}
    given = scene_texts({**texts, **dry})
    for slider in (x, y):
        if slider.key in SOFTENING and slider.key not in given:
            raise SceneError(f"{slider.key} has no effect without a number of {DRY_STRESS}")
    result = map_result(_constant(given), x, y)
    return {
        "x": x.values(MAP_SIZE).tolist(),
        "y": y.values(MAP_SIZE).tolist(),
        "z": getattr(result, quantity).reshape(MAP_SIZE, MAP_SIZE).tolist(),
        "along": [x.key, y.key],
        "quantity": QUANTITIES[quantity],
        "python": MAP_LINES.format(
            scene=scene_lines(tables(given | {"numerics.tolerance": str(MAP_TOLERANCE)})),
            x=x.key,
            y=y.key,
            values_x=_values_in_python(x),
            values_y=_values_in_python(y),
            quantity=quantity,
        ),
    }


def map_result(scene: Scene, x: Slider, y: Slider) -> PointResult:
    """The point of `scene` at all values of two sliders, x varying fastest, (MAP_SIZE^2,)."""
    across, up = np.meshgrid(x.si(x.values(MAP_SIZE)), y.si(y.values(MAP_SIZE)))
    varied = {CONDITIONS[x.key]: across.ravel(), CONDITIONS[y.key]: up.ravel()}
    conditions = varied_conditions(scene, **varied)
    loading, water = scene_loading(scene), scene.water.table
    return simulate(conditions, ice_model(scene), MAP_TOLERANCE, loading=loading, water=water)


def _constant(texts: Texts) -> Scene:
    """The scene of the texts; it must have a constant pressure and speed for the sliders."""
    scene = scene_of(texts)
    for name, course in (("pressure", scene.load.pressures), ("speed", scene.load.speeds)):
        if not course.is_constant:
            raise SceneError(
                f"load.{name} is a table of times; a slider takes a number: run it as a scene"
            )
    return scene


def _slider(key: str, texts: Texts) -> Slider:
    """The slider of `key`. Raises SceneError if it has no effect."""
    free = [s for s in SLIDERS if s.key not in CONSTANTS or texts.get("contact") == "constants"]
    found = next((slider for slider in free if slider.key == key), None)
    if found is None:
        raise SceneError(
            f"{key[:60]} has no effect here; allowed: {', '.join(s.key for s in free)}"
        )
    return found


def _series(scene: Scene, rows: list[HistoryRow]) -> dict[str, list[float]]:
    """Curves from a history; fluxes (W/m2) are means over a step, at its middle."""
    columns = map(np.array, zip(*rows, strict=True))
    table = dict(zip(rows[0]._fields, columns, strict=True))
    step = np.diff(table["time_s"])
    passed = scene.rubber.length * scene.rubber.width * step
    curves: dict[str, Array] = {
        "time": 1e3 * table["time_s"],
        "mu": table["mu"],
        "film": 1e9 * table["film_height_m"],
        "squeezed": 1e9 * table["squeezed_height_m"],
        "temperature": table["surface_temperature_C"],
        "middle": 1e3 * (table["time_s"][:-1] + 0.5 * step),
        "friction_flux": np.diff(table["friction_work_J"]) / passed,
        "ice_flux": np.diff(table["ice_heat_J"]) / passed,
    }
    return {name: values.tolist() for name, values in curves.items()}


def _closed_form(scene: Scene) -> dict[str, list[float]]:
    """(5.6), q = e (T_m - T_0) / sqrt(pi t), over the whole run."""
    time = scene.load.duration * np.geomspace(1e-3, 1.0, 100)
    ice = scene.ice.solid
    undercooling = ice.melting_temperature - scene.ice.temperature
    flux = ice.effusivity * undercooling / np.sqrt(np.pi * time)
    return {"closed_time": (1e3 * time).tolist(), "closed_flux": flux.tolist()}


def _values(scene: Scene) -> dict[str, float]:
    """SI values of the sliders with numbers; k, D and H_V are those at the pressure."""
    here = scene_conditions(scene)._asdict() | {"duration": [scene.load.duration]}
    film = scene.film
    numbers = {key: getattr(film, name) for key, name in CONDITIONS.items() if name not in here}
    numbers[DRY_STRESS] = numbers[DRY_STRESS] or 0.0
    found = {key: float(here[name][0]) for key, name in CONDITIONS.items() if name in here}
    return found | {key: value for key, value in numbers.items() if isinstance(value, float)}


def _values_in_python(slider: Slider) -> str:
    """Python code of the slider's values on a map, SI."""
    space = "geomspace" if slider.log else "linspace"
    shift = f" + {slider.shift:g}" if slider.shift else ""
    return f"{slider.scale:g} * np.{space}({slider.low:g}, {slider.high:g}, {MAP_SIZE}){shift}"
