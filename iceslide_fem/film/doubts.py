"""Warnings about films and friction outside the range where the law is credible."""

from __future__ import annotations

# Three to four water molecules of 0.28 nm. A thinner film is not a viscous fluid
# (docs/explanation/models.md).
THINNEST_FILM = 1e-9  # m
# Nearly three times the largest value that the thesis prints, 0.55.
LARGEST_FRICTION = 1.5
IN_DOUBT = f"the thesis's largest is 0.55, and above {LARGEST_FRICTION:g} it is in doubt"
WITHOUT_MELTING = (
    "the film law has no dry friction, so mu there is that of the water film that it begins with. "
    "Where rubber slides on ice without melting it measured friction is many times higher "
    '(page "Which model when, and its limits")'
)
LARGEST_IMBALANCE = 0.01  # error of an energy balance, relative to its scale
MOST = 0.5  # fraction of the contact without melting above which it dominates mu


def unbalanced(imbalance: float, scale: str) -> list[str]:
    """Warning about an energy `imbalance` over what `scale` says."""
    if abs(imbalance) <= LARGEST_IMBALANCE:
        return []
    kind = "missing" if imbalance > 0.0 else "too much"
    return [
        f"the energies do not close: {abs(imbalance):.1%} of {scale} is {kind}, so mu is as "
        "uncertain"
    ]


def doubts(
    height: float, friction: float, melting: float, dry: bool = False, wet: bool = False
) -> list[str]:
    """Warnings, without full stop: least film height (m), largest mu, ice that does not melt.

    melting: largest fraction of the contact that melts; dry: whether the law has dry friction; wet:
    whether there is water without melting.
    """
    found = []
    if wet and not dry and height < THINNEST_FILM:
        found.append(
            f"the film freezes to {1e9 * height:.2g} nm: only film.dry_stress limits its shear"
        )
    dry = dry or wet  # a missing film is then no reason to warn
    if melting == 0.0 and not dry:
        found.append(f"the ice does not melt: {WITHOUT_MELTING}")
    elif melting < 1.0 - MOST and not dry:
        part = f"{1.0 - melting:.0%}" if melting > 0.01 else "more than 99%"
        found.append(f"on {part} of the contact the ice does not melt: {WITHOUT_MELTING}")
    if height < THINNEST_FILM and not dry:
        found.append(
            f"the film gets {1e9 * height:.2g} nm thin: below {1e9 * THINNEST_FILM:g} nm there are "
            "three water molecules or less, too few for the viscosity of a fluid"
        )
    if friction > LARGEST_FRICTION:
        found.append(f"mu rises to {friction:.3g}: {IN_DOUBT}")
    return found
