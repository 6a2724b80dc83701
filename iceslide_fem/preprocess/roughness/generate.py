"""Random surfaces with a given spectrum and skewness, from a `surface.toml`."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from scipy.stats import gamma

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.input_file import read_text
from iceslide_fem.scene.messages import first_sentence
from iceslide_fem.scene.units import Quantity
from iceslide_fem.surfaces.surface import Surface
from iceslide_fem.surfaces.waves import Waves

Height = Annotated[float, Quantity("m", "1 nm", "10 mm")]
Wave = Annotated[float, Quantity("m", "10 nm", "1 m")]

SKEWNESS_ERROR = 0.02
ROUNDS = 30  # alternations of imposed heights and spectrum


class SurfaceSpec(BaseModel):
    """Parameters of a generated surface: a periodic square of `size` (m) with `pixels` per side.

    The spectrum is constant down to the wave length `rolloff`, falls as q^(-2 (1 + hurst)) to
    `shortest_wave`, and ends there. Either rms height or rms slope is given. A negative skewness
    means plateaus with deep valleys. The n-th realisation has the seed `seed` + n.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    rms_height: Height | None = None
    rms_slope: Annotated[float, Quantity("", "1e-4", "10")] | None = None
    hurst: Annotated[float, Quantity("", "0", "1")]
    rolloff: Wave
    shortest_wave: Wave
    skewness: Annotated[float, Quantity("", "-2", "2")] = 0.0
    size: Wave
    pixels: Annotated[int, Field(ge=16, le=8192, strict=True)]
    seed: Annotated[int, Field(ge=0, strict=True)] = 0

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.rms_height is None) == (self.rms_slope is None):
            given = "none" if self.rms_height is None else "both"
            raise ValueError(f"give one of rms_height and rms_slope; given: {given}")
        if not 2.0 * self.size / self.pixels <= self.shortest_wave <= self.rolloff <= self.size:
            lengths = 2.0 * self.pixel, self.shortest_wave, self.rolloff, self.size
            raise ValueError(
                "two pixels, shortest_wave, rolloff and size must not fall in this order; given: "
                + ", ".join(f"{1e6 * length:.4g} um" for length in lengths)
            )
        return self

    @property
    def pixel(self) -> float:
        """Side of a pixel, m."""
        return self.size / self.pixels


def read_spec(path: Path) -> SurfaceSpec:
    """Read a `surface.toml`; raises SceneError with one sentence if anything is wrong."""
    text = read_text(path, "the surface")
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"{path} is nested too deeply") from None
    except ValueError as error:  # invalid TOML, or an integer with thousands of digits
        raise SceneError(f"{path} is not valid TOML: {error}") from None
    try:
        return SurfaceSpec.model_validate(data)
    except ValidationError as error:
        raise SceneError(
            f"{path}: {first_sentence(error, list(SurfaceSpec.model_fields))}"
        ) from None


def generate(spec: SurfaceSpec, realisation: int = 0) -> Surface:
    """One realisation. Raises SceneError if the spectrum does not allow the skewness.

    Random phases give Gaussian heights. For other heights, the distribution (Pearson's type III)
    and the spectrum are imposed alternately, the spectrum last, so no wave is shorter than the
    cut-off. The skewness of the distribution is increased until the surface has the required one.
    """
    amplitude = _amplitudes(spec)
    random = np.random.default_rng(spec.seed + realisation)
    noise = random.standard_normal((spec.pixels, spec.pixels))
    start = _with_spectrum(np.fft.rfft2(noise), amplitude, spec)
    asked = spec.skewness
    if not asked:
        return Surface(start, spec.pixel, periodic=True)
    for _ in range(8):
        heights = _shaped(start, amplitude, asked, spec)
        found = float(np.mean(heights**3) / np.mean(heights**2) ** 1.5)
        if abs(found - spec.skewness) <= SKEWNESS_ERROR:
            return Surface(heights, spec.pixel, periodic=True)
        if found * asked > 0:
            asked = float(np.clip(asked * spec.skewness / found, -8, 8))
    raise SceneError(
        f"skewness = {spec.skewness:g} cannot be had with this spectrum: heights reach "
        f"{found:.2f}; raise hurst or the distance from rolloff to shortest_wave"
    )


def _amplitudes(spec: SurfaceSpec) -> Array:
    """Amplitudes of all waves, with the wanted rms height or slope."""
    waves = Waves((spec.pixels, spec.pixels), spec.pixel)
    q = waves.q
    knee, end = 2.0 * np.pi / spec.rolloff, 2.0 * np.pi / spec.shortest_wave
    amplitude = np.maximum(q, knee) ** -(1.0 + spec.hurst)
    amplitude[(q > end * (1.0 + 1e-9)) | (q == 0.0)] = 0.0
    power = waves.count * amplitude**2
    if spec.rms_height is not None:
        return np.asarray(amplitude * spec.rms_height / np.sqrt(power.sum()))
    assert spec.rms_slope is not None  # by validation
    return np.asarray(amplitude * spec.rms_slope / np.sqrt((q**2 * power).sum()))


def _with_spectrum(waves: NDArray[np.complex128], amplitude: Array, spec: SurfaceSpec) -> Array:
    """Heights with these amplitudes and the phases of `waves`."""
    size = np.abs(waves)
    phase = np.divide(waves, size, out=np.ones_like(waves), where=size > 0.0)
    shape = (spec.pixels, spec.pixels)
    return np.asarray(np.fft.irfft2(amplitude * phase * spec.pixels**2, s=shape))


def _shaped(start: Array, amplitude: Array, skewness: float, spec: SurfaceSpec) -> Array:
    """`start` with heights of this skewness in the same order, and the same spectrum."""
    rank = (np.arange(start.size) + 0.5) / start.size
    shape = 4.0 / skewness**2
    wanted = np.sign(skewness) * gamma.ppf(rank if skewness > 0 else 1.0 - rank, shape)
    heights = start
    for _ in range(ROUNDS):
        ordered = np.empty(start.size)
        ordered[np.argsort(heights, axis=None)] = wanted
        heights = _with_spectrum(np.fft.rfft2(ordered.reshape(start.shape)), amplitude, spec)
    return heights
