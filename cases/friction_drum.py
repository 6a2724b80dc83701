"""50 turns of a drum of ice below a block at 2 bar and 4 m/s; options as for `iceslide run`."""

import sys
from pathlib import Path

from iceslide_fem.cli import main

main(["run", str(Path(__file__).with_suffix(".toml")), *sys.argv[1:]])
