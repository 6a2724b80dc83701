"""Linear viscoelasticity of rubber: Prony series, creep, and the shift of times with temperature.

Imports only `runtime`.
"""
