"""Films and heat under a moving block: where they live, how contact points and ice nodes meet.

`build` chooses a film frame (`on_rubber`, `on_ice`, `user_law_on_ice`; what the coupled step knows
of it is in `film_frame`), its ice (`ice_columns`, `ice_continuum` with its `ice_modes`, `ice_mesh`;
points that share it give their heat to an `ice_surface`) and its rubber (`rubber_columns`,
`rubber_mesh`); `heat_models` makes those.
Points meet nodes on a `surface_grid`, which for passing ice is a `window`, over which `water`
moves. None of these keeps anything of a step: a model is asked for the body as it answers `under`
or `above` given contacts.

Imports `rubber`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
