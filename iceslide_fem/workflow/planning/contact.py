"""Effect of the contact's age on k, before a run."""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.conditions import exposure
from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene
from iceslide_fem.workflow.planning.row import Row


def aged_contact(scene: Scene) -> list[Row]:
    """k at the end of contact under the nominal pressure, and the creep compliance."""
    if (age := contact_age(scene)) is None:
        return []
    passes = scene.ice.motion == "sliding" and scene.film.carrier == "ice"
    time = exposure(scene) if passes else scene.load.duration
    at = np.array([time]), np.array([scene.ice.temperature])
    k = float(age.under_constant(np.array([scene.load.pressures.first]), *at).k[0])
    compliance = float(age.relaxation.compliance(*at)[0])
    modulus = readable(3.0 * scene.mooney_rivlin.shear_modulus, "Pa")
    return [
        Row("film", "k at the end", f"{k:.3g}", f"of contact that is {readable(time, 's')} old"),
        Row("film", "compliance at the end", f"{compliance:.3g}", f"E_0 J, E_0 = {modulus}"),
    ]
