"""The one reader of tables in text files, whichever program has written them.

`text` decodes, `layout` finds separators, decimal marks and headings, `cells` has the numbers,
`columns` gives columns by name in SI units, `grid` gives maps. Imports `runtime` only.
"""
