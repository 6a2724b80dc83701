"""Finished runs: read, drawn, shown, and pages about them.

`results` reads and draws, `report` writes pages of HTML. Imports `runs` and what is below it; no
DOLFINx.
"""
