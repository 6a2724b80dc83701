"""Drawings of the fields of a run for the page: block, contact, ice."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.postprocess.report.field_grids import (
    FACES,
    PLACES,
    Grid,
    mirrored,
    outer_faces,
    read_grid,
)
from iceslide_fem.postprocess.report.page import ROBUST, Fields, Text, colours, plain
from iceslide_fem.postprocess.results import Run, field_parts
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import CONTACT, HEIGHT, STRESS, TEMPERATURE, WARMTH, Quantity
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR

CELLS = 6000  # of a drawing at most
MM, UM = 1e3, 1e6
NOTHING = "no contact"
MIRRORED = " (half is computed, the other its mirror image)"

Drawing = dict[str, Any]
Files = dict[str, list[tuple[float, list[Path]]]]  # parts of fields by body and time


def drawings_of(
    run: Run, rubber: list[Grid], interface: list[Grid], ice: list[Grid]
) -> list[Drawing]:
    """Drawings of a run from its grids at some times; grids with too many cells are skipped."""
    flat = run.scene["model"] == "slice"
    coldest = run.scene["ice"]["temperature"] - ZERO_CELSIUS
    quantities = (CONTACT, HEIGHT, WARMTH)
    drawings: list[Drawing] = []
    half = bool(rubber[0].points[:, 1].min() > -1e-9)
    if len(rubber[0].cells) <= CELLS:
        drawings.append(_slice(rubber) if flat else _block(rubber, interface, half))
    if flat:
        drawings += [_along(interface, quantity) for quantity in quantities]
    elif max(len(grid.cells) for grid in interface) <= CELLS:
        drawings += [_below(interface, quantity, half, coldest) for quantity in quantities]
    if len(ice) == len(rubber):
        drawings += _ice(ice, flat, coldest)
    return drawings


def _coloured(
    name: str, title: str, says: str, unit: str, colour_map: str, ends: list[float], **more: Any
) -> Drawing:
    """A coloured drawing, of cells in the x-z plane unless `more` says otherwise."""
    plane = {"kind": "cells", "x": "x (mm)", "y": "z (mm)", "equal": True, "edges": False}
    about = {"name": name, "title": title, "says": says, "unit": unit, "nothing": ""}
    return {**plane, **about, "colours": colours(colour_map), "range": ends, **more}


def _slice(grids: list[Grid]) -> Drawing:
    """The deformed cells of a slice, coloured by von Mises stress if it was written."""
    stressed = STRESS.name in grids[0].at_points
    frames, stresses = [], []
    for grid in grids:
        points = MM * (grid.points + grid.at_points["displacement"])[:, :2]
        stress = np.full(len(grid.cells), np.nan)
        if stressed:
            stress = grid.at_points[STRESS.name][grid.cells].mean(axis=1) / BAR
        stresses.append(stress)
        frames.append({"points": plain(points), "values": plain(stress)})
    x0, y0 = MM * grids[0].points[:, :2].min(axis=0)
    x1, y1 = MM * grids[0].points[:, :2].max(axis=0)
    what = "by its von Mises stress" if stressed else "; its stress was not written"
    return _coloured(
        "block",
        "The block, deformed to scale",
        f"The mesh of {len(grids[0].cells)} cells, {what}; dotted: undeformed. It slides to the "
        "right.",
        "bar",
        "viridis",
        _range(stresses),
        edges=True,
        cells=grids[0].cells.tolist(),
        outlines=[{"x": plain([x0, x1, x1, x0, x0]), "y": plain([y0, y0, y1, y1, y0])}],
        frames=frames,
    )


def _along(grids: list[Grid], quantity: Quantity) -> Drawing:
    """A quantity along the contact line of a slice."""
    frames, xs, ys = [], [], []
    for grid in grids:
        x = MM * grid.points[grid.cells][..., 0].mean(axis=1)
        y = grid.in_contact(quantity)
        order = np.argsort(x)
        curve = {"name": quantity.title, "x": plain(x[order]), "y": plain(y[order]), "look": 0}
        frames.append([curve | {"marks": False}])
        xs.append(x[grid.at_cells[CONTACT.name] > 0.0])
        ys.append(y)
    touching = np.concatenate(xs)
    ends = [touching.min(), touching.max()] if touching.size else [0.0, 1.0]
    return {
        "kind": "lines",
        "name": f"along-{quantity.title.split()[0].lower()}",
        "title": quantity.title,
        "says": "Along the contact, facet by facet; nothing where there is none.",
        "x": "x (mm)",
        "y": quantity.unit,
        "xrange": _wider(ends),
        "yrange": _wider(_range(ys, quantity is CONTACT)),
        "equal": False,
        "frames": frames,
    }


def _below(grids: list[Grid], quantity: Quantity, half: bool, coldest: float) -> Drawing:
    """A quantity on the contact facets of a block, seen from above."""
    frames, seen = [], []
    for grid in grids:
        points, cells, values = MM * grid.points[:, :2], grid.cells, grid.in_contact(quantity)
        seen.append(values)
        if half:
            points, cells, values = mirrored(points, cells, values)
        frames.append({"points": plain(points), "cells": cells.tolist(), "values": plain(values)})
    return _coloured(
        f"map-{quantity.title.split()[0].lower()}",
        quantity.title,
        f"On the contact surface, from above{MIRRORED if half else ''}; grey: no contact.",
        quantity.unit,
        quantity.colours,
        [coldest, 0.0] if quantity is WARMTH else _range(seen, quantity is CONTACT),
        y="y (mm)",
        nothing=NOTHING,
        frames=frames,
    )


def _block(rubber: list[Grid], interface: list[Grid], half: bool) -> Drawing:
    """The surface of a block, with contact facets coloured by pressure."""
    from scipy.spatial import cKDTree

    faces = outer_faces(rubber[0], half)
    used, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, len(FACES[rubber[0].kind][0]))
    fans = [faces[:, [0, corner, corner + 1]] for corner in range(1, faces.shape[1] - 1)]
    frames, seen = [], []
    for grid, facets in zip(rubber, interface, strict=True):
        points = (grid.points + grid.at_points["displacement"])[used]
        centres = facets.points[facets.cells].mean(axis=1)
        distance, nearest = cKDTree(centres).query(points[faces].mean(axis=1))
        pressure = facets.in_contact(CONTACT)
        seen.append(pressure)
        near = distance < 1e-4 * np.ptp(points, axis=0).max()
        values = np.tile(np.where(near, pressure[nearest], np.nan), len(fans))
        points, triangles = MM * points, np.concatenate(fans)
        if half:
            points, triangles, values = mirrored(points, triangles, values)
        frames.append({"points": plain(points), "values": plain(values)})
    return _coloured(
        "block",
        "The block from below, deformed to scale",
        f"The mesh of {len(rubber[0].cells)} cells{MIRRORED if half else ''}; its contact by "
        "pressure, grey: no contact. Drag to turn it.",
        "bar",
        "viridis",
        _range(seen, True),
        kind="solid",
        nothing=NOTHING,
        faces=triangles.T.tolist(),
        frames=frames,
    )


def _ice(grids: list[Grid], flat: bool, coldest: float) -> list[Drawing]:
    """The temperature below the block in its middle plane, if it can be drawn."""
    frames: list[Any] = [_section(grid, flat) for grid in grids]
    kind, says = "heat", "In the plane of the block's middle, z downwards and stretched."
    if not all(frames):
        if not flat or len(grids[-1].cells) > CELLS:
            return []
        kind, says = "cells", "Below every facet in contact, z downwards and stretched."
        frames = [
            {
                "points": plain(grid.points[:, :2] * [MM, UM]),
                "cells": grid.cells.tolist(),
                "values": plain(grid.at_points[TEMPERATURE.name][grid.cells].mean(axis=1)),
            }
            for grid in grids
        ]
    title, ends = "Temperature of the ice below", [coldest, 0.0]
    more = {"kind": kind, "y": "z (µm)", "equal": False, "frames": frames}
    return [_coloured("ice", title, says, "°C", WARMTH.colours, ends, **more)]


def _section(grid: Grid, flat: bool) -> Drawing | None:
    """Temperatures on a grid of x and z, if the ice has one; for 3-D ice in the middle plane."""
    points, values = grid.points, grid.at_points[TEMPERATURE.name]
    if not flat:
        y = points[:, 1]
        here = np.abs(y - y[np.abs(y).argmin()]) < 1e-9
        points, values = points[here], values[here]
    x, column = np.unique(points[:, 0].round(PLACES), return_inverse=True)
    z, row = np.unique(points[:, 1 if flat else 2].round(PLACES), return_inverse=True)
    if x.size * z.size != len(points):
        return None
    table = np.full((z.size, x.size), np.nan)
    table[row, column] = values
    return {"xs": plain(MM * x), "ys": plain(UM * z), "values": [plain(line) for line in table]}


def _range(values: list[Array], from_zero: bool = False) -> list[float]:
    """Range of the colours for all values."""
    every = np.concatenate(values)
    every = every[np.isfinite(every)]
    if not every.size:
        return [0.0, 1.0]
    low, high = np.percentile(every, (100.0 - ROBUST, ROBUST))
    return [0.0 if from_zero else float(low), float(high)]


def _wider(ends: list[float]) -> list[float | None]:
    low, high = ends
    margin = 0.08 * (high - low) or 0.5
    return plain([low - margin, high + margin])


MOMENTS = 13  # at most
MS = 1e3
UNREADABLE = (SceneError, LookupError, OSError, TypeError, ValueError)


def fields_of(run: Run) -> list[Text | Fields]:
    """Rubber, interface and ice at some of the written times, if any."""
    try:
        files = _files(run)
        times = _times(files)
        if not times.size:
            return []
        chosen = _moments(times, float(run.summary["mu_peak_time_s"]))
        drawings = _drawings_at(run, files, chosen)
    except UNREADABLE as error:
        return [Text(f"The fields are there but could not be read ({error}).", "warning")]
    if not drawings:
        return [Text(f"More than {CELLS} cells are not drawn here: iceslide view does that.")]
    said = [
        f"t = {MS * times[number]:.3g} ms, mu = {run.at('mu', times[number]):.4g}"
        for number in chosen
    ]
    others = "; the others are in its folder" if times.size > len(chosen) else ""
    about = Text(
        f"{len(chosen)} of the {times.size} moments that the run wrote{others}. Colours end where "
        f"{100.0 - ROBUST:g} % of the values of all moments lie beyond."
    )
    return [about, Fields([MS * times[number] for number in chosen], said, drawings)]


def fields_beside(runs: Mapping[str, Run]) -> list[Text | Fields]:
    """Fields of several runs side by side, each kind with one scale, at the first one's times.

    Each run is drawn at its written moment nearest to that time. Nothing if one has no fields.
    """
    try:
        files = {name: _files(run) for name, run in runs.items()}
        written = {name: _times(own) for name, own in files.items()}
        if not all(times.size for times in written.values()):
            return []
        first, run = next(iter(runs.items()))
        times = written[first]
        times = times[_moments(times, float(run.summary["mu_peak_time_s"]))]
        near = {
            name: [int(np.abs(own - time).argmin()) for time in times]
            for name, own in written.items()
        }
        of_each = {name: _drawings_at(run, files[name], near[name]) for name, run in runs.items()}
    except UNREADABLE as error:
        return [Text(f"The fields are there but could not be read ({error}).", "warning")]
    groups: dict[str, list[Drawing]] = {}
    for number, (name, drawings) in enumerate(of_each.items()):
        for drawing in drawings:
            own = {"name": f"{drawing['name']}-{number}", "title": f"{name}: {drawing['title']}"}
            groups.setdefault(drawing["name"], []).append(drawing | own)
    beside = [one for group in groups.values() if len(group) > 1 for one in _on_one_scale(group)]
    if not beside:
        return [Text("Their fields have too many cells, or are of different kinds.")]
    said = [
        f"t = {MS * time:.3g} ms: mu = "
        + ", ".join(f"{run.at('mu', time):.4g} ({name})" for name, run in runs.items())
        for time in times
    ]
    about = Text("Each run at its written moment nearest to the time; equal colours, equal values.")
    return [about, Fields((MS * times).tolist(), said, beside)]


def _on_one_scale(drawings: list[Drawing]) -> list[Drawing]:
    """Drawings of one kind with the widest ends of all of them."""
    ends = {}
    for key in ("range", "xrange", "yrange"):
        if all(drawing.get(key) for drawing in drawings):
            lows, highs = zip(*(drawing[key] for drawing in drawings), strict=True)
            ends[key] = [min(lows), max(highs)]
    return [drawing | ends for drawing in drawings]


def _files(run: Run) -> Files:
    """The field files of each body, by time."""
    return {name: field_parts(run.directory, name) for name in ("rubber", "interface", "ice")}


def _times(files: Files) -> Array:
    """Times (s) at which a run wrote its fields, none if it wrote none."""
    return np.array([time for time, _ in files["interface"][: len(files["rubber"])]])


def _drawings_at(run: Run, files: Files, chosen: list[int]) -> list[Drawing]:
    grids = {
        name: [read_grid(parts[number][1]) for number in chosen if number < len(parts)]
        for name, parts in files.items()
    }
    return drawings_of(run, grids["rubber"], grids["interface"], grids["ice"])


def _moments(times: Array, peak: float) -> list[int]:
    """Indices of at most `MOMENTS` times, with first, last and nearest to `peak` (s)."""
    some = np.linspace(0, times.size - 1, min(MOMENTS, times.size)).round().astype(int)
    nearest = int(np.abs(times - peak).argmin())
    inner = some[1:-1]
    if nearest not in some and inner.size:
        some[1 + int(np.abs(inner - nearest).argmin())] = nearest
    return np.unique(some).tolist()
