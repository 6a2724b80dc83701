"""The picture of a footprint: reading, rotating, cropping. Arrays (rows, columns, 3) of bytes."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps, UnidentifiedImageError
from PIL.ImageColor import getrgb

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular

Picture = NDArray[np.uint8]
FORMATS = ("PNG", "JPEG", "TIFF")


class Box(NamedTuple):
    """A rectangle of pixels: left and top inside, right and bottom outside, from the top left."""

    left: int
    top: int
    right: int
    bottom: int


def read_picture(path: Path | str, behind: tuple[int, int, int] = (255, 255, 255)) -> Picture:
    """The picture as red, green and blue from 0 to 255; 16-bit grey is scaled to that.

    It stands as programs show it, which turn what a camera calls turned. Transparent pixels become
    `behind`. Raises SceneError if it is not a readable PNG, JPEG or TIFF, or has values that are no
    colours.
    """
    check_regular(Path(path), "the picture")
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path, formats=FORMATS) as image:
            # Warnings are of damage that leaves a readable picture.
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
    """The picture turned counter-clockwise, grown so that its corners fit; `fill` around it.

    Colours are not mixed: each pixel is one of the original.
    """
    if degrees % 360.0 == 0.0:
        return picture
    image = Image.fromarray(picture)
    return np.array(image.rotate(degrees, Image.Resampling.NEAREST, expand=True, fillcolor=fill))


def cut(picture: Picture, box: Box, what: str) -> Picture:
    """The part of the picture in `box`. Raises SceneError, with `what`, if it is not inside."""
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
