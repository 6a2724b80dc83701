"""Ice on a gmsh mesh, with the heat equation assembled by DOLFINx: the `mesh` model.

Films give their heat to the surface's facets and read them with the same weights. Each rank has a
part of the ice and a part of the points. PETSc exchanges values between them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import PETSc
from iceslide_fem.film.law import Film, FilmStage
from iceslide_fem.heat.balance import AboveIce, Balance, Meeting
from iceslide_fem.heat.bodies import Bodies
from iceslide_fem.heat.equation import HeatEquation
from iceslide_fem.heat.surface import HeatedSurface, Reading, Readings
from iceslide_fem.interface.film_frame import Rises
from iceslide_fem.interface.surface_grid import Contacts, OwnNodes, Placement, Profile, Recent
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import Solid


class Settings(NamedTuple):
    """Settings of meshed ice.

    solid, temperature: material and initial temperature (K); interface_resistance: between ice and
    points, K m2/W (see `heat.balance`); agreement: of both, K (see `Balance`).
    """

    solid: Solid
    temperature: float
    interface_resistance: float
    agreement: float


class MeshedIce:
    """Ice that stays below the rubber. Heat state: rises of this rank's unknowns, (n_own,), K."""

    nodes: OwnNodes | None = None  # the heat state is not on a grid

    def __init__(
        self,
        equation: HeatEquation,
        settings: Settings,
        others: Sequence[HeatEquation] = (),
    ) -> None:
        """Ice without points, in one heat balance with the `others`. Collective."""
        self.equation: HeatEquation = equation
        self._surface = HeatedSurface(equation, "surface")
        self._bodies = Bodies([equation, *others])
        self._settings = settings
        self._balance = Balance(self._bodies, settings.temperature, settings.agreement)
        self._recent = Recent(self._meeting, equation.comm)

    @property
    def n_dofs(self) -> int:
        """Temperature unknowns on all ranks."""
        return self.equation.n_dofs

    def place(self, points: Array) -> Placement:
        """Placement of points (n, d-1), m, among the surface's unknowns. Collective."""
        reading = self._surface.read(points)
        return Placement(reading.number.astype(np.int32), reading.weight)

    def initial(self, n_points: int) -> Array:
        """Ice at its initial temperature, for any number of points."""
        return self._bodies.initial()

    def under(self, contacts: Contacts) -> MeshedIce:
        """The thermal response of this ice below `contacts`. Collective."""
        below = copy(self)
        contact = AboveIce(contacts.area, self._settings.solid, self._settings.interface_resistance)
        meeting = self._recent.of(contacts.at).among(contacts.points)
        below._balance = self._balance.under(meeting, contact)
        return below

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature at the points (K), shape (n,). Collective."""
        return self._balance.temperature(heat_state)

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """One implicit stage of ice and films together. Collective. Raises NotConverged."""
        return self._balance.stage(start, float(dt), film)

    @property
    def places(self) -> Array:
        """Positions of this rank's unknowns, (n_own, d), m."""
        return self.equation.x

    def rises(self, heat_state: Array) -> Rises:
        """Rise at the nodes of the ice. Collective."""
        return Rises(self.equation.nodal(heat_state))

    def heat(self, heat_state: Array) -> float:
        """Heat above the initial temperature, J (J/m in a slice). Collective."""
        return self.equation.heat(heat_state)

    def unknowns(self, at: Placement) -> Reading:
        """Interpolation from the ice's unknowns to points placed `at`."""
        return Reading(at.node.astype(np.int64), at.weight)

    def _meeting(self, at: Placement) -> Meeting:
        """Thermal contact of films and bodies at points placed `at`. Collective."""
        meeting = self._met(self.unknowns(at))
        # PETSc frees objects that Python has deleted only in a collective call.
        PETSc.garbage_cleanup(self._bodies.conduction.getComm())
        return meeting

    def _met(self, below: Reading) -> Meeting:
        """Thermal contact of films and ice with the interpolation `below`. Collective."""
        return self._balance.meeting(Readings(self._bodies.reading(below)))

    def profile(self, heat_state: Array) -> Profile | None:
        """None: the mesh has the temperatures."""
        return None

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """Checkpoint arrays at this rank's unknowns."""
        return {"rise": heat_state}

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state from `saved` arrays."""
        return saved["rise"]
