"""How wrong k, D and H_V of a rough surface are, and what they depend on.

Errors against closed forms; parameters and mean mu over the shortest wave that is kept; the spread
between random surfaces; contact that creeps, stepped in time, against the correspondence principle;
and large strains. Rubber that creeps: under a load that is held contact only grows, and k, D and
H_V are those of elastic rubber at p_eff = p E_0 J(t / a_T) (E. H. Lee, J. R. M. Radok, J. Appl.
Mech. 27 (1960) 438), for three surfaces, one standard linear solid and a series of ten arms over
nine decades, at 0, 1, 5 and 100 ms. Large strains: a plane strain block of compound B with a random
profile below, mirrored at its sides, is pressed on a frictionless plane (quadratic quadrilaterals,
the package's Mooney-Rivlin energy, penalty contact); the half-space presses the same profile at the
pressure that the elements have found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import pi
from time import process_time
from typing import NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from petsc4py import PETSc

from iceslide_fem.fenics import compat
from iceslide_fem.film import point
from iceslide_fem.mechanics.element import WHOLE_DEGREE, energy_density
from iceslide_fem.preprocess.roughness.creep import hold, steps
from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate, read_spec
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.preprocess.roughness.parameters import (
    Parameters,
    corrected_share,
    measure,
    squeeze_diameter,
)
from iceslide_fem.preprocess.roughness.survey import parameters
from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene.materials import BAR, COMPOUNDS, YOUNGS_MODULUS
from iceslide_fem.surfaces.surface import Surface, low_passed, statistics
from scripts.studies.common import ROOT, options, table

COMPOUND_B = ROOT / "cases" / "surfaces" / "compound_B.toml"
MODULUS = YOUNGS_MODULUS["B"] / 0.75
PRESSURES = np.array([1.0, 5.0]) * BAR


def westergaard(share: float) -> tuple[float, float]:
    """Errors of k (absolute) and of the mean gap (relative) for a wave in one direction."""
    n, wave, height = 512, 1e-3, 5e-6
    x = (np.arange(n) + 0.5) / n
    pressure = share * pi * MODULUS * height / wave
    heights = np.tile(height * np.cos(2 * pi * x), (4, 1))
    (contact,) = press(heights, wave / n, MODULUS, [pressure])
    end, s = np.sqrt(share), np.abs(np.sin(pi * (np.arange(100_000) + 0.5) / 100_000))
    outside = s[s > end]
    root = np.sqrt(outside**2 - end**2)
    gap = 2.0 * height * (outside * root - end**2 * np.log((outside + root) / end)).sum() / s.size
    share_error = (contact.pressure > 0).mean() - 2.0 / pi * np.arcsin(end)
    return float(share_error), float(contact.gap.mean() / gap - 1.0)


def hertz(radius_in_pixels: float) -> tuple[float, float]:
    """Relative errors of a sphere's contact radius, without and with the correction of its rim."""
    n, pixel, radius = int(8 * radius_in_pixels), 1e-6, 1e-3
    y, x = (np.indices((n, n)) - 0.5 * (n - 1)) * pixel
    a = radius_in_pixels * pixel
    force = 4.0 * MODULUS * a**3 / (3.0 * radius)
    heights = -(x**2 + y**2) / (2.0 * radius)
    (contact,) = press(heights, pixel, MODULUS, [force / (n * pixel) ** 2])
    mask = contact.pressure > 0
    raw, corrected = (np.sqrt(share * n**2 / pi) for share in (mask.mean(), corrected_share(mask)))
    return raw / radius_in_pixels - 1.0, corrected / radius_in_pixels - 1.0


def disc(radius: float) -> float:
    """Largest relative error of D of discs at 20 places, against discs of the same area."""
    errors = []
    for dx, dy in np.random.default_rng(1).random((20, 2)):
        n = int(2 * radius + 8)
        y, x = np.indices((n, n)) - 0.5 * (n - 1)
        inside = (x - dx) ** 2 + (y - dy) ** 2 < radius**2
        errors.append(squeeze_diameter(inside) / (2.0 * np.sqrt(inside.sum() / pi)) - 1.0)
    return float(np.abs(errors).max())


def kappa(hurst: float, pixels: int) -> list[float]:
    """k E* g / p at light loads; g: rms slope."""
    spec = SurfaceSpec(
        rms_slope=0.3, hurst=hurst, rolloff=0.25e-3, shortest_wave=16e-3 / pixels,
        size=1e-3, pixels=pixels,
    )  # fmt: skip
    surface = generate(spec)
    reduced = np.array([0.005, 0.01, 0.02, 0.05])
    found = parameters(surface, MODULUS, reduced * MODULUS * 0.3)
    return list(found.k / reduced)


def closed_forms(quick: bool) -> None:
    """Errors of the solver."""

    def rows() -> Iterator[tuple[object, ...]]:
        for share in (0.05, 0.3, 0.8):
            k, gap = westergaard(share)
            name = f"wave in one direction, p/p* = {share}"
            yield name, f"k {k:+.4f}, mean gap {gap:+.2%}"
        for radius in (12,) if quick else (12, 25, 51):
            raw, corrected = hertz(radius)
            name = f"sphere, radius of contact {radius} pixels"
            yield name, f"{raw:+.2%}, with its rim {corrected:+.2%}"
        for radius in (8, 30):
            yield f"D of discs, radius {radius} pixels", f"up to {disc(radius):.2%}"
        for hurst in (0.2, 0.8):
            name = f"k E* slope / p at p/(E* slope) = 0.005, 0.01, 0.02, 0.05, Hurst {hurst}"
            yield name, ", ".join(f"{one:.2f}" for one in kappa(hurst, 128 if quick else 512))

    table(("what", "error, or value"), rows())


def cut_offs(quick: bool) -> None:
    """The same surface, continued to short waves by its own power law, with less and less of it."""
    base = read_spec(COMPOUND_B)
    finest, size, pixels = (8e-6, 0.25e-3, 128) if quick else (4e-6, 0.4e-3, 400)
    long = base.model_copy(
        update={"size": size, "pixels": pixels, "rolloff": min(base.rolloff, size)}
    )
    spec = long.model_copy(update={"shortest_wave": finest})
    surfaces = [generate(spec, number) for number in range(1 if quick else 2)]
    # As much of the waves that compound B has as in its own surface.
    own = np.mean([statistics(low_passed(s, base.shortest_wave)).rms_height for s in surfaces])
    scale = statistics(generate(long)).rms_height / own

    def rows() -> Iterator[tuple[object, ...]]:
        for wave in (35e-6, 16e-6, 11.6e-6, 8e-6, 4e-6):
            if wave < finest:
                return
            cut = [low_passed(Surface(s.heights * scale, s.pixel, True), wave) for s in surfaces]
            each = [np.array(parameters(surface, MODULUS, PRESSURES)) for surface in cut]
            found = Parameters(*np.mean(each, axis=0))
            friction = point.simulate(
                point.Conditions.of(
                    pressure=PRESSURES, speed=3.0, temperature=269.15, k=found.k, D=found.D,
                    H_V=found.H_V, initial_height=70e-9, duration=7e-3,
                )
            )  # fmt: skip
            values = (
                (found.k, ".3f"), (1e6 * found.D, ".1f"), (1e6 * found.H_V, ".2f"),
                (friction.mu_mean, ".3f"), (friction.mu_peak, ".3f"),
            )  # fmt: skip
            slope = f"{statistics(cut[-1]).rms_slope:.2f}"
            cells = (", ".join(f"{value:{form}}" for value in row) for row, form in values)
            yield f"{1e6 * wave:g}", slope, *cells

    head = ("shortest wave, um", "rms slope", "k", "D, um", "H_V, um", "mean mu", "peak mu")
    print("\nOne surface, ever shorter waves kept (1 bar, 5 bar)\n")
    table(head, rows())


def spread(quick: bool) -> None:
    """Standard deviations between realisations over the size of the map."""
    base = read_spec(COMPOUND_B)

    def rows() -> Iterator[tuple[object, ...]]:
        for share in (0.5, 1.0):
            spec = base.model_copy(
                update={"size": share * base.size, "pixels": round(share * base.pixels)}
            )
            several = (generate(spec, number) for number in range(2 if quick else 8))
            each = np.array([np.array(parameters(s, MODULUS, PRESSURES)[:3]) for s in several])
            deviation = each.std(axis=0, ddof=1) / each.mean(axis=0)
            cells = (", ".join(f"{value:.1%}" for value in row) for row in deviation)
            yield f"{1e3 * spec.size:.3g}", *cells

    print("\nStandard deviation between realisations (1 bar, 5 bar)\n")
    table(("side of the map, mm", "k", "D", "H_V"), rows())


# --- rubber that creeps into contact

SLS = Prony((0.3,), (5e-3,))
_TIMES = np.logspace(-7.0, 2.0, 10)
TEN = Prony(tuple((0.9 * _TIMES**-0.1 / (_TIMES**-0.1).sum()).tolist()), tuple(_TIMES.tolist()))
SERIES = {"one arm": SLS, "ten arms": TEN}
AGES = (0.0, 1e-3, 5e-3, 0.1)  # s
CREEPING = 4.0 * 546e3  # E* = 4 G of incompressible rubber, Pa
SURFACES = {
    "smooth, Hurst 0.8": {"rms_slope": 0.2, "hurst": 0.8, "rolloff": 2e-4, "shortest_wave": 5e-5},
    "rough, Hurst 0.3": {"rms_slope": 0.4, "hurst": 0.3, "rolloff": 1e-4, "shortest_wave": 5e-5},
    "valleys": {
        "rms_slope": 0.3, "hurst": 0.9, "rolloff": 2e-4, "shortest_wave": 5e-5, "skewness": -0.9,
    },
}  # fmt: skip
SIDE, PIXELS = 5e-4, 64  # m
LOADS = (0.05, 0.15, 0.4)  # of E* times the rms slope


def compared(name: str, series: str, pixels: int) -> tuple[str, ...]:
    """The row of one surface and series: over all loads and ages, the largest differences."""
    given, prony = SURFACES[name], SERIES[series]
    spec = SurfaceSpec.model_validate({**given, "size": SIDE, "pixels": pixels})
    heights, pixel = generate(spec).heights, SIDE / pixels
    pressures = [load * CREEPING * given["rms_slope"] for load in LOADS]
    begun = process_time()
    held = list(hold(heights, pixel, CREEPING, pressures, prony, AGES))
    seconds = process_time() - begun
    iterations = sum(contact.iterations for contacts in held for contact in contacts)
    found = []
    for pressure, contacts in zip(pressures, held, strict=True):
        effective = (pressure * prony.creep.compliance(AGES)).tolist()
        for pair in zip(contacts, press(heights, pixel, CREEPING, effective), strict=True):
            found.append([measure(each, pixel, "hydrodynamic", True)[:3] for each in pair])
    values = np.array(found)  # (loads and ages, held and elastic, k, D and H_V)
    k, open_ = values[:, 1, 0], values[:, 1, 2] > 1e-9
    off = 100.0 * np.abs(values[:, 0] - values[:, 1]) / np.maximum(values[:, 1], 1e-12)
    largest = [f"{part.max():.2f} %" for part in (off[:, 0], off[:, 1], off[open_, 2])]
    number = len(steps(prony, AGES)) - 1
    return (
        name, series, f"{k.min():.3f} to {k.max():.3f}", *largest, str(number), str(iterations),
        f"{seconds:.1f}",
    )  # fmt: skip


def creep(quick: bool) -> None:
    """Held contact against elastic contact at the effective pressure."""
    pixels = PIXELS if quick else 2 * PIXELS
    head = ("surface", "series", "k", "k off", "D off", "H_V off", "steps", "iterations", "seconds")
    print()
    table(head, (compared(name, series, pixels) for name in SURFACES for series in SERIES))


# --- large strains

RUBBER = COMPOUNDS["B"]
PLANE_STRAIN = RUBBER.youngs_modulus / (1.0 - RUBBER.poissons_ratio**2)
LENGTH = 0.2e-3  # m, half a period
HEIGHT = 0.15e-3
WAVES = range(3, 12)  # half-waves in LENGTH: 133 to 36 um
PENALTY = 2e13  # Pa/m: 50 nm at 10 bar; gaps are counted from the mean of what overlaps
SLOPES = (0.1, 0.3, 0.5)


class Pressed(NamedTuple):
    """Mean pressure (Pa), fraction of the length in contact, mean gap (m)."""

    pressure: float
    share: float
    gap: float


def profile(slope: float, x: Array, seed: int = 1) -> Array:
    """Heights (m, towards the plane) of random signs and falling amplitudes, of this rms slope."""
    random = np.random.default_rng(seed)
    n = np.array(WAVES)[:, None]
    amplitude = random.choice([-1.0, 1.0], n.shape) * random.uniform(0.5, 1.0, n.shape) / n**1.5
    z = (amplitude * np.cos(np.pi * n * x / LENGTH)).sum(axis=0)
    dense = np.linspace(0.0, LENGTH, 2001)
    derivative = np.pi * n / LENGTH * amplitude * np.sin(np.pi * n * dense / LENGTH)
    return np.asarray(z * slope / np.sqrt(np.mean(derivative.sum(axis=0) ** 2)))


class Block:
    """The block and its equilibrium under a plate that is moved down."""

    def __init__(self, slope: float, across: int, up: int) -> None:
        self.mesh = dolfinx_mesh.create_rectangle(
            MPI.COMM_SELF,
            [np.zeros(2), np.array([LENGTH, 1.0])],
            [across, up],
            dolfinx_mesh.CellType.quadrilateral,
        )
        points = self.mesh.geometry.x
        s = points[:, 1].copy()
        graded = (np.exp(2.5 * s) - 1.0) / (np.exp(2.5) - 1.0)
        below = profile(slope, np.linspace(0.0, LENGTH, 4001)).max() - profile(slope, points[:, 0])
        points[:, 1] = below * (1.0 - graded) + HEIGHT * graded
        space = compat.vector_space(self.mesh, 2)
        self.u = fem.Function(space)
        where = space.tabulate_dof_coordinates()
        sides = np.flatnonzero((where[:, 0] < 1e-9) | (where[:, 0] > LENGTH - 1e-9))
        self.top = np.flatnonzero(where[:, 1] > HEIGHT * (1.0 - 1e-9))
        self.fixed = np.unique(np.concatenate([2 * sides, 2 * self.top, 2 * self.top + 1]))
        facets = dolfinx_mesh.locate_entities_boundary(
            self.mesh, 1, lambda x: (x[1] < 0.5 * HEIGHT) & (x[0] > -1.0)
        )
        mid = dolfinx_mesh.compute_midpoints(self.mesh, 1, facets)
        inner = (mid[:, 0] > 1e-9) & (mid[:, 0] < LENGTH - 1e-9)
        tags = dolfinx_mesh.meshtags(
            self.mesh, 1, np.sort(facets[inner]), np.ones(inner.sum(), np.int32)
        )
        ds = ufl.Measure("ds", self.mesh, subdomain_data=tags)(1, metadata={"quadrature_degree": 8})
        X = ufl.SpatialCoordinate(self.mesh)
        gap = X[1] + self.u[1]
        push = PENALTY * ufl.max_value(-gap, 0.0)
        energy = energy_density(ufl.grad(self.u), RUBBER) * ufl.dx(
            metadata={"quadrature_degree": WHOLE_DEGREE["quadrilateral"]}
        )
        contact = 0.5 * PENALTY * ufl.max_value(-gap, 0.0) ** 2 * ds
        residual = ufl.derivative(energy + contact, self.u)
        self._residual = compat.form(residual)
        self._tangent = compat.form(ufl.derivative(residual, self.u))
        self._force = compat.form(push * ds)
        self._vector, self._change = compat.create_vector(space), compat.create_vector(space)
        self._matrix = compat.create_matrix(self._tangent)
        self._solver = PETSc.KSP().create(MPI.COMM_SELF)
        self._solver.setType("preonly")
        self._solver.getPC().setType("lu")
        tangent = ufl.as_vector((-ufl.FacetNormal(self.mesh)[1], ufl.FacetNormal(self.mesh)[0]))
        stretch = abs(tangent[0] + ufl.dot(ufl.grad(self.u)[0, :], tangent))
        self._touching = compat.form(ufl.conditional(ufl.lt(gap, 0.0), stretch, 0.0) * ds)
        self._overlap = fem.Constant(self.mesh, PETSc.ScalarType(0.0))
        self._volume = compat.form(ufl.max_value(gap + self._overlap, 0.0) * stretch * ds)

    def lowered(self, by: float) -> Pressed:
        """Move the plate down by this more (m) and find equilibrium."""
        before = self.u.x.array.copy()
        self.u.x.array[2 * self.top + 1] -= by
        vector, change, matrix, solver = self._vector, self._change, self._matrix, self._solver
        for _ in range(60):
            compat.assemble_vector(vector, self._residual)
            compat.assemble_matrix(matrix, self._tangent)
            vector.array[self.fixed] = 0.0
            matrix.zeroRowsColumns(self.fixed.astype(PETSc.IntType), 1.0)
            solver.setOperators(matrix)
            solver.solve(vector, change)
            length = float(np.abs(change.array).max())
            if not np.isfinite(length):
                break
            self.u.x.array[:] -= min(1.0, 2e-6 / max(length, 1e-30)) * change.array
            if length < 1e-11:
                return self._found()
        self.u.x.array[:] = before
        raise SimulationStopped("the profile finds no equilibrium")

    def _found(self) -> Pressed:
        force, touching = (
            compat.assemble_scalar(each, MPI.COMM_SELF) / LENGTH
            for each in (self._force, self._touching)
        )
        self._overlap.value = force / (PENALTY * max(touching, 1e-3))
        volume = compat.assemble_scalar(self._volume, MPI.COMM_SELF) / LENGTH
        return Pressed(force, touching, volume)


def half_space(slope: float, pressures: list[float], pixels: int = 1024) -> list[Pressed]:
    """The same profile, mirrored, on the half-space."""
    x = (np.arange(pixels) + 0.5) * LENGTH / pixels
    z = profile(slope, x)
    heights = np.tile(np.concatenate([z, z[::-1]]), (4, 1))
    contacts = press(heights, LENGTH / pixels, PLANE_STRAIN, pressures)
    return [
        Pressed(p, float((contact.pressure > 0).mean()), float(contact.gap.mean()))
        for p, contact in zip(pressures, contacts, strict=True)
    ]


def strains(quick: bool) -> None:
    """k and the gap by elements and by the half-space."""

    def rows() -> Iterator[tuple[object, ...]]:
        for slope in SLOPES[:1] if quick else SLOPES:
            block = Block(slope, *((40, 12) if quick else (80, 18)))
            step = 0.05 * slope * 30e-6
            found: list[Pressed] = []
            while not found or found[-1].pressure < 6.0 * BAR and found[-1].share < 0.95:
                try:
                    found.append(block.lowered(step))
                except SimulationStopped:
                    step *= 0.5
                    if step < 1e-9:
                        raise
            smooth = half_space(slope, [each.pressure for each in found])
            for share in (0.2, 0.35, 0.5, 0.65, 0.8):
                i = int(np.argmin([abs(each.share - share) for each in found]))
                fe, hs = found[i], smooth[i]
                yield (
                    slope, f"{fe.pressure / BAR:.2f}", f"{fe.share:.3f}", f"{hs.share:.3f}",
                    f"{fe.share / hs.share - 1.0:+.1%}", f"{1e6 * fe.gap:.3f}",
                    f"{1e6 * hs.gap:.3f}", f"{fe.gap / hs.gap - 1.0:+.1%}",
                )  # fmt: skip

    head = ("rms slope", "p, bar", "k, elements", "k, half-space", "difference")
    print()
    table((*head, "gap, um, elements", "gap, um, half-space", "difference"), rows())


QUESTIONS: dict[str, Callable[[bool], None]] = {
    "forms": closed_forms,
    "cut-offs": cut_offs,
    "spread": spread,
    "creep": creep,
    "strains": strains,
}


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="small maps, few realisations")
    parser.add_argument("--questions", nargs="+", choices=list(QUESTIONS), default=list(QUESTIONS))
    given = parser.parse_args()
    for name in given.questions:
        QUESTIONS[name](given.quick)


if __name__ == "__main__":
    main()
