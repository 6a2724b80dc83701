"""One step of block and film, committed whole or not at all; its energies and its error.

`sliding` is the run over time. Each step is a `trial` (film and heat in sub-steps of their own:
`films`), whose `step_error` and `acceptance` decide whether it is taken into the `state`; `energy`
and `ledger` keep the accounts, `plate` says what drives the block, `restart` what goes on.

Imports `interface`, `rubber`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
