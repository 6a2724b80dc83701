"""The scene: an immutable, completely validated description of a simulation in SI units.

It is read from a TOML file or a dictionary, where values may have units. Material data have their
sources. Imports `relaxation`, `surfaces` and
`runtime` only.
"""

from iceslide_fem.scene.film import Film
from iceslide_fem.scene.ice import Ice, Water
from iceslide_fem.scene.load import Load
from iceslide_fem.scene.model import Scene, scene_from_dict
from iceslide_fem.scene.nested import flat, put
from iceslide_fem.scene.numerics import REFINEMENTS, Numerics
from iceslide_fem.scene.rubber import Rubber
from iceslide_fem.scene.toml import (
    as_toml,
    key_and_text,
    load_scene,
    override,
    parsed,
    read_scene,
)
from iceslide_fem.scene.variation import unit_of

__all__ = [
    "REFINEMENTS",
    "Film",
    "Ice",
    "Load",
    "Numerics",
    "Rubber",
    "Scene",
    "Water",
    "as_toml",
    "flat",
    "key_and_text",
    "load_scene",
    "override",
    "parsed",
    "put",
    "read_scene",
    "scene_from_dict",
    "unit_of",
]
