"""Films and heat under a moving block: who carries them, how contact points and ice nodes meet.

Imports `rubber`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
