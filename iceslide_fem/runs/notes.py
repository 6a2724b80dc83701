"""Notes on a scene: keys without effect, and values outside the validated range.

A note does not stop a run. It is printed before the run and saved in its summary.
"""

from __future__ import annotations

from math import pi, sqrt

from iceslide_fem.film.strength_over_speed import shearing_height
from iceslide_fem.relaxation.doubts import of_fit, of_use
from iceslide_fem.runtime.units import ZERO_CELSIUS, readable
from iceslide_fem.scene.materials import BAR
from iceslide_fem.scene.model import Scene
from iceslide_fem.scene.rubber import BREP

# docs/validation/stability.md, operating envelope, ends included
ENVELOPE = {
    ("film", "initial_height"): (1e-9, 1e-6, "m"),
    ("load", "speed"): (1e-3, 30.0, "m/s"),
    ("load", "pressure"): (0.2 * BAR, 5.0 * BAR, "Pa"),
}
COLDEST, WARMEST = -40.0, -0.1  # degC, of the ice
LARGEST_STRAIN = 0.31  # p / E at 5 bar on compound B
PENALTIES = (10.0, 1000.0)  # in E / H
SHEAR_RAMPS = (0.002, 0.2)  # of the pressure
LARGEST_FRICTION = 2.0  # at t = 0

NOT_OF_A_POINT = (
    "rubber.sipes rubber.grooves rubber.stores_water rubber.wall_friction rubber.edge_radius "
    "rubber.chamfer rubber.draft_angle rubber.outline rubber.mesh rubber.step "
    "rubber.inertia ice.margin ice.cell ice.trail film.carrier film.water_speed film.pressure "
    "load.static_friction numerics.refinement rubber.plate numerics.penalty "
    "numerics.shear_ramp_pressure "
    "numerics.time_limit"
).split()

OF_CAD = "step_unit step_up step_along step_plane step_gap step_heal step_cells".split()
RELAXES = ["rubber.prony", "rubber.dma"]
OF_THE_FILM = (
    "film.pressure film.k film.contact film.initial_height film.water_speed "
    "water.viscosity numerics.shear_ramp_pressure"
).split()


def notes(scene: Scene) -> list[str]:
    """Notes without full stop; none if all keys have an effect and all values are usual."""
    table = scene.outside_table()
    found = _unused(scene) + _point(scene) + _wet_start(scene) + ([table] if table else [])
    found += _relaxation(scene) + counted_twice(scene)
    return found + _outside_envelope(scene)


def _unused(scene: Scene) -> list[str]:
    """Notes on given keys without effect, with the reason."""
    ice, sliding = scene.ice, scene.ice.motion == "sliding"
    reasons: dict[str, list[str]] = {}
    if scene.load.passes == 1:
        reasons["without load.passes of more than 1"] = ["film.between"]
    if scene.model == "point":
        used = {"film.water_speed"} if scene.rubber.rows > 1 else set()
        used |= {"rubber.sipes"} if scene.film.voids == "carry" else set()  # ends of the lug
        reasons['with model = "point"'] = [key for key in NOT_OF_A_POINT if key not in used]
        if not scene.film.contact_age and not scene.ice.roughness.is_rough:
            reasons["at a point without film.contact_age: its contact is taken as old"] = RELAXES
    else:
        if not sliding:
            of_sliding = ["ice.cell", "ice.trail", "film.carrier", "film.water_speed"]
            reasons['with ice.motion = "attached"'] = of_sliding
        elif scene.film.carrier == "rubber":
            reasons['with film.carrier = "rubber", where water stays with its film'] = [
                "film.water_speed"
            ]
        if ice.mesh is not None:
            reasons["on ice.mesh, which reaches as far as it does"] = ["ice.margin"]
        elif ice.heat not in ("continuum", "mesh") and not (sliding and scene.model == "block"):
            reasons[f'with ice.heat = "{ice.heat}"'] = ["ice.margin"]
        elif sliding and scene.model == "slice":
            reasons["below a slice that slides: ice.trail is what lies behind it"] = ["ice.margin"]
    if (law := scene.friction.law) != "film":
        no_history = ["film.carrier"] if law == "coulomb" else []
        reasons[f'with friction.law = "{law}"'] = [*no_history, *OF_THE_FILM]
    if not ice.roughness.is_rough:
        reasons["on smooth ice, whose contact is that of the film's table"] = ["rubber.roughness"]
    if scene.rubber.is_drawn:
        shape, file = ["rubber.length", "rubber.width", "rubber.height"], "mesh"
        if scene.rubber.step is not None:
            file = "step"
            shape += ["rubber.sipes", "rubber.grooves", "rubber.edge_radius", "rubber.chamfer"]
        reasons[f"on the shape of the block, which is that of rubber.{file}"] = shape
    if scene.rubber.step is None:
        reasons["without rubber.step"] = [f"rubber.{name}" for name in OF_CAD]
    elif scene.rubber.step.suffix.lower() != BREP:
        reasons["on a file that says its unit"] = ["rubber.step_unit"]
    if scene.rubber.step is not None and scene.model != "slice":
        reasons["in a block"] = ["rubber.step_plane"]
    if scene.rubber.mesh is None:
        reasons["without rubber.mesh"] = ["rubber.mesh_unit", "rubber.mesh_tags"]
    if ice.mesh is None:
        reasons["without ice.mesh"] = ["ice.mesh_unit"]
    if scene.rubber.heat != "mesh" and scene.model != "point":
        reasons['without rubber.heat = "mesh"'] = ["rubber.plate"]
    if scene.model == "slice":
        reasons["in a slice, which is as long as rubber.length"] = ["rubber.outline"]
        reasons["in a slice"] = ["rubber.grooves"]
    if not isinstance(scene.rubber.sipes, int):
        kept = ["rubber.sipe_width", "rubber.sipe_depth"]
        reasons["beside a list of rubber.sipes, which have their own"] = kept
    elif scene.rubber.sipes == 0:
        reasons["without rubber.sipes"] = ["rubber.sipe_width", "rubber.sipe_depth"]
    if scene.film.voids != "carry" or not scene.rubber.cuts:
        reasons['without rubber.sipes and film.voids = "carry"'] = ["rubber.stores_water"]
    if not scene.rubber.cuts and not scene.rubber.grooves and not scene.rubber.is_drawn:
        reasons["without walls that could meet"] = ["rubber.wall_friction"]
    if not scene.rubber.heat and not scene.rubber.inertia:
        reasons["without rubber.heat or rubber.inertia"] = ["rubber.density"]
    if not scene.rubber.heat:
        reasons["without rubber.heat"] = [
            "rubber.conductivity",
            "rubber.heat_capacity",
            "water.conductivity",
        ]
        relaxes = any(one.relaxation for one in scene.rubber.compounds.values())
        if not (relaxes and (scene.model != "point" or scene.film.contact_age)):
            reasons["without rubber.heat or relaxation"] = ["rubber.temperature"]
    elif scene.film.conductance is not None:
        reasons["beside film.conductance"] = ["water.conductivity"]
    found = []
    for reason, keys in reasons.items():
        given = [key for key in keys if _is_given(scene, key)]
        if given:
            found.append(f"{' and '.join(given)} {_have(given)} no effect {reason}")
    return found


def _point(scene: Scene) -> list[str]:
    """Notes on how a point model interprets keys of a block."""
    found = []
    if scene.model == "point" and scene.ice.heat in ("continuum", "mesh"):
        nearest = f'below a point the ice is a column, the nearest to ice.heat = "{scene.ice.heat}"'
        as_at_first = ", with properties at ice.temperature" if scene.ice.has_rows else ""
        found.append(nearest + as_at_first)
    if scene.model == "point" and scene.rubber.heat == "mesh":
        found.append('above a point the rubber is a column, the nearest to rubber.heat = "mesh"')
    if scene.model == "point" and scene.ice.motion == "sliding":
        transit = readable(scene.rubber.length / scene.load.speeds.mean, "s")
        found.append(f"ice below a point passes in L / v = {transit}; mu is that of the block")
    return found


def _is_given(scene: Scene, key: str) -> bool:
    """Whether the dotted `key` differs from its default."""
    table, name = key.split(".")
    values = getattr(scene, table)
    return bool(getattr(values, name) != type(values).model_fields[name].default)


def _wet_start(scene: Scene) -> list[str]:
    """Note on dry shear that begins with a water film."""
    height = scene.initial_height
    if scene.film.dry_stress is None or height == 0.0:
        return []
    return [
        f"film.initial_height = {readable(height, 'm')} with film.dry_stress: rubber begins on a "
        "film of water; film.initial_height = 0 begins dry"
    ]


def _relaxation(scene: Scene) -> list[str]:
    """Notes on rubber that relaxes: its table, the fit to it, and its temperatures."""
    measured = scene.rubber.measured
    found = (
        []
        if measured is None
        else [f"the table of rubber.dma: {each}" for each in of_fit(measured)]
    )
    for name, compound in scene.rubber.compounds.items():
        if (relaxation := compound.relaxation) is not None:
            where = "" if compound is scene.rubber else f'layer "{name}": '
            found += [where + each for each in of_use(relaxation, scene.rubber_temperature)]
    return found


def counted_twice(scene: Scene) -> list[str]:
    """Note on what may be counted twice on rough ice."""
    if not scene.ice.roughness.is_rough or scene.film.dry_stress is None:
        return []
    return [
        "hysteresis adds to film.dry_stress: a stress from measurements on rough ice, or on "
        "another contact table, holds it already, and is to be fitted to mu - mu_h (iceslide "
        "hysteresis)"
    ]


def _have(keys: list[str]) -> str:
    return "has" if len(keys) == 1 else "have"


def _outside_envelope(scene: Scene) -> list[str]:
    """Notes on values outside the range where default settings are known to converge."""
    found = []
    for (table, key), (low, high, unit) in ENVELOPE.items():
        if key == "pressure" and (scene.model == "point" or scene.rubber.compound != "B"):
            continue
        for value in _extremes(scene, table, key):
            if not low * (1 - 1e-9) <= value <= high * (1 + 1e-9):
                found.append(
                    f"{table}.{key} = {_text(value, unit)} is outside the range that is known to "
                    f"work, {_text(low, unit)} to {_text(high, unit)}"
                )
    celsius = scene.ice.temperature - ZERO_CELSIUS
    if not COLDEST - 1e-9 <= celsius <= WARMEST + 1e-9:
        found.append(
            f"ice.temperature = {celsius:g} degC is outside the range that is known to work, "
            f"{COLDEST:g} to {WARMEST:g} degC"
        )
    return found + _friction(scene) + ([] if scene.model == "point" else _rubber(scene))


def _extremes(scene: Scene, table: str, key: str) -> list[float]:
    """Least and largest value of a key (one if equal), without a plate at rest.

    The keys are those of the load, and the film's initial height.
    """
    if table != "load":
        return [] if scene.film.dry_stress is not None else [scene.initial_height]
    course = getattr(scene.load, f"{key}s")
    return sorted({course.smallest, course.largest} - {0.0})


def _friction(scene: Scene) -> list[str]:
    """Note on friction at t = 0, mu = k eta v / (h0 p) (5.29, 5.30), limited by dry shear."""
    if scene.friction.law != "film":
        return []
    p, v = scene.load.pressures.first, scene.load.speeds.first
    height = shearing_height(scene, v)
    if not height:
        return []
    friction = float(scene.contact_parameters(p).k) * scene.viscosity * v / (height * p)
    if friction <= LARGEST_FRICTION:
        return []
    return [
        f"friction at t = 0 is {friction:.3g} (k η v / (h₀ p)), above {LARGEST_FRICTION:g}: "
        "the first steps are short, and a block may not hold it"
    ]


def _rubber(scene: Scene) -> list[str]:
    """Notes on compression, buckling, and settings of the contact."""
    rubber, load, numerics = scene.rubber, scene.load, scene.numerics
    E, G = scene.softest.youngs_modulus, scene.softest.shear_modulus
    found = []
    most = load.pressures.largest
    if most > LARGEST_STRAIN * E * (1 + 1e-2) and rubber.compound != "B":
        found.append(
            f"load.pressure is {most / E:.0%} of Young's modulus ({_text(E, 'Pa')}); "
            f"up to {LARGEST_STRAIN:.0%} are known to work"
        )
    if not rubber.is_drawn and rubber.outline is None:
        length = rubber.length if scene.model == "slice" else min(rubber.length, rubber.width)
        limit = buckling_pressure(E, G, length, rubber.height)
        if most > limit:
            found.append(
                f"the block, {rubber.height / length:.2g} times as tall as thick, buckles at about "
                f"{_text(limit, 'Pa')}"
            )
    for key, value, unit, (low, high), scale, name in (
        ("penalty", numerics.penalty, "Pa/m", PENALTIES, E / rubber.height, "E / H"),
        (
            "shear_ramp_pressure",
            numerics.shear_ramp_pressure,
            "Pa",
            SHEAR_RAMPS,
            load.pressures.first,
            "p",
        ),
    ):
        if key == "penalty" and rubber.is_drawn:  # its height is not yet known
            continue
        if value is not None and not low * (1 - 1e-9) <= value / scale <= high * (1 + 1e-9):
            found.append(
                f"numerics.{key} = {value:.3g} {unit} is {value / scale:.2g} {name}; "
                f"{low:g} to {high:g} {name} are known to work"
            )
    return found


def buckling_pressure(E: float, G: float, length: float, height: float) -> float:
    """Pressure (Pa) at which a block buckles sideways between parallel plates.

    Euler's load of a column with ends that do not rotate, p_E = pi^2 E (L / H)^2 / 12, with shear
    after Haringx: p = (kappa G / 2) (sqrt(1 + 4 p_E / (kappa G)) - 1), kappa = 5/6.
    """
    euler, shear = pi**2 * E * (length / height) ** 2 / 12.0, 5.0 / 6.0 * G
    return 0.5 * shear * (sqrt(1.0 + 4.0 * euler / shear) - 1.0)


def _text(value: float, unit: str) -> str:
    return f"{value / BAR:.3g} bar" if unit == "Pa" else readable(value, unit)
