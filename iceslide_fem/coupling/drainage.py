"""Drainage: where water goes that flows out from below the lugs, or that edges wipe off.

Half of the outflow along x goes to either side, into a sipe if it has room. Water wiped off by a
leading edge goes into the sipe in front of it. The rest is pushed out. A full sipe lets water pass,
so the lugs on its two sides act as one (`scene.lugs`).
"""

from __future__ import annotations

from operator import attrgetter
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.coupling.state import CoupledState
from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.carrying import LUG
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import ContactLoads, FilmFrame
from iceslide_fem.laws.carrying_film import CarryingFilm
from iceslide_fem.rubber.block import Block
from iceslide_fem.rubber.contact_surface import ContactSurface, area_vectors
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.lugs import Lugs, open_sipes

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


class Sipes:
    """Water flows into the sipes of `block` and out at its edges."""

    def __init__(self, block: Block, frame: FilmFrame, lugs: Lugs) -> None:
        surface = block.surface
        undeformed = surface.positions(np.zeros_like(block.rubber.displacements))
        self._block, self._frame, self._lugs = block, frame, lugs
        self._lug = lugs.at(undeformed[..., 0].ravel())
        self._volumes = lugs.volumes * block.scene.rubber.width / block.scale

    def begun(self, interface: InterfaceState, loads: ContactLoads) -> Drained:
        """The state with empty sipes."""
        stored = np.zeros_like(self._volumes)
        parts = self._frame.parts(loads, self._lug, len(self._lugs.ends))
        return Drained(self._below_lugs(interface, stored, parts), stored)

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
        openness = self._openness(stored)
        caught = self._lugs.into_sipes(by_lug[0], openness) + openness * by_lug[1, :-1]
        after = np.minimum(stored + caught, self._capacity())
        pushed_out = flowed_out + wiped_off - float((after - stored).sum())
        interface = self._below_lugs(end.interface, after, parts)
        return Drained(interface, after, flowed_out, covered, pushed_out)

    def _lying(self, state: CoupledState) -> Array:
        """Water in each film, (n,), m3 (m2 in a slice)."""
        return state.interface.squeezed_height * sum(self._frame.water_areas(state.loads))

    def _openness(self, stored: Array) -> Array:
        room = self._capacity()
        return open_sipes(np.divide(stored, room, out=np.ones_like(room), where=room > 0.0))

    def _below_lugs(self, interface: InterfaceState, stored: Array, parts: Array) -> InterfaceState:
        """The interface after each film is assigned the lug above it, if there is one."""
        lengths = self._lugs.outflow_lengths(self._openness(stored))
        internal = interface.internal.copy()
        internal[LUG] = np.where(parts.any(axis=0), lengths @ parts, internal[LUG])
        return interface._replace(internal=internal)

    def _capacity(self) -> Array:
        """Volume of each sipe between its present walls, (sipes,), m3 (m2 in a slice).
        Collective.
        """
        walls = self._block.rubber.self_contact
        if walls is None or not np.isfinite(self._volumes).any():
            return self._volumes
        held = self._between(walls.own_facets)
        self._block.surface.comm.Allreduce(MPI.IN_PLACE, held, op=MPI.SUM)
        return np.maximum(held, 0.0)

    def _between(self, walls: ContactSurface) -> Array:
        """This rank's part of the volumes between ice and deformed sipe walls, (sipes,).

        By Gauss's theorem the volume is minus the integral of x n_x over the walls. Mouth and end
        of a sipe are level and add nothing.
        """
        u = self._block.rubber.displacements
        normals = area_vectors(walls.tangents(u))[..., 0] * walls.weights
        volumes = -walls.positions(u)[..., 0] * normals
        places, held = walls.positions(np.zeros_like(u)), np.zeros_like(self._volumes)
        for i, sipe in enumerate(self._block.scene.rubber.cuts):
            middle = sipe.position + np.tan(sipe.angle) * places[..., -1]
            beside = np.abs(places[..., 0] - middle) - 0.5 * sipe.width
            held[i] = volumes[beside <= sipe.amplitude + NEAR].sum()
        return held


def drainage_of(block: Block, frame: FilmFrame) -> Drainage:
    """The drainage of `block` under its friction law."""
    if isinstance(block.law, CarryingFilm):
        return Sipes(block, frame, block.law.lugs)
    return Undrained(block)
