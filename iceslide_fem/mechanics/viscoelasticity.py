"""Finite-strain viscoelasticity of the rubber, with internal variables at quadrature points.

The isochoric part of the second Piola-Kirchhoff stress relaxes, the volumetric part is elastic
(J. C. Simo, Comput. Methods Appl. Mech. Eng. 60 (1987) 153; G. A. Holzapfel, *Nonlinear Solid
Mechanics*, 2000, chapter 6.10). With the instantaneous S_iso and arms g_i, tau_i

    S = S_vol + S_iso - sum R_i,   tau_i dR_i/dt + R_i = g_i S_iso,   R_i(0) = 0       (1)

g_i S_iso - R_i is the stress of an arm, and R_i its relaxed part. S_iso is linear in time over a
step, which is second-order accurate. With x = dt / tau_i and b(x) = 1 - (1 - exp(-x)) / x the
stress at the end of a step is (subscript 0: at its start)

    S = S_vol + f S_iso + H,   f = 1 - sum g_i b,
    H = - sum [exp(-x) R_i0 + g_i (1 - exp(-x) - b) S_iso0],

the derivative of the energy W_vol + f W_iso + H : C / 2 (`relaxing_energy`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, fem, ufl
from iceslide_fem.mechanics.element import (
    SIX,
    WHOLE_DEGREE,
    Energy,
    integrated,
    isochoric_energy,
    tensors,
    volumetric_energy,
)
from iceslide_fem.mechanics.materials import Materials
from iceslide_fem.relaxation.prony import delayed, mean_response
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import MooneyRivlin

SMALL = 1e-2  # dt / tau below which a series gives the error of a step


class Strained(NamedTuple):
    """State at the points (c, q): S_iso (Pa) and C by six components (c, q, 6); W_iso (c, q),
    J/m3.
    """

    stress: Array
    strain: Array
    energy: Array


class Relaxed(NamedTuple):
    """Internal variables of (1): committed as a whole with the step that leads to them.

    relaxed: R_i (m, c, q, 6), Pa; strained: strain state at that time; rate: mean dS_iso/dt (Pa/s)
    of the last step; span: length of that step, s, infinite without one; stored: energy of the arms
    minus that of elastic rubber, (c, q), J/m3.
    """

    relaxed: Array
    strained: Strained
    rate: Array
    span: float
    stored: Array

    @property
    def fallen(self) -> Array:
        """Reduction of stress (six components) and stored energy by relaxation, (c, q, 7), Pa,
        J/m3.
        """
        return np.concatenate([self.relaxed.sum(axis=0), -self.stored[..., None]], axis=-1)


class RelaxedStep(NamedTuple):
    """End of a step: internal variables, dissipation (c, q), J/m3, and mean stress error, Pa."""

    after: Relaxed
    heat: Array
    error: float


def relaxing_energy(history: Any) -> Energy:
    """The energy whose derivative is the stress at the end of a step.

    history: f and the components of H, (xx, zz, xz) or the six of `SIX`, at the points of the
    rule of WHOLE_DEGREE.
    """

    def energy(u: Any, material: MooneyRivlin, dx: Any) -> Any:
        F, dim = ufl.grad(u), u.ufl_shape[0]
        deformed = ufl.Identity(dim) + F
        kept = _symmetric(history, dim)
        isochoric = history[0] * isochoric_energy(F, material)
        isochoric += 0.5 * ufl.inner(deformed * kept, deformed)
        return integrated(isochoric, volumetric_energy(F, material), dx)

    return energy


def _symmetric(history: Any, dim: int) -> Any:
    """H (d, d) from the components after the first, which is f."""
    number = {place: 1 + i for i, place in enumerate(_components(dim))}
    rows = [[history[number[min(i, j), max(i, j)]] for j in range(dim)] for i in range(dim)]
    return ufl.as_matrix(rows)


def _components(dim: int) -> tuple[tuple[int, int], ...]:
    return tuple((i, j) for i, j in SIX if max(i, j) < dim)


def _strained(u: Any, material: MooneyRivlin) -> Any:
    """S_iso and C, (6,) each, and W_iso as one UFL vector; plane strain in a slice.

    S_iso = 2 [C10 J^(-2/3) (1 - I1/3 C^-1) + C01 J^(-4/3) (I1 1 - C - 2/3 I2 C^-1)].
    """
    dim = u.ufl_shape[0]
    grad = ufl.grad(u)
    F = ufl.as_matrix(
        [
            [grad[i, j] + (i == j) if max(i, j) < dim else float(i == j) for j in range(3)]
            for i in range(3)
        ]
    )
    C, unit = F.T * F, ufl.Identity(3)
    inverse, scale = ufl.inv(C), ufl.exp(-2.0 / 3.0 * ufl.ln(ufl.det(F)))
    I1 = ufl.tr(C)
    I2 = 0.5 * (I1**2 - ufl.inner(C, C))
    stress = 2.0 * material.C10 * scale * (unit - I1 / 3.0 * inverse)
    stress += 2.0 * material.C01 * scale**2 * (I1 * unit - C - 2.0 / 3.0 * I2 * inverse)
    six = [part[i, j] for part in (stress, C) for i, j in SIX]
    return ufl.as_vector([*six, isochoric_energy(grad, material)])


class Viscoelasticity:
    """Internal variables (1) of the rubber on its `space`, at quadrature points of this rank's
    cells.

    history: Function of f and H in the rubber's energy; points: of the rule on the reference cell;
    volume: of each point, (c, q), m3 (m2 in a slice).
    """

    def __init__(self, u: Any, materials: Materials) -> None:
        """u: displacement of the rubber of these materials. Collective."""
        self._mesh = mesh = u.function_space.mesh
        dim = mesh.geometry.dim
        self._components = [SIX.index(place) for place in _components(dim)]
        size = 1 + len(self._components)
        name = compat.cell_name(mesh)
        space = compat.quadrature_space(mesh, WHOLE_DEGREE[name], size)
        self.history = fem.Function(space)
        self.points, weights = compat.quadrature(name, WHOLE_DEGREE[name])
        owned = mesh.topology.index_map(mesh.topology.dim).size_local
        self._cells = np.arange(owned, dtype=np.int32)
        self._places = compat.cell_dofs(space)[:owned]
        self._values = np.asarray(self.history.x.array).reshape(-1, size)
        self._at_points = compat.at_points(_strained(u, materials.constants), self.points)
        stretch = compat.at_points(abs(ufl.JacobianDeterminant(mesh)), self.points)
        determinants = compat.evaluated(stretch, mesh, self._cells)
        self.volume = determinants.reshape(owned, len(weights)) * weights
        self._whole = self.total(np.ones_like(self.volume))
        self._relaxing = [(one, cells[cells < owned]) for one, cells in materials.relaxing]
        arms = max(len(one.prony.times) for one, _ in self._relaxing)
        # Arms that a cell's material does not have are zero.
        self._g, self._softness = np.zeros((2, arms, owned, 1))
        moduli = materials.at_cells(self._cells).shear_modulus
        for one, cells in self._relaxing:
            for g, fraction in zip(self._g, one.prony.fractions, strict=False):
                g[cells] = fraction
        np.divide(0.25 / moduli, self._g, out=self._softness, where=self._g > 0.0)
        self.begin_elastic()

    def begin_elastic(self) -> None:
        """Make the rubber elastic with the instantaneous modulus, without relaxation."""
        self._values[:] = np.eye(1, self._values.shape[1])

    def at_rest(self) -> Relaxed:
        """Internal variables at the present displacements, without relaxation."""
        now = self._now()
        relaxed = np.zeros((len(self._g), *now.stress.shape))
        return self._relaxed(relaxed, now, np.zeros_like(now.stress), np.inf)

    def restored(self, relaxed: Array, rate: Array, span: float) -> Relaxed:
        """Internal variables at present displacements from saved R_i (m, c, q, 6), rate and
        span.
        """
        return self._relaxed(relaxed, self._now(), rate, span)

    def begin_step(self, start: Relaxed, dt: float, temperature: Array | float) -> None:
        """Set f and H of a step of `dt` (s) from `start`, at temperatures (K) of points (c, q)."""
        factor = np.ones(self.volume.shape)
        kept = np.zeros_like(start.strained.stress)
        nothing = np.zeros(1)
        for g, x, R in zip(self._g, self._steps(dt, temperature), start.relaxed, strict=True):
            factor -= g * mean_response(x)
            kept -= delayed(R, g[..., None] * start.strained.stress, nothing, x[..., None])
        self._values[self._places, 0] = factor
        self._values[self._places, 1:] = kept[..., self._components]

    def end_step(self, start: Relaxed, dt: float, temperature: Array | float) -> RelaxedStep:
        """The end of the step at the present displacements. Collective."""
        before, now = start.strained, self._now()
        rate = (now.stress - before.stress) / dt
        bend = 0.0 * rate if start.span == np.inf else 2.0 * (rate - start.rate) / (dt + start.span)
        relaxed, off = np.empty_like(start.relaxed), np.zeros_like(rate)
        for i, one in enumerate(self._steps(dt, temperature)):
            x, g = one[..., None], self._g[i, ..., None]
            relaxed[i] = delayed(start.relaxed[i], g * before.stress, g * now.stress, x)
            off += g * dt**2 * _curvature_response(x) * bend
        after = self._relaxed(relaxed, now, rate, dt)
        mean = 0.5 * (start.relaxed + relaxed).sum(axis=0)
        undone = 0.5 * _inner(mean, now.strain - before.strain)  # work on elastic rubber
        heat = start.stored - after.stored - undone
        error = self.total(np.sqrt(_inner(off, off))) / self._whole
        return RelaxedStep(after, heat, error)

    @property
    def places(self) -> Array:
        """Positions of the points in the undeformed block, (c q, d), m."""
        x = compat.at_points(ufl.SpatialCoordinate(self._mesh), self.points)
        values = compat.evaluated(x, self._mesh, self._cells)
        return values.reshape(-1, self._mesh.geometry.dim)

    def total(self, density: Array) -> float:
        """Integral of values (c, q) over the undeformed rubber of all ranks. Collective."""
        own = float((self.volume * density).sum())
        return float(self._mesh.comm.allreduce(own, op=MPI.SUM))

    def _relaxed(self, relaxed: Array, at: Strained, rate: Array, span: float) -> Relaxed:
        """Internal variables with their stored energy.

        An arm of stress H stores tr(C H C H) / (4 g G), exact for small strains.
        """
        energy = -self._g.sum(axis=0) * at.energy
        C = tensors(at.strain)
        for g, softness, R in zip(self._g, self._softness, relaxed, strict=True):
            turned = C @ tensors(g[..., None] * at.stress - R)
            energy += softness * np.einsum("...ij,...ji", turned, turned)
        return Relaxed(relaxed, at, rate, span, energy)

    def _steps(self, dt: float, temperature: Array | float) -> Array:
        """dt / (a_T tau_i) of arms, (m, c, q) or (m, c, 1); 1 of arms that a cell lacks."""
        kelvin = np.atleast_2d(temperature)
        kelvin = np.broadcast_to(kelvin, (len(self.volume), kelvin.shape[1]))
        steps = np.ones((len(self._g), *kelvin.shape))
        for one, cells in self._relaxing:
            reduced = one.reduced(dt, kelvin[cells])
            for step, tau in zip(steps, one.prony.times, strict=False):
                step[cells] = reduced / tau
        return steps

    def _now(self) -> Strained:
        values = compat.evaluated(self._at_points, self._mesh, self._cells)
        values = values.reshape(*self.volume.shape, 13)
        return Strained(values[..., :6].copy(), values[..., 6:12].copy(), values[..., 12].copy())


def _inner(a: Array, b: Array) -> Array:
    """a : b of symmetric tensors by their six components."""
    return np.asarray(a[..., :3] * b[..., :3]).sum(axis=-1) + 2.0 * (a[..., 3:] * b[..., 3:]).sum(
        axis=-1
    )


def _curvature_response(x: Array) -> Array:
    """Response of a first-order lag to the curvature of its input over a step dt = x tau.

    It is in units of dt^2 times the second derivative, relative to linear input: (1 + exp(-x)) / (2
    x) - (1 - exp(-x)) / x^2, which is x / 12 of small steps.
    """
    safe = np.maximum(x, SMALL)
    exact = 0.5 * (1.0 + np.exp(-safe)) / safe + np.expm1(-safe) / safe**2
    return np.where(x < SMALL, x / 12.0, exact)
