"""Friction laws, as the solver uses them.

`protocol` is what the solver asks of a law, and the published protocol of a user's law. `table`
chooses the law of a scene: `film`, the water film, with its shear limited (`limited_film`), its
contact ageing (`aged_film`) or its voids bearing load (`carrying_film`); `coulomb`; or a user's
law, of which `user_law` and `user_stage` make an interface law. `points` integrates any law at
points.

Imports `film`, `scene` and what is below them.
"""
