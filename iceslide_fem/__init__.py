"""A rubber tread block sliding on ice: finite elements with a melting water film.

For scripts and notebooks, with results as labelled arrays that have units: scenes (`load_scene`)
and what is known of them (`info`), runs (`run`, `read_run`) and their `difference`, sweeps
(`sweep`, `read_sweep`), pages about all of them (`report`), the point level (`Conditions`,
`simulate_points`), parameters from data (`calibrate`) and what doubt in inputs means
(`uncertainty`), which candidate is better (`compare`), footprints, surfaces, rubbers and wheels
(`footprint`, `roughness`, `hysteresis`, `rubber`, `wheel`), user friction laws (`Law` with
`Contact`, `Surface`, `Response`), data of materials (`COMPOUNDS`, `CONTACT_TABLES`, `ICE`), closed
forms and formulas (`reference`), and errors, each one sentence (`SceneError`, `SimulationStopped`,
`Interrupted`, `OutputError`). Each name is loaded when it is asked for.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from iceslide_fem import reference
    from iceslide_fem.api.inference import calibrate, compare, uncertainty
    from iceslide_fem.api.points import Conditions, simulate_points
    from iceslide_fem.api.preprocessors import footprint, hysteresis, roughness, rubber, wheel
    from iceslide_fem.api.reports import report
    from iceslide_fem.api.runs import difference, read_run, run
    from iceslide_fem.api.scenes import info, load_scene
    from iceslide_fem.api.sweeps import sweep
    from iceslide_fem.film import point
    from iceslide_fem.laws.protocol import Contact, Law, Response, Surface
    from iceslide_fem.runtime.errors import (
        Interrupted,
        OutputError,
        SceneError,
        SimulationStopped,
    )
    from iceslide_fem.scene.materials import COMPOUNDS, CONTACT_TABLES, ICE
    from iceslide_fem.workflow.sweep import read_sweep

__version__ = "1.0.0"

__all__ = [
    "COMPOUNDS",
    "CONTACT_TABLES",
    "ICE",
    "Conditions",
    "Contact",
    "Interrupted",
    "Law",
    "OutputError",
    "Response",
    "SceneError",
    "SimulationStopped",
    "Surface",
    "calibrate",
    "compare",
    "difference",
    "footprint",
    "hysteresis",
    "info",
    "load_scene",
    "point",
    "read_run",
    "read_sweep",
    "reference",
    "report",
    "roughness",
    "rubber",
    "run",
    "simulate_points",
    "sweep",
    "uncertainty",
    "wheel",
]

_MODULES = {
    "api.inference": ("calibrate", "compare", "uncertainty"),
    "api.points": ("Conditions", "simulate_points"),
    "api.preprocessors": ("footprint", "hysteresis", "roughness", "rubber", "wheel"),
    "api.reports": ("report",),
    "api.runs": ("difference", "read_run", "run"),
    "api.scenes": ("info", "load_scene"),
    "api.sweeps": ("sweep",),
    "laws.protocol": ("Contact", "Law", "Response", "Surface"),
    "runtime.errors": ("Interrupted", "OutputError", "SceneError", "SimulationStopped"),
    "scene.materials": ("COMPOUNDS", "CONTACT_TABLES", "ICE"),
    "workflow.sweep": ("read_sweep",),
}
_WHOLE = {"point": "film.point", "reference": "reference"}


def __getattr__(name: str) -> Any:
    """A public name, loaded when it is asked for: NumPy and DOLFINx take their time."""
    if name in _WHOLE:
        return importlib.import_module(f"iceslide_fem.{_WHOLE[name]}")
    for module, names in _MODULES.items():
        if name in names:
            return getattr(importlib.import_module(f"iceslide_fem.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
