"""The friction subroutine of the thesis (appendix A), line by line as it is printed.

R. Leonardi, Politecnico di Torino, 2017-18; numbers in comments are those of its lines. What looks
like a slip is kept, and may be undone one by one by a parameter, which 0 leaves as printed:

- 6402, 6607: the speed is 3 m/s (6400), whatever the slip speed is;
- 6408: press = 1e5 Pa in the squeeze rate and in mu, whatever the load (`press`);
- 6459: saturation is asked of Hss, the mean of all nodes, for each of them;
- 6461, 6518, 6566: node 1 melts by its temperature, nodes 2 and 3 by xx, which is never set: as 0
  it is below T_m for ever, and they only melt once saturated (`xx_set` = 1: by temperature);
- 6468, 6473: the flux into the ice is (5.6) of the run's time, not of the time since melting began;
- 6511-6512, 6559-6560: nodes 2 and 3 begin each step with h and Hs of uh(1) and uh(2), where the
  means of all are kept (6617, 6618); what they store in uh(4), (5), (7), (8) nobody reads;
- 6600: Hss is 70e-9 m when sliding begins, as h is;
- 6606: in the pre-load hh is not set, so that uh(1) would be what memory holds: here it is uc(5);
- 6611: (Hs+Hs2+Hs3)/mm+nn+oo is without brackets 3 Hs + 2 m (`brackets` = 1: over mm+nn+oo).

All three nodes are in contact here, so AA, BB, CC, mm, nn and oo are 1.
"""

import numpy as np

from iceslide_fem.laws.protocol import Response

RHO, L, LAMBDA, ETA, ALPHA, T_0, T_M = 916.0, 330e3, 2.25, 1.8e-3, 1.105e-6, 269.15, 273.15
PI = 3.14  # 6346


class ThesisSubroutine:
    fields = {"h_m": 70e-9, "Hss_m": 70e-9, "time_s": 0.0}
    carrier = "rubber"  # its history is that of a node of its mesh

    def __init__(self, k=0.266, D=29e-6, H_V=2.86e-6, press=1e5, brackets=0, xx_set=0):
        self.k, self.H_V, self.press = k, H_V, press
        self.brackets, self.xx_set = brackets, xx_set
        self.vv = 3.0  # 6400
        self.cost1 = k * ETA * self.vv**2 / (RHO * L)  # 6402
        self.cost2 = LAMBDA * (T_M - T_0) / (RHO * L * (PI * ALPHA) ** 0.5)  # 6405
        self.cost3 = 8.0 * press / (3.0 * ETA * D**2)  # 6410

    def mu(self, hh):
        return self.k * ETA * self.vv / (self.press * hh)  # 6607

    def node(self, h, Hss, melts, time, dt):
        """One node's h and Hs: 6456-6473, and the same again for the others."""
        squeeze = self.cost3 * h**3
        melt = self.cost1 / h - self.cost2 / time**0.5
        rate = np.where(Hss < self.H_V, np.where(melts, melt, 0.0) - squeeze, melt)
        return h + dt * rate, Hss + dt * squeeze

    def respond(self, contact, state, surface, dt):
        h, Hss, time = (state[name] for name in self.fields)
        if dt > 0.0:
            time = time + dt
            heat = self.mu(h) * contact.pressure * np.abs(contact.speed)
            warm = surface.temperature(heat) >= T_M - 1e-9
            first, Hs = self.node(h, Hss, warm, time, dt)
            others, Hs2 = self.node(h, Hss, warm & bool(self.xx_set), time, dt)
            h = np.maximum((first + 2.0 * others) / 3.0, 1e-10)  # 6606
            total = Hs + 2.0 * Hs2
            mean = total / 3.0 if self.brackets else total + 2.0  # 6611
            Hss = np.where(Hss < self.H_V, mean, self.H_V)
        mu = self.mu(h)
        new = {"h_m": h, "Hss_m": Hss, "time_s": time}
        return Response(mu * contact.pressure, mu, new)
