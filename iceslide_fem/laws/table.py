"""The friction law of a scene: one row for each name of `friction.law`.

Any other value names a class in a user's file.
"""

from __future__ import annotations

from collections.abc import Callable

from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.laws.aged_film import AgedFilm
from iceslide_fem.laws.carrying_film import CarryingFilm, carrying_film
from iceslide_fem.laws.coulomb import Coulomb
from iceslide_fem.laws.film import FilmLaw, film_law
from iceslide_fem.laws.interface_law import InterfaceLaw
from iceslide_fem.laws.law_file import read_law
from iceslide_fem.laws.limited_film import limited_film
from iceslide_fem.laws.protocol import Law
from iceslide_fem.laws.user_law import UserLaw
from iceslide_fem.laws.weakening import check_weakening
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene


def law_of(scene: Scene) -> InterfaceLaw:
    """The law of `scene`. Runs a law's file; raises SceneError."""
    return LAWS.get(scene.friction.law, user_law)(scene)


def user_law(scene: Scene) -> UserLaw:
    """Coulomb's law, or one in a file. Raises SceneError."""
    friction, ice = scene.friction, scene.ice
    if friction.law == "coulomb":
        law: Law = Coulomb.of(friction.mu, friction.table)
        name = "coulomb"
    else:
        law, name = read_law(*friction.law_file, friction.parameters)
    bound = UserLaw(law, name, ice.temperature, ice.melting_temperature)
    passes = scene.model == "point" and ice.motion == "sliding"
    if passes and bound.fields and bound.frame(scene.film.carrier) == "rubber":
        raise SceneError(
            f'the friction law {name} has carrier = "rubber", which contradicts model = '
            '"point" where ice slides: its history is older than the ice below; allowed: '
            'model = "slice" or "block", or ice.motion = "attached"'
        )
    check_weakening(scene, bound)
    return bound


def film(scene: Scene) -> FilmLaw | AgedFilm | CarryingFilm:
    """The film law, with the scene's options: limiting shear, contact age, or voids that carry."""
    strength = scene.shear_strength
    law = film_law(scene) if strength is None else limited_film(scene, strength)
    if scene.film.voids == "carry":
        return carrying_film(law, scene)
    age = contact_age(scene)
    return law if age is None else AgedFilm(law, age, scene.ice.temperature)


LAWS: dict[str, Callable[[Scene], InterfaceLaw]] = {"film": film, "coulomb": user_law}
