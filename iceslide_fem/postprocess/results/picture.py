"""One picture of a run at one time: block, contact pressure, film, temperatures and mu."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from iceslide_fem.postprocess.report.page import ROBUST
from iceslide_fem.postprocess.report.png import BLUE, RED
from iceslide_fem.postprocess.results import Run
from iceslide_fem.postprocess.results.snapshots import (
    Interface,
    Snapshot,
    read_interface,
    read_mises,
)
from iceslide_fem.runtime.columns import CONTACT, HEIGHT, STRESS, TEMPERATURE, WARMTH, Quantity
from iceslide_fem.runtime.units import ZERO_CELSIUS

NO_CONTACT, ICE = "#D9D9D9", "#D6ECF8"
EDGES = "#595959"  # of a mesh's cells
SIZE, DPI = (12.8, 9.6), 100  # inches; their pixels divide by 16, as video needs it
MM, UM, MS = 1e3, 1e6, 1e3
THERMAL_LENGTHS = 2.0  # shown depth of ice


class Scales(NamedTuple):
    """Common scales of all pictures of a run: ranges of quantities by name, and of x in mm."""

    ranges: dict[str, tuple[float, float]]
    x: tuple[float, float]


def scales_of(run: Run, n_times: int) -> Scales:
    """Scales for all times with fields."""
    parts = [read_interface(run.directory, number) for number in range(n_times)]
    robust = 100.0 if parts[0].flat else ROBUST
    coldest = run.scene["ice"]["temperature"] - ZERO_CELSIUS
    ranges = {WARMTH.name: (coldest, run.ice.melting_temperature - ZERO_CELSIUS)}
    for quantity in (CONTACT, HEIGHT):
        values = np.concatenate([part.values[quantity.name][part.touching] for part in parts])
        low, high = np.nanpercentile(quantity.factor * values, (100.0 - robust, robust))
        ranges[quantity.name] = (0.0 if quantity is CONTACT else float(low), float(high))
    if parts[0].flat:
        stresses = [read_mises(run.directory, number) for number in range(n_times)]
        known = [stress for stress in stresses if stress is not None]
        if known:  # pressures are singular at edges
            ranges[STRESS.name] = (0.0, STRESS.factor * float(np.percentile(known[-1], ROBUST)))
    x = MM * np.concatenate([part.corners[part.touching][..., 0].ravel() for part in parts])
    margin = 0.1 * np.ptp(x)
    return Scales(ranges, (float(x.min() - margin), float(x.max() + margin)))


def draw(run: Run, snapshot: Snapshot, scales: Scales) -> Figure:
    """The picture of `snapshot`, for rendering at `DPI`."""
    figure = Figure(figsize=SIZE, layout="constrained")
    mu = run.at("mu", snapshot.time)
    figure.suptitle(
        f"{run.title}\nt = {MS * snapshot.time:.2f} ms,  $\\mu$ = {mu:.3f}", fontsize=14
    )
    flat, has_ice = snapshot.interface.flat, snapshot.ice is not None
    quantities = [CONTACT, HEIGHT, WARMTH] if flat else [HEIGHT, WARMTH]
    above = ["block", "ice" if has_ice else "mu"]
    below = [quantity.name for quantity in quantities] + ["mu"] * has_ice
    panels: dict[str, Axes] = {}
    parts: Any = figure.subfigures(2, 1, height_ratios=[1.4, 1.0])
    for part, row in zip(parts, (above, below), strict=True):
        panels |= zip(row, part.subplots(1, len(row)), strict=True)
    (_block_2d if flat else _block_3d)(panels["block"], snapshot, scales)
    for quantity in quantities:
        (_curve if flat else _map)(panels[quantity.name], snapshot.interface, quantity, scales)
    _friction(panels["mu"], run, snapshot.time)
    if snapshot.ice is not None:
        _ice(panels["ice"], run, snapshot, snapshot.ice, scales)
        _say_stretch(figure, panels["ice"])
    return figure


def _colour_bar(panel: Axes, quantity: Quantity, scales: Scales, **where: Any) -> None:
    colours = ScalarMappable(Normalize(*scales.ranges[quantity.name]), quantity.colours)
    extend = "neither" if quantity is WARMTH else "both" if quantity is HEIGHT else "max"
    title = quantity.title[:1].lower() + quantity.title[1:]
    label = f"{title} ({quantity.unit})" if where else quantity.unit
    figure: Any = panel.get_figure()
    figure.colorbar(colours, ax=panel, extend=extend, label=label, **where)


def _block_3d(panel: Axes, snapshot: Snapshot, scales: Scales) -> None:
    with pv.vtk_verbosity("error"):  # suppresses the warning about a missing X server
        panel.imshow(_render(snapshot, scales))
    panel.set_axis_off()
    size = " x ".join(f"{MM * length:.3g}" for length in np.ptp(snapshot.undeformed, axis=0))
    panel.set_title(
        "The block from below (arrow: sliding direction; grey: no contact)\n"
        f"deformed to scale (lines: undeformed, {size} mm)",
        fontsize=10,
    )
    _colour_bar(panel, CONTACT, scales, location="left", aspect=30)


def _render(snapshot: Snapshot, scales: Scales) -> NDArray[np.uint8]:
    """Cropped image of the block seen from below the ice."""
    low, high = snapshot.undeformed
    centre, size = (low + high) / 2, float(np.linalg.norm(high - low))
    plotter = pv.Plotter(off_screen=True, window_size=(1000, 1000))
    plotter.set_background("white")
    rubber = snapshot.rubber.copy()
    rubber.cell_data[CONTACT.name] *= CONTACT.factor
    contact = np.isfinite(rubber.cell_data[CONTACT.name])
    edges = {"show_edges": True, "edge_color": EDGES}
    plotter.add_mesh(rubber.extract_cells(~contact), color=NO_CONTACT, ambient=0.2, **edges)
    plotter.add_mesh(
        rubber.extract_cells(contact),
        scalars=CONTACT.name,
        clim=scales.ranges[CONTACT.name],
        cmap=CONTACT.colours,
        lighting=False,  # exact colours of the bar
        show_scalar_bar=False,
        **edges,
    )
    outline = pv.Box(np.column_stack([low, high]).ravel()).extract_all_edges()
    plotter.add_mesh(outline, color="black", line_width=2)
    start = [high[0] + 0.1 * size, centre[1], 0.0]
    arrow = pv.Arrow(start=start, direction=(1.0, 0.0, 0.0), scale=0.25 * size)
    plotter.add_mesh(arrow, color="black")
    plotter.camera_position = [centre + size * np.array([0.6, -1.1, -1.5]), centre, (0, 0, 1)]
    plotter.enable_parallel_projection()
    plotter.reset_camera()
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    inked = np.any(image < 255, axis=2)
    rows, columns = (np.flatnonzero(np.any(inked, axis=axis)) for axis in (1, 0))
    return image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]


def _block_2d(panel: Axes, snapshot: Snapshot, scales: Scales) -> None:
    cells = MM * snapshot.rubber.points[snapshot.rubber.regular_faces][..., :2]
    faces = PolyCollection(cells, facecolors=NO_CONTACT, edgecolors="0.6", lw=0.3)
    if STRESS.name in scales.ranges and STRESS.name in snapshot.rubber.point_data:
        nodal = (
            STRESS.factor * snapshot.rubber.point_data[STRESS.name][snapshot.rubber.regular_faces]
        )
        faces.set(array=nodal.mean(axis=1), cmap=STRESS.colours)
        faces.set_norm(Normalize(*scales.ranges[STRESS.name]))
        _colour_bar(panel, STRESS, scales, location="bottom", aspect=40)
    panel.add_collection(faces)
    (x0, z0, _), (x1, z1, _) = MM * snapshot.undeformed
    panel.plot([x0, x1, x1, x0, x0], [z0, z0, z1, z1, z0], "k:", linewidth=1.2)
    contact = snapshot.interface.touching
    panel.add_collection(
        LineCollection(
            [*(MM * snapshot.interface.corners[contact][..., :2])],
            array=CONTACT.factor * snapshot.interface.values[CONTACT.name][contact],
            cmap=CONTACT.colours,
            norm=Normalize(*scales.ranges[CONTACT.name]),
            linewidth=6,
        )
    )
    panel.axhspan(-0.08 * z1, 0.0, color=ICE, zorder=0)
    top, arrow = 1.08 * z1, {"arrowstyle": "-|>", "color": "black"}
    tail, head = (x0 + share * (x1 - x0) for share in (0.62, 0.88))
    panel.annotate("", (head, top), (tail, top), arrowprops=arrow)
    panel.text(x0 + 0.6 * (x1 - x0), top, "sliding", ha="right", va="center")
    panel.set(xlabel="x (mm)", ylabel="z (mm)", ylim=(-0.08 * z1, 1.15 * z1))
    panel.set_aspect("equal")
    panel.set_title("The block, deformed to scale (dotted: undeformed)", fontsize=10)
    _colour_bar(panel, CONTACT, scales, location="bottom", aspect=40)


def _map(panel: Axes, interface: Interface, quantity: Quantity, scales: Scales) -> None:
    """The quantity on the contact area, seen from above."""
    corners, touching = MM * interface.corners[..., :2], interface.touching
    panel.add_collection(PolyCollection([*corners[~touching]], facecolors=NO_CONTACT))
    panel.add_collection(
        PolyCollection(
            [*corners[touching]],
            array=quantity.factor * interface.values[quantity.name][touching],
            cmap=quantity.colours,
            norm=Normalize(*scales.ranges[quantity.name]),
            edgecolors="face",
            linewidths=0.3,
        )
    )
    panel.set(xlabel="x (mm)", ylabel="y (mm)")
    panel.set_aspect("equal")
    panel.autoscale_view()
    panel.set_title(f"{quantity.title} (from above)", fontsize=10)
    _colour_bar(panel, quantity, scales)


def _curve(panel: Axes, interface: Interface, quantity: Quantity, scales: Scales) -> None:
    """The quantity along the contact line of a slice."""
    x = MM * interface.corners[..., 0].mean(axis=1)
    values = np.where(interface.touching, quantity.factor * interface.values[quantity.name], np.nan)
    order = np.argsort(x)
    panel.plot(x[order], values[order], ".-", color=BLUE)
    low, high = scales.ranges[quantity.name]
    margin = 0.1 * (high - low)
    ends = (low - margin, high + margin)
    panel.set(xlabel="x (mm)", ylabel=quantity.unit, xlim=scales.x, ylim=ends)
    panel.grid(alpha=0.25)
    panel.set_title(quantity.title, fontsize=10)


def _ice(panel: Axes, run: Run, snapshot: Snapshot, ice: pv.PolyData, scales: Scales) -> None:
    x, depth = MM * ice.points[:, 0], UM * ice.points[:, 1 if snapshot.interface.flat else 2]
    shading: Any = {"shading": "gouraud", "cmap": WARMTH.colours}
    shading["norm"] = Normalize(*scales.ranges[WARMTH.name])
    drawn = panel.tripcolor(
        x, depth, ice.point_data[TEMPERATURE.name], triangles=ice.regular_faces, **shading
    )
    length = math.sqrt(run.ice.diffusivity * run.history["time_s"][-1])
    shown = UM * THERMAL_LENGTHS * length
    panel.set(xlabel="x (mm)", ylabel="z (µm)", ylim=(-shown, 0.06 * shown))
    panel.set_xlim(min(scales.x[0], x.min()), max(scales.x[1], x.max()))
    touching = MM * snapshot.interface.corners[snapshot.interface.touching][..., 0]
    panel.plot([touching.min(), touching.max()], [0.03 * shown] * 2, "k", linewidth=5)
    figure: Any = panel.get_figure()
    figure.colorbar(drawn, ax=panel, label="temperature (°C)")


def _say_stretch(figure: Figure, panel: Axes) -> None:
    """Title with the exaggeration of the depth, known only after the layout."""
    panel.set_title("Temperature", fontsize=10)
    figure.draw_without_rendering()
    box = panel.get_window_extent()
    wide, deep = np.ptp(panel.get_xlim()) / MM, np.ptp(panel.get_ylim()) / UM
    stretch = (box.height / deep) / (box.width / wide)
    panel.set_title(
        f"Temperature of the ice below the block's middle\n"
        f"(depth stretched {stretch:.0f} times; black: rubber in contact)",
        fontsize=10,
    )


def _friction(panel: Axes, run: Run, time: float) -> None:
    panel.plot(MS * run.history["time_s"], run.history["mu"], color=BLUE)
    panel.plot(MS * time, run.at("mu", time), "o", color=RED, markersize=8)
    panel.set(xlabel="sliding time (ms)", ylabel=r"$\mu$ (1)")
    panel.set_ylim(0.0, 1.1 * run.history["mu"].max())
    panel.grid(alpha=0.25)
    panel.set_title("Friction coefficient", fontsize=10)
