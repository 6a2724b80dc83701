"""Synthetic footprints with known pressure, and pictures of them, because no measured one is free.

The tread has ribs cut into blocks by sipes, inside a rounded outline. The pressure is higher on the
shoulders, rounded towards leading and trailing edge, and slightly uneven.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

from iceslide_fem.preprocess.footprint.picture import Box, Picture
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.materials import BAR

LEGEND_SHARE = 0.05  # width of the legend over that of the picture
TICKS = 16  # pixels between footprint and legend


@dataclass(frozen=True)
class Tread:
    """A tread pattern, in m: circumferential grooves between ribs, sipes across them.

    shoulder: additional pressure at the outer edges relative to the middle; roughness: standard
    deviation of the pressure over its mean, with a correlation length of about 2 mm.
    """

    length: float = 0.18
    width: float = 0.14
    ribs: int = 5
    groove: float = 6e-3
    pitch: float = 24e-3
    sipe: float = 2e-3
    shoulder: float = 0.35
    roughness: float = 0.03
    mean_pressure: float = 2.2 * BAR

    def footprint(self, shape: tuple[int, int], seed: int = 1) -> PressureMap:
        """The pressure on `shape` = (ny, nx) pixels, with a margin of 5 % around the contact."""
        ny, nx = shape
        dx, dy = self.length / nx, self.width / ny
        x, y = (np.arange(0.0, nx) + 0.5) * dx, ((np.arange(0.0, ny) + 0.5) * dy)[:, None]
        u = (2.0 * x / self.length - 1.0) / 0.9  # -1 to 1 from the trailing to the leading edge
        w = (2.0 * y / self.width - 1.0) / 0.9
        inside = (np.abs(u) ** 4 + np.abs(w) ** 6 < 1.0) & self._touches(x, y)
        shape_x = np.maximum(1.0 - 0.75 * u**4, 0.0)
        uneven = _unevenness(shape, 2e-3 / dx, 2e-3 / dy, seed)
        pressure = shape_x * (1.0 + self.shoulder * w**4) * (1.0 + self.roughness * uneven)
        pressure = np.where(inside, pressure, 0.0)
        pressure *= self.mean_pressure / pressure[inside].mean()
        return PressureMap(pressure, dx, dy)

    def _touches(self, x: Array, y: Array) -> Mask:
        """Mask of rubber (neither groove nor sipe); sipes are offset from rib to rib."""
        rib_pitch = (0.9 * self.width + self.groove) / self.ribs
        across = y - 0.05 * self.width
        rib = np.floor(across / rib_pitch)
        on_rib = (across - rib * rib_pitch < rib_pitch - self.groove) & (across >= 0.0)
        slanted = x + 0.2 * (across - rib * rib_pitch) + 0.4 * self.pitch * (rib % 2.0)
        return np.asarray(on_rib & (slanted % self.pitch >= self.sipe))


def grey_picture(footprint: PressureMap, high: float) -> Picture:
    """A grey picture: black is no contact, white is `high` (Pa)."""
    grey = np.rint(255.0 * np.clip(footprint.pressure[::-1] / high, 0.0, 1.0)).astype(np.uint8)
    return np.repeat(grey[:, :, None], 3, axis=2)


def coloured_picture(footprint: PressureMap, high: float, colormap: str) -> tuple[Picture, Box]:
    """A picture on white through a colour map from 0 to `high` (Pa), with a legend at its right.

    Returns the picture and the box of the legend, whose frame is black and outside of the box.
    """
    value = footprint.pressure[::-1] / high
    colours = matplotlib.colormaps[colormap](value, bytes=True)[:, :, :3]
    colours[~footprint.contact[::-1]] = 255
    rows, columns = value.shape
    wide = max(8, round(LEGEND_SHARE * columns))
    canvas = np.full((rows, columns + 2 * TICKS + wide, 3), 255, dtype=np.uint8)
    canvas[:, :columns] = colours
    box = Box(columns + TICKS, rows // 10, columns + TICKS + wide, rows - rows // 10)
    canvas[box.top - 2 : box.bottom + 2, box.left - 2 : box.right + 2] = 0
    tall = box.bottom - box.top
    levels = (np.arange(tall)[::-1] + 0.5) / tall
    bar = matplotlib.colormaps[colormap](levels, bytes=True)[:, None, :3]
    canvas[box.top : box.bottom, box.left : box.right] = bar
    return canvas, box


def save(picture: Picture, path: Path, quality: int = 90) -> Path:
    """Write the picture (JPEG with `quality`, colours at half resolution) and return its path."""
    options = {"quality": quality} if path.suffix in (".jpg", ".jpeg") else {}
    Image.fromarray(picture).save(path, **options)
    return path


def _unevenness(shape: tuple[int, int], size_x: float, size_y: float, seed: int) -> Array:
    """Smooth noise with mean 0 and standard deviation 1; sizes in pixels."""
    noise = np.random.default_rng(seed).standard_normal(shape)
    smooth = gaussian_filter(noise, (size_y, size_x), mode="wrap")
    return np.asarray((smooth - smooth.mean()) / smooth.std())
