"""From colours to values between 0 and 1: grey scales, named colour maps, legends in a picture."""

from __future__ import annotations

import difflib
from typing import NamedTuple

import matplotlib
import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt
from scipy.spatial import cKDTree

from iceslide_fem.preprocess.footprint.image import Picture
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError

# Distances between colours are relative to the full range of one channel.
FAR = 0.15  # from the bar: such a pixel mixes colours, or the bar is not the picture's
NEAR = 0.015  # a colour of the bar up to the rounding to bytes
MOST_FAR = 0.3  # of the pixels in contact; JPEG at the edges of thin ribs makes up to 0.15
MOST_COLOURED = 0.01  # of pixels that are not grey in a picture taken as a grey scale
BAR_COLOURS = 2048
SQUARE = np.ones((3, 3))  # a pixel and its neighbours
MAX_REACH = 4.0  # pixels over which an unclear pixel takes the value of a clear one


class Reading(NamedTuple):
    """What a picture says; arrays (rows, columns).

    value: 0 to 1 along the bar, 0 on the background; distance: of each colour to the bar (or to
    the background, where that is closer), relative to the full range of one channel; unclear:
    pixels in contact whose value was taken from their neighbours.
    """

    value: Array
    distance: Array
    unclear: Mask


def read_grey(picture: Picture) -> Reading:
    """Values G / 255 of a grey picture, (4.2) to (4.4); the distance is how far it is from grey.

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

    A legend that is taller than wide has its high end on top, another one at the right. Raises
    SceneError if it shows fewer than three colours.
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
    """Place of every pixel's colour on the `bar`; 0 where the `background` is closer.

    At the edges of the background colours mix, and elsewhere some are far from the bar: such a
    pixel takes the value of the nearest clear one, if that is near; at an edge it is in contact if
    that colour makes up at least half of its own. Raises SceneError if the colours are not those
    of the bar.
    """
    # Every colour, one number of its three bytes, is searched for once.
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
