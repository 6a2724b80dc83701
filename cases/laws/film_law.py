"""The film law, written by the protocol of laws: for a check of both, and as a pattern.

The shear is faded in with the pressure, because the film's does not go to zero with it.
"""

import numpy as np

from iceslide_fem import CONTACT_TABLES, Response
from iceslide_fem.film.law import Surface, implicit_stage
from iceslide_fem.laws.film import FilmLaw as SceneFilm


class FilmLaw:
    fields = {"log_height": float(np.log(70e-9)), "squeezed_height_m": 0.0}

    def __init__(self, ramp_pressure=5e3):
        self.friction = SceneFilm(CONTACT_TABLES["B"], None, ramp_pressure)

    def respond(self, contact, state, surface, dt):
        log_height, squeezed = (state[name] for name in self.fields)
        if dt > 0.0:
            loads = self.friction.loads(*contact)
            loads = loads._replace(free_height=np.maximum(loads.free_height, squeezed))
            ice = Surface(surface.offset, surface.resistance, surface.melted_flux)
            end = implicit_stage(log_height, squeezed, dt, loads, ice)
            log_height, squeezed = end.log_height, end.squeezed_height
        shear, by_pressure = self.friction.shear(*contact, np.exp(log_height))
        state = {"log_height": log_height, "squeezed_height_m": squeezed}
        return Response(shear, by_pressure, state)
