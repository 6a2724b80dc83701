"""Finished runs: reading, pictures, and HTML pages.

`results` reads and draws, `report` writes HTML pages. Imports `runs` and what is below it; no
DOLFINx.
"""
