"""The names of `iceslide_fem` for scripts and notebooks: results as labelled arrays with units.

A module for each group of names; `iceslide_fem` loads them when they are asked for. Imports
`simulate`, `preprocess`, `workflow` and what is below them.
"""
