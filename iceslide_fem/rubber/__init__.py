"""The block: hyperelasticity, contact with the ice's plane, equilibrium, press, motion.

Imports `film` (its friction law), `mesh`, `fenics`, `scene` and what is below them.
"""
