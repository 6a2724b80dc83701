"""The rubber block: hyperelasticity, contact with the ice plane, equilibrium, press, motion.

Imports `laws`, `mesh`, `fenics`, `scene` and what is below them.
"""
