"""One step of block, film and ice, committed whole or not at all.

`sliding` is the run over time. `coupled_step` makes each step: predict, film (in substeps:
`subcycling`), equilibrium, correct, `accept`. `step_error` measures its errors.
`energy` and `ledger` have its energy balance, `plate` its loads, `state` the committed state.
`restart` turns that state into arrays (`layouts`) and back.

Imports `interface`, `rubber`, `laws`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
