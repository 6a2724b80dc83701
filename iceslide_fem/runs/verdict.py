"""What a result is worth: mu with its errors of numbers, model and inputs, and whether it holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.film.doubts import MOST
from iceslide_fem.runs.many_points import friction
from iceslide_fem.runs.simplifications import Simplification, made
from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.scene import Scene
from iceslide_fem.scene.distribution import BAND, inputs_of
from iceslide_fem.scene.variation import with_values

# Error of the mean of mu by the mesh at refinement 1: the largest of the cases, rounded up
# (docs/validation/accuracy.md, whole runs).
MESH = 0.005
FEW = 5  # cases of several that are looked at
SMALL_PART = 0.05  # of the contact outside the table of k, D and H_V


class Verdict(NamedTuple):
    """Mean mu of a result and its errors, as parts of it.

    numerical: of steps and mesh; model: estimated, of what the model leaves out, None if it was not
    estimated; worst: the largest of these; inputs: half width of the 95 % band, None where inputs
    are taken as exact; holds: where the law holds, in words, and `doubtful` if it may not.
    """

    mu: float
    numerical: float
    model: float | None
    worst: Simplification | None
    inputs: float | None
    holds: str
    doubtful: bool

    @property
    def sentence(self) -> str:
        """All of it in words."""
        model = "not estimated"
        if self.model is not None:
            model = ""
            if self.worst is not None and self.model > 0.0:
                model = f"± {self.mu * self.model:.1g} at most, most by {self.worst.name}"
        said = in_words("Mean mu", self.mu, self.numerical, "steps and mesh", model,
                        self.model or 0.0, self.inputs)  # fmt: skip
        return f"{said} {self.holds}"

    def as_dict(self) -> dict[str, Any]:
        """The entry of a summary."""
        return {
            "mu_mean": self.mu,
            "numerical": self.mu * self.numerical,
            "model": None if self.model is None else self.mu * self.model,
            "inputs": None if self.inputs is None else self.mu * self.inputs,
            "doubtful": self.doubtful,
            "sentence": self.sentence,
        }


def in_words(
    what: str,
    mu: float,
    numerical: float,
    of_numbers: str,
    model: str = "not estimated",
    model_error: float = 0.0,
    inputs: float | None = None,
) -> str:
    """A sentence about a friction coefficient, with the decimals that its errors leave.

    numerical, model_error, inputs: parts of mu; of_numbers: what the first is of; model: what is
    left out, "" if nothing is.
    """
    error = mu * (numerical + model_error)
    # down to a tenth of the error, at most four decimals
    digits = 4 if error <= 0.0 else min(max(1 - floor(log10(error)), 0), 4)
    parts = [f"± {mu * numerical:.1g} ({of_numbers})"]
    if model:
        parts.append(f"model {model}")
    given = "inputs taken as exact" if inputs is None else f"± {mu * inputs:.1g} (inputs)"
    return f"{what} is {mu:.{digits}f}: {', '.join([*parts, given])}."


def verdict(scene: Scene, entries: Mapping[str, Any]) -> Verdict:
    """The verdict on a run of `scene` with the `entries` of its summary."""
    numerics = scene.numerics
    mesh = 0.0 if scene.model == "point" else MESH / numerics.refinement
    try:
        left: Sequence[Simplification] | None = made(scene)
    except IceslideError:  # a law that fails in these estimates
        left = None
    model = None if left is None else sum(one.effect for one in left)
    worst = max(left, key=lambda one: one.effect) if left else None
    holds, doubtful = _holds(scene, entries)
    return Verdict(entries["mu_mean"], numerics.tolerance + mesh, model, worst,
                   input_band(scene), holds, doubtful)  # fmt: skip


def of_cases(cases: Sequence[tuple[Scene, Mapping[str, Any]]]) -> str:
    """A sentence about several results: the range of mean mu, and the largest errors of some.

    cases: scenes with the entries of their summaries; errors are those of at most `FEW`, spread
    over mu with both ends. "" without any case.
    """
    if not cases:
        return ""
    order = sorted(cases, key=lambda case: float(case[1]["mu_mean"]))
    places = sorted({round(place) for place in np.linspace(0, len(order) - 1, FEW)})
    some = [verdict(*order[place]) for place in places]
    models = [one for one in some if one.model]
    parts = [f"± {max(one.numerical for one in some):.1%} (steps and mesh)"]
    if models:
        largest = max(models, key=lambda one: one.model or 0.0)
        worst = f", most by {largest.worst.name}" if largest.worst is not None else ""
        parts.append(f"model ± {largest.model:.0%} at most{worst}")
    bands = [one.inputs for one in some if one.inputs is not None]
    parts.append(f"± {max(bands):.0%} (inputs)" if bands else "inputs taken as exact")
    doubt = next((f" In some cases: {one.holds}" for one in some if one.doubtful), "")
    low, high = some[0].mu, some[-1].mu
    return f"Mean mu is {low:.3g} to {high:.3g} in {len(cases)} cases: {', '.join(parts)}.{doubt}"


def input_band(scene: Scene) -> float | None:
    """Half width of the 95 % band by uncertain inputs over mu, None without any.

    To first order, of points: one standard deviation to both sides of each input
    (`iceslide uncertainty` draws samples).
    """
    inputs = inputs_of(scene)
    if not inputs or scene.friction.law != "film":
        return None
    point = scene.model_copy(update={"model": "point"})
    scenes = [point]
    for one in inputs:
        scenes += [with_values(point, {one.parameter.key: end}) for end in one.sides]
    mu, *sides = friction(scenes).mu_mean[:, 0]
    halves = 0.5 * np.diff(np.reshape(sides, (-1, 2)))
    return float(BAND * np.sqrt((halves**2).sum()) / mu)


def _holds(scene: Scene, entries: Mapping[str, Any]) -> tuple[str, bool]:
    """Where the law holds, in words, and whether it may not."""
    if scene.friction.law != "film":
        return "The friction law is the scene's own.", False
    said, doubtful = [], False
    dry, wet = scene.film.dry_stress is not None, scene.ice.is_wet
    melts = entries.get("melt_onset_s") is not None
    part = entries.get("melted_fraction", float(melts))
    if melts and part < 1.0 - MOST and not (dry or wet):
        said.append(
            f"ice melts on at most {part:.0%} of the contact, and the film law has no dry "
            "friction: mu is in doubt"
        )
        doubtful = True
    elif melts:
        said.append("ice melts, which the film law is for")
    elif dry or wet:
        said.append("no ice melts, and dry friction or water of the scene holds")
    else:
        said.append("no ice melts, and the film law has no dry friction: mu is in doubt")
        doubtful = True
    outside = entries.get("outside_table_fraction") or 0.0
    if outside > SMALL_PART:
        said.append(f"{outside:.0%} of the contact is outside the table of k, D and H_V")
        doubtful = True
    text = "; ".join(said)
    return f"{text[0].upper()}{text[1:]}.", doubtful
