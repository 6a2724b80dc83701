"""Estimated cost of a run: steps, unknowns, memory, and time on one core; and what it will warn of.

Steps follow the film and the heat below it, so they are counted in a point run at the same
tolerance, which takes a tenth of a second. A block is solved when its motion requires it: some
dozens of times, then half as often as a point steps at 1e-2, more at smaller tolerances. On sliding
ice a step is limited to the passage of some cells. Memory and time per step depend on the unknowns.
The constants are from runs on one 2020s core with OpenBLAS and compiled forms
(scripts.studies.accuracy_cost). The estimates are within a factor of two of those runs
(tests/test_cost.py), and of slices and blocks with sipes, from CAD, wet or relaxing
(scripts.studies.expected_cost). Other scenes may deviate more.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil
from typing import NamedTuple

from iceslide_fem.film.conditions import scene_passes
from iceslide_fem.film.doubts import WITHOUT_MELTING
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.output.table import HistoryRow
from iceslide_fem.runs.doubts import before_run
from iceslide_fem.runs.notes import ENVELOPE, LARGEST_FRICTION
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene
from iceslide_fem.workflow.planning.passes import single_pass

FEWEST_STEPS = 40  # least number, for the motion of a block
STEPS_PER_POINT_STEP = 0.5  # at a tolerance of 1e-2
TIGHTER = 0.55  # additional power of 1 / tolerance in a block's number of steps
FIXED_STEPS = 40  # of a block with fixed steps
INERTIA_STEPS = 2.0  # times as many steps with the rubber's mass, for its waves
# With sipes or grooves, whose walls may meet: times as many steps, and times as long a step.
CUT_STEPS, CUT_WORK = 1.5, 2.0
# Under a point's friction above this, edges fold and lift off: times as many steps.
FOLDING, FOLDING_STEPS = 0.7, 3.0
# Seconds of the start, and per step: a constant, and per n^(3/2) (slice) or n^(4/3) (block) of n
# rubber unknowns, as the direct solver scales; a constant, and per node of continuum ice and of
# meshed ice. Fitted and printed by scripts.studies.accuracy_cost.
START_SECONDS = 2.3
PLANE_SECONDS = 0.016, 1.3e-8
SPACE_SECONDS = 0.036, 2.8e-7
ICE_SECONDS = 0.0, 9e-6
MESHED_SECONDS = 0.0, 1.2e-5
POINT_SECONDS = 8e-4  # per step of a point: fitted there, too
START_STEPS = 15  # press and speed ramp, in steps
POINT_MEMORY = 0.16e9  # bytes, of which nearly all is programs


class Cost(NamedTuple):
    """steps; unknowns of rubber and of meshed ice; memory (bytes) and time (s) on one core."""

    steps: int
    rubber_unknowns: int
    ice_unknowns: int
    memory: float
    time: float


def estimate(scene: Scene) -> Cost:
    """Expected cost of a run. Raises SceneError if the user's mesh is unsuitable."""
    steps = expected_steps(scene)
    if scene.model == "point":
        return Cost(steps, 0, 0, POINT_MEMORY, START_SECONDS + POINT_SECONDS * steps)

    from iceslide_fem.mesh.size import memory_needed, unknowns  # loads gmsh

    size = unknowns(scene)
    seconds = step_seconds(size.dimensions, size.rubber, size.ice, scene.ice.heat)
    time = START_SECONDS + (steps + START_STEPS) * work_of_cuts(scene) * seconds
    return Cost(steps, size.rubber, size.ice, memory_needed(size), time)


def step_seconds(dimensions: int, rubber: int, ice: int, heat: str) -> float:
    """Time (s) per step with these unknowns of rubber, and of ice with this `ice.heat`."""
    fixed, work = PLANE_SECONDS if dimensions == 2 else SPACE_SECONDS
    of_ice, of_node = MESHED_SECONDS if heat == "mesh" else ICE_SECONDS
    ice_seconds = of_ice + of_node * ice if ice else 0.0
    return fixed + work * rubber ** work_power(dimensions) + ice_seconds


def work_of_cuts(scene: Scene) -> float:
    """Time of a step over that of a block with as many unknowns and without sipes or grooves."""
    return CUT_WORK if _is_cut(scene) else 1.0


def _is_cut(scene: Scene) -> bool:
    """Whether the block has walls that may meet."""
    if not scene.rubber.is_drawn:
        return bool(scene.rubber.cuts or scene.rubber.grooves)
    from iceslide_fem.mesh.rubber import tagged_rubber  # loads gmsh

    return "walls" in tagged_rubber(scene).facets


def work_power(dimensions: int) -> float:
    """Exponent of the number of unknowns in the work of a step."""
    return 3 / 2 if dimensions == 2 else 4 / 3


@lru_cache(maxsize=1)
def point_rows(scene: Scene) -> list[HistoryRow]:
    """History of the scene's point level, of its first pass, at the nominal pressure."""
    # a block runs for its duration, independent of the transit time of ice
    motion = scene.ice.motion if scene.model == "point" else "attached"
    ice = scene.ice.model_copy(update={"motion": motion})
    update: dict[str, object] = {"model": "point", "ice": ice}
    if scene.model != "point":
        update["numerics"] = scene.numerics.model_copy(update={"max_step": None})
    return point_history(single_pass(scene).model_copy(update=update))[0]


def expected_steps(scene: Scene) -> int:
    """Accepted steps of a run, from t = 0."""
    numerics, duration = scene.numerics, scene.load.duration
    if scene.model != "point" and not INTEGRATORS[numerics.film_integrator].estimate:
        return ceil(duration / numerics.max_step) if numerics.max_step else FIXED_STEPS
    rows = point_rows(scene)
    steps = len(rows) - 1
    if scene.model == "point":
        return steps * scene_passes(scene).number
    more = (1e-2 / numerics.tolerance) ** TIGHTER
    fewest = FEWEST_STEPS + STEPS_PER_POINT_STEP * steps * more
    if numerics.max_step:
        fewest = max(fewest, duration / numerics.max_step)
    if scene.ice.motion == "sliding":  # a step is at most the passage of some cells
        from iceslide_fem.mesh.ice import cells_in_a_step, window_cell

        distance = cells_in_a_step(scene) * window_cell(scene)
        fewest = max(fewest, duration * scene.load.speeds.largest / distance)
    folds = max(row.mu for row in rows) > FOLDING
    for applies, times in (
        (_is_cut(scene), CUT_STEPS),
        (scene.rubber.inertia, INERTIA_STEPS),
        (folds, FOLDING_STEPS),
    ):
        fewest *= times if applies else 1.0
    return scene_passes(scene).number * ceil(fewest - 1e-6)  # against rounding


def foreseen(scene: Scene) -> list[str]:
    """Everything that is in doubt about a scene, and what its run will warn of, without full stop.

    Raises SceneError if a user's mesh is unsuitable.
    """
    return before_run(scene) + expected(scene)


def expected(scene: Scene) -> list[str]:
    """What a run of the scene will warn of besides `runs.doubts`, without full stop.

    Raises SceneError if a user's mesh is unsuitable.
    """
    return _film_doubts(scene) + ([] if scene.model == "point" else _memory(scene))


def _film_doubts(scene: Scene) -> list[str]:
    """Films and friction of a point at the nominal pressure outside the validated range."""
    low, high, _ = ENVELOPE["film", "initial_height"]
    rows = point_rows(scene)
    heights = [row.film_height_m for row in rows]
    found = []
    dry = scene.film.dry_stress is not None
    if (min(heights) < low and not dry) or max(heights) > high:
        found.append(
            f"films of a point get {readable(min(heights), 'm')} to {readable(max(heights), 'm')} "
            f"high; {readable(low, 'm')} to {readable(high, 'm')} are known to work"
        )
    rides = scene.ice.is_wet  # water exists without melting
    film = scene.friction.law == "film" and not dry and not rides
    if film and not any(row.melted_fraction for row in rows):
        found.append(f"the ice below a point does not melt: {WITHOUT_MELTING}")
    largest = max(rows, key=lambda row: row.mu)
    if largest.mu > LARGEST_FRICTION and largest.time_s > 0.0:
        found.append(f"friction of a point rises to {largest.mu:.3g}")
    return found


def _memory(scene: Scene) -> list[str]:
    """Warning of a run that is refused for memory."""
    from iceslide_fem.mesh.size import shortage  # loads gmsh

    short = shortage(scene)
    return [f"a run is refused, because it {short}"] if short else []
