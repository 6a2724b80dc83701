"""Module 1: reading of a footprint from a picture, from maps or from a line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.macroscopic import State, States
from iceslide_fem.preprocess.footprint.maps import (
    HIGHEST,
    check_pressures,
    read_pressures,
    read_states,
    read_temperatures,
)
from iceslide_fem.preprocess.footprint.picture import (
    colour,
    cut,
    legend_bar,
    lowest_colour,
    named_bar,
    read_colours,
    read_grey,
    read_picture,
    rotate,
)
from iceslide_fem.preprocess.footprint.pressure_map import (
    PressureMap,
    as_map,
    gaussian_profile,
    pressure_from_values,
    touching,
)
from iceslide_fem.preprocess.footprint.profile import read_profile
from iceslide_fem.preprocess.footprint.sensor_text import saturation
from iceslide_fem.preprocess.footprint.source_options import SourceOptions
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import BAR
from iceslide_fem.scene.messages import missing

BRIGHT = 0.5  # of the grey scale
FACTORS = 0.2, 5.0  # factors of a given load on the read pressures, beyond which a note is given


class ReadFootprint(NamedTuple):
    """A pressure map and the quality of its reading.

    distance: of every pixel's colour to the bar, (ny, nx), relative to the range of a channel;
    unclear: pixels with the value of a neighbour; both are None for pressures given as numbers.
    load_factor: factor on all pressures by a given load. temperature (K) and state (ny, nx): given
    values, or None. left: x of the map's left side in the data, m. notes: sentences for the user.
    """

    pressure_map: PressureMap
    distance: Array | None = None
    unclear: Mask | None = None
    load_factor: float = 1.0
    temperature: Array | None = None
    state: States | None = None
    left: float = 0.0
    notes: tuple[str, ...] = ()


def read_footprint(case: FootprintCase) -> ReadFootprint:
    """Module 1, with given temperatures and states. Raises as `read_source`."""
    read = _with_own_maps(_whole(case), case)
    if not case.thesis_balance and (read.temperature is not None or read.state is not None):
        raise SceneError(
            f"--line {case.line} has temperatures or states, which are of the thesis's balance; "
            "give --thesis-balance, too, or leave them out"
        )
    return read if case.row is None else one_row(read, case.row)


def read_source(case: SourceOptions) -> ReadFootprint:
    """The pressures. Raises SceneError for invalid data."""
    read = _whole(case)
    return read if case.row is None else one_row(read, case.row)


def _whole(case: SourceOptions) -> ReadFootprint:
    """All lines of a footprint, at its load."""
    if case.gaussian is not None:
        length, peak, sigma = case.gaussian
        x, pressure = gaussian_profile(length, peak, sigma=sigma)
        read = ReadFootprint(as_map(touching(pressure, case.lowest_pressure), float(x[1] - x[0])))
    elif case.line is not None:
        read = _read_line(case.line, case)
    else:
        read = _read_picture(case) if case.image is not None else _read_map(case)
    return read if case.load is None else _loaded(read, case.load)


def _loaded(read: ReadFootprint, load: float) -> ReadFootprint:
    """With pressures that carry `load` (N)."""
    footprint, factor = read.pressure_map.carrying(load)
    if (high := float(footprint.pressure.max())) > HIGHEST:
        raise SceneError(
            f"--load {load:g} N takes pressures up to {high / BAR:.4g} bar on the "
            f"{1e4 * footprint.contact_area:.4g} cm2 in contact; allowed: {HIGHEST / BAR:g} bar"
        )
    check_pressures(footprint.pressure, f"--load {load:g} N", "Pa")
    notes = read.notes
    if not FACTORS[0] <= factor <= FACTORS[1]:
        notes += (f"--load multiplies the pressures that were read by {factor:.3g}",)
    return read._replace(pressure_map=footprint, load_factor=factor, notes=notes)


def _read_picture(case: SourceOptions) -> ReadFootprint:
    assert case.image is not None and case.max_pressure is not None
    assert case.length is not None and case.width is not None
    background = None if case.background == "none" else colour(case.background)
    white = (255, 255, 255) if case.dark_is == "high" else (0, 0, 0)
    around = white if case.in_grey else background or (255, 255, 255)
    picture = read_picture(case.image, around)
    bar = None
    if case.legend is not None:
        bar = legend_bar(cut(picture, case.legend, "legend"))
    elif case.colormap is not None:
        bar = named_bar(case.colormap)
    if bar is not None and background is None:  # pixels added by a rotation are not in contact
        around = lowest_colour(bar)
    picture = rotate(picture, case.rotation, around)
    if case.crop is not None:
        picture = cut(picture, case.crop, "crop")
    reading = read_grey(picture) if bar is None else read_colours(picture, bar, background)
    value = reading.value
    if case.dark_is == "high":
        value = 1.0 - value
    elif case.in_grey and case.dark_is is None:
        sides = np.concatenate([value[0], value[-1], value[:, 0], value[:, -1]])
        if np.median(sides) > BRIGHT:
            raise SceneError(
                f"{case.image} is bright along its sides, where bright would be high pressure; "
                "give --dark-is high for a print in ink, --dark-is low if bright is high indeed"
            )
    ends = case.min_pressure, case.max_pressure
    size = case.length, case.width
    footprint = pressure_from_values(value, *ends, case.lowest_pressure, size)
    said, loaded = f"the picture {case.image}", case.load is not None
    notes = saturation(footprint.pressure, said, case.max_pressure, True, loaded)
    return ReadFootprint(footprint, reading.distance[::-1], reading.unclear[::-1], notes=notes)


def _read_map(case: SourceOptions) -> ReadFootprint:
    assert case.pressure_map is not None
    given = read_pressures(case.pressure_map, case.pressure_unit, case.frame)
    size = {"length": case.length, "width": case.width}
    for (name, option), said in zip(size.items(), given.size or (), strict=False):
        if option is not None and abs(option - said) > 1e-3 * said:
            raise SceneError(
                f"--{name} {1e3 * option:.4g} mm contradicts the file of --pressure-map, whose "
                f"sensors cover {1e3 * said:.4g} mm; leave it out"
            )
        size[name] = said
    length, width = size.values()
    if length is None or width is None:
        raise SceneError(missing([f"--{name}" for name in size if size[name] is None]))
    pressure = touching(given.values[::-1], case.lowest_pressure)
    rows, columns = pressure.shape
    footprint = PressureMap(pressure, length / columns, width / rows)
    source, loaded = f"--pressure-map {case.pressure_map}", case.load is not None
    notes = saturation(pressure, source, given.saturation, False, loaded)
    return ReadFootprint(footprint, notes=given.notes + notes)


def _read_line(path: Path, case: SourceOptions) -> ReadFootprint:
    """A profile as a map of one row, 1 m wide."""
    profile = read_profile(path, case.pressure_unit)
    line = as_map(touching(profile.pressure, case.lowest_pressure), profile.dx)
    read = ReadFootprint(line, left=profile.first - 0.5 * profile.dx)
    if profile.temperature is not None:
        read = read._replace(temperature=profile.temperature[None])
    if profile.state is not None:
        _check_states(profile.state[None], line.contact, f"state of --line {path}")
        read = read._replace(state=profile.state[None])
    return read


def _check_states(state: States, contact: Mask, said: str) -> None:
    """Raise SceneError if given states contradict the pressure."""
    if (state[contact] == State.NO_CONTACT).any():
        raise SceneError(f"{said} has no contact (0) where the pressure is above 0")


def _with_own_maps(read: ReadFootprint, case: FootprintCase) -> ReadFootprint:
    """Add the given temperatures and states, which must have the same pixels."""
    contact = read.pressure_map.contact
    if case.temperature_map is not None:
        given = read_temperatures(case.temperature_map)
        temperature = _fitting(given.values, contact, "--temperature-map")
        if np.isnan(temperature[contact]).any():
            raise SceneError("--temperature-map has no number where the pressure is above 0")
        read = read._replace(temperature=temperature, notes=read.notes + given.notes)
    if case.state_map is not None:
        given = read_states(case.state_map)
        state = _fitting(given.values, contact, "--state-map").astype(np.uint8)
        _check_states(state, contact, "--state-map")
        read = read._replace(state=state, notes=read.notes + given.notes)
    return read


def _fitting(values: Array, contact: Mask, option: str) -> Array:
    """A map with the pixels of `contact`, flipped from first row on top to first row below."""
    if values.shape != contact.shape:
        raise SceneError(
            f"{option} has {values.shape[1]} x {values.shape[0]} pixels, the pressure "
            f"{contact.shape[1]} x {contact.shape[0]}: they must be the same"
        )
    return values[::-1]


def one_row(read: ReadFootprint, row: int) -> ReadFootprint:
    """One line of pixels, `row` from the top."""
    footprint = read.pressure_map
    rows = len(footprint.pressure)
    if row >= rows:
        raise SceneError(f"--row {row} is not in the footprint, which has rows 0 to {rows - 1}")
    if not footprint.contact[rows - 1 - row].any():
        near = rows - 1 - np.flatnonzero(footprint.contact.any(axis=1))
        raise SceneError(
            f"--row {row} touches nowhere; the nearest that does is "
            f"{near[np.abs(near - row).argmin()]}"
        )
    here = slice(rows - 1 - row, rows - row)
    maps = {
        name: values[here]
        for name, values in read._asdict().items()
        if name in ("distance", "unclear", "temperature", "state") and values is not None
    }
    line = replace(footprint, pressure=footprint.pressure[here])
    return read._replace(pressure_map=line, **maps)
