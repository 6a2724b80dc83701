"""How a block relaxes from step to step: before its equilibrium, and after it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.coupling.state import CoupledState
from iceslide_fem.fenics import compat
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import FilmFrame
from iceslide_fem.interface.rubber_mesh import MeshedIceAndRubber
from iceslide_fem.rubber.block import Block
from iceslide_fem.rubber.contact_surface import space_degree
from iceslide_fem.rubber.viscoelasticity import Relaxed, Viscoelasticity
from iceslide_fem.runtime.arrays import Array


class RelaxationStep(NamedTuple):
    """After a step: the rubber's internal variables, None of an elastic one; the interface, whose
    rubber the heat has warmed; the heat, J of the whole block; the error of the stress, Pa.
    """

    relaxed: Relaxed | None
    interface: InterfaceState
    dissipation: float = 0.0
    error: float = 0.0


class Relaxing(Protocol):
    """What a coupled step asks of the block's relaxation. All is collective.

    may_skip: whether a block whose loads hardly change stays as it is.
    """

    may_skip: bool

    def at_rest(self) -> Relaxed | None:
        """Internal variables of a block that has just been brought to its present displacements."""

    def begin_at_once(self) -> None:
        """Let the block's equilibrium be one that it is brought to in no time."""

    def begin(self, start: CoupledState, dt: float) -> None:
        """Let the block's equilibrium be that at the end of a step of `dt` (s) from `start`."""

    def end(self, start: CoupledState, dt: float, interface: InterfaceState) -> RelaxationStep:
        """The step as it ends at the block's present displacements, with this `interface`."""


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
        """Nothing happens."""
        return RelaxationStep(None, interface)


class Viscoelastic:
    """A `block` that relaxes. Its heat warms a mesh that conducts heat at the end of the step, and
    times go with the temperature at the start of the next one.
    """

    may_skip = False

    def __init__(self, block: Block, rubber: Viscoelasticity, frame: FilmFrame) -> None:
        self._rubber, self._ice, self._scale = rubber, frame.ice, block.scale
        self._ambient = block.scene.ice.temperature
        space = block.rubber.space
        element = compat.basix_lagrange(compat.cell_name(space.mesh), space_degree(space))
        self._shape = np.array(element.tabulate(0, rubber.points))[0, ..., 0]
        self._dofs = compat.cell_dofs(space)[: len(rubber.volume)]
        self._nodes = len(block.rubber.displacements)
        portions = (self._shape**2).sum(axis=0)  # of a cell's heat, for its nodes: all positive
        self._portions = portions / portions.sum()

    def at_rest(self) -> Relaxed:
        """Nothing has relaxed."""
        return self._rubber.at_rest()

    def begin_at_once(self) -> None:
        """With the instantaneous modulus."""
        self._rubber.begin_elastic()

    def begin(self, start: CoupledState, dt: float) -> None:
        """What has relaxed until `start` goes on."""
        assert start.relaxed is not None
        self._rubber.begin_step(start.relaxed, dt, self._temperature(start))

    def end(self, start: CoupledState, dt: float, interface: InterfaceState) -> RelaxationStep:
        """With what has relaxed by then."""
        assert start.relaxed is not None
        after, heat, error = self._rubber.end_step(start.relaxed, dt, self._temperature(start))
        if isinstance(self._ice, MeshedIceAndRubber):
            at_nodes, of_cells = np.zeros(self._nodes), (self._rubber.volume * heat).sum(axis=1)
            np.add.at(at_nodes, self._dofs, of_cells[:, None] * self._portions)
            interface = interface._replace(ice=self._ice.warmed(interface.ice, at_nodes))
        return RelaxationStep(after, interface, self._scale * self._rubber.total(heat), error)

    def _temperature(self, start: CoupledState) -> Array | float:
        """Of the rubber, K: everywhere, or at the points (c, q) of its mesh."""
        if not isinstance(self._ice, MeshedIceAndRubber):
            return self._ambient
        rise = self._ice.rubber_rise(start.interface.ice)
        return np.asarray(self._ambient + rise[self._dofs] @ self._shape.T)


def relaxing(block: Block, frame: FilmFrame) -> Relaxing:
    """How the `block` on this `frame` relaxes."""
    rubber = block.rubber.viscoelasticity
    return Elastic() if rubber is None else Viscoelastic(block, rubber, frame)
