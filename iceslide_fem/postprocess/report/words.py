"""Text and tables of a report: what was simulated, its assumptions, and how to repeat it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from iceslide_fem.postprocess.report.page import SCENES, Cell, Section, Table, Text
from iceslide_fem.postprocess.results import Run
from iceslide_fem.postprocess.results.run_directory import load_range
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, as_toml, flat, scene_from_dict
from iceslide_fem.scene.fields import number_text
from iceslide_fem.scene.materials import BAR
from iceslide_fem.scene.nested import beside, different
from iceslide_fem.scene.toml import without_none
from iceslide_fem.scene.variation import quantity_or_none

if TYPE_CHECKING:
    from iceslide_fem.runs.simplifications import Simplification

MM, MS, NM = 1e3, 1e3, 1e9
DIGITS = 5  # of values of keys
_MODELS = {
    "point": "at one point, at its nominal pressure",
    "slice": "in a slice along the sliding direction (plane strain)",
    "block": "in three dimensions",
}
_HEAT = {
    "half-space": "by the closed form of a half-space",
    "column": "in columns below the contact",
    "continuum": "as a continuum",
    "mesh": "on a finite element mesh",
}

_BETWEEN = {
    "freeze": "water freezes as far as the rest lets it",
    "drain": "water is gone",
    "keep": "the water that stays on the ice is kept",
}


def in_words(scene: Mapping[str, Any]) -> str:
    """Description of a resolved scene in a few sentences."""
    rubber, load, ice, film = (scene[name] for name in ("rubber", "load", "ice", "film"))
    size = " x ".join(f"{MM * rubber[side]:.4g}" for side in ("length", "width", "height"))
    file = rubber.get("mesh") or rubber.get("step")
    own = f" drawn in {Path(file).name}" if file else f" of {size} mm"
    compound = f"compound {rubber['compound']}" if rubber.get("compound") else "given constants"
    layers = [f"{layer['name']} of another rubber" for layer in rubber.get("layers") or []]
    compound = ", ".join([compound, *layers])
    passing = (
        "passes below it" if ice["motion"] == "sliding" else "stays below it, as seen from the ice"
    )
    carried = " and carries the film" if film["carrier"] == "ice" else "; the rubber keeps the film"
    return (
        f"A rubber block{own} ({compound}) is pressed on ice at "
        f"{ice['temperature'] - ZERO_CELSIUS:.4g} °C with {load_range(load['pressure'], BAR)} bar "
        f"and slides at {load_range(load['speed'], 1.0)} m/s for {MS * load['duration']:.4g} ms."
        f"{_passes(scene)} "
        f"It is computed {_MODELS[scene['model']]}. The ice {passing}"
        f"{carried if ice['motion'] == 'sliding' else ''}; heat in it is computed "
        f"{_HEAT[ice['heat']]}, {'with' if rubber.get('heat') else 'without'} heat in the rubber. "
        f"{_law(scene, film)} "
        f"Steps and layers are chosen for a relative error of mu(t) of "
        f"{scene['numerics']['tolerance']:g}."
    )


def _passes(scene: Mapping[str, Any]) -> str:
    """Sentence on repeated passes over the same ice; "" for one pass."""
    load, rubber = scene["load"], scene["rubber"]
    if rubber.get("rows", 1) > 1:
        return (
            f" {rubber['rows']} such blocks follow each other, {MM * rubber['row_pitch']:.4g} mm "
            f"from leading edge to leading edge; {_BETWEEN['keep']}."
        )
    if load.get("passes", 1) > 1:
        return (
            f" It slides over the same ice {load['passes']} times, once every "
            f"{load['period']:.4g} s; between passes {_BETWEEN[_between(scene)]}."
        )
    return ""


def _between(scene: Mapping[str, Any]) -> str:
    """Treatment of water between passes; rows of blocks keep it."""
    return "keep" if scene["rubber"].get("rows", 1) > 1 else str(scene["film"]["between"])


def _law(scene: Mapping[str, Any], film: Mapping[str, Any]) -> str:
    """Sentence on the friction law: the film, or another law."""
    law = scene.get("friction", {}).get("law", "film")
    if law == "film":
        height = float(Curve.of(film["initial_height"])(scene["ice"]["temperature"]))
        return f"The film begins with {NM * height:.4g} nm."
    return f"Friction is that of the law {law} in place of the film."


def doubts_of(run: Run) -> list[Text]:
    """Paragraphs of a run's warnings; a note if there are none."""
    found = [as_warning(str(sentence)) for sentence in run.summary.get("warnings") or []]
    return found or [Text("The run gave no warning.")]


def as_warning(sentence: str) -> Text:
    """A sentence without capital and full stop as a paragraph."""
    return Text(f"{sentence[:1].upper()}{sentence[1:]}.", "warning")


# Simplifications with whether the run's model makes them; or the reason why they are unknown.
LeftOut: TypeAlias = "list[tuple[Simplification, bool]] | str"


def left_out(run: Run) -> LeftOut:
    """Simplifications of this scene's model, with estimates of their change of mu(t)."""
    from iceslide_fem.runs.simplifications import made, simplifications

    scene = scene_of(run.scene)
    if scene is None:
        return "its files are not here"
    try:
        here = made(scene)
        return [(one, one in here) for one in simplifications(scene)]
    except IceslideError as reason:
        return str(reason)


def neglected(left: LeftOut, scene: Mapping[str, Any]) -> list[Text | Table]:
    """The simplifications in words and as a table."""
    always = Text(
        "Every model here takes the ice as rigid and smooth, the water as Newtonian and the "
        "contact parameters k, D and H_V as functions of the local pressure alone."
        f"{_without_freezing(scene)}"
    )
    if isinstance(left, str):
        return [always, Text(f"What else it leaves out was not estimated: {left}.")]
    rows = []
    for one, made in left:
        texts = (f"{one.number:.2g}", one.formula, f"{one.effect:.2g}", "yes" if made else "no")
        rows.append([*map(Cell, (one.name, *texts))])
    head = ["simplification", "its number", "which is", "moves mu by up to", "made here"]
    return [always, Table("Estimates before the run (iceslide info, ladder)", head, rows)]


def _without_freezing(scene: Mapping[str, Any]) -> str:
    """Sentence on water that does not freeze; "" without any."""
    if scene["film"].get("refreeze", "nothing") != "nothing":
        return ""
    below = " below the rubber" if _passes(scene) and _between(scene) == "freeze" else ""
    return f" Melted ice does not freeze again{below}."


def scene_of(values: Mapping[str, Any]) -> Scene | None:
    """The scene of a summary, if its files still exist."""
    try:
        return scene_from_dict(without_none(values))
    except (IceslideError, OSError, TypeError, ValueError):
        return None


def again(scene: Mapping[str, Any], command: str = "run") -> list[Text]:
    """How to repeat the run: the scene as a file, and the command."""
    name = scene["name"]
    return [
        Text(f"Save this as {name}.toml, then: iceslide {command} {name}.toml --out {name}"),
        Text(as_toml(scene), "code"),
    ]


def versions_of(summaries: Mapping[str, Mapping[str, Any]]) -> Table:
    """Versions and cost, a column for each summary."""
    versions = [summary.get("versions", {}) for summary in summaries.values()]
    rows = []
    for name in {name: None for each in versions for name in each}:
        rows.append([Cell(name), *(Cell(str(each.get(name, "–"))) for each in versions)])
    for key, name in _COST.items():
        values = [summary.get(key) for summary in summaries.values()]
        if any(value is not None for value in values):
            rows.append([Cell(name), *(Cell(_counted(value), key, value) for value in values)])
    head = ["", *(summaries if len(summaries) > 1 else [""])]
    return Table("What computed it, and what it cost", head, rows)


def _counted(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


_COST = {
    "wall_s": "seconds",
    "ranks": "processes",
    "steps": "steps",
    "rejected_steps": "rejected steps",
    "newton_iterations": "Newton iterations",
    "dofs": "unknowns of the rubber",
    "scene_hash": "hash of the scene",
}


def all_keys(scenes: Mapping[str, Mapping[str, Any]], only_different: bool = False) -> Table:
    """The keys of one or more scenes, with units."""
    tables = [flat(scene) for scene in scenes.values()]
    rows = [
        [Cell(key), *(Cell(_shown(value, key)) for value in values)]
        for key, values in (different if only_different else beside)(tables).items()
        if any(value is not None for value in values)
    ]
    return Table(SCENES, ["key", *scenes], rows)


def _shown(value: Any, key: str) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number_text(value, quantity_or_none(key), DIGITS)
    if isinstance(value, list) and not any(isinstance(each, list) for each in value):
        return ", ".join(map(str, value)) or "none"
    return str(value)


def section_again(run: Run, left: LeftOut) -> list[Section]:
    """The last sections of the page of any run."""
    return [
        Section("neglected", "What the model leaves out", neglected(left, run.scene)),
        Section("scene", "The scene", [all_keys({run.scene["name"]: run.scene})]),
        Section("again", "Run it again", [*again(run.scene), versions_of({"": run.summary})]),
    ]
