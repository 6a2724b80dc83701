"""What excludes each other in a scene: a row for each rule, with its reason and what is allowed.

The rows are checked in their order, listed in the reference, and tested one by one.
"""

from __future__ import annotations

from functools import reduce
from itertools import product
from types import SimpleNamespace
from typing import Any, NamedTuple

from iceslide_fem.scene.film import RESIDUAL


class Is(NamedTuple):
    """A condition on a key, or on another attribute of the tables: it is one of `values`, or none
    of `besides`, or above `above`. Without any of them it is given: neither None, nor false, nor 0.

    shown: the condition in words, else those of the key.
    """

    key: str
    values: tuple[Any, ...] = ()
    besides: tuple[Any, ...] = ()
    above: float | None = None
    shown: str = ""

    def holds(self, scene: Any) -> bool:
        """Whether the scene has it."""
        value = self.of(scene)
        if self.values:
            return value in self.values
        if self.besides:
            return value not in self.besides
        return bool(value) if self.above is None else value > self.above

    def of(self, scene: Any) -> Any:
        """The value of the key."""
        return reduce(getattr, self.key.split("."), scene)

    def told(self, value: Any) -> str:
        """The condition in words, with the `value` of the key."""
        if self.shown:
            return self.shown
        if isinstance(value, bool):
            return f"{self.key} = {str(value).lower()}"
        return f'{self.key} = "{value}"' if isinstance(value, str) else self.key

    @property
    def words(self) -> str:
        """The condition in words, with all values."""
        if self.values:
            return " or ".join(self.told(value) for value in self.values)
        if self.besides and not self.shown:
            return f"another {self.key} than {' or '.join(map(repr, self.besides))}"
        return self.told(None) if self.above is None else f"{self.key} above {self.above:g}"


class Rule(NamedTuple):
    """Conditions that exclude each other: they are `named`, and hold only together with `where`."""

    named: tuple[Is, ...]
    reason: str = ""
    allowed: str = "one of them"
    where: tuple[Is, ...] = ()

    def fault(self, scene: Any) -> str | None:
        """The sentence about a scene in which all conditions hold, else None."""
        if not all(one.holds(scene) for one in (*self.where, *self.named)):
            return None
        return self.sentence([one.told(one.of(scene)) for one in self.named])

    def sentence(self, named: list[str]) -> str:
        """What is wrong, why, and what is allowed."""
        *others, last = named
        why = f": {self.reason}" if self.reason else ""
        return f"{', '.join(others)} and {last} contradict each other{why}; allowed: {self.allowed}"


POINT, BLOCKS = Is("model", ("point",)), Is("model", besides=("point",))
SLIDING = Is("ice.motion", ("sliding",))
OTHER_LAW, FILM_LAW = Is("friction.law", besides=("film",)), Is("friction.law", ("film",))
UNMESHED = Is("ice.heat", besides=("mesh",))
HALF_SPACE = Is("ice.heat", ("half-space",))
WARM_RUBBER = Is("rubber.heat")
CHANGES = Is("load.changes", shown="rows of load.pressure or load.speed")
CARRY = Is("film.voids", ("carry",))
DRY, AGES = Is("film.dry_stress"), Is("film.contact_age")
REFREEZES = Is("film.refreeze", ("film", "all"))
SOFTENS = Is("film.dry_softens", shown="film.dry_stress that falls as the ice gets warmer")
ROWS_OF_VISCOSITY = Is("water.table", shown="rows of water.viscosity")
ROWS_OF_ICE = Is("ice.has_rows", shown="rows of ice.conductivity or ice.heat_capacity")
CHANGING = Is("load.pressures.is_constant", (False,), shown="a load.pressure that changes in time")
CHANGING_SPEED = Is("load.speeds.is_constant", (False,), shown="a load.speed that changes in time")
EDGE, CHAMFER = Is("rubber.edge_radius"), Is("rubber.chamfer")
EXPLICIT = Is("numerics.film_integrator", ("explicit-euler",))
PASSES, ROWS = Is("load.passes", above=1), Is("rubber.rows", above=1)
ON_A_POINT = "where ice slides a point meets ice that is younger than the rubber"
IMPLICIT = "'sdirk2', 'sdirk3' or 'implicit-euler'"
OF_FILMS = 'friction.law = "film"'
FE = 'model = "slice" or "block"'
CLOSED_FORM = (
    "the closed form holds for ice that stays under the rubber and was never warmed before"
)
TOGETHER = "the water in the voids and the contact are found together"


def _passing(key: Is) -> tuple[Rule, ...]:
    """Of passes, or of rows of blocks, which are passes, too."""
    return (
        Rule((key, OTHER_LAW), "what passes leave behind is a film's", OF_FILMS),
        Rule((key, HALF_SPACE), CLOSED_FORM, "ice.heat = 'column'"),
    )  # fmt: skip


def _number(key: str) -> Is:
    """Whether a number is given, 0 too."""
    return Is(key, besides=(None,), shown=key)


# Of the rubber that touches the ice, and of each of its layers.
OF_COMPOUNDS = (
    Rule((_number("rubber.D1"), _number("rubber.nu")), "", "one of them"),
    *(
        Rule((Is("rubber.compound"), _number(key)), "", "the compound or the constants")
        for key in ("rubber.C10", "rubber.C01")
    ),
    Rule((Is("rubber.wlf"), Is("rubber.shift_factors")), "", "one of them"),
)  # fmt: skip

RULES = (
    *OF_COMPOUNDS,
    Rule((Is("rubber.layers"), Is("model", ("point", "auto"))),
         "a point is the rubber that touches the ice", FE),
    Rule((Is("rubber.prony"), Is("rubber.dma")), "",
         "the arms, or the table that they are fitted to"),
    Rule((Is("rubber.outline"), Is("rubber.mesh")), "", "one of them"),
    Rule((Is("rubber.step"), Is("rubber.mesh")), "", "one of them"),
    Rule((Is("rubber.step"), Is("rubber.outline")), "", "one of them"),
    *(
        Rule((Is(cut), Is(f"rubber.{other}")), "it is cut into the built-in box only",
             f"cuts drawn in the {other}")
        for cut, other in product(("rubber.sipes", "rubber.grooves"), ("mesh", "outline"))
    ),
    *(
        Rule((edge, Is(f"rubber.{other}")), reason, "edges and sides drawn in a mesh")
        for edge, (other, reason) in product(
            (EDGE, CHAMFER, Is("rubber.draft_angle")),
            (
                ("mesh", "it is cut into the built-in box only"),
                ("outline", "an outline has sharp edges and upright sides"),
            ),
        )
    ),
    Rule((EDGE, CHAMFER), "an edge is round or cut off", "one of them"),
    Rule((Is("film.contact"), Is("film.k")),
         "one is a table over pressure, the other holds at every pressure", "one of them"),
    Rule((AGES, Is("film.k")), "constants do not follow the contact's age",
         "film.contact, or a compound's table"),
    *(
        Rule((Is("ice.heat", ("half-space", "continuum")), condition),
             "it takes the ice as a half-space", "ice.heat = 'column' or 'mesh'")
        for condition in (
            Is("ice.depth"), Is("ice.layers"), Is("ice.base_temperature"),
            Is("ice.base", ("held",)),
        )
    ),
    Rule((ROWS_OF_ICE, UNMESHED), "rows make it nonlinear", "ice.heat = 'mesh'"),
    Rule((Is("ice.mesh"), UNMESHED), "", "ice.heat = 'mesh'"),
    Rule((Is("ice.mesh"), SLIDING), "ice that passes is a window of equal cells",
         "ice.motion = 'attached'"),
    Rule((Is("ice.mesh"), Is("ice.depth")), "the mesh has the depth"),
    Rule((Is("ice.base_temperature"), Is("ice.base", ("insulated",))),
         "no heat leaves an insulated base", "ice.base = 'held'"),
    Rule((Is("ice.mesh"), POINT), "below a point the ice is a column, and nothing says how deep",
         f"{FE}, or ice.depth and ice.layers instead of ice.mesh"),
    Rule((Is("film.carrier", ("rubber",)), POINT), f"{ON_A_POINT}, and so is its history",
         f'{FE}, or film.carrier = "ice"', (SLIDING, Is("friction.law", besides=("coulomb",)))),
    Rule((WARM_RUBBER, POINT), ON_A_POINT, FE, (SLIDING,)),
    Rule((HALF_SPACE, SLIDING), CLOSED_FORM, "'column', 'continuum' or 'mesh'"),
    Rule((CHANGES, POINT), "where ice slides points that enter the contact one after the "
         "other see other loads", f'{FE}, or ice.motion = "attached"', (SLIDING,)),
    Rule((Is("film.pressure", ("nominal",)), CHANGING),
         "k, D and H_V of one nominal pressure are held", "'local'"),
    Rule((PASSES, ROWS), "rows are passes of the period rubber.row_pitch / load.speed"),
    Rule((ROWS, BLOCKS), "", 'model = "point"'),
    Rule((PASSES, Is("rubber.heat", ("mesh",))), "meshes of ice and rubber do not part between "
         "passes", "rubber.heat = true", (BLOCKS,)),
    Rule((Is("film.refreeze", ("area",)), Is("film.carrier", ("rubber",)), SLIDING), "films that "
         "stay with the rubber meet new cold ice, and no water comes with it",
         'film.carrier = "ice", or film.refreeze = "nothing"', (BLOCKS,)),
    Rule((PASSES, Is("film.carrier", ("rubber",)), SLIDING), "the rubber takes its films along, "
         "and begins each pass untouched", 'film.carrier = "ice"', (BLOCKS,)),
    Rule((PASSES, Is("ice.water_has_rows", shown="rows of ice.water"), SLIDING), "all ice that a "
         "pass leaves behind is alike", "a number", (BLOCKS,)),
    Rule((PASSES, BLOCKS, CHANGES), "", 'numbers, or model = "point"'),
    Rule((PASSES, BLOCKS, Is("rubber.wall_friction")), "", '0, or model = "point"'),
    *_passing(PASSES),
    *_passing(ROWS),
    Rule((ROWS, Is("ice.motion", ("attached",))), "rows need ice that passes below them at one "
         "speed", 'ice.motion = "sliding"'),
    Rule((ROWS, CHANGES), "rows need ice that passes below them at one speed",
         "load.speed and load.pressure as numbers"),
    Rule((Is("ice.is_wet", shown="ice.water"), Is("film.voids", besides=("carry",))),
         "where squeeze-out stops nothing says what more water does",
         'film.voids = "carry", or no ice.water'),
    *(
        Rule((CARRY, condition), TOGETHER, allowed)
        for condition, allowed in (
            (Is("film.k"), "film.contact, or a compound's table"),
            (Is("rubber.mesh"), "rubber.length and rubber.sipes"),
            (Is("rubber.step"), "rubber.length and rubber.sipes"),
            (Is("film.pressure", ("nominal",)), "'local'"),
            (Is("film.water_speed", (0.0,), shown="film.water_speed = 0"), "more than 0"),
            (REFREEZES, 'film.refreeze = "area" or "nothing"'),
            (OTHER_LAW, OF_FILMS),
            (EXPLICIT, IMPLICIT),
        )
    ),
    Rule((Is("film.refreeze", ("area",)), Is("film.voids", besides=("carry",))),
         "by area is a balance of water that carries", 'film.voids = "carry"'),
    Rule((AGES, OTHER_LAW), "k, D and H_V are of films", OF_FILMS),
    Rule((Is("ice.roughness.is_rough", shown="ice.roughness"), OTHER_LAW),
         "hysteresis adds to the shear of films", OF_FILMS),
    Rule((Is("rubber.roughness.is_rough", shown="rubber.roughness"),
          Is("ice.roughness.is_rough", shown="ice.roughness"), CHANGING_SPEED),
         "k, D and H_V on rough ice are those of one speed", "a number"),
    Rule((DRY, OTHER_LAW), "it limits the shear of films", OF_FILMS),
    Rule((Is("film.dry_speed"), BLOCKS, CHANGING_SPEED), "an elastic body has no quasi-static "
         "motion under a strength that falls with its own speed, so it takes the load's",
         'a number, or model = "point"'),
    Rule((Is("film.dry_residual", besides=(RESIDUAL,), shown="film.dry_residual"),
          Is("film.dry_softening", (None,), shown="no film.dry_softening")),
         "a stress that does not fall reaches 0 nowhere above the melting point",
         "film.dry_softening, or no film.dry_residual"),
    Rule((DRY, EXPLICIT), "the stress follows the temperature that it makes", IMPLICIT),
    Rule((SOFTENS, BLOCKS, Is("rubber.inertia", (False,))),
         "dry friction that weakens by its own heat has no motion without inertia "
         '(page "Dry contact, from dry to wet")',
         'rubber.inertia = true, model = "point", or a dry_stress that is the same at every '
         "temperature"),
    Rule((HALF_SPACE, WARM_RUBBER), "the closed form gives the ice a flux that does not depend on "
         "the rubber", "'column', 'continuum' or 'mesh'"),
    *(
        Rule((Is("rubber.heat", ("mesh",)), condition), reason, f"{allowed}rubber.heat = true",
             (BLOCKS, *where))
        for condition, reason, allowed, where in (
            (UNMESHED, "both meshes are solved together",
             "ice.heat = 'mesh', or ", ()),
            (ROWS_OF_ICE, "rows make it nonlinear", "numbers, or ", ()),
            (Is("film.carrier", ("ice",)), "films that pass meet other points of the rubber in "
             "every step", "film.carrier = 'rubber', ice.motion = 'attached', or ", (SLIDING,)),
            (OTHER_LAW, "only a film's heat is shared between meshes", "", ()),
        )
    ),
    Rule((Is("film.conductance"), Is("rubber.heat", (False,))),
         "it is between film and rubber that takes heat",
         "no film.conductance, or rubber.heat = true"),
)  # fmt: skip


def check_rules(scene: Any) -> None:
    """Raise ValueError with the first rule that the `scene`, or a layer of its rubber, breaks."""
    for rule in RULES:
        if fault := rule.fault(scene):
            raise ValueError(fault)
    for layer, rule in product(scene.rubber.layers, OF_COMPOUNDS):
        if fault := rule.fault(SimpleNamespace(rubber=layer)):
            raise ValueError(fault.replace("rubber.", f"{layer.place}."))
