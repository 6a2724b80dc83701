"""What the solver asks of a friction law at contact points, whoever wrote it.

`InterfaceLaw` is the law of a scene. The film (`laws.film`) and laws of the published protocol
(`laws.user_law`) implement it; `laws.table` chooses. Its loads (`film.integrators.Loads`) are what
acts at an end of a step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from iceslide_fem.film.integrators import InterfaceState, Loads
from iceslide_fem.runtime.arrays import Array, Mask

# Shear (Pa) of pressures (Pa) and slip speeds (m/s), and its derivatives by both; arrays (n,) or
# any other shape of as many.
Sheared = Callable[[Array, Array], tuple[Array, Array, Array]]


class InterfaceLaw(Protocol):
    """A friction law at n contact points."""

    @property
    def name(self) -> str:
        """What messages call it."""

    @property
    def has_film(self) -> bool:
        """Whether films of water with the scene's k, D and H_V separate rubber and ice.

        Then a point's steps end where its film begins to melt and where its voids are full.
        """

    @property
    def viscous(self) -> bool:
        """Whether shear is proportional to the slip speed at a given state.

        Then it falls as fast as the speed, and cannot jump. Of other laws nothing is assumed.
        """

    @property
    def fault(self) -> str | None:
        """What a law has done wrong on this rank, or None."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the internal variables in tables."""

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """Initial values of the internal variables, one for each."""

    def frame(self, asked: str) -> str:
        """Where the history lives if ice slides, "ice" or "rubber", if the scene has `asked`.

        What lives on the ice is held by its nodes (`interface.build.ON_ICE`).
        """

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """ln h (h in m), H_s (m) and internal variables (m, n) of `n` points at the start."""

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """What `initial` says of ln h and internal variables, of films of the height (m) on ice
        whose surface has the temperature (K), (n,).
        """

    def loads(self, pressure: Array, speed: Array) -> Loads:
        """What acts at local `pressure` (Pa) and slip `speed` (m/s), (n,)."""

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """Shear of points in `state` on ice of that temperature (K)."""

    def at_start(self, film_height: float, n: int) -> Sheared:
        """Shear of `n` points at the start, on films of the height (m) where there are films."""

    def film_height(self, state: InterfaceState) -> Array:
        """Film heights (n,), m; NaN of a law without a film."""

    def reported(self, internal: Array, pressure: Array) -> Mapping[str, Array]:
        """Column -> values, SI, of internal variables (m, n) under pressures (Pa), (n,)."""

    def outside(self, pressure: Array) -> Mask:
        """Where the law has no data for the pressure."""
