"""Effect of the contact penalty: halved, doubled, and much stiffer.

The 1 mm cube of compound B is pressed under static friction with the default penalty, with half of
it and with twice as much: the plate's displacement, its change, the deepest penetration relative to
the displacement, and the largest pressure over the nominal one. With --meshes slides of the slice
at 1 bar, 3 m/s and a tolerance of 3e-3 on columns of ice, with stiffer penalties on three meshes.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.block import build_block
from iceslide_fem.mechanics.contact import default_penalty
from iceslide_fem.mechanics.press import press
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.scene.materials import BAR, COMPOUNDS
from iceslide_fem.simulate import run
from scripts.studies.common import options, table

SIZE, TOLERANCE = 1e-3, 1e-3  # m


def cube(model: str, pressure: float, penalty: float, **numerics: float) -> Scene:
    """The cube at a pressure (Pa), with a multiple of the default penalty."""
    standard = default_penalty(COMPOUNDS["B"], SIZE, TOLERANCE)
    return scene_from_dict(
        {
            "name": "penalty-effect",
            "model": model,
            "rubber": {"compound": "B", "length": SIZE, "width": SIZE, "height": SIZE},
            "load": {"pressure": pressure, "speed": 3.0, "duration": 7e-3},
            "ice": {"heat": "column"},
            "numerics": {"tolerance": TOLERANCE, "penalty": penalty * standard, **numerics},
        }
    )


def presses(quick: bool) -> Iterator[tuple[object, ...]]:
    """Rows of the press."""
    for model in ("slice",) if quick else ("slice", "block"):
        for bar in (1.0,) if quick else (1.0, 5.0):
            default = 0.0
            for factor in (1.0, 0.5, 2.0):
                block = build_block(cube(model, bar * BAR, factor), MPI.COMM_SELF)
                press(block, lambda _: None)
                plate, contact = block.equilibrium.plate_displacement(), block.contact
                default = default or plate
                yield (
                    f"{model}, {bar:g} bar", f"penalty x {factor:g}", f"{1e6 * plate:.3f}",
                    f"{plate / default - 1.0:+.2%}", f"{-float(contact.gap.min()) / plate:.2%}",
                    f"{float(contact.pressure.max()) / (bar * BAR):.3f}",
                )  # fmt: skip


def slides() -> Iterator[tuple[object, ...]]:
    """Rows of whole slides with 1 to 100 times the default penalty, 1000 E/H."""
    for refinement in (0.5, 1.0, 2.0):
        for factor in (1.0, 10.0, 100.0):
            scene = cube("slice", BAR, factor, refinement=refinement, tolerance=3e-3)
            with tempfile.TemporaryDirectory() as folder:
                summary = run(scene, folder)
            values = (f"{summary[key]:.5f}" for key in ("mu_peak", "mu_mean", "mu_end"))
            work = (summary[key] for key in ("steps", "rejected_steps", "newton_iterations"))
            name = f"refinement {refinement:g}, {1e3 * factor:g} E/H"
            yield (name, *values, *work, f"{summary['wall_s']:.1f}")


def main() -> None:
    """Print a table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="the slice at 1 bar only")
    parser.add_argument("--meshes", action="store_true", help="slides on three meshes instead")
    given = parser.parse_args()
    if given.meshes:
        of_mu = ("mu_peak", "mu_mean", "mu_end")
        table(("case", *of_mu, "steps", "rejected", "Newton", "s"), slides())
        return
    of_press = ("plate, um", "change", "penetration / plate", "largest p / p")
    table(("press", "case", *of_press), presses(given.quick))


if __name__ == "__main__":
    main()
