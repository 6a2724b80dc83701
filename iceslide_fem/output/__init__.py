"""What a run writes: tables, fields, summary. Whatever has been written stays readable.

Imports `rubber`, `fenics`, `files` and what is below them; nothing of a step.
"""
