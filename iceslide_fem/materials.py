"""Material data for user scripts and laws: public names of `scene`."""

from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable
from iceslide_fem.scene.materials import BAR, COMPOUNDS, CONTACT_TABLES, ICE, MooneyRivlin, Solid

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
