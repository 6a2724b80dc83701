"""The block: hyperelasticity, contact with the ice's plane, equilibrium, press, motion.

Imports `laws`, `mesh`, `fenics`, `scene` and what is below them.
"""
