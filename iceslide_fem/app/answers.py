"""Requests of the page by name: each answer is a function of the JSON that it sends.

Inputs are texts of fields; outputs are numbers, tables and sentences. Invalid input raises
SceneError.
"""

from __future__ import annotations

import threading
import tomllib
from collections.abc import Callable, Mapping
from typing import Any

import tomlkit

from iceslide_fem import __version__
from iceslide_fem.app import form, line, point, wheel
from iceslide_fem.app.form import (
    checked_texts,
    named_in,
    scene_lines,
    scene_of,
    tables,
    texts_of,
)
from iceslide_fem.app.runs import Runs
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runs.notes import notes
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.workflow.planning.cost import foreseen
from iceslide_fem.workflow.planning.info import describe

Asked = Mapping[str, Any]
TABS = {"line": line.TAB, "wheel": wheel.TAB}
RUN_LINES = """\
import iceslide_fem as ice

{scene}
found = ice.run(scene, {out!r})
print(found.attrs["mu_mean"])
"""


class Answers:
    """Answers to one page; start: texts of its initial scene by dotted key."""

    def __init__(self, runs: Runs, start: Mapping[str, str], link: str = "") -> None:
        """`link`: initial state of the page, the part after # in its address."""
        self._runs = runs
        self._start = dict(start)
        self._link = link
        self._meshing = threading.Lock()  # gmsh has one model at a time

    @staticmethod
    def refused(name: str, sentence: str) -> dict[str, Any]:
        """A message of the answer `name` in the page's words, and the keys of its fields."""
        if name in (*TABS, "stops"):
            tab = TABS.get(name, wheel.TAB)
            return {"sentence": tab.worded(sentence), "keys": tab.fields_in(sentence)}
        return {"sentence": sentence, "keys": named_in(sentence, [*form.keys(), "contact"])}

    def by_name(self) -> dict[str, Callable[[Asked], Any]]:
        """Name in the address -> answer function."""
        return {
            "start": self.start,
            "point": lambda asked: point.curves(_texts(asked)),
            "half-space": lambda asked: point.half_space_curves(_texts(asked)),
            "map": lambda asked: point.friction_map(
                _texts(asked), _words(asked, "along", 2), _words(asked, "quantity", 1)[0]
            ),
            "line": lambda asked: line.curves(_texts(asked)),
            "wheel": lambda asked: wheel.curves(_texts(asked)),
            "stops": lambda asked: wheel.stops(_texts(asked)),
            "scene": self.scene,
            "read": read,
            "info": self.info,
            "run": self.run,
            "runs": lambda asked: {"runs": self._runs.listed()},
            "cancel": self.cancel,
        }

    def start(self, asked: Asked) -> dict[str, Any]:
        """The fields of the page, and their initial texts."""
        return {
            "version": __version__,
            "fields": form.fields(),
            "point": {
                "sliders": [slider.described() for slider in point.SLIDERS],
                "contacts": point.CONTACTS,
                "constants": point.CONSTANTS,
                "quantities": point.QUANTITIES,
                "help": form.meanings([slider.key for slider in point.SLIDERS] + ["film.contact"]),
            },
            **{name: tab.described() for name, tab in TABS.items()},
            "scene": self._start,
            "link": self._link,
        }

    def scene(self, asked: Asked) -> dict[str, Any]:
        """Validate the scene in the fields; its file and its Python code."""
        texts = _texts(asked)
        scene = scene_of(texts)
        folder = str(self._runs.folder(scene))
        return {
            "notes": notes(scene),
            "toml": tomlkit.dumps(tables(texts)),
            "python": RUN_LINES.format(scene=scene_lines(tables(texts)), out=folder),
            "folder": folder,
        }

    def info(self, asked: Asked) -> dict[str, Any]:
        """The rows of `iceslide info`, and its notes."""
        with self._meshing:
            scene = resolved(scene_of(_texts(asked)))
            return {
                "title": f"{scene.name} ({scene.model}, {scene.ice.heat} ice)",
                "rows": [row._asdict() for row in describe(scene)],
                "notes": foreseen(scene),
            }

    def run(self, asked: Asked) -> dict[str, Any]:
        """Start or continue the scene; returns the number of its run."""
        scene = scene_of(_texts(asked))
        force, resume = asked.get("force") is True, asked.get("resume") is True
        return {"number": self._runs.start(scene, force, resume)}

    def cancel(self, asked: Asked) -> dict[str, Any]:
        """Ask a run to stop."""
        number = asked.get("number")
        if not isinstance(number, int):
            raise SceneError("the number of a run is missing")
        self._runs.get(number).cancel()
        return {}


def read(asked: Asked) -> dict[str, Any]:
    """Texts of the fields for the `text` of a scene file. Raises SceneError if it is no TOML."""
    text = asked.get("text")
    try:
        return {"texts": texts_of(tomllib.loads(text if isinstance(text, str) else ""))}
    except (ValueError, RecursionError) as error:
        raise SceneError(f"the file is not valid TOML: {error}") from None


def _texts(asked: Asked) -> dict[str, str]:
    return checked_texts(asked.get("texts"))


def _words(asked: Asked, name: str, count: int) -> list[str]:
    """The `count` texts of the entry `name`. Raises SceneError."""
    value = asked.get(name)
    words = value if isinstance(value, list) else [value]
    if len(words) != count or not all(isinstance(word, str) for word in words):
        raise SceneError(f"{name} needs {count} texts")
    return [str(word) for word in words]
