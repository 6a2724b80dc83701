"""Films and friction that the law gives and that no one should believe without a look."""

from __future__ import annotations

# Three to four water molecules of 0.28 nm: fewer are no fluid with a viscosity (docs/theory.md).
THINNEST_FILM = 1e-9  # m
# Nearly three times the largest value that the thesis prints, 0.55.
LARGEST_FRICTION = 1.5
IN_DOUBT = f"the thesis's largest is 0.55, and above {LARGEST_FRICTION:g} it is in doubt"


def doubts(height: float, friction: float) -> list[str]:
    """A sentence each, without its full stop, on the least film height (m) and the largest mu."""
    found = []
    if height < THINNEST_FILM:
        found.append(
            f"the film gets {1e9 * height:.2g} nm thin: below {1e9 * THINNEST_FILM:g} nm there are "
            "three water molecules or less, which are no fluid with a viscosity"
        )
    if friction > LARGEST_FRICTION:
        found.append(f"mu rises to {friction:.3g}: {IN_DOUBT}")
    return found
