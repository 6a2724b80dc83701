"""`iceslide export tir` and `iceslide export fmu`: a wheel for vehicle programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from iceslide_fem.runtime.errors import SceneError

Folder = Annotated[
    Path, typer.Argument(metavar="DIR", help="What iceslide wheel wrote.", show_default=False)
]
Out = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Where to write; else in DIR.", show_default=False),
]


def tir(
    folder: Folder,
    load: Annotated[
        str | None,
        typer.Option(metavar="N", help="Of the wheel: 3432N; else its own.", show_default=False),
    ] = None,
    out: Out = None,
) -> dict[str, Any]:
    """A tyre property file: Magic Formula of MF 5.2, pure longitudinal and lateral slip."""
    from iceslide_fem.exchange.exported import formulas_of, wheel_in, write_tir
    from iceslide_fem.exchange.magic_formula import SAID
    from iceslide_fem.scene.command_options import as_number
    from iceslide_fem.scene.units import Quantity

    case, newtons = wheel_in(folder), None
    if load is not None:
        allowed = Quantity("N", "1 N", "1e6 N")
        try:
            newtons = allowed.in_range(as_number(load))
        except ValueError as error:
            raise SceneError(
                f'--load "{load}" {error}; allowed: {allowed.low} to {allowed.high}'
            ) from None
    path = out or folder / "wheel.tir"
    found = formulas_of(case, newtons)
    write_tir(case, found, path, folder)
    for name, curve in (("along", found.along), ("across", found.across)):
        one = curve.formula
        typer.echo(
            f"{name}: B = {one.B:.5g}, C = {one.C:.5g}, D = {one.D:.5g}, E = {one.E:.5g}; largest "
            f"error {one.error:.2%} of the peak"
        )
        if one.error > SAID:
            typer.echo(
                f"Note: the formula misses the friction {name} the wheel by up to {one.error:.1%} "
                "of its peak: its shape is none of this formula."
            )
    typer.echo(str(path))
    return {"file": path, **found._asdict()}


def fmu(folder: Folder, out: Out = None) -> dict[str, Any]:
    """A functional mock-up unit (FMI 2.0, co-simulation): friction over speed and slip."""
    from iceslide_fem.exchange.exported import wheel_in, write_unit

    path = out or folder / "wheel.fmu"
    write_unit(wheel_in(folder), path, folder)
    typer.echo(str(path))
    return {"file": path}
