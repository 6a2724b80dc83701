"""The interface of a friction law at contact points, as the solver uses it.

`InterfaceLaw` is the law of a scene. The film (`laws.film`) and laws of the published protocol
(`laws.user_law`) implement it; `laws.table` chooses the law. Its loads (`film.integrators.Loads`)
hold at one end of a step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from iceslide_fem.film.integrators import InterfaceState, Loads
from iceslide_fem.runtime.arrays import Array, Mask

# Shear law: function of pressures (Pa) and slip speeds (m/s). It returns the shear (Pa) and its
# derivatives with both. Arrays are (n,) or have any other shape of n entries.
Sheared = Callable[[Array, Array], tuple[Array, Array, Array]]


class InterfaceLaw(Protocol):
    """A friction law at n contact points."""

    @property
    def name(self) -> str:
        """Name of the law in messages."""

    @property
    def has_film(self) -> bool:
        """Whether water films with the scene's k, D and H_V separate rubber and ice.

        Steps at a point then end at melt onset and at saturation of the voids.
        """

    @property
    def viscous(self) -> bool:
        """Whether shear is proportional to the slip speed at a given state.

        Shear then vanishes with the speed and cannot jump. Nothing is assumed of other laws.
        """

    @property
    def fault(self) -> str | None:
        """Message about an invalid result of the law on this rank, or None."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the internal variables in tables."""

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """Initial value of each internal variable."""

    def frame(self, asked: str) -> str:
        """Frame of the history on sliding ice, "ice" or "rubber"; asked: that of the scene.

        History on the ice is held by its nodes (`interface.build.ON_ICE`).
        """

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """ln h (h in m), H_s (m) and internal variables (m, n) of `n` points at the start."""

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """ln h and internal variables as of `initial`, for given films and ice.

        height: of the films, m; temperature: of the ice's surface, K; both (n,).
        """

    def loads(self, pressure: Array, speed: Array) -> Loads:
        """Loads at local `pressure` (Pa) and slip `speed` (m/s), (n,)."""

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """The shear law of points in `state`, on ice of `temperature` (K)."""

    def at_start(self, film_height: float, n: int) -> Sheared:
        """The initial shear law of `n` points, with films of the height (m) if the law has
        films.
        """

    def film_height(self, state: InterfaceState) -> Array:
        """Film heights (n,), m; NaN for a law without films."""

    def reported(self, internal: Array, pressure: Array) -> Mapping[str, Array]:
        """Column -> values, SI, of internal variables (m, n) under pressures (Pa), (n,)."""

    def outside(self, pressure: Array) -> Mask:
        """Mask of pressures for which the law has no data."""
