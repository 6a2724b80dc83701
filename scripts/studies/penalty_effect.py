"""Effect of the contact penalty and of the shear ramp: each halved and doubled.

The 1 mm cube of compound B is pressed under static friction, brought to 3 m/s under the film's
shear at its initial height, and last held under a shear of 0.3 p. Rows give the plate's
displacement (change against the default), the deepest penetration relative to it, the largest
pressure, the spread of the pressure over the contact (standard deviation over mean), the fraction
of static friction that is mobilised, and mu. With --slides whole slides are run as well, with
--meshes nothing but slides of the slice at 1 bar, with stiffer penalties on three meshes. Also
under mpirun.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.laws.film import RAMP_SHARE
from iceslide_fem.rubber.block import Block
from iceslide_fem.rubber.build import build_block
from iceslide_fem.rubber.contact import Traction, default_penalty
from iceslide_fem.rubber.press import press, start_sliding
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.scene.materials import BAR, COMPOUNDS
from iceslide_fem.simulate import run
from scripts.studies import common
from scripts.studies.blocks import shear_of_pressure

COMM = MPI.COMM_WORLD
SIZE, SPEED = 1e-3, 3.0  # m, m/s
TOLERANCE = 1e-3
SHEAR = 0.3  # of the pressure
FACTORS = (1.0, 0.5, 2.0)


def cube(model: str, pressure: float, penalty: float = 1.0, ramp: float = 1.0) -> Scene:
    """The cube at a pressure (Pa), with multiples of the default penalty and ramp pressure."""
    standard = default_penalty(COMPOUNDS["B"], SIZE, TOLERANCE)
    return scene_from_dict(
        {
            "name": "penalty-effect",
            "model": model,
            "rubber": {"compound": "B", "length": SIZE, "width": SIZE, "height": SIZE},
            "load": {"pressure": pressure, "speed": SPEED, "duration": 7e-3},
            "numerics": {
                "tolerance": TOLERANCE,
                "penalty": penalty * standard,
                "shear_ramp_pressure": ramp * RAMP_SHARE * pressure,
            },
        }
    )


class Held(NamedTuple):
    """A block held in equilibrium: lengths in m, pressure relative to the nominal one.

    friction: mean size of the tangential traction over the mean pressure; mu: its resultant.
    """

    plate: float
    penetration: float
    largest: float
    spread: float
    friction: float
    mu: float


def held(block: Block, traction: Traction) -> Held:
    """Numbers of the present equilibrium under its `traction`."""
    contact, surface = block.contact, block.surface
    touching = np.where(contact.pressure > 0.0, contact.area, 0.0)
    area = surface.total(np.ones_like(touching), touching)
    mean = surface.total(contact.pressure, touching) / area
    variance = surface.total((contact.pressure - mean) ** 2, touching) / area
    size = surface.total(np.linalg.norm(traction.value, axis=-1), touching)
    along = surface.total(-traction.value[..., 0], touching)
    deepest = COMM.allreduce(float((-contact.gap).max(initial=0.0)), op=MPI.MAX)
    largest = COMM.allreduce(float(contact.pressure.max(initial=0.0)), op=MPI.MAX)
    return Held(
        block.equilibrium.plate_displacement(),
        deepest,
        largest / block.scene.load.pressure,
        variance**0.5 / mean,
        size / (area * mean),
        along / (area * mean),
    )


def phases(scene: Scene) -> dict[str, Held]:
    """The block after the press, at speed, and under constant friction, as far as it gets."""
    found: dict[str, Held] = {}
    block = build_block(scene, COMM)

    def present(law: Any) -> Held:
        displacement = block.surface.displacements(block.rubber.displacements)[..., :-1]
        return held(block, law(block.contact.pressure, displacement))

    try:
        press(block, lambda _: None)
        found["static"] = present(block.static)
        laws: list[Any] = []
        start_sliding(block, lambda point: laws.append(point.law))
        found["sliding"] = present(laws[-1])
        constant = shear_of_pressure(SHEAR)
        block.balance(constant)
        found["constant"] = present(constant)
    except (NotConverged, SimulationStopped):
        pass
    return found


def show(title: str, results: dict[str, dict[str, Held]]) -> None:
    """Print one table; the first case is what the others are compared with."""
    say(f"\n### {title}\n")
    head = ("phase", "case", "plate, um", "change", "penetration", "largest p", "spread of p",
            "t / p", "mu")  # fmt: skip
    standard = next(iter(results.values()))
    names = {"static": "pressed", "sliding": "film at h0", "constant": f"tau = {SHEAR:g} p"}
    rows: list[tuple[object, ...]] = []
    for phase, name in names.items():
        for case, found in results.items():
            if phase not in found:
                rows.append((name, case, "not found in one solve", *6 * ("",)))
                continue
            row = found[phase]
            change = f"{row.plate / standard[phase].plate - 1:+.2%}" if phase in standard else ""
            lengths = (f"{1e6 * row.plate:.3f}", change, f"{row.penetration / row.plate:.2%}")
            pressures = (f"{row.largest:.3f}", f"{row.spread:.3f}")
            rows.append((name, case, *lengths, *pressures, f"{row.friction:.4f}", f"{row.mu:.5f}"))
    show_table(head, rows)


def show_slides(scenes: dict[str, Scene]) -> None:
    """Run whole slides and print what their summaries say of mu."""
    keys = ("mu_peak", "mu_mean", "mu_end")
    say("")
    rows: list[tuple[object, ...]] = []
    for case, scene in scenes.items():
        with tempfile.TemporaryDirectory() as folder:
            try:
                summary = run(scene, COMM.bcast(folder))
            except SimulationStopped as reason:
                rows.append((case, reason, *6 * ("",)))
                continue
            COMM.barrier()
        values = (f"{summary[key]:.5f}" for key in keys)
        work = (summary["steps"], summary["rejected_steps"], summary["newton_iterations"])
        rows.append((case, *values, *work, f"{summary['wall_s']:.1f}"))
    show_table(("case", *keys, "steps", "rejected", "Newton", "s"), rows)


def on_meshes() -> dict[str, Scene]:
    """Slides with 1 to 100 times the default penalty, 1000 E/H, on meshes of three sizes."""
    scenes = {}
    for refinement in (0.5, 1.0, 2.0):
        for factor in (1.0, 10.0, 100.0):
            scene = cube("slice", 1 * BAR, factor)
            numerics = {"refinement": refinement, "tolerance": 3e-3}
            ice = {"heat": "column"}
            changed = {
                "numerics": scene.numerics.model_copy(update=numerics),
                "ice": scene.ice.model_copy(update=ice),
            }
            case = f"refinement {refinement:g}, {1e3 * factor:g} E/H"
            scenes[case] = scene.model_copy(update=changed)
    return scenes


def show_table(head: Sequence[str], rows: list[tuple[object, ...]]) -> None:
    """Print a table on rank 0."""
    if COMM.rank == 0:
        common.table(head, rows)


def say(line: str) -> None:
    """Print on rank 0."""
    if COMM.rank == 0:
        print(line, flush=True)


def main() -> None:
    """Print the tables."""
    parser = common.options(__doc__)
    parser.add_argument("--quick", action="store_true", help="the slice at 1 bar only")
    parser.add_argument("--slides", action="store_true", help="run whole slides as well")
    parser.add_argument("--meshes", action="store_true", help="slides on three meshes instead")
    options = parser.parse_args()
    if options.meshes:
        show_slides(on_meshes())
        return
    cases = {"default": (1.0, 1.0)}
    cases |= {f"penalty x {factor:g}": (factor, 1.0) for factor in FACTORS[1:]}
    cases |= {f"ramp pressure x {factor:g}": (1.0, factor) for factor in FACTORS[1:]}
    for model in ("slice",) if options.quick else ("slice", "block"):
        for pressure in (1 * BAR,) if options.quick else (1 * BAR, 5 * BAR):
            scenes = {case: cube(model, pressure, *factors) for case, factors in cases.items()}
            results = {case: phases(scene) for case, scene in scenes.items()}
            show(f"{model}, {pressure / BAR:g} bar", results)
            if options.slides:
                show_slides(scenes)


if __name__ == "__main__":
    main()
