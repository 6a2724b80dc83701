"""Rubber that relaxes at finite strain: uniform shear against exact stresses, and a block's cost.

First the rubber of a slice in uniform strain (C10 0.1662, C01 0.1068 MPa instantaneous, g 0.3, tau
5 ms): simple shear of 0.5 at once and within 5 ms, and the heat of a cycle at omega tau = 1. Exact
values: the Prony series, and one point integrated by SciPy to ten digits.
Then thesis_1bar as a block (`--model slice`: as a slice) at a tolerance of 1e-2, elastic and with
five arms (g 0.1 each, tau 0.1, 0.5, 2, 10, 50 ms), in turn: seconds by the clock, medians of three,
the largest memory, and what mu(t) is off by against a tolerance of 1e-3. --quick: a moment on
coarse meshes, once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from statistics import median

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.mechanics.materials import Material
from iceslide_fem.mesh.rubber import rubber_mesh
from iceslide_fem.relaxation.prony import Prony, Relaxation
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import COMPOUNDS
from scripts.studies.command_runs import MOMENT, found, moved
from scripts.studies.common import case, options, table

TAU = 5e-3  # s
ONE = Relaxation(Prony((0.3,), (TAU,)))
B = Material(COMPOUNDS["B"], ONE)
FIVE = "rubber.prony=[[0.1,'0.1 ms'],[0.1,'0.5 ms'],[0.1,'2 ms'],[0.1,'10 ms'],[0.1,'50 ms']]"
RELAXES = FIVE, "rubber.modulus_is=instantaneous"
AT_ONCE = {0.0: 273000.0, 1e-3: 258154.05, 5e-3: 221229.33, 20e-3: 192600.05, 1e3: 191100.0}
RAMP = {2.5e-3: 127815.83, 5e-3: 243411.55, 10e-3: 210344.34}
CYCLES = {0.1: 2579.53, 0.5: 68425.66}  # amplitude -> J/m3
REPEATS = 3


def sheared(gamma: Callable[[float], float], times: Sequence[float] | Array) -> tuple[Array, Array]:
    """Cauchy shear stress (Pa) at the times (s), and the heat (J/m3) of each step."""
    scene = case("thesis_1bar", "model=slice", "numerics.refinement=0.25")
    rubber = HyperelasticBody(rubber_mesh(scene, MPI.COMM_SELF), {"rubber": B})
    X = rubber.space.tabulate_dof_coordinates()[:, :2]
    relaxes, forces = rubber.viscoelasticity, rubber.create_vector()
    assert relaxes is not None
    area = relaxes.total(np.ones_like(relaxes.volume))

    def stress(time: float) -> float:
        F = np.array([[1.0, gamma(time)], [0.0, 1.0]])
        rubber.displacements[:] = X @ (F - np.eye(2)).T
        rubber.internal_forces(forces)
        first_piola = forces.array.reshape(-1, 2).T @ X / area
        return float((first_piola @ F.T)[0, 1])

    found_stress, heat = [stress(times[0])], [0.0]
    now = relaxes.at_rest()
    for before, after in zip(times[:-1], times[1:], strict=True):
        relaxes.begin_step(now, after - before, 293.15)
        found_stress.append(stress(after))
        step = relaxes.end_step(now, after - before, 293.15)
        now = step.after
        heat.append(relaxes.total(step.heat) / area)
    return np.array(found_stress), np.array(heat)


def exact_rows() -> Iterator[tuple[object, ...]]:
    """Deformation, steps, time, stress or heat, exact, relative error."""

    def row(what: str, steps: int, at: str, value: float, exact: float) -> tuple[object, ...]:
        return what, steps, at, f"{value:.2f}", f"{exact:.2f}", f"{value / exact - 1.0:+.1e}"

    times = list(AT_ONCE)
    stress, _ = sheared(lambda time: 0.5, times)
    for time, value, exact in zip(times, stress, AT_ONCE.values(), strict=True):
        yield row("shear 0.5 at once, Pa", len(times) - 1, f"{1e3 * time:g} ms", value, exact)
    for steps in (20, 40):
        ramp = np.linspace(0.0, 10e-3, 2 * steps + 1)
        stress, _ = sheared(lambda time: 0.5 * min(time / 5e-3, 1.0), ramp)
        for time, exact in RAMP.items():
            value = float(stress[np.argmin(np.abs(ramp - time))])
            yield row("shear 0.5 in 5 ms, Pa", 2 * steps, f"{1e3 * time:g} ms", value, exact)
    for amplitude, exact in CYCLES.items():
        per_cycle, cycles = 400, 4
        cycle = np.linspace(0.0, 2.0 * np.pi * TAU * cycles, per_cycle * cycles + 1)
        _, heat = sheared(partial(_sine, amplitude), cycle)
        value = float(heat[-per_cycle:].sum())
        yield row(f"a cycle of shear {amplitude:g}, J/m3", per_cycle, "the last", value, exact)


def _sine(amplitude: float, time: float) -> float:
    """Of omega tau = 1."""
    return float(amplitude * np.sin(time / TAU))


def cost_rows(model: str, moment: Sequence[str], repeats: int) -> Iterator[tuple[object, ...]]:
    """Rubber, steps, iterations, seconds, over elastic; memory, over elastic; errors of mu."""
    changes = f"model={model}", *moment
    kinds = {"elastic": (), "five arms": RELAXES}
    runs: dict[str, list[tuple[float, int]]] = {kind: [] for kind in kinds}
    last = {}
    for _ in range(repeats):
        for kind, more in kinds.items():
            run = found("thesis_1bar", (*changes, "numerics.tolerance=1e-2", *more), 1)
            runs[kind].append((run.summary["wall_s"], run.memory))
            last[kind] = run
    cost = {kind: tuple(map(median, zip(*values, strict=True))) for kind, values in runs.items()}
    for kind, more in kinds.items():
        exact = found("thesis_1bar", (*changes, "numerics.tolerance=1e-3", *more), 1)
        summary, (seconds, memory) = last[kind].summary, cost[kind]
        first = cost["elastic"]
        yield (
            kind, summary["steps"], summary["newton_iterations"],
            f"{seconds:.2f}", f"{seconds / first[0]:.2f}",
            f"{memory / 2**20:.0f}", f"{memory / first[1]:.2f}",
            *moved(last[kind], exact), f"{summary['mu_mean']:.4f}",
        )  # fmt: skip


def main() -> None:
    """Print both tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a moment on coarse meshes, once")
    parser.add_argument("--model", default="block", choices=("slice", "block"))
    arguments = parser.parse_args()
    table(("uniform strain", "steps", "at", "found", "exact", "error"), exact_rows())
    moment, repeats = (MOMENT, 1) if arguments.quick else ((), REPEATS)
    head = (
        "rubber", "steps", "Newton", "wall s", "over elastic", "MiB", "over elastic",
        "largest of mu(t)", "of its mean", "mean mu",
    )  # fmt: skip
    print()
    table(head, cost_rows(arguments.model, moment, repeats))


if __name__ == "__main__":
    main()
