"""Checks of scenes with load-bearing water in voids, and with wet ice."""

from __future__ import annotations

from iceslide_fem.scene.tables import Tables


def check_voids(scene: Tables) -> None:
    """Raise ValueError if voids cannot bear load, or ice cannot be wet, in this scene."""
    film, ice = scene.film, scene.ice
    if film.voids != "carry":
        if ice.is_wet:
            raise ValueError(
                "ice.water needs voids that carry: where squeeze-out stops nothing says what more "
                'water does; allowed: film.voids = "carry", or no ice.water'
            )
        return
    on_nodes = ice.motion == "sliding" and film.carrier == "ice" and scene.model != "point"
    if isinstance(ice.water, tuple) and not on_nodes:
        raise ValueError(
            "ice.water has rows over x, which need ice that passes below a slice or a block and "
            'carries the films; allowed: ice.motion = "sliding" and film.carrier = "ice", or a '
            "number"
        )
    for key, there, allowed in (
        ("film.k", film.k is not None, "film.contact, or a compound's table"),
        ("film.contact_age", film.contact_age, "film.contact_age = false"),
        ("film.dry_stress", film.dry_stress is not None, "no film.dry_stress"),
        ("rows of water.viscosity", scene.water.table is not None, "one viscosity"),
        ("rubber.mesh", scene.rubber.mesh is not None, "rubber.length and rubber.sipes"),
        ("rubber.heat", bool(scene.rubber.heat), "rubber.heat = false"),
        ('film.pressure = "nominal"', film.pressure == "nominal", "'local'"),
        (
            f'friction.law = "{scene.friction.law}"',
            scene.friction.law != "film",
            'friction.law = "film"',
        ),
        (
            'numerics.film_integrator = "explicit-euler"',
            scene.numerics.film_integrator == "explicit-euler",
            "'sdirk2', 'sdirk3' or 'implicit-euler'",
        ),
    ):
        if there:
            raise ValueError(
                f'film.voids = "carry" and {key} contradict each other: the water in the voids and '
                f"the contact are found together; allowed: {allowed}"
            )
