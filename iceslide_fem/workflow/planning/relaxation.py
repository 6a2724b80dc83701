"""Relaxation of the rubber in a run, for `iceslide info`."""

from __future__ import annotations

from iceslide_fem.runtime.units import ZERO_CELSIUS, readable
from iceslide_fem.scene import Scene
from iceslide_fem.workflow.planning.row import Row


def relaxation_rows(scene: Scene) -> list[Row]:
    """Young's modulus at the end of the run and after infinite time; empty for elastic rubber."""
    relaxation = scene.rubber.relaxation
    if relaxation is None:
        return []
    modulus, temperature = scene.mooney_rivlin, scene.ice.temperature
    fractions = (
        float(relaxation.modulus(scene.load.duration, temperature)),
        (relaxation.prony.long_term),
    )
    end, long_term = (
        readable(modulus.stiffer(fraction).youngs_modulus, "Pa") for fraction in fractions
    )
    shift = float(relaxation.shift(temperature))
    at = f"{temperature - ZERO_CELSIUS:.3g} °C: relaxation times are {shift:.3g} times those given"
    return [
        Row("rubber", "modulus at the end", end, f"E(t), of a strain held since t = 0 at {at}"),
        Row("rubber", "long-term modulus", long_term, "E after infinite time; above at t = 0"),
    ]
