"""The thesis's LS-DYNA run at 1 bar, 3 m/s for 7 ms; options as for `iceslide run`."""

import sys
from pathlib import Path

from iceslide_fem.cli import main

main(["run", str(Path(__file__).with_suffix(".toml")), *sys.argv[1:]])
