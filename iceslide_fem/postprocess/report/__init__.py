"""Report pages of a run, of several runs, of a ladder, and of an unfinished run.

Each page is one self-contained HTML file. Pages of footprints and sweeps are in the folders of
their commands. plotly.js in the page draws; `png` draws the same charts by matplotlib. Imports
`results`, `runs` and what is below them; no DOLFINx.
"""
