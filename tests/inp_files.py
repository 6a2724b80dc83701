"""Input files of Abaqus for tests: a slice of 3 x 1 quadrilaterals, a block of 2 x 1 x 1 hexahedra.

The slice is 3 mm long and 1 mm high, the block 2 mm long, 1 mm wide and 1 mm high; sides are
tagged up to the top. Lengths are in mm.
"""

SLICE_NODES = """\
*NODE
1, -1.5, 0
2, -0.5, 0
3, 0.5, 0
4, 1.5, 0
5, -1.5, 1
6, -0.5, 1
7, 0.5, 1
8, 1.5, 1
"""
SLICE_CELLS = "1, 1, 2, 6, 5\n2, 2, 3, 7, 6\n3, 3, 4, 8, 7\n"
BOTTOM = "11, 1, 2\n12, 2, 3\n13, 3, 4\n"
ENDS = "14, 1, 5\n15, 4, 8\n"
TOP = "21, 5, 6\n22, 6, 7\n23, 7, 8\n"
FACETS = (
    f"*ELEMENT, TYPE=T2D2, ELSET=contact\n{BOTTOM}{ENDS}*ELEMENT, TYPE=T2D2, ELSET=plate\n{TOP}"
)
SLICE = f"*HEADING\na slice\n{SLICE_NODES}*ELEMENT, TYPE=CPE4H, ELSET=rubber\n{SLICE_CELLS}{FACETS}"

BLOCK_NODES = """\
*NODE
1, -1, 0, 0
2, 0, 0, 0
3, 1, 0, 0
4, -1, 1, 0
5, 0, 1, 0
6, 1, 1, 0
7, -1, 0, 1
8, 0, 0, 1
9, 1, 0, 1
10, -1, 1, 1
11, 0, 1, 1
12, 1, 1, 1
"""
BLOCK_CELLS = "1, 1, 2, 5, 4, 7, 8, 11, 10\n2, 2, 3, 6, 5, 8, 9, 12, 11\n"
