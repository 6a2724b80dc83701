"""How large a step's errors are, relative to what the scene's tolerance allows.

Errors at the points are means over all ranks, weighted with the friction force of each: the mean
of relative errors of the shear bounds that of mu.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from iceslide_fem.coupling.energy import Energies
from iceslide_fem.coupling.limits import LIMITS, StepLimits
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.viscosity import temperature_scale
from iceslide_fem.interface.film_frame import InterfaceStep
from iceslide_fem.rubber.block import Block
from iceslide_fem.runtime.arrays import Array


class StepRejected(ArithmeticError):
    """A trial step is not good enough: `factor` says how much shorter the next should be."""

    def __init__(self, reason: str, factor: float) -> None:
        super().__init__(reason)
        self.factor = factor


class StepError:
    """Errors of a step of `block` on its interface; 1 is what is allowed. All are collective."""

    def __init__(self, block: Block, longest: float, limits: StepLimits = LIMITS) -> None:
        """`longest`: step that is made of the slide, s."""
        scene = block.scene
        self._block, self.limits = block, limits
        # Shear (Pa) that moves the bottom of the block as far as it may lag behind.
        stiffness = scene.mooney_rivlin.youngs_modulus / (3.0 * block.height)
        lag = limits.skipped_motion * scene.load.speeds.mean * longest
        self._skipped_shear = lag * stiffness
        self._tolerance = tolerance = scene.numerics.tolerance
        self._local_tolerance = limits.local * tolerance**limits.local_power
        # However large a tolerance: energies of a block and a film that agree less do not close.
        self._agreement = min(tolerance, limits.energy)
        scale = scene.ice.melting_temperature - scene.ice.temperature
        if scene.ice.motion == "sliding":
            scale *= limits.moving_ice
        self._temperature_scale = temperature_scale(scale, scene.water.table)

    @property
    def least_friction(self) -> float:
        """A friction force of the whole block that counts as none, N."""
        block, least = self._block, self.limits.least_friction
        return least * block.scene.load.pressures.smallest * block.area * block.scale

    def of_film(self, interface_step: InterfaceStep) -> float:
        """Local error of film and heat over a step; infinite if one has failed."""
        scale = np.full(interface_step.area.shape, self._temperature_scale)
        error = interface_step.local_error(scale)
        friction = interface_step.friction()
        finite = bool(np.isfinite(error).all() and np.isfinite(friction).all())
        if not self._block.surface.comm.allreduce(finite, op=MPI.LAND):
            return np.inf
        return self._mean(error, friction) / self._local_tolerance

    def of_motion(self, error: Array, dt: float, area: Array, elasticity: float = 1.0) -> float:
        """Error (m, of all dofs) of the block's motion: by its stress, and by its slip speed.

        `elasticity`: of friction with the slip speed, v / F dF/dv; 1 of a film.
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
        """Error (Pa) of the stress of rubber that relaxes, against the pressure."""
        return error / (self._block.scene.load.pressures.smallest * self._local_tolerance)

    def of_coupling(self, before: InterfaceStep, after: InterfaceStep) -> float:
        """What one more pass over block and film has changed."""
        allowed = self.limits.agreement * self._agreement
        return self._mean(after.change(before), after.friction()) / allowed

    def of_line(self, forces: Sequence[float], ends: Sequence[float]) -> float:
        """How far friction `forces` (N) within a step leave the line between its ends.

        `forces` are those at its start and at the `ends` of its parts, in any unit of time from its
        start. A history has one row per step.
        """
        line = np.interp(ends, [0.0, ends[-1]], [forces[0], forces[-1]])
        off = float(np.abs(np.array(forces[1:]) - line).max())
        size = max(np.abs(forces).max(), self.least_friction)
        return off / (self.limits.curve * self._tolerance * size)

    def straight_parts(self, forces: Sequence[float], ends: Sequence[float]) -> tuple[int, float]:
        """How many parts of a step, from its start, may be one step; and how far friction leaves
        the line between the ends of that, as `of_line` has it.
        """
        for parts in range(len(ends), 0, -1):
            nonlinearity = self.of_line(forces[: parts + 1], ends[:parts])
            if nonlinearity <= 1.0:
                break
        return parts, nonlinearity

    def of_velocity(self, force: float, extrapolated: float, straight: Sequence[float]) -> float:
        """How far the friction `force` (N) at the end of a step is from that by the predictor.

        `extrapolated`: with the velocity that the block's last parabola gives; `straight`: with the
        velocity held, and before the block was solved for. Far from one of these it has to be the
        nearer to the former.
        """
        size, limits = self._tolerance * max(abs(force), self.least_friction), self.limits
        off = abs(force - extrapolated) / size
        change = max(abs(force - one) for one in straight) / size
        return max(off / limits.predicted, min(off / limits.smooth, change / limits.straight))

    def first_behind_kink(self, force: float, rate: float) -> float:
        """The step (s) in which friction goes as far from the predicted `force` (N) as it may,
        where its rate of change jumps by `rate` (N/s).
        """
        size = max(abs(force), self.least_friction)
        off = self.limits.predicted * self._tolerance * size
        return off / abs(rate) if rate else np.inf

    def is_jump(self, force: float, extrapolated: float) -> bool:
        """Whether friction (N) is so far from the predicted one that the velocity has jumped."""
        return abs(force - extrapolated) > self.limits.jump * max(abs(force), self.least_friction)

    def may_snap(self, dt: float) -> bool:
        """Whether a step of `dt` (s) is so short that the block may snap through in it."""
        return dt <= self.limits.snap_step * self._block.scene.load.duration

    def of_energy(self, energies: Energies, dt: float, friction: float) -> float:
        """What is missing in the energies of a step of `dt` (s), or too much.

        Where loads go in time they are small against what moves when the plate starts or stops, or
        is pressed, and under a law that is not viscous when its friction dies away. `friction` (N)
        at the mean speed is taken then, and what the load does.
        """
        taken = energies.ice_heat + energies.rubber_heat + energies.latent_heat
        turnover = max(abs(energies.friction_work), taken)
        load = self._block.scene.load
        if load.changes or not self._block.law.viscous:
            sliding = max(abs(friction), self.least_friction) * load.speeds.mean * dt
            turnover = max(turnover, abs(energies.load_work), sliding)
        fraction = self.limits.energy
        if self.may_snap(dt):
            fraction = max(fraction, self.limits.snap_energy * load.duration / dt)
        return abs(energies.missing) / (fraction * turnover) if turnover else np.inf

    def may_skip_mechanics(self, shear: Array, solved: Array, area: Array) -> bool:
        """Whether the block need not be solved under `shear` (Pa) after it was under that `solved`.

        It is quiet, and would hardly move when it is solved again.
        """
        most = min(self._skipped_shear, self._quiet(solved, area))
        return self._mean(shear - solved, area) <= most

    def is_quiet(self, shear: Array, solved: Array, area: Array) -> bool:
        """Whether the block may stay as it was solved for under the shear `solved` (Pa)."""
        return self._mean(shear - solved, area) <= self._quiet(solved, area)

    def _quiet(self, solved: Array, area: Array) -> float:
        """Change (Pa) of the mean shear `solved` that is no reason to solve for the block."""
        return self.limits.quiet * self._agreement * self._mean(solved, area)

    def _mean(self, values: Array, weights: Array) -> float:
        """Mean size of `values` over all ranks' points; 0 without weight."""
        total = np.array([weights @ np.abs(values), weights.sum()])
        self._block.surface.comm.Allreduce(MPI.IN_PLACE, total, op=MPI.SUM)
        return float(total[0] / total[1]) if total[1] != 0.0 else 0.0
