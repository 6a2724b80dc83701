"""What a run writes: tables, fields, summary. Whatever has been written stays readable.

Imports `coupling` and what is below it; `table` and `summary` import no FEniCS.
"""
