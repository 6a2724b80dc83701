"""The friction law of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, StrictFloat, StrictInt, StringConstraints, model_validator

from iceslide_fem.runtime.files import is_regular
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.mu_table import read_table
from iceslide_fem.scene.table import Table
from iceslide_fem.scene.units import Quantity

Parameter = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,99}$", strict=True)]


class Friction(Table):
    """The law of friction: the water film's, Coulomb's, or a class in a file, "my_law.py:MyLaw".

    `mu`, or `table` (the path of a CSV file), belong to Coulomb's law (docs/reference/laws.md).
    `parameters` are keyword arguments of the class.
    """

    law: Annotated[str, StringConstraints(strict=True, max_length=1000)] = "film"
    mu: Annotated[float, Quantity("", "0", "2")] | None = None
    table: InputFile | None = None
    parameters: dict[Parameter, Annotated[StrictFloat, Field(allow_inf_nan=False)] | StrictInt] = {}

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        path, name = self.law_file
        if self.law not in ("film", "coulomb"):
            if not name.isidentifier() or path.suffix != ".py":
                raise ValueError(
                    f'friction.law = "{self.law}" is not known; allowed: "film", "coulomb", or the '
                    'class of a file, as in "my_law.py:MyLaw"'
                )
            if not is_regular(path):
                raise ValueError(f'friction.law = "{self.law}": there is no file {path}')
            object.__setattr__(self, "law", f"{path.resolve()}:{name}")
        elif self.parameters:
            raise ValueError("friction.parameters are of a law in a file of your own only")
        given = [key for key in ("mu", "table") if getattr(self, key) is not None]
        if self.law == "coulomb" and len(given) != 1:
            raise ValueError('friction.law = "coulomb" needs one of friction.mu and friction.table')
        if self.law != "coulomb" and given:
            raise ValueError(
                f'friction.{given[0]} is of friction.law = "coulomb"; here it is "{self.law}"'
            )
        if self.table is not None:
            read_table(self.table)
        return self

    @property
    def law_file(self) -> tuple[Path, str]:
        """File and class of a user law."""
        path, _, name = self.law.rpartition(":")
        return Path(path), name
