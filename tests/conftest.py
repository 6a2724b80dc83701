"""NumPy is loaded with the kernels of OpenBLAS that commands choose: what tests and commands
compute is the same to the last digit.
"""

import iceslide_fem  # noqa: F401
