"""Friction laws as the solver asks for them.

`interface_law` is what it asks, `table` chooses the scene's law. `film` is the water film's.
`protocol` is the published protocol of a user's own law, `user_law` and `user_stage` make an
interface law of it, `law_file` loads it; `coulomb` is Coulomb's friction by that protocol.
`weakening` refuses friction that no block can follow, `points` steps any law at points.

Imports `film`, `scene` and what is below them.
"""
