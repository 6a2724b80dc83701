"""Description of a scene before a run: layer depths, dimensionless numbers, time scales, cost."""

from __future__ import annotations

from math import sqrt

import numpy as np

from iceslide_fem.film.hysteresis import hysteresis_of
from iceslide_fem.film.loads import squeeze_rate
from iceslide_fem.film.shear_strength import shear_strength
from iceslide_fem.film.strength_over_speed import shearing_height
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.doubts import LATERAL_FRACTION, sideways
from iceslide_fem.runs.simplifications import simplifications
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene
from iceslide_fem.scene.contact_table import ContactTable
from iceslide_fem.scene.course import SAMPLED
from iceslide_fem.scene.materials import BAR
from iceslide_fem.workflow.planning.cost import estimate
from iceslide_fem.workflow.planning.passes import Row, describe_passes
from iceslide_fem.workflow.planning.regime import aged_contact, regime, relaxation_rows


def describe(scene: Scene) -> list[Row]:
    """Rows for `iceslide info`, at the scene's nominal pressure.

    Raises SceneError if the user's mesh is unsuitable.
    """
    if scene.model == "point":
        size: tuple[float, ...] = (scene.rubber.length, scene.rubber.height)
        of_body = []
    else:
        from iceslide_fem.mesh.rubber import block_size  # loads gmsh, which a point does not need

        size = block_size(scene)
        of_body = _rubber(scene, size) + _mesh(scene)
    return (
        _load(scene)
        + describe_passes(scene)
        + _heat(scene, size)
        + _film(scene, size)
        + of_body
        + _cost(scene)
    )


def _load(scene: Scene) -> list[Row]:
    """Ranges of loads that change in time; other rows use their means, or values at t = 0."""
    found = []
    for name, course, unit in (
        ("pressure", scene.load.pressures, "Pa"),
        ("speed", scene.load.speeds, "m/s"),
    ):
        if not course.is_constant:
            low, high = (readable(value, unit) for value in (course.smallest, course.largest))
            corners = course.sampled(SAMPLED * scene.numerics.tolerance).corners
            mean = f"mean {readable(course.mean, unit)}, {len(corners)} corners"
            found.append(Row("load", name, f"{low} to {high}", mean))
    if found:
        distance = readable(scene.load.speeds.integral(scene.load.duration), "m")
        found.append(Row("load", "sliding distance", distance, "by the end"))
    return found


def _heat(scene: Scene, size: tuple[float, ...]) -> list[Row]:
    """Depth sqrt(alpha t) warmed in time t, and Peclet number v L / alpha."""
    v, L, duration = scene.load.speeds.mean, size[0], scene.load.duration
    heated, when = duration, "√(α t) at the end"
    if scene.ice.motion == "sliding":
        heated, when = min(duration, L / v), "√(α t) after the time under the block"
    diffusivity = scene.ice.solid.diffusivity
    thermal = sqrt(diffusivity * heated)
    in_rubber = sqrt(scene.rubber.solid.diffusivity * duration)
    lateral = sideways(scene)
    finer = "take continuum ice" if scene.ice.is_half_space else "take ice on a mesh"
    enough = "columns of ice suffice" if lateral <= LATERAL_FRACTION else finer
    worth = f"√(α t) / L: {enough}; at 0.09 worth 0.8 % of mean μ, 3 % with cold ice beside"
    return [
        Row("heat", "warm layer in ice", readable(thermal, "m"), when),
        Row("heat", "warm layer in rubber", readable(in_rubber, "m"), "√(α t) at the end"),
        Row("heat", "sideways in ice", f"{lateral:.2g}", worth),
        Row("heat", "transit time", readable(L / v, "s"), "L / v, an ice point's time under it"),
        Row("heat", "Péclet number", f"{v * L / diffusivity:.3g}", "v L / α in ice"),
    ]


def _film(scene: Scene, size: tuple[float, ...]) -> list[Row]:
    """Contact parameters, friction at t = 0 (5.29, 5.30) and the film law's two time scales.

    Squeeze-out alone: h0^2/h^2 = 1 + 2 K3 h0^2 t with K3 of (6.5); melting
    alone: h^2/h0^2 = 1 + 2 K1 t / h0^2 with K1 = k eta v^2 / (rho L).
    """
    if not (law := law_of(scene)).has_film or law.wet is not None:
        return _law(scene, law)
    p, v, h0, eta = (
        scene.load.pressures.first,
        scene.load.speeds.first or scene.load.speeds.mean,
        scene.initial_height,
        scene.viscosity,
    )
    contact = scene.contact_parameters(p)
    k, D, H_V = float(contact.k), float(contact.D), float(contact.H_V)
    tau = k * eta * v / shearing_height(scene, v)
    strength = shear_strength(scene)
    friction = "μ = k η v / (h₀ p)" if strength is None else "μ = τ / p, of film and dry shear"
    power = "k η v² / h₀" if strength is None else "τ v"
    return [
        *_table(scene, size, tau / p),
        Row("film", "k", f"{k:.3g}", "relative contact area at the nominal pressure"),
        *aged_contact(scene),
        Row("film", "D", readable(D, "m"), "mean asperity diameter"),
        Row("film", "H_V", readable(H_V, "m"), "mean free height; saturated when squeezed full"),
        *_viscosity(scene),
        *_hysteresis(scene, p, v),
        Row("film", "friction at t = 0", f"{tau / p:.3g}", friction),
        Row("film", "friction power at t = 0", readable(tau * v, "W/m^2"), power),
        *_times(h0, squeeze_rate(p, D, eta), k * eta * v**2 / scene.ice.solid.melting_enthalpy),
        *([] if strength is None else regime(scene, strength, v)),
    ]


def _hysteresis(scene: Scene, pressure: float, speed: float) -> list[Row]:
    """mu_h on rough ice under the pressure (Pa) at the speed (m/s)."""
    law = hysteresis_of(scene)
    if law is None:
        return []
    mu = float(law.along(speed * law.shift(scene.rubber_temperature), pressure).mu[0])
    return [Row("film", "hysteresis", f"{mu:.3g}", "mu_h on rough ice, which adds to the film's")]


def _times(height: float, squeezing: float, melting: float) -> list[Row]:
    """Time scales of a film of `height` h0 (m), with K3 (1/(m2 s)) and K1 (m2/s)."""
    if not height:
        return []
    return [
        Row(
            "film",
            "squeeze-out time",
            readable(0.5 / (squeezing * height**2), "s"),
            "1 / (2 K₃ h₀²)",
        ),
        Row("film", "melting time", readable(0.5 * height**2 / melting, "s"), "h₀² / (2 K₁)"),
    ]


def _law(scene: Scene, law: InterfaceLaw) -> list[Row]:
    """The friction law that replaces the film, and its friction at t = 0."""
    p, v = scene.load.pressures.first, scene.load.speeds.first
    start = law.at_start(scene.initial_height, 1)
    mu = float(start(np.array([p]), np.array([v]))[0][0]) / p
    history = f"internal variables {', '.join(law.columns)}" if law.columns else "without history"
    return [
        Row("law", "friction", law.name, f"in place of the film; {history}"),
        Row("law", "friction at t = 0", f"{mu:.3g}", "of the law, on ice as it is then"),
    ]


def _viscosity(scene: Scene) -> list[Row]:
    """Range of film viscosities, if they are given by a table."""
    if (table := scene.water.table) is None:
        return []
    warm = readable(float(table(scene.ice.melting_temperature)), "Pa*s")
    cold = readable(scene.viscosity, "Pa*s")
    return [Row("film", "viscosity", f"{cold} to {warm}", "of films from T₀ to melting")]


def _table(scene: Scene, size: tuple[float, ...], mu: float) -> list[Row]:
    """Source of k, D and H_V, their range of pressures, and the fraction of the load in it."""
    table, p = scene.contact_parameters, scene.load.pressures.mean
    if not isinstance(table, ContactTable):
        return [Row("film", "k, D, H_V", "constant", "given in the scene, at every pressure")]
    low, high = table.pressure[0], table.pressure[-1]
    covers = f"{low / p:.2g} to {high / p:.2g} times the nominal pressure; outside: its ends"
    mean, tilt = p, 0.0
    if scene.model != "point":
        E = scene.mooney_rivlin.youngs_modulus
        mean, tilt = p * E / (E + p), 3.0 * mu * size[-1] / size[0]
    span = f"{low / BAR:.3g} to {high / BAR:.3g} bar"
    within = f"{covered_load(table, mean, tilt):.0%}"
    about = "about: flattened by p / E, tilted by 3 μ H / L with μ at t = 0"
    return [
        Row("film", "k, D, H_V", span, f"{table.source}: {covers}"),
        *_scaled(scene),
        Row("film", "load within the table", within, about),
    ]


def _scaled(scene: Scene) -> list[Row]:
    """The moduli between which the table of k, D and H_V is scaled; empty if it stands."""
    table, modulus = scene.given_table.youngs_modulus, scene.contact_modulus
    if table in (None, modulus):
        return []
    which = "E, long-term if rubber relaxes; k, D and H_V depend on p / E"
    if scene.film.contact_age:
        which = "E_0, of fresh contact; k, D and H_V depend on p / E"
    rubber = f"{readable(table, 'Pa')} to {readable(modulus, 'Pa')}"
    return [Row("film", "table scaled from", rubber, which)]


def covered_load(table: ContactTable, pressure: float, tilt: float) -> float:
    """Fraction of the load under local pressures that the table covers.

    pressure: mean over the contact, Pa. Along the block the relative pressure is 1 + tilt x, x from
    -1 to 1, at least 0 (lifted edge). Peaks at the edges are neglected.
    """
    x = np.linspace(-1.0, 1.0, 2001)
    local = np.maximum(1.0 + tilt * x, 0.0)
    local *= pressure / local.mean()
    return float(local[~table.outside(local)].sum() / local.sum())


def _rubber(scene: Scene, size: tuple[float, ...]) -> list[Row]:
    """Stiffness, expected strain p/E and time of a shear wave through the height, H sqrt(rho/G)."""
    duration, constants = scene.load.duration, scene.mooney_rivlin
    E, G, nu = constants.youngs_modulus, constants.shear_modulus, constants.poissons_ratio
    strain = f"{scene.load.pressures.largest / E:.2%}"
    wave = size[-1] * sqrt(scene.rubber.density / G)
    of_run = f"H √(ρ/G), {wave / duration:.2%} of the run"
    rows = [
        Row("rubber", "Young's modulus", readable(E, "Pa"), f"Poisson's ratio {nu:.3f}"),
        Row("rubber", "compression", strain, "p / E, the expected strain"),
        Row("rubber", "shear wave time", readable(wave, "s"), of_run),
        *relaxation_rows(scene),
    ]
    for layer in scene.rubber.layers:
        other = layer.constants()
        modulus = readable(other.youngs_modulus, "Pa")
        meaning = f"Young's modulus; Poisson's ratio {other.poissons_ratio:.3f}"
        rows.append(Row("rubber", f"layer {layer.name}", modulus, meaning))
    if not scene.rubber.inertia and not scene.rubber.is_drawn:  # error of the quasi-static box
        effect = f"{simplifications(scene).inertia.effect:.2g}"
        meaning = "of μ(t) for a moment at most, of its mean far less: rubber.inertia resolves it"
        rows.append(Row("rubber", "inertia left out", effect, meaning))
    return rows


def _mesh(scene: Scene) -> list[Row]:
    """Cells of the rubber's mesh, their size, and their sharpest corner (if there is memory)."""
    from iceslide_fem.mesh.rubber import divisions, tagged_rubber
    from iceslide_fem.mesh.size import shortage
    from iceslide_fem.mesh.tagged import smallest_angle

    size = divisions(scene)
    counts = " x ".join(f"{size[name]:.0f}" for name in ("nx", "ny", "nz") if name in size)
    smallest, largest = readable(size["smallest_m"], "m"), readable(size["largest_m"], "m")
    own = scene.rubber.is_drawn
    drawn = "own mesh" if scene.rubber.mesh is not None else "from CAD"
    shape = counts or (drawn if own else "by gmsh")
    half = "plane strain" if scene.model == "slice" else "3-D" if own else "the half with y ≥ 0"
    where = "finest at the contact's edges" if counts else "shortest and longest"
    rows = [
        Row("mesh", "cells of rubber", f"{size['cells']:.0f}", f"{shape}, {half}"),
        Row("mesh", "cell edges", f"{smallest} to {largest}", where),
    ]
    if scene.rubber.step is not None:
        from iceslide_fem.mesh.cad.tread import up_of

        dim = 2 if scene.model == "slice" else 3
        axis, why = up_of(scene.rubber, dim, scene.numerics.refinement)
        rows.append(Row("mesh", "up", f"{axis} of the file", why))
    if shortage(scene) is None:
        angle = f"{smallest_angle(tagged_rubber(scene)):.0f}°"
        rows.append(Row("mesh", "smallest angle", angle, "between edges of a cell"))
        if scene.ice.heat == "mesh":
            rows += _ice_mesh(scene)
    return rows


def _ice_mesh(scene: Scene) -> list[Row]:
    """Cells of ice and layers, and their size at the surface."""
    from iceslide_fem.mesh.ice_body import ice_body

    tagged = ice_body(scene)
    regions = ", ".join(f"{len(cells)} of {name}" for name, cells in tagged.named_cells.items())
    heights = tagged.points[tagged.cells, -1]
    topmost = readable(float(np.ptp(heights[heights.max(axis=1) >= 0.0], axis=1).max()), "m")
    return [
        Row("mesh", "cells of ice", f"{len(tagged.cells)}", f"{regions}, quadratic"),
        Row("mesh", "topmost cells of ice", topmost, "the thickest; half as much between nodes"),
        Row("mesh", "depth", readable(-float(heights.min()), "m"), "to the base, or as heat comes"),
    ]


def _cost(scene: Scene) -> list[Row]:
    """Cost of a run; see `cost` for the accuracy of the estimates."""
    cost = estimate(scene)
    meaning, rows = "of the point level at this tolerance", []
    if cost.rubber_unknowns:
        meaning = "from those of a point at this tolerance"
        rows = [
            Row("cost", "unknowns, rubber", f"{cost.rubber_unknowns}", "displacements, quadratic"),
            Row("cost", "unknowns, ice", f"{cost.ice_unknowns}", "temperatures; columns need none"),
        ]
    memory = f"about {cost.memory / 1e9:.1f} GB"
    return [
        *rows,
        Row("cost", "steps", f"about {cost.steps}", meaning),
        Row("cost", "memory", memory, "of one process"),
        Row("cost", "time", f"about {_duration(cost.time)}", "on one core, within a factor of two"),
    ]


def _duration(seconds: float) -> str:
    """Seconds, minutes or hours, as one would say it."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    if seconds < 100.0 * 60.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.0f} h"
