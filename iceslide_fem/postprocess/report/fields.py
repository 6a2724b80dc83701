"""The fields of a run over time, as the page draws them: block, contact, ice.

Read with meshio and thinned: a page is sent around, and written after every run. No VTK: it cannot
live in one process with DOLFINx, whose run has just ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.postprocess.report.page import Fields, Text, colours, plain
from iceslide_fem.postprocess.results import Run, field_files, field_parts
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import BAR, ZERO_CELSIUS

MOMENTS = 13  # at most
CELLS = 6000  # of a drawing at most
PLACES = 10  # of coordinates in m, to which points are the same
ROBUST = 98.0  # percentile at which colours end: pressures are singular at an edge
PRESSURE, MISES = "contact pressure (Pa)", "von Mises stress (Pa)"
MM, MS, UM = 1e3, 1e3, 1e6
CORNERS = {"triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8}
FACES: dict[str, list[tuple[int, ...]]] = {
    "tetra": [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)],
    "hexahedron": [
        (0, 3, 2, 1),
        (4, 5, 6, 7),
        (0, 1, 5, 4),
        (1, 2, 6, 5),
        (2, 3, 7, 6),
        (3, 0, 4, 7),
    ],
}
NOTHING = "no contact"


class Contact(NamedTuple):
    """A quantity of the interface: cell data, title, unit, factor, colours."""

    name: str
    title: str
    unit: str
    factor: float
    colours: str


CONTACTS = (
    Contact(PRESSURE, "Contact pressure", "bar", 1.0 / BAR, "viridis"),
    Contact("film height (m)", "Height of the water film", "nm", 1e9, "YlGnBu"),
    Contact("surface temperature (degC)", "Temperature of the ice's surface", "°C", 1.0, "inferno"),
)


class Grid(NamedTuple):
    """A mesh of one kind of cells, by their corners; values at points and cells."""

    points: Array
    kind: str
    cells: NDArray[np.int64]
    at_points: dict[str, Array]
    at_cells: dict[str, Array]


def fields_of(run: Run) -> list[Text | Fields]:
    """Rubber, interface and ice at some of the times at which the run wrote them, if it did."""
    try:
        written = field_files(run.directory, "interface")
        rubber = field_files(run.directory, "rubber")
        if not written or not rubber:
            return []
        times = np.array([time for time, _ in written[: len(rubber)]])
        chosen = _moments(times, float(run.summary["mu_peak_time_s"]))
        drawings = _drawings(run, chosen)
    except (SceneError, LookupError, OSError, TypeError, ValueError) as error:
        return [Text(f"The fields are there but could not be read ({error}).", "warning")]
    said = [
        f"t = {MS * times[number]:.3g} ms, mu = {run.at('mu', times[number]):.4g}"
        for number in chosen
    ]
    left = times.size - len(chosen)
    about = Text(
        f"{len(chosen)} of the {times.size} moments that the run wrote"
        f"{'; the others are in its folder' if left else ''}. Colours end where "
        f"{100.0 - ROBUST:g} % of the values of all moments lie beyond."
    )
    if not drawings:
        return [Text(f"More than {CELLS} cells are not drawn here: iceslide view does that.")]
    return [about, Fields([MS * times[number] for number in chosen], said, drawings)]


def _moments(times: Array, peak: float) -> list[int]:
    """Numbers of at most `MOMENTS` times, first and last and the one nearest `peak` (s) too."""
    some = np.linspace(0, times.size - 1, min(MOMENTS, times.size)).round().astype(int)
    nearest = int(np.abs(times - peak).argmin())
    inner = some[1:-1]
    if nearest not in some and inner.size:
        some[1 + int(np.abs(inner - nearest).argmin())] = nearest
    return sorted({int(number) for number in some})


def _drawings(run: Run, chosen: Sequence[int]) -> list[dict[str, Any]]:
    def read(name: str) -> list[Grid]:
        files = field_parts(run.directory, name)
        return [_read_parts(files[number][1]) for number in chosen if number < len(files)]

    rubber, interface, ice = read("rubber"), read("interface"), read("ice")
    flat = run.scene["model"] == "slice"
    coldest = run.scene["ice"]["temperature"] - ZERO_CELSIUS
    drawings: list[dict[str, Any]] = []
    if flat:
        if len(rubber[0].cells) <= CELLS:
            drawings.append(_slice(rubber))
        drawings += [_along(interface, quantity) for quantity in CONTACTS]
    else:
        half = bool(rubber[0].points[:, 1].min() > -1e-9)
        if len(rubber[0].cells) <= CELLS:
            drawings.append(_block(rubber, interface, half))
        if max(len(grid.cells) for grid in interface) <= CELLS:
            drawings += [_below(interface, quantity, half, coldest) for quantity in CONTACTS]
    if len(ice) == len(chosen):
        drawing = _ice(ice, flat, coldest)
        if drawing:
            drawings.append(drawing)
    return drawings


def _read_parts(paths: Sequence[Path]) -> Grid:
    """One grid of all parts, which are of one kind: points on the border of two are one."""
    parts = [_read(path) for path in paths]
    first, *_ = parts
    if len(parts) == 1:
        return first
    points = np.concatenate([part.points for part in parts])
    _, kept, number = np.unique(
        points.round(PLACES), axis=0, return_index=True, return_inverse=True
    )
    before = np.cumsum([0, *(len(part.points) for part in parts)])[:-1]
    cells = np.concatenate([part.cells + start for part, start in zip(parts, before, strict=True)])
    at_points, at_cells = (
        {name: np.concatenate([one[name] for one in values]) for name in values[0]}
        for values in ([part.at_points for part in parts], [part.at_cells for part in parts])
    )
    once = {name: values[kept] for name, values in at_points.items()}
    return Grid(points[kept], first.kind, number.reshape(-1)[cells], once, at_cells)


def _read(path: Path) -> Grid:
    import meshio

    mesh = meshio.read(path)
    block = mesh.cells[0]
    kind = next((name for name in CORNERS if block.type.startswith(name)), block.type)
    corners = block.data[:, : CORNERS.get(kind, block.data.shape[1])].astype(np.int64)
    at_cells = {name: np.asarray(values[0]) for name, values in mesh.cell_data.items()}
    used = np.zeros(len(mesh.points), dtype=bool)
    used[corners] = True
    cells = (np.cumsum(used) - 1)[corners]
    at_points = {name: np.asarray(values)[used] for name, values in mesh.point_data.items()}
    return Grid(mesh.points[used], kind, cells, at_points, at_cells)


def _touching(grid: Grid) -> Mask:
    return np.asarray(grid.at_cells[PRESSURE] > 0.0)


def _slice(grids: list[Grid]) -> dict[str, Any]:
    """The deformed cells of a slice, by their von Mises stress where it was written."""
    stressed = MISES in grids[0].at_points
    frames, stresses = [], []
    for grid in grids:
        points = MM * (grid.points + grid.at_points["displacement"])[:, :2]
        stress = (
            grid.at_points[MISES][grid.cells].mean(axis=1) / BAR
            if stressed
            else np.full(len(grid.cells), np.nan)
        )
        stresses.append(stress)
        frames.append({"points": plain(points), "values": plain(stress)})
    low, high = grids[0].points[:, :2].min(axis=0), grids[0].points[:, :2].max(axis=0)
    (x0, y0), (x1, y1) = MM * low, MM * high
    what = "by its von Mises stress" if stressed else "; its stress was not written"
    return {
        "kind": "cells",
        "name": "block",
        "title": "The block, deformed to scale",
        "says": f"The mesh of {len(grids[0].cells)} cells, {what}; dotted: undeformed. It "
        "slides to the right.",
        "x": "x (mm)",
        "y": "z (mm)",
        "unit": "bar",
        "nothing": "",
        "colours": colours("viridis"),
        "range": _range(stresses) if stressed else [0.0, 1.0],
        "equal": True,
        "edges": True,
        "cells": grids[0].cells.tolist(),
        "outlines": [{"x": plain([x0, x1, x1, x0, x0]), "y": plain([y0, y0, y1, y1, y0])}],
        "frames": frames,
    }


def _along(grids: list[Grid], quantity: Contact) -> dict[str, Any]:
    """A quantity along the contact line of a slice."""
    frames, xs, ys = [], [], []
    for grid in grids:
        x = MM * grid.points[grid.cells][..., 0].mean(axis=1)
        touching = _touching(grid)
        y = np.where(touching, quantity.factor * grid.at_cells[quantity.name], np.nan)
        order = np.argsort(x)
        curve = {"name": quantity.title, "x": plain(x[order]), "y": plain(y[order]), "look": 0}
        frames.append([curve | {"marks": False}])
        xs.append(x[touching])
        ys.append(y[touching])
    return {
        "kind": "lines",
        "name": f"along-{quantity.title.split()[0].lower()}",
        "title": quantity.title,
        "says": "Along the contact, facet by facet; nothing where there is none.",
        "x": "x (mm)",
        "y": quantity.unit,
        "xrange": _wider(_ends(xs)),
        "yrange": _wider(_range(ys, quantity.name == PRESSURE)),
        "equal": False,
        "frames": frames,
    }


def _below(grids: list[Grid], quantity: Contact, half: bool, coldest: float) -> dict[str, Any]:
    """A quantity on the contact facets of a block, seen from above."""
    frames, seen = [], []
    for grid in grids:
        points = MM * grid.points[:, :2]
        values = np.where(_touching(grid), quantity.factor * grid.at_cells[quantity.name], np.nan)
        seen.append(values[np.isfinite(values)])
        cells: Any = grid.cells
        if half:
            points, cells, values = _mirrored(points, cells, values)
        frames.append({"points": plain(points), "cells": cells.tolist(), "values": plain(values)})
    of_ice = quantity.unit == "°C"
    return {
        "kind": "cells",
        "name": f"map-{quantity.title.split()[0].lower()}",
        "title": quantity.title,
        "says": f"On the contact surface, from above{_both(half)}; grey: no contact.",
        "x": "x (mm)",
        "y": "y (mm)",
        "unit": quantity.unit,
        "nothing": NOTHING,
        "colours": colours(quantity.colours),
        "range": [coldest, 0.0] if of_ice else _range(seen, quantity.name == PRESSURE),
        "equal": True,
        "edges": False,
        "frames": frames,
    }


def _both(half: bool) -> str:
    return " (half is computed, the other its mirror image)" if half else ""


def _mirrored(points: Array, cells: Any, values: Array) -> tuple[Array, Any, Array]:
    """Both halves of a block of which y >= 0 was computed."""
    mirror = np.ones(points.shape[1])
    mirror[1] = -1.0
    both = np.concatenate([points, points * mirror])
    return both, np.concatenate([cells, cells + len(points)]), np.tile(values, 2)


def _block(rubber: list[Grid], interface: list[Grid], half: bool) -> dict[str, Any]:
    """The surface of a block, its facets in contact by their pressure."""
    from scipy.spatial import cKDTree

    faces = _surface(rubber[0], half)
    used, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, len(FACES[rubber[0].kind][0]))
    fans = [faces[:, [0, corner, corner + 1]] for corner in range(1, faces.shape[1] - 1)]
    all_triangles = np.concatenate(fans)
    frames, seen = [], []
    for grid, facets in zip(rubber, interface, strict=True):
        points = (grid.points + grid.at_points["displacement"])[used]
        centres = facets.points[facets.cells].mean(axis=1)
        distance, nearest = cKDTree(centres).query(points[faces].mean(axis=1))
        pressure = np.where(_touching(facets), facets.at_cells[PRESSURE] / BAR, np.nan)
        seen.append(pressure[np.isfinite(pressure)])
        near = distance < 1e-4 * np.ptp(points, axis=0).max()
        values = np.tile(np.where(near, pressure[nearest], np.nan), len(fans))
        points, triangles = MM * points, all_triangles
        if half:
            points, triangles, values = _mirrored(points, triangles, values)
        frames.append({"points": plain(points), "values": plain(values)})
    return {
        "kind": "solid",
        "name": "block",
        "title": "The block from below, deformed to scale",
        "says": f"The mesh of {len(rubber[0].cells)} cells{_both(half)}; its contact by pressure, "
        "grey: no contact. Drag to turn it.",
        "unit": "bar",
        "nothing": NOTHING,
        "colours": colours("viridis"),
        "range": _range(seen, True),
        "equal": True,
        "faces": triangles.T.tolist(),
        "frames": frames,
    }


def _surface(grid: Grid, half: bool) -> NDArray[np.int64]:
    """Faces (n, k) that belong to one cell only, without those in the plane of symmetry."""
    every = np.concatenate([grid.cells[:, list(face)] for face in FACES[grid.kind]])
    _, first, count = np.unique(
        np.sort(every, axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = every[first[count == 1]]
    if half:
        size = np.ptp(grid.points[:, 1])
        outer = outer[(grid.points[outer][..., 1] > 1e-6 * size).any(axis=1)]
    return outer


def _ice(grids: list[Grid], flat: bool, coldest: float) -> dict[str, Any] | None:
    """The temperature below the block, in the plane of its middle."""
    about = {
        "name": "ice",
        "title": "Temperature of the ice below",
        "x": "x (mm)",
        "y": "z (µm)",
        "unit": "°C",
        "nothing": "",
        "colours": colours("inferno"),
        "range": [coldest, 0.0],
        "equal": False,
        "edges": False,
    }
    on_grid = [_section(grid, flat) for grid in grids]
    if all(frame is not None for frame in on_grid):
        return {
            **about,
            "kind": "heat",
            "says": "In the plane of the block's middle, z downwards and stretched.",
            "frames": on_grid,
        }
    if not flat or len(grids[-1].cells) > CELLS:
        return None
    frames = []
    for grid in grids:
        values = grid.at_points["temperature (degC)"][grid.cells].mean(axis=1)
        points = grid.points[:, :2] * [MM, UM]
        frames.append(
            {"points": plain(points), "cells": grid.cells.tolist(), "values": plain(values)}
        )
    says = "Below every facet in contact, z downwards and stretched."
    return {**about, "kind": "cells", "says": says, "frames": frames}


def _section(grid: Grid, flat: bool) -> dict[str, Any] | None:
    """Temperatures on lines of x and z, if the ice's points lie on such; of 3-D ice the middle."""
    points, values = grid.points, grid.at_points["temperature (degC)"]
    vertical = 1 if flat else 2
    if not flat:
        y = points[:, 1]
        middle = y[np.abs(y).argmin()]
        here = np.abs(y - middle) < 1e-9
        points, values = points[here], values[here]
    x, column = np.unique(points[:, 0].round(PLACES), return_inverse=True)
    z, row = np.unique(points[:, vertical].round(PLACES), return_inverse=True)
    if x.size * z.size != len(points):
        return None
    table = np.full((z.size, x.size), np.nan)
    table[row, column] = values
    return {"xs": plain(MM * x), "ys": plain(UM * z), "values": [plain(line) for line in table]}


def _range(values: list[Array], from_zero: bool = False) -> list[float]:
    every = np.concatenate(values)
    every = every[np.isfinite(every)]
    if not every.size:
        return [0.0, 1.0]
    low, high = np.percentile(every, (100.0 - ROBUST, ROBUST))
    return [0.0 if from_zero else float(low), float(high)]


def _ends(values: list[Array]) -> list[float]:
    every = np.concatenate(values)
    return [float(every.min()), float(every.max())] if every.size else [0.0, 1.0]


def _wider(ends: list[float]) -> list[float]:
    low, high = ends
    margin = 0.08 * (high - low) or 0.5
    return plain([low - margin, high + margin])  # type: ignore[return-value]
