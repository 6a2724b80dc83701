"""The model ladder: one scene on every rung, error against cost.

Imports `simulate`, `results`, `planning` and what is below them.
"""
