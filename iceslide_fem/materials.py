"""Material data for users' own scripts and laws: the public names of `scene.materials`."""

from iceslide_fem.scene.materials import (
    BAR,
    COMPOUNDS,
    CONTACT_TABLES,
    ICE,
    ZERO_CELSIUS,
    ConstantContact,
    ContactTable,
    MooneyRivlin,
    Solid,
)

__all__ = [
    "BAR",
    "COMPOUNDS",
    "CONTACT_TABLES",
    "ICE",
    "ZERO_CELSIUS",
    "ConstantContact",
    "ContactTable",
    "MooneyRivlin",
    "Solid",
]
