"""Studies: programs that print the tables and draw the pictures of docs/, one module each.

Listed in docs/validation/studies.md. They import the package, `common` and at most each other, and
are imported by nothing but tests. The package comes first: it chooses kernels of OpenBLAS before
NumPy is loaded.
"""

import iceslide_fem  # noqa: F401
