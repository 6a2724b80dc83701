"""Scenes in which k, D and H_V may depend on the contact's age."""

from __future__ import annotations

from iceslide_fem.scene.tables import Tables


def ages_in_warm_rubber(scene: Tables) -> bool:
    """Whether ageing depends on a changing temperature; at a point it depends on time only."""
    return scene.film.contact_age and bool(scene.rubber.heat)


def check_contact_age(scene: Tables) -> None:
    """Raise ValueError where k, D and H_V cannot follow the contact's age."""
    if scene.friction.law != "film":
        raise ValueError(
            f'film.contact_age and friction.law = "{scene.friction.law}" contradict each other: k, '
            'D and H_V are of films; allowed: friction.law = "film"'
        )
    if scene.rubber.relaxation is None:
        raise ValueError(
            "film.contact_age needs rubber that relaxes: k grows with its creep; give "
            "rubber.prony or rubber.dma"
        )
    if ages_in_warm_rubber(scene) and scene.model == "point":
        raise ValueError(
            'film.contact_age, rubber.heat and model = "point" contradict each other: at a point k '
            "follows the age at one temperature of the rubber; allowed: rubber.heat = false, or "
            'model = "slice" or "block"'
        )
