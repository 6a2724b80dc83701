"""What is in doubt about a scene before it runs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from math import sqrt
from typing import TypeVar

from iceslide_fem.runs.notes import notes
from iceslide_fem.runs.simplifications import model_doubts
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene
from iceslide_fem.scene.distribution import inputs_of

# Largest sqrt(alpha t) over the contact's shortest side for which columns of ice suffice. At 0.09
# columns change the mean mu by 0.8 %, and cold ice beside the contact changes it by 2.7 % (slice of
# thesis_1bar; docs/validation/published.md).
LATERAL_FRACTION = 0.1

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)")  # in a sentence
Name = TypeVar("Name")


def before_run(scene: Scene) -> list[str]:
    """Everything that is in doubt about a scene before it runs, without full stop.

    Notes on its keys and values, and on columns of ice; of blocks also on their mesh, duration, and
    model. `iceslide info` and a run print them, and a run keeps them in its summary. Raises
    SceneError if a user's mesh is unsuitable.
    """
    inputs_of(scene)  # refuses wrong ones
    found = notes(scene) + _columns(scene)
    if scene.model == "point":
        return found
    return found + _sides(scene) + _passing(scene) + model_doubts(scene)


def by_kind(said: Iterable[tuple[Name, str]]) -> list[list[tuple[Name, str]]]:
    """Sentences with the names of who says them, those together that differ in numbers only."""
    kinds: dict[str, list[tuple[Name, str]]] = {}
    for name, sentence in said:
        kinds.setdefault(NUMBER.sub("#", sentence), []).append((name, sentence))
    return list(kinds.values())


def in_ranges(sentences: Sequence[str]) -> str:
    """One sentence for those of a kind: numbers that differ as their smallest and largest one."""
    of_all = iter(zip(*map(NUMBER.findall, sentences), strict=True))

    def between(_: re.Match[str]) -> str:
        some = sorted(set(next(of_all)), key=float)
        return some[0] if len(some) == 1 else f"{some[0]} … {some[-1]}"

    return NUMBER.sub(between, sentences[0])


def sideways(scene: Scene) -> float:
    """sqrt(alpha t) over the contact's shortest side, with the time t for which a place is warmed.

    Heat diffuses as far sideways as downwards. The relative error of columns of ice is of this
    order.
    """
    if scene.model == "point":
        sides: tuple[float, ...] = (scene.rubber.length,)
    else:
        from iceslide_fem.mesh.rubber import block_size  # loads gmsh, which a point does not need

        sides = block_size(scene)[:-1]
    heated = scene.load.duration
    if scene.ice.motion == "sliding":
        heated = min(heated, sides[0] / scene.load.speeds.mean)
    return sqrt(scene.ice.solid.diffusivity * heated) / min(sides)


def _columns(scene: Scene) -> list[str]:
    """Warning of columns of ice below a contact that heat leaves sideways."""
    if scene.model != "point" and scene.ice.heat in ("continuum", "mesh"):
        return []
    number = sideways(scene)
    if number <= LATERAL_FRACTION:
        return []
    finer = "continuum" if scene.ice.is_half_space else "mesh"
    model = "a slice or block with " if scene.model == "point" else ""
    return [
        f"heat reaches √(α t) / L = {number:.2g} of the contact's shortest side, but columns of "
        f"ice conduct it downwards only: above {LATERAL_FRACTION:g}, beside cold ice, they are too "
        f'warm and mu is too low; {model}ice.heat = "{finer}" conducts it sideways'
    ]


def _sides(scene: Scene) -> list[str]:
    """Warning of a mesh whose sides have no contact and may pass through the ice."""
    if scene.rubber.mesh is None:
        return []
    from iceslide_fem.mesh.completeness import only_lowest
    from iceslide_fem.mesh.rubber import tagged_rubber

    if not only_lowest(tagged_rubber(scene)):
        return []
    return [
        'the lowest facets of rubber.mesh alone are tagged "contact": its sides pass through the '
        "ice where they lean onto it"
    ]


def _passing(scene: Scene) -> list[str]:
    """Warning of a run shorter than the transit time of the ice."""
    if scene.ice.motion != "sliding":
        return []
    from iceslide_fem.mesh.rubber import block_size

    transit = block_size(scene)[0] / scene.load.speeds.mean
    if scene.load.duration >= transit:
        return []
    after = readable(transit, "s")
    return [f"the run ends before an ice point has passed the block, after {after}"]
