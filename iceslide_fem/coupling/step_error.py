"""How large a step's errors are, relative to what the scene's tolerance allows.

Errors at the points are means over all ranks, weighted with the friction force of each: the mean
of relative errors of the shear bounds that of mu.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.coupling.energy import Energies
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.viscosity import temperature_scale
from iceslide_fem.interface.carriers import InterfaceStep
from iceslide_fem.rubber.block import Block

# Errors of single steps add up to one of mu(t) that falls as their power 2/3 to 3/4 (see
# docs/accuracy.md): with this share of tolerance^1.6 per step it stays below the tolerance.
LOCAL_SHARE, LOCAL_POWER = 2.4, 1.6
# How much larger the temperature's local error may be where ice passes: it sits in the one or two
# cells where melting begins, and leaves with them. mu(t) stays within the tolerance.
PASSING_EASE = 10.0
# Share of the tolerance by which friction may leave the line from one step's end to the next.
CURVE_SHARE = 0.5
# By how many tolerances friction at a step's end may differ from that with the velocity foreseen
# for the rubber. With that of the new parabola it is off by less: by a fifth of this in a smooth
# motion, by up to a half where that has a corner, as when a point begins to melt or lifts off.
CURVED_SHARE = 2.0
# Two corners in a row may hide each other: by how many it may differ from that of a block which
# goes on straight, or, as that is no error, with the velocity foreseen. A smooth motion is foreseen
# that well: friction that dies away as the plate stops takes a third as many steps with it.
STRAIGHT_SHARE, FORESEEN_SHARE = 4.0, 0.4
# Friction that differs by more of itself has jumped, and with it the block's velocity.
JUMP_SHARE = 0.5
# Share of the energy that a step turns over which may be missing or too much: that of a whole run
# is then no larger. Steps of a smooth motion stay below half of it.
ENERGY_SHARE = 0.01
# How far a block that rests may be left behind, of the way that it slides in the longest step. When
# it is released film and heat see but half of that, and the step's energy does not close by the
# other half.
REST_SHARE = 5e-3
# A point that folds over snaps from one equilibrium to the next, however short the step, because no
# inertia delays it. Steps of up to this share of the duration may jump so, if what is missing then
# is at most this share of the energy that the whole run turns over at the present friction.
SNAP_STEP, SNAP_SHARE = 1e-5, 1e-3
# Where loads go in time, or the law is not viscous, energies count against this
# friction coefficient at the mean speed at least, and the block's speed always: those of a plate
# that starts or rests are nothing but the solver's tolerance. A tenth of it takes five to twenty
# times the steps, to the same work (docs/loads.md).
LEAST_FRICTION = 1e-2
# Under a law whose friction does not follow the slip speed an error of it still is one of the heat.
LEAST_ELASTICITY = 0.1


class Refused(ArithmeticError):
    """A trial step is not good enough: `factor` says how much shorter the next should be."""

    def __init__(self, reason: str, factor: float) -> None:
        super().__init__(reason)
        self.factor = factor


class CouplingControl(NamedTuple):
    """How closely block and film are solved together.

    agreement: change of the film that one more pass over block and film may make, and quiet: change
    of the shear below which the block is not solved again, in shares of the tolerance (of 1 % where
    it is larger); passes: so many at most, then the step is shortened.
    """

    agreement: float = 0.3
    quiet: float = 0.3
    passes: int = 4


COUPLING = CouplingControl()


class StepError:
    """Errors of a step of `block` on its interface; 1 is what is allowed. All are collective."""

    def __init__(self, block: Block, longest: float, control: CouplingControl = COUPLING) -> None:
        """`longest`: step that is made of the slide, s."""
        scene = block.scene
        # The mean shear (Pa) that moves the bottom of the block as far as it may be left behind.
        stiffness = scene.mooney_rivlin.youngs_modulus / (3.0 * block.height)
        self._resting = REST_SHARE * scene.load.speeds.mean * longest * stiffness
        self._block, self._control = block, control
        self._tolerance = tolerance = scene.numerics.tolerance
        self._local_tolerance = LOCAL_SHARE * tolerance**LOCAL_POWER
        # However large a tolerance: energies of a block and a film that agree less do not close.
        self._agreement = min(tolerance, ENERGY_SHARE)
        self._temperature_scale = scene.ice.melting_temperature - scene.ice.temperature
        if scene.ice.motion == "sliding":
            self._temperature_scale *= PASSING_EASE
        self._temperature_scale = temperature_scale(self._temperature_scale, scene.water.table)

    @property
    def least_friction(self) -> float:
        """A friction force of the whole block that counts as none, N."""
        block = self._block
        return LEAST_FRICTION * block.scene.load.pressures.smallest * block.area * block.scale

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

        `elasticity`: of friction with the slip speed, v / F dF/dv; 1 of a film. As much as
        LEAST_ELASTICITY counts in any case, because slip makes heat.
        """
        surface, scene = self._block.surface, self._block.scene
        nodal = error.reshape(self._block.rubber.displacements.shape)
        size = np.linalg.norm(surface.displacements(nodal), axis=-1).ravel()
        stress = (
            scene.mooney_rivlin.youngs_modulus / self._block.height / scene.load.pressures.smallest
        )
        speed = min(max(elasticity, LEAST_ELASTICITY), 1.0) / (dt * scene.load.speeds.mean)
        return self._mean(size, area) * max(stress, speed) / self._local_tolerance

    def of_coupling(self, before: InterfaceStep, after: InterfaceStep) -> float:
        """What one more pass over block and film has changed."""
        change = after.change(before)
        return self._mean(change, after.friction()) / (self._control.agreement * self._agreement)

    def of_curve(self, forces: Sequence[float], ends: Sequence[float]) -> float:
        """How far friction `forces` (N) within a step leave the line between its ends.

        `forces` are those at its start and at the `ends` of its parts, in any unit of time from its
        start. A history has one row per step.
        """
        line = np.interp(ends, [0.0, ends[-1]], [forces[0], forces[-1]])
        off = float(np.abs(np.array(forces[1:]) - line).max())
        size = max(np.abs(forces).max(), self.least_friction)
        return off / (CURVE_SHARE * self._tolerance * size)

    def straight_parts(self, forces: Sequence[float], ends: Sequence[float]) -> tuple[int, float]:
        """How many parts of a step, from its start, may be one step; and how far friction leaves
        the line between the ends of that, as `of_curve` has it.
        """
        for parts in range(len(ends), 0, -1):
            bend = self.of_curve(forces[: parts + 1], ends[:parts])
            if bend <= 1.0:
                break
        return parts, bend

    def of_speed(self, found: float, curved: float, straight: Sequence[float]) -> float:
        """How far the friction force (N) `found` at the end of a step is from what was foreseen.

        `curved`: with the velocity that the block's last parabola foresees; `straight`: with the
        velocity held, and before the block was solved for. Far from one of these it has to be the
        nearer to the former.
        """
        size = self._tolerance * max(abs(found), self.least_friction)
        off, change = abs(found - curved) / size, max(abs(found - one) for one in straight) / size
        return max(off / CURVED_SHARE, min(off / FORESEEN_SHARE, change / STRAIGHT_SHARE))

    def first_behind_corner(self, force: float, rate: float) -> float:
        """The step (s) in which friction goes as far from the `force` (N) that was foreseen as it
        may, where its rate of change jumps by `rate` (N/s).
        """
        off = CURVED_SHARE * self._tolerance * max(abs(force), self.least_friction)
        return off / abs(rate) if rate else np.inf

    def is_jump(self, found: float, curved: float) -> bool:
        """Whether friction (N) is so far from what was foreseen that the velocity has jumped."""
        return abs(found - curved) > JUMP_SHARE * max(abs(found), self.least_friction)

    def is_snap(self, dt: float) -> bool:
        """Whether a step of `dt` (s) is so short that the block may jump in it."""
        return dt <= SNAP_STEP * self._block.scene.load.duration

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
        share = ENERGY_SHARE
        if self.is_snap(dt):
            share = max(share, SNAP_SHARE * load.duration / dt)
        return abs(energies.missing) / (share * turnover) if turnover else np.inf

    def may_rest(self, shear: Array, solved: Array, area: Array) -> bool:
        """Whether the block may rest under `shear` as it was solved for under that `solved` (Pa):
        it is quiet, and would hardly move when it is released.
        """
        most = min(self._resting, self._quiet(solved, area))
        return self._mean(shear - solved, area) <= most

    def is_quiet(self, shear: Array, solved: Array, area: Array) -> bool:
        """Whether the block may stay as it was solved for under the shear `solved` (Pa)."""
        return self._mean(shear - solved, area) <= self._quiet(solved, area)

    def _quiet(self, solved: Array, area: Array) -> float:
        """Change (Pa) of the mean shear `solved` that is no reason to solve for the block."""
        return self._control.quiet * self._agreement * self._mean(solved, area)

    def _mean(self, values: Array, weights: Array) -> float:
        """Mean size of `values` over all ranks' points; 0 without weight."""
        total = np.array([weights @ np.abs(values), weights.sum()])
        self._block.surface.comm.Allreduce(MPI.IN_PLACE, total, op=MPI.SUM)
        return float(total[0] / total[1]) if total[1] != 0.0 else 0.0
