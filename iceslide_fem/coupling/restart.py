"""What a slide remembers, gathered into arrays that know nothing of ranks, and given back.

A layout gathers values (..., n) of this rank's points into (..., N) on rank 0 (nothing elsewhere),
and picks this rank's own from such arrays, on any number of ranks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.arrays import Array
from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import Memory
from iceslide_fem.errors import SceneError
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.carriers import Carrier, Ice
from iceslide_fem.interface.surface_grid import OwnNodes
from iceslide_fem.rubber.block import Block
from iceslide_fem.rubber.time_discretisation import Motion
from iceslide_fem.rubber.wall_friction import Grip

Arrays = dict[str, Array]
MOVES = ("displacements", "velocity", "acceleration")  # of a Motion, at the nodes
# Points are the same if they are this near, relative to the extent of all.
SAME_PLACE = 1e-7


class Layout(Protocol):
    """How the values of one kind are laid out over the ranks."""

    def gather(self, values: Mapping[str, Array]) -> Arrays:
        """Arrays (..., N) on rank 0 of this rank's values (..., n). Collective."""

    def own(self, gathered: Mapping[str, Array]) -> Arrays:
        """This rank's values (..., n) of what `gather` gave on rank 0."""


class PointLayout:
    """Points known by where they lie: x (n, d), m, of which this rank owns the first `n_owned`.

    Partitions number points in their own ways, and coordinates do not depend on them.
    """

    def __init__(self, x: Array, n_owned: int, comm: MPI.Comm) -> None:
        self._x, self._n_owned, self._comm = x, n_owned, comm

    def gather(self, values: Mapping[str, Array]) -> Arrays:
        """Values of all ranks' own points one after the other, and their `x`. Collective."""
        mine = {name: value[..., : self._n_owned] for name, value in values.items()}
        mine["x"] = self._x[: self._n_owned].T
        parts = self._comm.gather(mine, root=0)
        if parts is None:
            return {}
        return {name: np.concatenate([part[name] for part in parts], axis=-1) for name in mine}

    def own(self, gathered: Mapping[str, Array]) -> Arrays:
        """This rank's values, ghosts included. Raises SceneError where points are not found.

        Collective: all ranks raise it.
        """
        saved = gathered["x"].T
        size = float(np.ptp(saved, axis=0).max())
        distance, place = cKDTree(saved).query(self._x) if len(self._x) else (np.zeros(0), [])
        found = distance.max(initial=0.0) <= SAME_PLACE * size
        once = len(np.unique(place)) == len(self._x)
        if not self._comm.allreduce(found and once, op=MPI.LAND):
            raise SceneError("the checkpoint does not fit the mesh of this run")
        return {name: values[..., place] for name, values in gathered.items() if name != "x"}


class UnknownLayout(PointLayout):
    """Unknowns of ice on a mesh by where they lie: what a shorter run did not have is nothing yet.

    So much is that of the ice at first, which the content counts from.
    """

    def own(self, gathered: Mapping[str, Array]) -> Arrays:
        """This rank's values. Raises SceneError where the mesh is another one. Collective."""
        saved = gathered["x"].T
        size = float(np.ptp(saved, axis=0).max())
        distance, place = cKDTree(saved).query(self._x) if len(self._x) else (np.zeros(0), [])
        there = np.asarray(distance) <= SAME_PLACE * size
        count = self._comm.allreduce(int(there.sum()), op=MPI.SUM)
        if count != len(saved):
            raise SceneError("the checkpoint does not fit the ice of this run")
        return {
            name: np.where(there, values[..., place], 0.0)
            for name, values in gathered.items()
            if name != "x"
        }


class GridLayout:
    """This rank's `nodes` of a grid that every rank knows."""

    def __init__(self, nodes: OwnNodes, comm: MPI.Comm) -> None:
        self._nodes, self._comm = nodes, comm

    def gather(self, values: Mapping[str, Array]) -> Arrays:
        """Values at all nodes, in the grid's order. Collective."""
        gathered: Arrays = {}
        for name, value in values.items():
            full = np.zeros((*value.shape[:-1], self._nodes.total))
            full[..., self._nodes.numbers] = value
            total = self._comm.reduce(full, op=MPI.SUM, root=0)
            if total is not None:
                gathered[name] = total
        return gathered

    def own(self, gathered: Mapping[str, Array]) -> Arrays:
        """Values at this rank's nodes. Raises SceneError if the grid is another one."""
        if any(values.shape[-1] != self._nodes.total for values in gathered.values()):
            raise SceneError("the checkpoint does not fit the ice of this run")
        return {name: values[..., self._nodes.numbers] for name, values in gathered.items()}


class Layouts(NamedTuple):
    """The rubber's nodes and contact points, films, memory, and the content of ice and rubber.

    Rubber conducts heat above its contact points, wherever the films live; walls are its walls'
    own points.
    """

    nodes: Layout
    points: Layout
    films: Layout
    memory: Layout
    ice: Layout
    rubber: Layout
    walls: Layout


def node_layout(block: Block) -> PointLayout:
    """The rubber's nodes, by their undeformed positions."""
    space, dim = block.rubber.space, block.rubber.mesh.geometry.dim
    coordinates = space.tabulate_dof_coordinates()[:, :dim]
    return PointLayout(coordinates, space.dofmap.index_map.size_local, block.surface.comm)


def layouts_of(block: Block, carrier: Carrier) -> Layouts:
    """Layouts of everything that a sliding block remembers."""
    comm, surface = block.surface.comm, block.surface
    undeformed = surface.positions(np.zeros_like(block.rubber.displacements))
    undeformed = undeformed.reshape(surface.n_points, undeformed.shape[-1])
    points = PointLayout(undeformed, surface.n_points, comm)

    walls = block.rubber.walls
    at_walls = np.zeros((0, undeformed.shape[-1])) if walls is None else walls.points

    def layout(nodes: OwnNodes | None) -> Layout:
        return points if nodes is None else GridLayout(nodes, comm)

    return Layouts(
        node_layout(block),
        points,
        layout(carrier.nodes),
        layout(carrier.remembering),
        _of_ice(carrier.ice, layout, comm),
        points,
        PointLayout(at_walls, len(at_walls), comm),
    )


def _of_ice(ice: Ice, layout: Callable[[OwnNodes | None], Layout], comm: MPI.Comm) -> Layout:
    if ice.places is None:
        return layout(ice.nodes)
    return UnknownLayout(ice.places, len(ice.places), comm)


def gathered(sliding: Sliding) -> dict[str, Any]:
    """All that later steps depend on, of all ranks, in tables on rank 0. Collective."""
    block, carrier, memory = sliding.block, sliding.carrier, sliding.memory()
    layouts, dim = layouts_of(block, carrier), block.rubber.mesh.geometry.dim
    state, motion = memory.interface, memory.motion._asdict()
    nodes = {"start": memory.start} | {name: motion[name] for name in MOVES}
    films = {"log_height": state.log_height, "squeezed_height": state.squeezed_height}
    return {
        "time": memory.time,
        "step": memory.step,
        "film_step": memory.film_step,
        "solved": memory.motion[:4],
        "offset": memory.offset,
        "steady": memory.steady,
        "way": memory.way,
        "strongest": memory.strongest,
        "layers_for": sliding.layers_for,
        "nodes": layouts.nodes.gather({k: v.reshape(-1, dim).T for k, v in nodes.items()}),
        "points": layouts.points.gather({"speed": memory.speed, "shear": memory.shear}),
        "films": layouts.films.gather(films),
        "memory": layouts.memory.gather({"memory": state.memory} if len(state.memory) else {}),
        "ice": layouts.ice.gather(carrier.ice.saved(state.ice)),
        "rubber": layouts.rubber.gather(carrier.rubber.saved(state.rubber)),
        "walls": layouts.walls.gather(_saved_grip(block, memory.grip)),
    }


def resumed(block: Block, state: Mapping[str, Any]) -> Sliding:
    """The slide whose tables `gathered` gave, at its moment, on any number of ranks. Collective.

    The scene's duration may be a longer one. Raises SceneError if the state does not fit the
    meshes, and what forged tables lead to.
    """
    nodes = {name: v.T.ravel() for name, v in node_layout(block).own(state["nodes"]).items()}
    block.rubber.u.x.array[:] = nodes["start"]  # where the ice was meshed
    sliding = Sliding(block, layers_for=state["layers_for"])
    carrier = sliding.carrier
    layouts = layouts_of(block, carrier)
    points, films = layouts.points.own(state["points"]), layouts.films.own(state["films"])
    memory = layouts.memory.own(state.get("memory", {}))  # of a grid nothing is kept of nothing
    walls = layouts.walls.own(state["walls"]) if block.grip is not None else {}
    sliding.recall(
        Memory(
            time=state["time"],
            step=state["step"],
            film_step=state["film_step"],
            start=nodes["start"],
            motion=Motion(*state["solved"], *(nodes[name] for name in MOVES)),
            speed=points["speed"],
            shear=points["shear"],
            offset=state["offset"],
            interface=InterfaceState(
                films["log_height"],
                films["squeezed_height"],
                carrier.ice.restored(layouts.ice.own(state["ice"])),
                carrier.rubber.restored(layouts.rubber.own(state["rubber"])),
                memory["memory"] if memory else np.zeros((0, films["log_height"].size)),
            ),
            steady=state["steady"],
            way=state["way"],
            strongest=state["strongest"],
            grip=block.rubber.walls.restored(walls) if block.rubber.walls and walls else None,
        )
    )
    return sliding


def _saved_grip(block: Block, grip: Grip | None) -> Arrays:
    walls = block.rubber.walls
    return {} if walls is None or grip is None else walls.saved(grip)
