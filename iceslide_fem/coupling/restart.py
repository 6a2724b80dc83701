"""The state of a run as arrays that do not depend on the partition (`layouts`), and its restart."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.coupling.layouts import Arrays, GridLayout, Layout, PointLayout, UnknownLayout
from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import CheckpointState
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.film_frame import FilmFrame, Ice
from iceslide_fem.interface.surface_grid import OwnNodes
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.self_contact_friction import StickPoints
from iceslide_fem.mechanics.time_discretisation import Motion
from iceslide_fem.mechanics.viscoelasticity import Relaxed
from iceslide_fem.runtime.arrays import Array

MOVES = ("displacements", "velocity", "acceleration")  # fields of Motion, at the nodes
AHEAD = "ahead_"  # prefix of the tables of the ice that enters


class Layouts(NamedTuple):
    """Layouts of nodes, contact points, films, internal variables, and heat of ice and rubber.

    Heat of the rubber is at its contact points, also if films are on the ice. `walls` are the
    points of self-contact. Internal variables are at quadrature points of the cells.
    """

    nodes: Layout
    points: Layout
    films: Layout
    internal: Layout
    ice: Layout
    rubber: Layout
    self_contact: Layout
    relaxed: Layout


def node_layout(block: Block) -> PointLayout:
    """The rubber's nodes, identified by their undeformed positions."""
    space, dim = block.rubber.space, block.rubber.mesh.geometry.dim
    coordinates = space.tabulate_dof_coordinates()[:, :dim]
    return PointLayout(coordinates, space.dofmap.index_map.size_local, block.surface.comm)


def layouts_of(block: Block, frame: FilmFrame) -> Layouts:
    """Layouts of the whole state of a sliding block."""
    comm, surface = block.surface.comm, block.surface
    undeformed = surface.positions(np.zeros_like(block.rubber.displacements))
    undeformed = undeformed.reshape(surface.n_points, undeformed.shape[-1])
    points = PointLayout(undeformed, surface.n_points, comm)

    self_contact = block.rubber.self_contact
    at_walls = np.zeros((0, undeformed.shape[-1])) if self_contact is None else self_contact.points

    relaxes = block.rubber.viscoelasticity
    in_cells = np.zeros((0, undeformed.shape[-1])) if relaxes is None else relaxes.places

    def layout(nodes: OwnNodes | None) -> Layout:
        return points if nodes is None else GridLayout(nodes)

    return Layouts(
        node_layout(block),
        points,
        layout(frame.nodes),
        layout(frame.internal_nodes),
        _of_ice(frame.ice, layout, comm),
        points,
        PointLayout(at_walls, len(at_walls), comm),
        PointLayout(in_cells, len(in_cells), comm),
    )


def _of_ice(ice: Ice, layout: Callable[[OwnNodes | None], Layout], comm: MPI.Comm) -> Layout:
    if ice.places is None:
        return layout(ice.nodes)
    return UnknownLayout(ice.places, len(ice.places), comm)


def checkpoint_tables(sliding: Sliding) -> dict[str, Any]:
    """The checkpoint: this rank's part of all that later steps depend on. Collective."""
    block, frame, now = sliding.block, sliding.frame, sliding.checkpoint_state()
    layouts, dim = layouts_of(block, frame), block.rubber.mesh.geometry.dim
    state, motion = now.interface, now.motion._asdict()
    nodes = {"start": now.start} | {name: motion[name] for name in MOVES}
    return {
        "time": now.time,
        "pass": sliding.number,
        "step": now.dt,
        "film_step": now.film_dt,
        "solved": now.motion[:4],
        "offset": now.offset,
        "steady": now.quiescent,
        "stuck": now.stuck,
        "way": now.sliding_distance,
        "strongest": now.largest_friction_force,
        "layers_for": sliding.layers_for,
        "stored": now.stored.tolist(),
        "nodes": layouts.nodes.kept({k: v.reshape(-1, dim).T for k, v in nodes.items()}),
        "points": layouts.points.kept(
            {"speed": now.speed, "shear": now.shear}
            | ({"age": state.age} if len(state.age) else {})
        ),
        **_saved_ice(layouts, frame, state, ""),
        **({} if now.ahead is None else _saved_ice(layouts, frame, now.ahead, AHEAD)),
        "rubber": layouts.rubber.kept(frame.rubber.saved(state.rubber)),
        "walls": layouts.self_contact.kept(_saved_stick_points(block, now.stick_points)),
        "relaxed_for": 0.0 if now.relaxed is None else now.relaxed.span,
        "relaxed": layouts.relaxed.kept(_saved_relaxed(now.relaxed)),
    }


def resumed(
    block: Block, state: Mapping[str, Any], others: Sequence[Callable[[str], Arrays]] = ()
) -> Sliding:
    """The run restored from the tables of `checkpoint_tables`, on any number of ranks.

    Collective. state: tables that one rank saved; others: tables of arrays by name, for each other
    rank that saved. The scene's duration may be longer than in the earlier run. Raises SceneError
    if the state does not fit the meshes. Manipulated tables may raise any other error.
    """

    def kept(name: str) -> Iterator[Arrays]:
        yield state[name]
        for other in others:
            yield other(name)

    nodes = {name: v.T.ravel() for name, v in node_layout(block).own(kept("nodes")).items()}
    block.rubber.u.x.array[:] = nodes["start"]  # the ice mesh was built there
    sliding = Sliding(block, layers_for=state["layers_for"])
    sliding.number = state.get("pass", 1)
    frame = sliding.frame
    layouts = layouts_of(block, frame)
    points = layouts.points.own(kept("points"))
    interface = _restored_ice(layouts, frame, kept, "")
    stick_points = None
    if block.rubber.self_contact is not None and block.stick_points is not None:
        stick_points = block.rubber.self_contact.restored(layouts.self_contact.own(kept("walls")))
    relaxed = layouts.relaxed.own(kept("relaxed")) if "relaxed" in state else {}
    sliding.restore(
        CheckpointState(
            time=state["time"],
            dt=state["step"],
            film_dt=state["film_step"],
            start=nodes["start"],
            motion=Motion(*state["solved"], *(nodes[name] for name in MOVES)),
            speed=points["speed"],
            shear=points["shear"],
            offset=state["offset"],
            interface=interface._replace(
                rubber=frame.rubber.restored(layouts.rubber.own(kept("rubber"))),
                age=points.get("age", np.zeros((0, points["speed"].size))),
            ),
            quiescent=state["steady"],
            sliding_distance=state["way"],
            largest_friction_force=state["strongest"],
            stick_points=stick_points,
            stuck=state.get("stuck", False),
            stored=np.array(state.get("stored", ()), dtype=float),
            relaxed=_restored_relaxed(
                block, state.get("relaxed_for", 0.0), nodes["displacements"], relaxed
            ),
            ahead=_restored_ice(layouts, frame, kept, AHEAD) if f"{AHEAD}ice" in state else None,
        )
    )
    return sliding


def _saved_ice(
    layouts: Layouts, frame: FilmFrame, state: InterfaceState, prefix: str
) -> dict[str, Any]:
    """Tables of the films and the ice of a `state`, their names with a `prefix`. Collective."""
    films = {"log_height": state.log_height, "squeezed_height": state.squeezed_height}
    internal = {"memory": state.internal} if len(state.internal) else {}
    return {
        f"{prefix}films": layouts.films.kept(films),
        f"{prefix}memory": layouts.internal.kept(internal),
        f"{prefix}ice": layouts.ice.kept(frame.ice.saved(state.ice)),
    }


def _restored_ice(
    layouts: Layouts, frame: FilmFrame, kept: Callable[[str], Iterator[Arrays]], prefix: str
) -> InterfaceState:
    """Films and ice of the tables of `_saved_ice`. Collective."""
    films = layouts.films.own(kept(f"{prefix}films"))
    internal = layouts.internal.own(kept(f"{prefix}memory"))
    return InterfaceState(
        films["log_height"],
        films["squeezed_height"],
        frame.ice.restored(layouts.ice.own(kept(f"{prefix}ice"))),
        internal=internal["memory"] if internal else np.zeros((0, films["log_height"].size)),
    )


def _saved_relaxed(relaxed: Relaxed | None) -> Arrays:
    """Internal variables (..., n) at the quadrature points."""
    if relaxed is None:
        return {}
    parts = {"relaxed": relaxed.relaxed, "rate": relaxed.rate}
    return {name: _behind(part) for name, part in parts.items()}


def _behind(values: Array) -> Array:
    """Values (..., c, q, 6) as (..., 6, n)."""
    by_component = np.moveaxis(values, -1, -3)
    return by_component.reshape(*by_component.shape[:-2], -1)


def _restored_relaxed(
    block: Block, span: float, displacements: Array, saved: Arrays
) -> Relaxed | None:
    """Internal variables from the `saved` arrays, at `displacements` of all dofs. Collective."""
    rubber = block.rubber.viscoelasticity
    if rubber is None:
        return None
    block.rubber.u.x.array[:] = displacements
    shape = rubber.volume.shape

    def at_points(values: Array) -> Array:
        by_component = values.reshape(*values.shape[:-1], *shape)
        return np.moveaxis(by_component, -3, -1)

    return rubber.restored(at_points(saved["relaxed"]), at_points(saved["rate"]), span)


def _saved_stick_points(block: Block, stick_points: StickPoints | None) -> Arrays:
    self_contact = block.rubber.self_contact
    return {} if self_contact is None or stick_points is None else self_contact.saved(stick_points)
