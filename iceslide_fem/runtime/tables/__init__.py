"""Reader of tables in text files of any program.

`text` decodes files. `layout` finds separators, decimal marks and headings. `cells` converts
numbers. `columns` gives columns by name in SI units. `grid` gives maps. Imports `runtime` only.
"""
