"""A tread block with zigzag sipes from a CAD file; options as for `iceslide run`."""

import sys
from pathlib import Path

from iceslide_fem.cli import main

main(["run", str(Path(__file__).with_suffix(".toml")), *sys.argv[1:]])
