"""1 mm of ice on a cooled steel plate, at 1 bar and 3 m/s; options as for `iceslide run`."""

import sys
from pathlib import Path

from iceslide_fem.cli import main

main(["run", str(Path(__file__).with_suffix(".toml")), *sys.argv[1:]])
