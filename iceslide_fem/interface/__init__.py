"""Films and heat under a moving block: who carries them, how contact points and ice nodes meet.

`build` chooses a carrier (`on_rubber`, `on_ice`, `remembering_ice`; what the coupled step knows of
it is in `carriers`), its ice (`ice_columns`, or `ice_continuum` with its `ice_modes`; points that
share it give their heat to an `ice_surface`) and its rubber (`rubber_columns`).
Points meet nodes on a `surface_grid`, which for passing ice is a `window`, over which `water`
moves. None of these keeps anything of a step: a model is asked for the body as it answers `under`
or `above` given contacts.

Imports `rubber`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
