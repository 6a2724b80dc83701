"""One step of block, film and ice, committed whole or not at all.

`sliding` is the run over time. `coupled_step` makes each step: predict, film (in substeps of its
own: `subcycling`), equilibrium, correct, `accept`. `step_error` measures its errors against
`limits`, `energy` and `ledger` balance it, `plate` has its loads, `state` what is committed;
`restart` turns that into arrays (`layouts`) and back.

Imports `interface`, `rubber`, `laws`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
