"""The run of Klapproth's paper at 5 bar, 4 m/s for 5 ms; options as for `iceslide run`."""

import sys
from pathlib import Path

from iceslide_fem.cli import main

main(["run", str(Path(__file__).with_suffix(".toml")), *sys.argv[1:]])
