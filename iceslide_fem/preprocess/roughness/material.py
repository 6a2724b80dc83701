"""The rubber: its modulus, and its relaxation if contacts have an age."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.relaxation_options import rubber_in
from iceslide_fem.preprocess.roughness.case import RoughnessCase
from iceslide_fem.relaxation.prony import Prony, Relaxation
from iceslide_fem.relaxation.shift import AnyShift, NoShift, Shift
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.materials import YOUNGS_MODULUS
from iceslide_fem.scene.relaxation import series


class Material(NamedTuple):
    """name: for output; modulus: E* = E / (1 - nu^2), Pa, instantaneous if viscoelastic.

    prony: None for elastic rubber; stretched: a_T at the requested temperature.
    """

    name: str
    modulus: float
    prony: Prony | None = None
    stretched: float = 1.0


def material(case: RoughnessCase) -> Material:
    """The rubber of a case. Raises SceneError, one sentence."""
    scene = None if case.scene is None else load_scene(case.scene)
    name, modulus = _elastic(case, scene)
    if not case.ages:
        return Material(name, modulus)
    relaxation = _relaxation(case, scene)
    if case.prony is not None and case.modulus_is == "long-term":
        modulus /= relaxation.prony.long_term
    return Material(name, modulus, relaxation.prony, _stretched(case, relaxation.shift))


def _elastic(case: RoughnessCase, scene: Scene | None) -> tuple[str, float]:
    """Name and E* (Pa), incompressible by default; instantaneous for a scene with a series."""
    if case.modulus is not None:
        return f"E = {case.modulus / 1e6:.4g} MPa", case.modulus / 0.75
    compound = case.compound or "B"
    if scene is not None:
        rubber = scene.mooney_rivlin
        if scene.rubber.compound is None:
            modulus = rubber.youngs_modulus / (1.0 - rubber.poissons_ratio**2)
            return f"the rubber of {case.scene}", modulus
        compound = scene.rubber.compound
    stiffer = 1.0
    if scene is not None and scene.rubber.modulus_is == "long-term":
        assert scene.rubber.relaxation is not None  # by its validation
        stiffer = 1.0 / scene.rubber.relaxation.prony.long_term
    return f"compound {compound}", stiffer * YOUNGS_MODULUS[compound] / 0.75


def _relaxation(case: RoughnessCase, scene: Scene | None) -> Relaxation:
    """Arms and shift, from --prony or from the scene."""
    shift: AnyShift = NoShift() if case.wlf is None else Shift(*case.wlf)
    if isinstance(case.prony, tuple):
        return Relaxation(series(case.prony), shift)
    if case.prony is not None:
        found, said = rubber_in(case.prony).relaxation, str(case.prony)
    else:
        assert scene is not None  # by the case's validation
        found, said = scene.rubber.relaxation, str(case.scene)
    if found is None:
        raise SceneError(f"the rubber of {said} is elastic, and --age asks for one that relaxes")
    return found if case.wlf is None else Relaxation(found.prony, shift)


def _stretched(case: RoughnessCase, shift: AnyShift) -> float:
    """a_T at the given temperature. Raises SceneError if it is missing or has no effect."""
    if isinstance(shift, NoShift):
        if case.temperature is not None:
            raise SceneError(
                "--temperature has no meaning for times that do not shift with it; leave it out, "
                "or give --wlf"
            )
        return 1.0
    if case.temperature is None:
        raise SceneError("--temperature is missing: the times of this rubber shift with it")
    factor = float(shift(case.temperature))
    if not np.isfinite(factor):
        raise SceneError(
            f"the WLF shift has no value at --temperature {case.temperature - ZERO_CELSIUS:.4g} "
            "degC; allowed: a warmer one"
        )
    return factor
