"""Films and heat under a moving block, and the transfer between contact points and ice nodes.

`build` chooses a film frame (interface: `film_frame`): `on_rubber`, `on_ice`, or `growing_on_ice`
where pieces of ice keep the history of their contact. It chooses the ice, too (`ice_columns`,
`ice_continuum` with `ice_modes`, `ice_mesh`, `passing_mesh` for sliding ice) and the rubber that
takes heat (`rubber_mesh`, or the columns of `film.rubber_heat`). Points that share ice
(`surface_grid`) exchange heat with it through `ice_surface`, in the balance of `ice_balance`. A
`surface_grid` places the points among the nodes; for sliding ice it is a moving `window`. Ice
between two passes is `resting`. None of these objects holds the state of a step.

Imports `rubber`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
