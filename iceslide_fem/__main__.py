"""`python -m iceslide_fem`: the command `iceslide`."""

from iceslide_fem.cli import main

if __name__ == "__main__":
    main()
