"""Films and heat under a moving block, and the transfer between contact points and ice nodes.

`build` chooses a film frame (`on_rubber`, `on_ice`, `user_law_on_ice`; interface: `film_frame`),
its ice (`ice_columns`, `ice_continuum` with `ice_modes`, `ice_mesh`) and its rubber
(`rubber_columns`, `rubber_mesh`). `heat_models` builds these bodies. Points that share ice exchange
heat with it through `ice_surface`.
A `surface_grid` places the points among the nodes. For sliding ice it is a moving `window`, over
which `water` moves. None of these objects holds the state of a step: `under` and `above` return the
thermal response of a body for given contacts.

Imports `rubber`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
