"""Friction that falls as the ice gets warm: mu from `cold` to `melting` at the melting point.

The temperature at the end of the step depends on the heat that the friction makes in it: it is
found by bisection, because friction only falls with it.
"""

import numpy as np

from iceslide_fem.laws.protocol import Response


class FallsWithTemperature:
    fields = {}

    def __init__(self, cold=0.3, melting=0.03, width=4.0):
        self.cold, self.melting, self.width = cold, melting, width

    def mu(self, temperature, surface):
        below = np.clip((surface.melting_temperature - temperature) / self.width, 0.0, 1.0)
        return self.melting + (self.cold - self.melting) * below

    def respond(self, contact, state, surface, dt):
        low, high = surface.offset, np.full_like(surface.offset, surface.melting_temperature)
        high = np.maximum(low, high)
        for _ in range(50):
            middle = 0.5 * (low + high)
            heat = self.mu(middle, surface) * contact.pressure * np.abs(contact.speed)
            warmer = surface.temperature(heat) > middle
            low, high = np.where(warmer, middle, low), np.where(warmer, high, middle)
        mu = self.mu(0.5 * (low + high), surface)
        return Response(mu * contact.pressure, mu)
