"""Friction laws, as the solver uses them.

`protocol` is the interface of a law, `table` chooses the law of a scene, `film` is the law of
the water film. `protocol` is the published protocol of a user law. `user_law` and `user_stage` make
an interface law from it, `law_file` loads it. `coulomb` is Coulomb friction by this protocol.
`weakening` refuses velocity-weakening friction that no step can resolve. `points` integrates any
law at points.

Imports `film`, `scene` and what is below them.
"""
