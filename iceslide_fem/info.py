"""What a scene means before it is run: layer depths, dimensionless numbers, time scales, cost."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from iceslide_fem.materials import (
    ICE_DIFFUSIVITY,
    MELTING_ENTHALPY,
    RUBBER_CONDUCTIVITY,
    RUBBER_HEAT_CAPACITY,
    WATER_VISCOSITY,
)
from iceslide_fem.scene import Scene
from iceslide_fem.units import readable


class Row(NamedTuple):
    """One line of the table: the group it stands in, name, value with unit, and its meaning."""

    group: str
    quantity: str
    value: str
    meaning: str


def describe(scene: Scene) -> list[Row]:
    """Rows for `iceslide info`, at the scene's nominal pressure."""
    rows = _heat(scene) + _film(scene)
    return rows if scene.model == "point" else rows + _rubber(scene) + _mesh(scene)


def _heat(scene: Scene) -> list[Row]:
    """Depth sqrt(alpha t) warmed in time t, and Peclet number v L / alpha."""
    v, L, duration = scene.load.speed, scene.rubber.length, scene.load.duration
    rubber_diffusivity = RUBBER_CONDUCTIVITY / (scene.rubber.density * RUBBER_HEAT_CAPACITY)
    in_ice = readable(sqrt(ICE_DIFFUSIVITY * duration), "m")
    in_rubber = readable(sqrt(rubber_diffusivity * duration), "m")
    return [
        Row("heat", "warm layer in ice", in_ice, "√(α t) at the end"),
        Row("heat", "warm layer in rubber", in_rubber, "√(α t) at the end"),
        Row("heat", "transit time", readable(L / v, "s"), "L / v, an ice point's time under it"),
        Row("heat", "Péclet number", f"{v * L / ICE_DIFFUSIVITY:.3g}", "v L / α in ice"),
    ]


def _film(scene: Scene) -> list[Row]:
    """Contact parameters, friction at t = 0 (5.29, 5.30) and the film law's two time scales.

    Squeeze-out alone: h0^2/h^2 = 1 + 2 K3 h0^2 t with K3 = 8 p / (3 eta D^2) (6.5); melting
    alone: h^2/h0^2 = 1 + 2 K1 t / h0^2 with K1 = k eta v^2 / (rho L).
    """
    p, v, h0, eta = (
        scene.load.pressure,
        scene.load.speed,
        scene.film.initial_height,
        WATER_VISCOSITY,
    )
    contact = scene.contact_parameters(p)
    k, D, H_V = float(contact.k), float(contact.D), float(contact.H_V)
    tau = k * eta * v / h0
    squeeze_time = 1.0 / (2.0 * 8.0 * p / (3.0 * eta * D**2) * h0**2)
    melt_time = h0**2 / (2.0 * k * eta * v**2 / MELTING_ENTHALPY)
    return [
        Row("film", "k", f"{k:.3g}", "relative contact area at the nominal pressure"),
        Row("film", "D", readable(D, "m"), "mean asperity diameter"),
        Row("film", "H_V", readable(H_V, "m"), "mean free height; saturated when squeezed full"),
        Row("film", "friction at t = 0", f"{tau / p:.3g}", "μ = k η v / (h₀ p)"),
        Row("film", "friction power at t = 0", readable(tau * v, "W/m^2"), "k η v² / h₀"),
        Row("film", "squeeze-out time", readable(squeeze_time, "s"), "1 / (2 K₃ h₀²)"),
        Row("film", "melting time", readable(melt_time, "s"), "h₀² / (2 K₁)"),
    ]


def _rubber(scene: Scene) -> list[Row]:
    """Stiffness, expected strain p/E and time of a shear wave through the height, H sqrt(rho/G)."""
    rubber, load, constants = scene.rubber, scene.load, scene.mooney_rivlin
    E, G, nu = constants.youngs_modulus, constants.shear_modulus, constants.poissons_ratio
    wave = rubber.height * sqrt(rubber.density / G)
    return [
        Row("rubber", "Young's modulus", readable(E, "Pa"), f"Poisson's ratio {nu:.3f}"),
        Row("rubber", "compression", f"{load.pressure / E:.2%}", "p / E, the expected strain"),
        Row(
            "rubber",
            "shear wave time",
            readable(wave, "s"),
            f"H √(ρ/G), {wave / load.duration:.2%} of the run: quasi-static if small",
        ),
    ]


def _mesh(scene: Scene) -> list[Row]:
    """Size of the rubber's mesh, and unknowns of its quadratic displacements."""
    from iceslide_fem.meshing import divisions  # loads gmsh, which a point does not need

    size = divisions(scene)
    counts = " x ".join(f"{size[name]:.0f}" for name in ("nx", "ny", "nz") if name in size)
    dimensions = 2 if scene.model == "slice" else 3
    smallest, largest = readable(size["smallest_m"], "m"), readable(size["largest_m"], "m")
    half = "the half with y ≥ 0" if scene.model == "block" else "plane strain"
    return [
        Row("mesh", "cells of rubber", f"{size['cells']:.0f}", f"{counts or 'own mesh'}, {half}"),
        Row("mesh", "cell edges", f"{smallest} to {largest}", "finest at the contact's edges"),
        Row(
            "mesh",
            "unknowns",
            f"{dimensions * size['quadratic_nodes']:.0f}",
            "displacements, quadratic elements",
        ),
    ]
