"""Python code and commands that reproduce a picture of the page."""

from __future__ import annotations

from collections.abc import Mapping
from pprint import pformat
from textwrap import indent
from typing import Any

from iceslide_fem.app.form import Slider

Tables = Mapping[str, Any]


def point_lines(tables: Tables) -> str:
    """Python code for the history of a point."""
    return f"""\
from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import scene_from_dict

{_scene(tables)}
rows, results = point_history(scene)
time = [row.time_s for row in rows]
mu = [row.mu for row in rows]
print(results["mu_mean"])
"""


def map_lines(
    tables: Tables,
    names: Mapping[str, str],
    along: tuple[Slider, Slider],
    count: int,
    tolerance: float,
    quantity: str,
) -> str:
    """Python code for a map over two sliders; names: of a point's conditions."""
    x, y = along
    return f"""\
import numpy as np

from iceslide_fem import point
from iceslide_fem.film.conditions import ice_model, scene_loading, varied_conditions
from iceslide_fem.scene import scene_from_dict

{_scene(tables)}
x, y = np.meshgrid(
    {_values(x, count)},  # {names[x.key]}, SI
    {_values(y, count)},  # {names[y.key]}, SI
)
conditions = varied_conditions(scene, {names[x.key]}=x.ravel(), {names[y.key]}=y.ravel())
loading, water = scene_loading(scene), scene.water.table
found = point.simulate(
    conditions, ice_model(scene), {tolerance:g}, loading=loading, water=water
)
z = found.{quantity}.reshape(x.shape)
"""


def run_lines(tables: Tables, out: str) -> str:
    """Python code that runs a scene with results in `out`."""
    return f"""\
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.simulate import run

{_scene(tables)}
summary = run(scene, {out!r})
"""


def api_lines(name: str, options: Mapping[str, object], shown: str) -> str:
    """Python code that calls a function of the package with `options`; shown: what it prints."""
    given = "\n".join(f"    {key}={value!r}," for key, value in options.items())
    return f"import iceslide_fem\n\nfound = iceslide_fem.{name}(\n{given}\n)\nprint({shown})\n"


def _scene(tables: Tables) -> str:
    given = indent(pformat(dict(tables), sort_dicts=False), "    ")
    return f"scene = scene_from_dict(\n{given}\n)"


def _values(slider: Slider, count: int) -> str:
    space = "geomspace" if slider.log else "linspace"
    shift = f" + {slider.shift:g}" if slider.shift else ""
    return f"{slider.scale:g} * np.{space}({slider.low:g}, {slider.high:g}, {count}){shift}"
