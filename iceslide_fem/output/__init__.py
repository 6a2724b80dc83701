"""Output of a run: tables, fields, summary. Files are readable at any time.

Imports `coupling` and what is below it; `table` and `summary` import no FEniCS.
"""
