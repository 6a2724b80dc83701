"""Pixels at the upper end of what a sensor measures, or of a picture's colour scale.

Where the true pressure is higher, the load that is read is too low. The friction force hardly
changes, so mu is too high by the load that is missing (docs/explanation/footprint.md).
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import BAR

# Fractions of the pixels in contact that are said: where the file says the end, and elsewhere.
FEW, MANY = 0.01, 0.1
NEARLY_ALL = 0.9  # a map of these says where there is contact, not how hard
ROUNDING = 1e-3  # of pressures given as numbers
OF_COLOURS = 0.01  # of the scale of a picture
WITH_LOAD = 0.05  # largest error of mu at a given load (scripts.studies.poor_maps)


def saturation(
    pressure: Array, said: str, end: float | None, of_colours: bool, loaded: bool
) -> tuple[str, ...]:
    """A note on pixels at the `end` (Pa) of the scale of a sensor or picture; () if there is none.

    pressure: as read, Pa; said: the source in messages; end: None for pressures whose file has
    none, then it is the largest one, unless all are the same; loaded: whether the load is given.
    Raises SceneError without it if nearly all pixels in contact are at the end.
    """
    touching = pressure[pressure > 0.0]
    top = float(touching.max()) if end is None else end
    tolerance = OF_COLOURS if of_colours else ROUNDING if end is not None else 0.0
    fraction = float((touching >= (1.0 - tolerance) * top).mean())
    stated = end is not None and not of_colours
    alike = not stated and np.ptp(touching) <= tolerance * top
    if alike or fraction < (FEW if stated else MANY):
        return ()
    where = "the end of its colour scale" if of_colours else "its largest pressure"
    if stated:
        where = "the pressure at which its sensors saturate"
    found = f"{said} has {fraction:.0%} of the pixels in contact at {where}, {top / BAR:.4g} bar"
    if loaded:
        return (f"{found}: if the pressure is higher there, mu is off by up to {WITH_LOAD:.0%}",)
    if fraction > NEARLY_ALL:
        raise SceneError(
            f"{found}: it says where the tyre touches, and not how hard; --load says "
            "what it carries"
        )
    return (
        f"{found}: if the pressure is higher there, the load is too low, and mu too high by the "
        "same factor, 1.1 to 1.9 with half of the pixels cut (docs/explanation/footprint.md); with "
        f"the true --load mu is within {WITH_LOAD:.0%}",
    )
