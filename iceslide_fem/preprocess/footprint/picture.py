"""The picture of a footprint: reading, rotation, cropping, and conversion of colours to 0 to 1.

Pictures are arrays (rows, columns, 3) of bytes. Colours are converted by a grey scale, a named
colour map, or a legend in the picture.
"""

from __future__ import annotations

import difflib
import warnings
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps, UnidentifiedImageError
from PIL.ImageColor import getrgb
from scipy.ndimage import binary_dilation, distance_transform_edt
from scipy.spatial import cKDTree

from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular

Picture = NDArray[np.uint8]
FORMATS = ("PNG", "JPEG", "TIFF")
# Distances between colours are relative to the full range of one channel.
FAR = 0.15  # from the bar: mixed colours, or a wrong bar
NEAR = 0.015  # a colour of the bar within rounding to bytes
MOST_FAR = 0.3  # of the pixels in contact; JPEG causes up to 0.15 at edges of thin ribs
MOST_COLOURED = 0.01  # fraction of coloured pixels allowed in a grey picture
BAR_COLOURS = 2048
SQUARE = np.ones((3, 3))  # a pixel and its neighbours
MAX_REACH = 4.0  # pixels, largest distance of the clear pixel that replaces an unclear one


class Box(NamedTuple):
    """A rectangle of pixels from the top left: left and top inclusive, right and bottom
    exclusive.
    """

    left: int
    top: int
    right: int
    bottom: int

    def __str__(self) -> str:
        """As options take it."""
        return ",".join(map(str, self))


def read_picture(path: Path | str, behind: tuple[int, int, int] = (255, 255, 255)) -> Picture:
    """The picture as red, green and blue from 0 to 255; 16-bit grey is scaled.

    It is rotated by the camera's orientation tag. Transparent pixels become `behind`. Raises
    SceneError if it is not a readable PNG, JPEG or TIFF, or if its values are not colours.
    """
    check_regular(Path(path), "the picture")
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path, formats=FORMATS) as image:
            # Warnings mean damage of a still readable picture.
            image = ImageOps.exif_transpose(image) or image
            if image.mode[0] in "IF":
                low, high = np.asarray(image).min(), np.asarray(image).max()
                if image.mode == "F" or not 0 <= low <= high <= 65535:
                    raise ValueError(
                        f"its values, {low:g} to {high:g}, are no grey of 8 or 16 bits; pressures "
                        "as numbers go into --pressure-map"
                    )
                grey = np.asarray(image, dtype=float) * (255.0 / 65535.0)
                image = Image.fromarray(np.rint(grey).astype(np.uint8))
            elif "A" in image.getbands() or "transparency" in image.info:
                seen = image.convert("RGBA")
                image = Image.alpha_composite(Image.new("RGBA", seen.size, behind), seen)
            return np.array(image.convert("RGB"))
    except UnidentifiedImageError:
        raise SceneError(f"{path} is not a picture; allowed: {', '.join(FORMATS)}") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise SceneError(f"cannot read the picture {path}: {reason}") from None


def colour(name: str) -> tuple[int, int, int]:
    """Red, green, blue of a colour's name or #rrggbb. Raises SceneError if it is neither."""
    try:
        red, green, blue = getrgb(name)[:3]
    except ValueError:
        raise SceneError(
            f'the background "{name}" is not a colour; allowed: a name such as "white", "#rrggbb", '
            'or "none"'
        ) from None
    return red, green, blue


def rotate(picture: Picture, degrees: float, fill: tuple[int, int, int]) -> Picture:
    """The picture rotated counter-clockwise and enlarged to its corners, with `fill` around it.

    Colours are not interpolated: each pixel is one of the original.
    """
    if degrees % 360.0 == 0.0:
        return picture
    image = Image.fromarray(picture)
    return np.array(image.rotate(degrees, Image.Resampling.NEAREST, expand=True, fillcolor=fill))


def cut(picture: Picture, box: Box, what: str) -> Picture:
    """The part of the picture in `box`. Raises SceneError, naming `what`, if it is outside."""
    height, width = picture.shape[:2]
    if box.left >= box.right or box.top >= box.bottom:
        raise SceneError(
            f"the {what} box {_text(box)} is empty: it is LEFT,TOP,RIGHT,BOTTOM in pixels"
        )
    if box.left < 0 or box.top < 0 or box.right > width or box.bottom > height:
        raise SceneError(
            f"the {what} box {_text(box)} is outside the picture, which has {width} x {height} "
            "pixels"
        )
    return picture[box.top : box.bottom, box.left : box.right]


def _text(box: Box) -> str:
    return ",".join(str(edge) for edge in box)


class Reading(NamedTuple):
    """Values of a picture; arrays (rows, columns).

    value: 0 to 1 along the bar, 0 on the background; distance: of each colour to the bar (or to the
    background if closer), relative to the full range of a channel; unclear: pixels in contact with
    the value of a neighbour.
    """

    value: Array
    distance: Array
    unclear: Mask


def read_grey(picture: Picture) -> Reading:
    """Values G / 255 of a grey picture, (4.2) to (4.4); the distance is that from grey.

    Raises SceneError for a coloured picture.
    """
    channels = picture.astype(float) / 255.0
    distance = np.ptp(channels, axis=2)
    share = float((distance > FAR).mean())
    if share > MOST_COLOURED:
        raise SceneError(
            f"the picture is coloured ({share:.0%} of its pixels are not grey); give the colour "
            "map it was made with, or the box of its legend"
        )
    value = channels @ np.array([0.299, 0.587, 0.114])
    return Reading(value, distance, np.zeros(value.shape, dtype=bool))


def named_bar(name: str) -> Array:
    """Colours (n, 3), 0 to 1, of a colour map that matplotlib knows by `name`."""
    if name not in matplotlib.colormaps:
        close = difflib.get_close_matches(name.lower(), list(matplotlib.colormaps), n=1)
        hint = f"; did you mean {close[0]}?" if close else " to matplotlib"
        raise SceneError(f'the colour map "{name}" is not known{hint}')
    return np.asarray(matplotlib.colormaps[name](np.linspace(0.0, 1.0, 256)))[:, :3]


def lowest_colour(bar: Array) -> tuple[int, int, int]:
    """Red, green, blue (0 to 255) of the low end of a bar of colours (n, 3), 0 to 1."""
    red, green, blue = np.rint(255.0 * bar[0]).astype(int).tolist()
    return red, green, blue


def legend_bar(legend: Picture) -> Array:
    """Colours (n, 3), 0 to 1, along a legend cut from a picture, from its low to its high end.

    The high end is on top of a tall legend, and at the right of a wide one. Raises SceneError if it
    has fewer than three colours.
    """
    across = 1 if legend.shape[0] >= legend.shape[1] else 0
    width = legend.shape[across]
    middle = np.take(legend, np.arange(width // 4, width - width // 4), axis=across)
    bar: Array = np.median(middle, axis=across) / 255.0
    if across == 1:
        bar = bar[::-1]
    if len(bar) < 3 or np.ptp(bar, axis=0).max() < FAR:
        raise SceneError("the legend box shows a single colour; it should span the colour bar")
    return bar


def read_colours(picture: Picture, bar: Array, background: tuple[int, int, int] | None) -> Reading:
    """Position of every pixel's colour on the `bar`; 0 if the `background` is closer.

    Colours mix at edges of the background, and some are far from the bar. Such a pixel takes the
    value of the nearest clear pixel within reach. At an edge it is in contact if the clear colour
    is at least half of its colour. Raises SceneError if the colours do not match the bar.
    """
    # Each distinct colour, as one number of three bytes, is searched once.
    red, green, blue = np.moveaxis(picture.astype(np.int64), 2, 0)
    codes, index = np.unique(red << 16 | green << 8 | blue, return_inverse=True)
    index = index.reshape(picture.shape[:2])
    colours = np.column_stack([codes >> 16, codes >> 8 & 255, codes & 255]) / 255.0
    place = np.linspace(0.0, 1.0, BAR_COLOURS)
    knots = np.linspace(0.0, 1.0, len(bar))
    fine = np.column_stack([np.interp(place, knots, channel) for channel in bar.T])
    to_bar, nearest = cKDTree(fine).query(colours)
    distance, value = to_bar[index], place[nearest][index]
    contact = np.ones(value.shape, dtype=bool)
    edge = np.zeros(value.shape, dtype=bool)
    if background is not None:
        colours -= np.array(background) / 255.0
        to_background = np.linalg.norm(colours, axis=1)[index]
        contact = distance <= to_background
        distance = np.minimum(distance, to_background)
        edge = binary_dilation(contact, SQUARE) & binary_dilation(~contact, SQUARE)
        edge &= distance > NEAR
    far = contact & (distance > FAR)
    if far.sum() > MOST_FAR * contact.sum():
        raise SceneError(
            f"the colours of the picture are not those of the bar: {far.sum() / contact.sum():.0%} "
            f"of its pixels are farther than {FAR:g} from it (relative to the range of a channel); "
            "check the colour map, the legend box, the crop box and the background"
        )
    clear = contact & ~edge & ~far
    if not clear.any():
        return Reading(np.where(contact, value, 0.0), distance, np.zeros_like(contact))
    reach, (row, column) = distance_transform_edt(~clear, return_indices=True)
    unclear = (edge | far) & (reach <= MAX_REACH)
    value[unclear] = value[row[unclear], column[unclear]]
    mixed = unclear & edge
    own, full = colours[index[mixed]], colours[index[row[mixed], column[mixed]]]
    contact[mixed] = (own * full).sum(axis=1) >= 0.5 * (full * full).sum(axis=1)
    return Reading(np.where(contact, value, 0.0), distance, unclear & contact)
