"""The tables of a scene."""

from __future__ import annotations

from typing import Literal

from iceslide_fem.scene.film import Film, Friction
from iceslide_fem.scene.ice import Ice, Water
from iceslide_fem.scene.load import Load
from iceslide_fem.scene.numerics import Numerics, Output
from iceslide_fem.scene.rubber import Rubber
from iceslide_fem.scene.units import Name, Table, key


class Tables(Table):
    """The model level of a scene, and all its data.

    With model "auto" a run uses the cheapest sufficient level (`level.resolved`).
    """

    name: Name = key(..., "Name of the results: `results/<name>`.")
    model: Literal["point", "slice", "block", "auto"] = key(
        ...,
        "`point`, `slice` (plane strain) or `block` (three dimensions). `auto` takes the "
        "cheapest one whose simplifications stay below the tolerance.",
    )
    rubber: Rubber
    load: Load
    ice: Ice = Ice()
    water: Water = Water()
    film: Film = Film()
    friction: Friction = Friction()
    numerics: Numerics = Numerics()
    output: Output = Output()
