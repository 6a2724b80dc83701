"""The roughness of the ice: figures of a self-affine surface, or a map of heights."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Annotated, ClassVar, Self

from pydantic import model_validator

from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.units import Quantity, Table, key
from iceslide_fem.surfaces.power_spectrum import PowerSpectrum, self_affine

LEAST_RANGE = 2.0  # longest wave over the shortest one
STEEPEST = 2.0  # rms slope
PIXELS_PER_WAVE = 4.0  # of the shortest wave of a map
Wave = Annotated[float, Quantity("m", "1 nm", "1 m")]


class Roughness(Table):
    """Waves of a surface: figures, or a map."""

    where: ClassVar[str] = "roughness"  # name of the table, for messages

    rms: Annotated[float, Quantity("m", "0 m", "1 mm")] = key(
        0.0, "rms height of the waves from `longest` to `shortest`. 0 is smooth."
    )
    hurst: Annotated[float, Quantity("", "0.05", "1")] = key(
        0.8, "Hurst exponent of a self-affine surface. Polished surfaces have 0.7 to 0.9."
    )
    longest: Wave | None = key(
        None, "Longest wave: the roll-off, and shorter than what the mesh resolves."
    )
    shortest: Wave | None = key(
        None,
        "Shortest wave that rubber follows. It matters most, and is known least: `iceslide "
        "hysteresis` prints its effect. Of a map without it 4 pixels.",
    )
    map: InputFile | None = key(
        None,
        "Path of a height map instead of `rms`, `hurst` and `longest`, in the formats "
        "of `iceslide roughness`; relative to the scene file.",
    )
    pixel: Annotated[float, Quantity("m", "1 nm", "10 mm")] | None = key(
        None, "Pixel of a map that does not say it."
    )
    height_unit: Annotated[float, Quantity("m", "1 nm", "1 m")] | None = key(
        None, 'Unit of the lengths of a map that does not say it, as `"1 um"`. Without it metres.'
    )

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.map is None:
            for name in ("pixel", "height_unit"):
                if getattr(self, name) is not None:
                    raise ValueError(
                        f"{self.where}.{name} is that of {self.where}.map, which is missing"
                    )
            self._check_figures()
        elif self.rms or self.longest is not None:
            name = "rms" if self.rms else "longest"
            raise ValueError(
                f"{self.where}.{name} and {self.where}.map contradict each other: the map has "
                "it; allowed: one of them"
            )
        if (found := self.spectrum) is not None and found.slope > STEEPEST:
            raise ValueError(
                f"{self.where} has an rms slope of {found.slope:.3g}; allowed: up to "
                f"{STEEPEST:g}, by a longer shortest wave or a smaller rms height"
            )
        return self

    def _check_figures(self) -> None:
        """Raise ValueError if the waves of a self-affine surface are missing or in disorder."""
        if not self.rms:
            return
        for name in ("longest", "shortest"):
            if getattr(self, name) is None:
                raise ValueError(
                    f"{self.where}.{name} is missing: an rms height is that of a range of waves; "
                    "give longest and shortest"
                )
        assert self.longest is not None and self.shortest is not None
        if not self.longest >= LEAST_RANGE * self.shortest:
            raise ValueError(
                f"{self.where}.longest = {1e6 * self.longest:.4g} um is not at least "
                f"{LEAST_RANGE:g} times {self.where}.shortest = {1e6 * self.shortest:.4g} um"
            )

    @property
    def is_rough(self) -> bool:
        """Whether the ice has waves."""
        return self.rms > 0.0 or self.map is not None

    @property
    def spectrum(self) -> PowerSpectrum | None:
        """The power spectrum; None of smooth ice. Raises SceneError if its map cannot be read."""
        if self.map is not None:
            stamp = self.map.stat().st_mtime
            units = self.pixel, self.height_unit
            return _of_map(self.where, self.map, stamp, *units, self.shortest)
        if not self.rms:
            return None
        assert self.longest is not None and self.shortest is not None  # by validation
        return self_affine(self.rms, self.hurst, self.longest, self.shortest)


class IceRoughness(Roughness):
    """Waves of the ice's surface that deform the rubber."""

    where = "ice.roughness"
    gamma: Annotated[float, Quantity("", "0.3", "1")] = key(
        1.0,
        "Part of the elastic energy that stays where contact is partial. 1 is the theory of 2001,"
        " 0.5 a later correction.",
    )


class RubberRoughness(Roughness):
    """Waves of the rubber's surface, whose contact with smooth ice the film's table is of."""

    where = "rubber.roughness"


@lru_cache(maxsize=8)
def _of_map(
    where: str,
    path: Path,
    _stamp: float,
    pixel: float | None,
    unit: float | None,
    shortest: float | None,
) -> PowerSpectrum:
    """The spectrum of a height map; stamp: time of the file's last change, s."""
    from iceslide_fem.surfaces.measured_spectrum import measured  # takes long to import
    from iceslide_fem.surfaces.read import read_surface
    from iceslide_fem.surfaces.surface import levelled

    surface = levelled(read_surface(path, pixel, unit))
    least = PIXELS_PER_WAVE * surface.resolution
    if shortest is not None and shortest < least * (1.0 - 1e-3):
        raise ValueError(
            f"{where}.shortest = {1e6 * shortest:.4g} um is shorter than "
            f"{PIXELS_PER_WAVE:g} pixels of its map; allowed: at least {1e6 * least:.4g} um"
        )
    if (wave := shortest or least) > 0.25 * min(surface.size):
        raise ValueError(
            f"{where}.map has sides of {1e6 * min(surface.size):.4g} um, less than four of "
            f"the shortest wave, {1e6 * wave:.4g} um"
        )
    return measured(surface, wave)
