"""Viscoelastic relaxation of a block over a step: before its equilibrium, and after it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.coupling.state import CoupledState
from iceslide_fem.fenics import compat
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import FilmFrame
from iceslide_fem.interface.rubber_mesh import MeshedIceAndRubber
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.contact_surface import space_degree
from iceslide_fem.mechanics.viscoelasticity import Relaxed, Viscoelasticity
from iceslide_fem.runtime.arrays import Array


class RelaxationStep(NamedTuple):
    """Result of relaxation over a step.

    relaxed: internal variables, None for elastic rubber; interface: film and ice, with the rubber
    warmed by the dissipation; dissipation: heat of the whole block, J; error: of the stress, Pa.
    """

    relaxed: Relaxed | None
    interface: InterfaceState
    dissipation: float = 0.0
    error: float = 0.0


class Relaxing(Protocol):
    """Relaxation of a block, as a coupled step uses it. All methods are collective.

    may_skip: whether equilibrium may be skipped while the loads hardly change.
    """

    may_skip: bool

    def at_rest(self) -> Relaxed | None:
        """Internal variables of a block deformed instantaneously to its present state."""

    def begin_at_once(self) -> None:
        """Prepare equilibrium under instantaneous deformation."""

    def begin(self, start: CoupledState, dt: float) -> None:
        """Prepare equilibrium at the end of a step of `dt` (s) from `start`."""

    def end(self, start: CoupledState, dt: float, interface: InterfaceState) -> RelaxationStep:
        """The result at the block's present displacements, with `interface` at the end."""


class Elastic:
    """A block that does not relax."""

    may_skip = True

    def at_rest(self) -> None:
        """None."""

    def begin_at_once(self) -> None:
        """Nothing."""

    def begin(self, start: CoupledState, dt: float) -> None:
        """Nothing."""

    def end(self, start: CoupledState, dt: float, interface: InterfaceState) -> RelaxationStep:
        """The `interface` unchanged, and no heat."""
        return RelaxationStep(None, interface)


class Viscoelastic:
    """A viscoelastic `block`.

    Its dissipation warms the heat-conducting rubber mesh, if there is one, at the end of the step.
    Relaxation times follow the temperature at the start of a step.
    """

    may_skip = False

    def __init__(self, block: Block, rubber: Viscoelasticity, frame: FilmFrame) -> None:
        self._rubber, self._ice, self._scale = rubber, frame.ice, block.scale
        self._uniform, self._first = block.scene.rubber_temperature, block.scene.ice.temperature
        space = block.rubber.space
        element = compat.basix_lagrange(compat.cell_name(space.mesh), space_degree(space))
        self._shape = np.array(element.tabulate(0, rubber.points))[0, ..., 0]
        self._dofs = compat.cell_dofs(space)[: len(rubber.volume)]
        self._nodes = len(block.rubber.displacements)
        portions = (self._shape**2).sum(axis=0)  # of a cell's heat to its nodes, all positive
        self._portions = portions / portions.sum()

    def at_rest(self) -> Relaxed:
        """Internal variables before any relaxation."""
        return self._rubber.at_rest()

    def begin_at_once(self) -> None:
        """Set the instantaneous modulus."""
        self._rubber.begin_elastic()

    def begin(self, start: CoupledState, dt: float) -> None:
        """Continue from the internal variables of `start`."""
        assert start.relaxed is not None
        self._rubber.begin_step(start.relaxed, dt, self._temperature(start))

    def end(self, start: CoupledState, dt: float, interface: InterfaceState) -> RelaxationStep:
        """Internal variables, dissipation and error at the end of the step."""
        assert start.relaxed is not None
        after, heat, error = self._rubber.end_step(start.relaxed, dt, self._temperature(start))
        if isinstance(self._ice, MeshedIceAndRubber):
            at_nodes, of_cells = np.zeros(self._nodes), (self._rubber.volume * heat).sum(axis=1)
            np.add.at(at_nodes, self._dofs, of_cells[:, None] * self._portions)
            interface = interface._replace(ice=self._ice.warmed(interface.ice, at_nodes))
        return RelaxationStep(after, interface, self._scale * self._rubber.total(heat), error)

    def _temperature(self, start: CoupledState) -> Array | float:
        """Temperature of the rubber, K: uniform, or at the quadrature points (c, q)."""
        if not isinstance(self._ice, MeshedIceAndRubber):
            return self._uniform
        rise = self._ice.rubber_rise(start.interface.ice)
        return np.asarray(self._first + rise[self._dofs] @ self._shape.T)


def relaxing(block: Block, frame: FilmFrame) -> Relaxing:
    """The relaxation law of `block` on this `frame`."""
    rubber = block.rubber.viscoelasticity
    return Elastic() if rubber is None else Viscoelastic(block, rubber, frame)
