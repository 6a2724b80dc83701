"""From a footprint to finite element scenes of representative tread blocks."""

from __future__ import annotations

import json
import tomllib
from typing import NamedTuple

import numpy as np
import tomlkit
from scipy.ndimage import find_objects, label

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.outlines import outline_text, patch_outline
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.scene.dry_shear import USUAL_RESIDUAL
from iceslide_fem.scene.materials import BAR, ICE, WATER_VISCOSITY, Solid, ViscosityTable

# Smaller patches are noise, not blocks: fraction of the mean area of all patches.
SMALL = 0.05
TRANSITS = 1.5  # sliding distance of a scene's block over its length, enough for a steady state


class TreadBlock(NamedTuple):
    """A connected patch of contact; SI units.

    x, y: centre of its load, m; length: along x, m; width: area over length, m; pressure: mean, Pa;
    load: N; outline: polygons (n, 2) around its centre, m, the outer one first, empty if the
    picture has none.
    """

    x: float
    y: float
    length: float
    width: float
    pressure: float
    load: float
    outline: tuple[Array, ...] = ()


def scene_files(case: FootprintCase, footprint: PressureMap) -> dict[str, str]:
    """File names and texts of the scene of every representative block, and of its outline.

    Raises SceneError if there are fewer blocks than scenes, or a scene is not valid.
    """
    texts: dict[str, str] = {}
    if not case.scenes:
        return texts
    chosen = representative(tread_blocks(footprint), case.scenes)
    for number, (block, fraction) in enumerate(chosen, start=1):
        name = f"block_{number:02d}"
        texts[f"{name}.toml"] = scene_text(name, block, fraction, case)
        if block.outline:
            texts[f"{name}.csv"] = outline_text(block.outline, max(footprint.dx, footprint.dy))
    return texts


def tread_blocks(footprint: PressureMap) -> list[TreadBlock]:
    """Patches of pixels connected by sides or corners, sorted by pressure."""
    labels, _ = label(footprint.contact, np.ones((3, 3)))
    blocks = []
    for number, (rows, columns) in enumerate(find_objects(labels), start=1):
        pressure = np.where(labels[rows, columns] == number, footprint.pressure[rows, columns], 0.0)
        area = footprint.pixel_area * np.count_nonzero(pressure)
        length = footprint.dx * pressure.shape[1]
        total = pressure.sum()
        blocks.append(
            TreadBlock(
                x=float(pressure.sum(axis=0) @ footprint.x[columns] / total),
                y=float(pressure.sum(axis=1) @ footprint.y[rows] / total),
                length=length,
                width=area / length,
                pressure=float(total) * footprint.pixel_area / area,
                load=float(total) * footprint.pixel_area,
                outline=patch_outline(pressure > 0.0, footprint.dx, footprint.dy),
            )
        )
    mean_area = float(np.mean([block.length * block.width for block in blocks]))
    large = [block for block in blocks if block.length * block.width >= SMALL * mean_area]
    return sorted(large, key=lambda block: block.pressure)


def representative(blocks: list[TreadBlock], count: int) -> list[tuple[TreadBlock, float]]:
    """`count` blocks, each with the fraction of the load that it represents.

    The blocks, sorted by pressure, are divided into groups of about equal load. Each group is
    represented by the block whose pressure and length are closest to the group's load-weighted
    means. Raises SceneError if there are fewer blocks.
    """
    if count > len(blocks):
        raise SceneError(f"--scenes {count} is more than the {len(blocks)} blocks of the footprint")
    loads = np.array([block.load for block in blocks])
    middles = np.cumsum(loads) - 0.5 * loads
    # At least one block in each group.
    bounds = np.searchsorted(middles, loads.sum() * np.arange(count + 1) / count)
    for i in range(1, count):
        bounds[i] = min(max(bounds[i], bounds[i - 1] + 1), len(blocks) - count + i)
    chosen = []
    for first, last in zip(bounds[:-1], bounds[1:], strict=True):
        features = np.array([(block.pressure, block.length) for block in blocks[first:last]])
        mean = np.average(features, axis=0, weights=loads[first:last])
        nearest = int(np.argmin((((features - mean) / mean) ** 2).sum(axis=1)))
        chosen.append((blocks[first + nearest], float(loads[first:last].sum() / loads.sum())))
    return chosen


def aged_keys(scene: Scene) -> tuple[str, str]:
    """Lines of the tables rubber and film on a scene's contact age, SI."""
    of_rubber, of_film = scene.as_dict()["rubber"], scene.as_dict()["film"]
    for table, key, file in (
        (of_film, "contact", scene.film.contact),
        (of_rubber, "dma", scene.rubber.dma),
    ):
        table[key] = None if file is None else str(file.resolve())
    tables = []
    for table, names in (
        (of_rubber, ("compound", "C10", "C01", "D1", "nu", "prony", "dma", "wlf", "modulus_is")),
        (of_film, ("contact", "contact_modulus", "contact_age")),
    ):
        text = tomlkit.document()
        for name in names:
            if table[name] is not None:
                inline = tomlkit.inline_table()
                value = table[name]
                if isinstance(value, dict):
                    inline.update({key: part for key, part in value.items() if part is not None})
                    value = inline
                text.add(name, value)
        tables.append(tomlkit.dumps(text))
    return tables[0], tables[1]


def scene_text(name: str, block: TreadBlock, fraction: float, case: FootprintCase) -> str:
    """The scene file of a block that meets fresh ice, checked: SceneError if it is not valid.

    Length, width (m), pressure and position are those of the block; its height is that of the
    tread. It slides 1.5 times its length over passing ice, so its film becomes steady. `fraction`:
    of the load that it represents. If the block has an outline, the scene refers to `name`.csv.
    """
    ride, eta = case.ride, case.ride.viscosity
    ice = "".join(
        f"{key} = {value!r}\n"
        for key, value, usual in zip(Solid._fields, ride.solid, ICE, strict=True)
        if value != usual
    )
    water = film = inertia = ""
    if isinstance(eta, ViscosityTable):
        rows = [list(row) for row in zip(eta.temperature, eta.viscosity, strict=True)]
        water = f"[water]\nviscosity = {json.dumps(rows)}\n"
    elif eta != WATER_VISCOSITY:
        water = f"[water]\nviscosity = {eta!r}\n"
    if ride.water_speed != 1.0:
        film += f"water_speed = {ride.water_speed!r}\n"
    dry = case.dry_shear
    if dry.stress is not None:
        film += f"dry_stress = {json.dumps(dry.stress)}\n"
    if dry.softening is not None:
        film += f"dry_softening = {dry.softening!r}\n"
    if dry.residual != USUAL_RESIDUAL:
        film += f"dry_residual = {dry.residual!r}\n"
    if dry.softens:
        inertia = "inertia = true\n"
    if case.water is not None:
        ice += f"water = {case.water!r}\n"
        film += 'voids = "carry"\n'
    if case.contact is not None:
        film += f"contact = {tomlkit.item(str(case.contact.resolve())).as_string()}\n"
    rubber = f"compound = {json.dumps(case.compound)}\n"
    if case.aged_scene is not None:
        rubber, aged = aged_keys(case.aged_scene)
        film += aged
    text = f"""\
# A tread block of a footprint, on fresh ice. Its load of {block.load:.1f} N is centred
# {1e3 * block.x:.1f} mm from the left and {1e3 * block.y:.1f} mm from the lower edge of the map.
# It stands for {fraction:.1%} of the whole load. model = "block" computes it in 3-D.
name = {json.dumps(name)}
model = "slice"

[rubber]
{rubber}length = "{1e3 * block.length:.4g} mm"
width = "{1e3 * block.width:.4g} mm"
height = "{1e3 * case.tread_height:.4g} mm"
{inertia}
[load]
pressure = "{block.pressure / BAR:.5g} bar"
speed = "{ride.sliding_speed:.6g} m/s"
duration = "{1e3 * TRANSITS * block.length / ride.sliding_speed:.5g} ms"

[ice]
temperature = "{ride.temperature - ZERO_CELSIUS:.6g} degC"
motion = "sliding"
heat = "column"
{ice}{water}
[film]
carrier = "ice"
initial_height = "{1e9 * ride.initial_height:.6g} nm"
{film}
[numerics]
tolerance = 1e-2
"""
    scene_from_dict(tomllib.loads(text))
    if not block.outline:
        return text
    named = f'outline = "{name}.csv"         # in 3-D; a slice is as long as length\n'
    return text.replace("\n[load]\n", f"{named}\n[load]\n", 1)
