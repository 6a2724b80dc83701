"""Drainage: where water goes that flows out from below the lugs, or that edges wipe off.

Half of the outflow along x goes to either side, into a sipe if it has room. Water wiped off by a
leading edge goes into the sipe in front of it. The rest is pushed out. A full sipe lets water pass,
so the lugs on its two sides act as one (`film.lugs`).
"""

from __future__ import annotations

from operator import attrgetter
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.coupling.state import CoupledState
from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.loads import LUG
from iceslide_fem.film.voids import Lugs, open_sipes
from iceslide_fem.interface.film_frame import ContactLoads, FilmFrame
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.contact_surface import ContactSurface, area_vectors
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.cuts import Sipe

NEAR = 1e-6  # m, tolerance between a wall and its position in the drawing


class Drained(NamedTuple):
    """The interface and the water after a step; volumes in m3 (m2 in a slice).

    interface: film and ice; stored: water in each sipe; flowed_out: outflow from below the lugs in
    the step; covered: water that newly covered area has met, negative where area shrank;
    pushed_out: water pushed out; lost: wiped water that is lost.
    """

    interface: InterfaceState
    stored: Array
    flowed_out: float = 0.0
    covered: float = 0.0
    pushed_out: float = 0.0
    lost: float = 0.0


class Drainage(Protocol):
    """The drainage of a block. All methods are collective."""

    def begun(self, interface: InterfaceState, loads: ContactLoads) -> Drained:
        """The drained state at the beginning of a pass."""

    def after(
        self, start: CoupledState, end: CoupledState, subcycles: Subcycles, wiped: Array
    ) -> Drained:
        """The drained state after a step from `start` to `end`.

        `end` still has the sipe water of `start`. The water wiped off each film is (n,), m3 (m2 in
        a slice).
        """


class Undrained:
    """Water does not flow out of the voids."""

    def __init__(self, block: Block) -> None:
        self._comm = block.surface.comm

    def begun(self, interface: InterfaceState, loads: ContactLoads) -> Drained:
        """The interface as it is."""
        return Drained(interface, np.zeros(0))

    def after(
        self, start: CoupledState, end: CoupledState, subcycles: Subcycles, wiped: Array
    ) -> Drained:
        """All wiped water is lost."""
        lost = self._comm.allreduce(float(wiped.sum()), op=MPI.SUM)
        return Drained(end.interface, end.stored, lost=lost)


class _Walls:
    """Walls of the `sipes` on this rank's facets of a `surface`."""

    def __init__(self, surface: ContactSurface, sipes: tuple[Sipe, ...], at_rest: Array) -> None:
        x, height = np.moveaxis(surface.positions(at_rest), -1, 0)[[0, -1]]
        self._surface = surface
        self._of_sipe = [
            np.abs(x - sipe.position - np.tan(sipe.angle) * height)
            <= 0.5 * sipe.width + sipe.amplitude + NEAR
            for sipe in sipes
        ]

    def volumes(self, u: Array) -> Array:
        """This rank's part of the volumes between ice and walls displaced by `u`, (sipes,).

        By Gauss's theorem the volume is minus the integral of x n_x over the walls. Mouth and end
        of a sipe are level and add nothing.
        """
        surface = self._surface
        normals = area_vectors(surface.tangents(u))[..., 0] * surface.weights
        volumes = -surface.positions(u)[..., 0] * normals
        return np.array([volumes[mask].sum() for mask in self._of_sipe])


class Sipes:
    """Water flows into the sipes of `block` and out at its edges."""

    def __init__(self, block: Block, frame: FilmFrame, lugs: Lugs) -> None:
        at_rest, walls = np.zeros_like(block.rubber.displacements), block.rubber.self_contact
        self._block, self._frame, self._lugs = block, frame, lugs
        self._lug = lugs.at(block.surface.positions(at_rest)[..., 0].ravel())
        self._volumes = lugs.volumes * block.scene.rubber.width / block.scale
        self._walls = None
        if walls is not None and np.isfinite(self._volumes).any():
            self._walls = _Walls(walls.own_facets, block.scene.rubber.cuts, at_rest)

    def begun(self, interface: InterfaceState, loads: ContactLoads) -> Drained:
        """The state with empty sipes."""
        stored = np.zeros_like(self._volumes)
        parts = self._frame.parts(loads, self._lug, len(self._lugs.ends))
        openness = _openness(stored, self._capacity())
        return Drained(self._below_lugs(interface, openness, parts), stored)

    def after(
        self, start: CoupledState, end: CoupledState, subcycles: Subcycles, wiped: Array
    ) -> Drained:
        """The state after the sipes have taken all water that they have room for."""
        parts = self._frame.parts(end.loads, self._lug, len(self._lugs.ends))
        substeps = subcycles.substeps
        out, gained = (
            sum((one.of_all(one.area * values(one.step)) for one in substeps), np.zeros(1))
            for values in (attrgetter("flowed_out"), attrgetter("squeezed"))
        )
        came = self._lying(end) - self._lying(start) - gained + wiped
        gone = np.stack([out, wiped])
        by_lug, whole = gone @ parts.T, np.append(gone.sum(axis=1), came.sum())
        comm, stored = self._block.surface.comm, start.stored
        for amounts in (by_lug, whole):
            comm.Allreduce(MPI.IN_PLACE, amounts, op=MPI.SUM)
        flowed_out, wiped_off, covered = map(float, whole)
        room = self._capacity()
        openness = _openness(stored, room)
        caught = self._lugs.into_sipes(by_lug[0], openness) + openness * by_lug[1, :-1]
        after = np.minimum(stored + caught, room)
        pushed_out = flowed_out + wiped_off - float((after - stored).sum())
        interface = self._below_lugs(end.interface, _openness(after, room), parts)
        return Drained(interface, after, flowed_out, covered, pushed_out)

    def _lying(self, state: CoupledState) -> Array:
        """Water in each film, (n,), m3 (m2 in a slice)."""
        return state.interface.squeezed_height * sum(self._frame.water_areas(state.loads))

    def _below_lugs(
        self, interface: InterfaceState, openness: Array, parts: Array
    ) -> InterfaceState:
        """The interface after each film is assigned the lug above it, if there is one."""
        lengths = self._lugs.outflow_lengths(openness)
        internal = interface.internal.copy()
        internal[LUG] = np.where(parts.any(axis=0), lengths @ parts, internal[LUG])
        return interface._replace(internal=internal)

    def _capacity(self) -> Array:
        """Volume of each sipe between its present walls, (sipes,), m3 (m2 in a slice).
        Collective.
        """
        if self._walls is None:
            return self._volumes
        held = self._walls.volumes(self._block.rubber.displacements)
        self._block.surface.comm.Allreduce(MPI.IN_PLACE, held, op=MPI.SUM)
        return np.maximum(held, 0.0)


def _openness(stored: Array, room: Array) -> Array:
    return open_sipes(np.divide(stored, room, out=np.ones_like(room), where=room > 0.0))


def drainage_of(block: Block, frame: FilmFrame) -> Drainage:
    """The drainage of `block` under its friction law."""
    wet = block.law.wet
    return Undrained(block) if wet is None else Sipes(block, frame, wet.lugs)
