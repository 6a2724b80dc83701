"""Errors of a step, relative to the limits that the scene's tolerance sets.

Errors at points are averaged over all ranks, weighted with the friction force of each point. This
mean of relative shear errors bounds the relative error of mu.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from iceslide_fem.coupling.energy import Energies
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.viscosity import temperature_scale
from iceslide_fem.interface.film_frame import ContactLoads, InterfaceStep
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.mechanics.block import Block
from iceslide_fem.runtime.arrays import Array


@dataclass(frozen=True)
class StepLimits:
    """Limits of a coupled step; `docs/validation/accuracy.md` has their cost and their benefit.

    Film and heat
        local, local_power: the limit of a local error is local * tolerance^local_power. Local
        errors add up to a global error of mu(t). The global error falls as the power 2/3 to 3/4 of
        the local ones, so mu(t) stays within the tolerance.
        moving_ice: factor on the limit of the temperature's local error where ice slides. This
        error is confined to the one or two cells where melting begins, and leaves with them.
        most_substeps: largest number of substeps of film and heat in one coupled step.
    Block and film together
        agreement: change of the film by one more iteration of block and film, over the tolerance,
        which counts up to 1 %.
        alike: change of the friction at the points by the loads of equilibrium, over the change of
        the film that is allowed. Film and heat change less than their loads; below this fraction
        they are not repeated.
        passes: largest number of these iterations.
    Friction over the step
        curve: distance of friction from the line between the ends of a step, over the tolerance.
        predicted: difference of friction at the end from friction with the extrapolated velocity of
        the rubber, over the tolerance. It reaches a fifth of this in a smooth motion, and up to a
        half at a kink of the velocity.
        straight, smooth: a second kink may hide the first one. Friction must therefore be within
        `straight` tolerances of friction at the held velocity, or within `smooth` tolerances of
        friction at the extrapolated velocity.
        jump: above this relative difference from its prediction, friction counts as a jump. The
        block's velocity then jumps, too.
    Energy
        energy: error of a step's energy balance, over the energy turned over in the step.
        snap_step, snap_energy: a point that folds over snaps through to another equilibrium.
        Without inertia this takes no time, however short the step. A step up to snap_step of the
        duration may snap. Its energy error may be up to snap_energy of the energy that the whole
        run turns over at the present friction.
        least_friction: least friction coefficient, at the mean speed, that energy errors are
        relative to if loads change in time or the law is not viscous. Errors of the block's speed
        always are. When a plate starts or stops, the true energies are below the solver's
        tolerance. A tenth of this value takes five to twenty times the steps for the same work
        (docs/how-to/loads.md).
        least_elasticity: least weight of an error of the slip speed. Under a law whose friction
        does not depend on slip speed, the error still affects the heat.
    Steps without mechanics
        quiet: change of the shear below which equilibrium is skipped, over the tolerance, which
        counts up to 1 %.
        skipped_motion: lag of the block behind its equilibrium, over the sliding distance of the
        longest step. When the block is solved again, half of the lag enters film and heat. The
        other half is an error of the step's energy balance.
    """

    local: float = 2.4
    local_power: float = 1.6
    moving_ice: float = 10.0
    most_substeps: int = 24
    agreement: float = 0.3
    alike: float = 0.3
    passes: int = 4
    curve: float = 0.5
    predicted: float = 2.0
    straight: float = 4.0
    smooth: float = 0.4
    jump: float = 0.5
    energy: float = 0.01
    snap_step: float = 1e-5
    snap_energy: float = 1e-3
    least_friction: float = 1e-2
    least_elasticity: float = 0.1
    quiet: float = 0.3
    skipped_motion: float = 5e-3


LIMITS = StepLimits()


class StepRejected(ArithmeticError):
    """A trial step is rejected. `factor` times its length is the length of the next trial."""

    def __init__(self, reason: str, factor: float) -> None:
        super().__init__(reason)
        self.factor = factor


class StepError:
    """Errors of a step of `block` on its interface, over their limits. All are collective."""

    def __init__(self, block: Block, longest: float, limits: StepLimits = LIMITS) -> None:
        """`longest`: largest length of a step, s."""
        scene = block.scene
        self._block, self.limits = block, limits
        # Shear (Pa) that moves the bottom of the block by the allowed lag.
        stiffness = scene.softest.youngs_modulus / (3.0 * block.height)
        lag = limits.skipped_motion * scene.load.speeds.mean * longest
        self._skipped_shear = lag * stiffness
        self._tolerance = tolerance = scene.numerics.tolerance
        self._local_tolerance = limits.local * tolerance**limits.local_power
        # A larger disagreement of block and film leaves the energy balance open at any tolerance.
        self._agreement = min(tolerance, limits.energy)
        scale = scene.ice.melting_temperature - scene.ice.temperature
        if scene.ice.motion == "sliding":
            scale *= limits.moving_ice
        self._temperature_scale = temperature_scale(scale, scene.water.table)

    @property
    def least_friction(self) -> float:
        """Friction force of the whole block below which errors are absolute, N."""
        block, least = self._block, self.limits.least_friction
        return least * block.scene.load.pressures.smallest * block.area * block.scale

    def of_film(self, interface_step: InterfaceStep) -> float:
        """Local error of film and heat over a step; infinite if a value is not finite."""
        scale = np.full(interface_step.area.shape, self._temperature_scale)
        error = interface_step.local_error(scale)
        friction = interface_step.friction()
        finite = bool(np.isfinite(error).all() and np.isfinite(friction).all())
        if not self._block.surface.comm.allreduce(finite, op=MPI.LAND):
            return np.inf
        return self._mean(error, friction) / self._local_tolerance

    def of_motion(self, error: Array, dt: float, area: Array, elasticity: float = 1.0) -> float:
        """Error of the block's motion from its displacement error (dofs,), m.

        It is the larger one of the relative errors of stress and slip speed.

        elasticity: of friction in the slip speed, v/F dF/dv; 1 for a viscous film.
        """
        surface, scene = self._block.surface, self._block.scene
        nodal = error.reshape(self._block.rubber.displacements.shape)
        size = np.linalg.norm(surface.displacements(nodal), axis=-1).ravel()
        modulus, pressure = scene.mooney_rivlin.youngs_modulus, scene.load.pressures.smallest
        stress = modulus / self._block.height / pressure
        elasticity = min(max(elasticity, self.limits.least_elasticity), 1.0)
        speed = elasticity / (dt * scene.load.speeds.mean)
        return self._mean(size, area) * max(stress, speed) / self._local_tolerance

    def of_stress(self, error: float) -> float:
        """Error (Pa) of the viscoelastic stress, relative to the pressure."""
        return error / (self._block.scene.load.pressures.smallest * self._local_tolerance)

    def of_coupling(self, before: InterfaceStep, after: InterfaceStep) -> float:
        """Change of the film by one more iteration of block and film."""
        allowed = self.limits.agreement * self._agreement
        return self._mean(after.change(before), after.friction()) / allowed

    def of_loads(self, sheared: Sheared, before: ContactLoads, after: ContactLoads) -> float:
        """Change of the points' friction by other loads, over the allowed change of the film."""
        one, other = (sheared(at.pressure, at.speed)[0] * at.area for at in (before, after))
        evenly = np.ones_like(other)
        allowed = self.limits.agreement * self._agreement * self._mean(other, evenly)
        return self._mean(one - other, evenly) / allowed if allowed else np.inf

    def of_line(self, forces: Sequence[float], ends: Sequence[float]) -> float:
        """Largest distance of friction `forces` (N) within a step from the line between its ends.

        The forces are at the start and at the `ends` of the substeps, in any unit of time from the
        start. History output has one row per step, so friction has to be nearly linear in it.
        """
        line = np.interp(ends, [0.0, ends[-1]], [forces[0], forces[-1]])
        off = float(np.abs(np.array(forces[1:]) - line).max())
        size = max(np.abs(forces).max(), self.least_friction)
        return off / (self.limits.curve * self._tolerance * size)

    def straight_parts(self, forces: Sequence[float], ends: Sequence[float]) -> tuple[int, float]:
        """Number of substeps, from the start, over which friction is nearly linear; its
        `of_line`.
        """
        for parts in range(len(ends), 0, -1):
            nonlinearity = self.of_line(forces[: parts + 1], ends[:parts])
            if nonlinearity <= 1.0:
                break
        return parts, nonlinearity

    def of_velocity(self, force: float, extrapolated: float, straight: Sequence[float]) -> float:
        """Difference of the friction `force` (N) at the end of a step from its prediction.

        extrapolated: friction at the velocity extrapolated from the block's last parabola;
        straight: friction at the held velocity, and before equilibrium. Far from either of
        `straight`, the force has to be close to `extrapolated`.
        """
        size, limits = self._tolerance * max(abs(force), self.least_friction), self.limits
        off = abs(force - extrapolated) / size
        change = max(abs(force - one) for one in straight) / size
        return max(off / limits.predicted, min(off / limits.smooth, change / limits.straight))

    def first_behind_kink(self, force: float, rate: float) -> float:
        """The step (s) in which a jump of dF/dt by `rate` (N/s) moves friction to its limit."""
        size = max(abs(force), self.least_friction)
        off = self.limits.predicted * self._tolerance * size
        return off / abs(rate) if rate else np.inf

    def is_jump(self, force: float, extrapolated: float) -> bool:
        """Whether friction (N) differs so much from its prediction that the velocity has jumped."""
        return abs(force - extrapolated) > self.limits.jump * max(abs(force), self.least_friction)

    def may_snap(self, dt: float) -> bool:
        """Whether a step of `dt` (s) is so short that the block may snap through in it."""
        return dt <= self.limits.snap_step * self._block.scene.load.duration

    def of_energy(
        self, energies: Energies, dt: float, friction: float, stuck: bool = False
    ) -> float:
        """Error of the energy balance of a step of `dt` (s), over its limit.

        The reference is the energy turned over. It is small when the plate starts, stops or
        presses, and when friction under a law that is not viscous dies away. The reference is then
        at least the work of `friction` (N) at the mean speed, and the load's work. After points
        have `stuck`, it is at least the exchange of elastic and kinetic energy: a held block
        swings.
        """
        taken = energies.ice_heat + energies.rubber_heat + energies.latent_heat
        taken += energies.hysteresis_heat
        turnover = max(abs(energies.friction_work), taken)
        load = self._block.scene.load
        if load.changes or not self._block.law.viscous:
            sliding = max(abs(friction), self.least_friction) * load.speeds.mean * dt
            turnover = max(turnover, abs(energies.load_work), sliding)
        if stuck:
            turnover = max(turnover, abs(energies.elastic_energy), abs(energies.kinetic_energy))
        fraction = self.limits.energy
        if self.may_snap(dt):
            fraction = max(fraction, self.limits.snap_energy * load.duration / dt)
        return abs(energies.missing) / (fraction * turnover) if turnover else np.inf

    def may_skip_mechanics(self, shear: Array, solved: Array, area: Array) -> bool:
        """Whether equilibrium at `shear` (Pa) may be skipped after one at shear `solved` (Pa).

        Both the change of shear and the displacement of a new equilibrium have to be small.
        """
        most = min(self._skipped_shear, self._quiet(solved, area))
        return self._mean(shear - solved, area) <= most

    def is_quiet(self, shear: Array, solved: Array, area: Array) -> bool:
        """Whether `shear` (Pa) hardly differs from the shear `solved` (Pa) of equilibrium."""
        return self._mean(shear - solved, area) <= self._quiet(solved, area)

    def _quiet(self, solved: Array, area: Array) -> float:
        """Largest mean change (Pa) of the shear `solved` that needs no new equilibrium."""
        return self.limits.quiet * self._agreement * self._mean(solved, area)

    def _mean(self, values: Array, weights: Array) -> float:
        """Weighted mean of |values| over all ranks' points; 0 if all weights are 0."""
        total = np.array([weights @ np.abs(values), weights.sum()])
        self._block.surface.comm.Allreduce(MPI.IN_PLACE, total, op=MPI.SUM)
        return float(total[0] / total[1]) if total[1] != 0.0 else 0.0
