"""Conversion of Prony series of other programs from and to fractions of the instantaneous modulus.

docs/explanation/relaxation.md has the sources, and one example in each form.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.runtime.arrays import Array


def from_abaqus(g: Sequence[float], tau: Sequence[float]) -> Prony:
    """From *VISCOELASTIC, TIME=PRONY: g_i of the instantaneous modulus, tau_i in s.

    MODULI=INSTANTANEOUS and MODULI=LONG TERM do not change g_i. They tell which modulus the
    constants of *HYPERELASTIC are: `modulus_is` of a scene.
    """
    return _sorted(np.asarray(g, dtype=float), np.asarray(tau, dtype=float))


def from_ls_dyna(
    long_term: float, moduli: Sequence[float], decays: Sequence[float]
) -> tuple[Prony, float]:
    """From *MAT_077_H and others: shear moduli G_i (Pa), a long-term one, decays beta_i (1/s).

    g_i = G_i / (G_inf + sum G_i), tau_i = 1 / beta_i; returns the series and the instantaneous
    shear modulus, Pa. *MAT_006 is one such arm: G_1 = G0 - GI.
    """
    G, instantaneous = np.asarray(moduli, dtype=float), long_term + float(np.sum(moduli))
    return _sorted(G / instantaneous, 1.0 / np.asarray(decays, dtype=float)), instantaneous


def to_ls_dyna(prony: Prony, instantaneous: float) -> tuple[float, list[float], list[float]]:
    """G_inf (Pa), G_i (Pa), beta_i (1/s) of a series and its instantaneous shear modulus (Pa)."""
    return (
        instantaneous * prony.long_term,
        [instantaneous * g for g in prony.fractions],
        [1.0 / tau for tau in prony.times],
    )


def from_febio(g: Sequence[float], t: Sequence[float], g0: float = 1.0) -> tuple[Prony, float]:
    """From "viscoelastic" and "uncoupled viscoelastic": G(t) = g0 + sum g_i exp(-t / t_i).

    G multiplies the stress of the elastic material, which is the long-term stress if g0 is 1.
    Returns the series, and the instantaneous modulus over that of the elastic material.
    """
    now = g0 + float(np.sum(g))
    return _sorted(np.asarray(g, dtype=float) / now, np.asarray(t, dtype=float)), now


def to_febio(prony: Prony) -> tuple[list[float], list[float]]:
    """g_i of the long-term modulus and t_i (s) of a series, for g0 = 1."""
    return [g / prony.long_term for g in prony.fractions], list(prony.times)


def _sorted(fractions: Array, times: Array) -> Prony:
    order = np.argsort(times)
    return Prony(tuple(fractions[order].tolist()), tuple(times[order].tolist()))
