"""What the commands on footprints make of each key of a scene.

`iceslide wheel --scene` computes `TAKEN`, refuses `NOT_COMPUTED`, and has no use for `UNRELATED`.
`--contact-age` takes `OF_AGE` of a scene, and says what else of its physics is another one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any, NamedTuple

from iceslide_fem.scene import Scene
from iceslide_fem.scene.rules import CARRY, FILM_LAW, ROWS, ROWS_OF_ICE, Is

# The rubber, and its contact with the ice.
OF_AGE = (
    *"rubber.compound rubber.C10 rubber.C01 rubber.D1 rubber.nu rubber.prony rubber.dma".split(),
    *"rubber.wlf rubber.shift_factors rubber.modulus_is rubber.temperature".split(),
    *"film.contact film.contact_age film.contact_modulus".split(),
    *"film.k_scale film.D_scale film.H_V_scale".split(),
)
# The lug that water flows out of, with film.voids = "carry".
OF_LUG = ("model rubber.length rubber.width rubber.sipes rubber.sipe_width rubber.grooves").split()
# Of rubber that takes heat.
OF_HEAT = (
    "rubber.density rubber.conductivity rubber.heat_capacity film.conductance water.conductivity"
).split()
TAKEN = (
    *OF_AGE,
    *OF_LUG,
    "rubber.heat",
    *OF_HEAT,
    *"ice.temperature ice.conductivity ice.density ice.heat_capacity".split(),
    *"ice.depth ice.base ice.base_temperature ice.layers".split(),
    *"ice.melting_temperature ice.latent_heat ice.water water.viscosity".split(),
    *"film.k film.D film.H_V film.initial_height film.water_speed film.dry_stress".split(),
    *"film.dry_softening film.dry_residual film.voids film.refreeze".split(),
    *"film.dry_speed film.dry_width film.dry_rows film.dry_shift".split(),
    "ice.roughness.gamma",
    *(
        f"{body}.roughness.{name}"
        for body in ("ice", "rubber")
        for name in "rms hurst longest shortest map pixel height_unit".split()
    ),
    *"load.passes load.period film.between".split(),
    *"friction.law friction.mu friction.table friction.parameters".split(),
)
UNRELATED: Mapping[str, Sequence[str]] = {
    "the wheel has its own load, speed and tread": (
        "load.pressure load.speed load.duration load.static_friction load.interpolation "
        "load.pressure_scale load.speed_scale rubber.height rubber.edge_radius rubber.chamfer "
        "rubber.draft_angle rubber.outline rubber.mesh rubber.mesh_unit rubber.mesh_tags "
        "rubber.step rubber.step_unit rubber.step_up rubber.step_along rubber.step_plane "
        "rubber.step_gap rubber.step_heal rubber.step_cells rubber.layers "
        "rubber.wall_friction rubber.sipe_depth"
    ).split(),
    "a wheel computes one set of inputs": ["uncertainty"],
    "bristles have no mass": ["rubber.inertia"],
    "only with rows, which are refused": ["rubber.row_pitch"],
    "a tread is thicker than heat reaches": ["rubber.plate"],
    "the ice below each pixel is a column that the wheel passes": (
        "ice.motion ice.heat ice.margin ice.cell ice.trail ice.mesh_unit"
    ).split(),
    "the command has its own name, tolerance and output": (
        "name numerics.tolerance numerics.refinement numerics.penalty "
        "numerics.shear_ramp_pressure numerics.film_integrator numerics.max_step "
        "numerics.time_limit output.times output.fields output.probes"
    ).split(),
}


class NotComputed(NamedTuple):
    """Physics of a scene that a wheel does not have: `keys` that make it, and the condition `met`.

    It is refused together with `where`; else the keys have no effect.
    """

    keys: Sequence[str]
    met: Is
    reason: str
    allowed: str
    where: Sequence[Is] = ()

    def fault(self, scene: Scene) -> str | None:
        """Why the scene has it, and what is allowed; None if it has not."""
        if not all(one.holds(scene) for one in (*self.where, self.met)):
            return None
        told = self.met.told(self.met.of(scene))
        return f"{told} is not computed below a wheel: {self.reason}; allowed: {self.allowed}"


WATER = 'water that bears a part of the pressure, with film.voids = "carry"'
NOT_COMPUTED = (
    NotComputed(
        ["rubber.rows"], ROWS, "the tread has its own pattern", "1, and load.passes of the wheel"
    ),
    NotComputed(
        ["ice.mesh"],
        Is("ice.mesh"),
        "nothing says how deep its columns are",
        "ice.depth and ice.layers",
    ),
    NotComputed(
        [], ROWS_OF_ICE, "its ice has one conductivity and one heat capacity", "one number each"
    ),
    NotComputed(
        [],
        Is("ice.water_has_rows", shown="ice.water with rows over x"),
        "the ice that comes in is the same everywhere",
        "a number",
    ),
    NotComputed(
        ["film.carrier"],
        Is("film.carrier", ("rubber",)),
        "films, and the history of a law, stay on the ice",
        '"ice"',
        (Is("friction.law", besides=("coulomb",)),),
    ),
    NotComputed(
        ["film.pressure"],
        Is("film.pressure", ("nominal",)),
        "k, D and H_V follow the pressure of each pixel",
        '"local"',
        (FILM_LAW,),
    ),
    NotComputed(
        ["rubber.stores_water"],
        Is("rubber.stores_water"),
        f"{WATER}, finds room in all sipes",
        "false",
        (CARRY,),
    ),
)


def refused(scene: Scene) -> str | None:
    """The first physics of a scene that a wheel does not have, in words; None if it has all."""
    return next((fault for each in NOT_COMPUTED if (fault := each.fault(scene))), None)


def dropped(scene: Scene, taken: Scene) -> list[str]:
    """Keys of the physics of a `scene` whose values are not those of the scene `taken`."""
    physics = [*TAKEN, *(key for each in NOT_COMPUTED for key in each.keys)]
    apart = OF_LUG if scene.rubber.heat else [*OF_LUG, *OF_HEAT]
    of_law = [key for key in physics if key not in apart]
    return [key for key in of_law if _value(scene, key) != _value(taken, key)]


def _value(scene: Scene, key: str) -> Any:
    return reduce(getattr, key.split("."), scene)
