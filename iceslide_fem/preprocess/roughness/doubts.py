"""What a height map cannot carry, in sentences: short maps, coarse pixels, steep slopes."""

from __future__ import annotations

from collections.abc import Sequence

from iceslide_fem.preprocess.roughness.surface import SpectrumFit

STEEP = 0.6  # rms slope above which the half-space is inaccurate
NEARLY_FULL = 0.9  # fraction of contact
# Largest roll-off over the side of a map, and shortest wave over the roll-off, without a note: k, D
# and H_V are then within 12 % of those of a long and fine map (scripts.studies.poor_maps).
OF_THE_SIDE, OF_THE_ROLLOFF = 0.35, 0.2


def wave_doubts(
    fit: SpectrumFit | None, shortest_wave: float | None, size: tuple[float, float]
) -> list[str]:
    """Sentences on a map that is too short, or whose waves end too early, for its roll-off.

    shortest_wave: m, None if the pixels limit it; size: of the map, m.
    """
    if fit is None:
        return [
            "the map has too few waves for a fit of its spectrum: k, D and H_V are those of the "
            "map, and not of a surface"
        ]
    found, rolloff = [], fit.rolloff
    if rolloff > OF_THE_SIDE * min(size):
        found.append(
            f"the roll-off found, {1e6 * rolloff:.3g} um, is {rolloff / min(size):.2f} of the "
            "map's side, so longer waves are missing: on maps of 2, 1 and 0.5 roll-offs D was 12, "
            "18 and 33 % too small, and H_V 2, 9 and 33 %"
        )
    if shortest_wave is not None and shortest_wave > OF_THE_ROLLOFF * rolloff:
        found.append(
            f"the shortest wave kept is {shortest_wave / rolloff:.2f} of the roll-off, "
            f"{1e6 * rolloff:.3g} um: at 0.25, 0.5 and 1 of it k was 1.2, 1.7 and 3.2 times that "
            "of a surface with waves down to 0.16, and H_V 7, 25 and 68 % too small"
        )
    return found


def slope_doubts(rms_slope: float) -> Sequence[str]:
    """A sentence on slopes that strain the rubber too much."""
    if rms_slope <= STEEP:
        return ()
    return (
        f"the rms slope is {rms_slope:.2f}: above {STEEP:g} rubber is strained too much for the "
        "elastic half-space",
    )
