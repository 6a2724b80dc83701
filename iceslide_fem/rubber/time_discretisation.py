"""How the block's displacements move on from one step to the next: quasi-static or with inertia.

Both give the nodal velocities as `slope * displacement + intercept`, linear in what is solved
for: so the slip speed can be taken at the displacement that is being found.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.rubber.hyperelasticity import HyperelasticBody
from iceslide_fem.runtime.arrays import Array

# Spectral radius of the generalised-alpha method at high frequencies: what a step leaves of a
# mode that it does not resolve.
HIGH_FREQUENCY_RADIUS = 0.5


class Motion(NamedTuple):
    """Displacements (m), velocities (m/s) and accelerations (m/s2) of all dofs of this rank.

    time (s): when they were found; span (s): how long the block took from the solution before,
    infinite if it has rested since; behind_kink: whether the velocity had a corner or a jump there;
    smooth: whether the acceleration before has told more of the velocity then than that alone.
    """

    time: float
    span: float
    behind_kink: bool
    smooth: bool
    displacements: Array
    velocity: Array
    acceleration: Array


class Rate(NamedTuple):
    """Nodal velocity (m/s) as slope (1/s) * displacement + intercept (dofs,)."""

    slope: float
    intercept: Array


class MotionLaw(Protocol):
    """What the coupled step needs to know of the block's motion."""

    may_skip: bool

    def begin(self, start: Motion, time: float) -> tuple[Array, Rate]:
        """Displacements to start from at `time` (s), and the velocity's dependence on them."""

    def end(self, start: Motion, time: float, displacements: Array) -> Motion:
        """The motion at `time` with the displacements that were found."""

    def local_error(self, start: Motion, end: Motion) -> Array:
        """Estimated error of the displacements (dofs,) that the step made, m."""

    def extrapolated_velocity(self, start: Motion, time: float) -> Array:
        """What the acceleration adds to the velocity (dofs,) that `begin` has at `time`, m/s."""

    def velocity_error(self, start: Motion, end: Motion) -> Array:
        """Velocity (dofs,) at the end less that expected at the start, m/s, if nothing else tells
        its error.
        """

    def behind_kink(self, start: Motion, end: Motion) -> Motion:
        """`end` behind a corner, before which nothing tells how the velocity goes on."""

    def kinetic_energy(self, motion: Motion) -> float:
        """Kinetic energy relative to the plate, J (J/m in a slice). Collective."""

    def mass_moment(self, motion: Motion) -> float:
        """Mass times the displacement of its centre along x relative to the plate, kg m.
        Collective.
        """


def motion_at_rest(displacements: Array) -> Motion:
    """A block that does not move at t = 0."""
    still = np.zeros_like(displacements)
    return Motion(0.0, np.inf, False, False, displacements.copy(), still, still)


def quiescent_motion(motion: Motion) -> Motion:
    """The same displacements, held since."""
    still = np.zeros_like(motion.velocity)
    return motion._replace(
        span=np.inf, behind_kink=False, smooth=False, velocity=still, acceleration=still
    )


class QuasiStatic:
    """No inertia: displacements follow the forces; predicted on the line through the last two.

    The velocity at the end of a step is that of the parabola through three solutions (BDF2), or of
    the line through two after a rest or a jump: with v the mean velocities of this step and of the
    one before, dt and dt0 their lengths, v1 = v + dt / (dt + dt0) (v - v0). The parabola's
    acceleration is a = 2 (v - v0) / (dt + dt0).
    """

    may_skip = True

    def begin(self, start: Motion, time: float) -> tuple[Array, Rate]:
        """The line through the last two solutions; the parabola's slope."""
        dt = time - start.time
        weight = 0.0 if start.behind_kink else dt / (dt + start.span)
        slope = (1.0 + weight) / dt
        rate = Rate(slope, -slope * start.displacements - weight * start.velocity)
        return start.displacements + dt * start.velocity, rate

    def end(self, start: Motion, time: float, displacements: Array) -> Motion:
        """The velocity is the mean one since the last solution."""
        span = time - start.time
        velocity = (displacements - start.displacements) / span
        acceleration = 2.0 * (velocity - start.velocity) / (span + start.span)
        return Motion(time, span, False, False, displacements, velocity, acceleration)

    def local_error(self, start: Motion, end: Motion) -> Array:
        """None: there is nothing to integrate."""
        return np.zeros_like(end.displacements)

    def extrapolated_velocity(self, start: Motion, time: float) -> Array:
        """a0 t, of the last parabola, with t the time since the middle of the step before."""
        if not np.isfinite(start.span):
            return np.zeros_like(start.velocity)
        return np.asarray((0.5 * start.span + time - start.time) * start.acceleration)

    def velocity_error(self, start: Motion, end: Motion) -> Array:
        """How far the last parabola's velocity is from this one's, at the end: v1 - (v0 + a0 t).

        Of second order in dt and 4.5 times the error of v1 where the motion is smooth (in equal
        steps); at a corner at least twice it.
        """
        found = end.velocity + 0.5 * end.span * end.acceleration
        return np.asarray(found - start.velocity - self.extrapolated_velocity(start, end.time))

    def behind_kink(self, start: Motion, end: Motion) -> Motion:
        """Without a parabola to go on with; but the first one behind a corner is good."""
        if start.behind_kink:
            return end
        return end._replace(
            behind_kink=True, smooth=False, acceleration=np.zeros_like(end.acceleration)
        )

    def kinetic_energy(self, motion: Motion) -> float:
        """None: its mass is neglected."""
        return 0.0

    def mass_moment(self, motion: Motion) -> float:
        """None: its mass is neglected."""
        return 0.0


class Dynamic:
    """Implicit dynamics: the generalised-alpha method with all forces at the step's end.

    With rho the spectral radius at high frequencies, alpha_m = (rho - 1) / (rho + 1) and
    alpha_f = 0 (Wood, Bossak and Zienkiewicz's member of the family of Chung and Hulbert, J. Appl.
    Mech. 60 (1993) 371): second order, unconditionally stable for linear problems.

        M [(1 - alpha_m) a1 + alpha_m a0] + f(u1) = 0
        u1 = u0 + dt v0 + dt^2 [(1/2 - beta) a0 + beta a1]
        v1 = v0 + dt [(1 - gamma) a0 + gamma a1]

    Displacements are relative to the plate: where that is accelerated, M times its acceleration at
    the step's end is among the forces f.
    """

    may_skip = False

    def __init__(
        self,
        rubber: HyperelasticBody,
        radius: float = HIGH_FREQUENCY_RADIUS,
        plate: Callable[[float], float] = lambda time: 0.0,
    ) -> None:
        """`rubber` carries the inertia forces; `radius` in 0 to 1 (1 dissipates nothing).

        `plate` is the acceleration (m/s2) along x of the plate at a time (s).
        """
        self._rubber, self._plate = rubber, plate
        self._alpha = (radius - 1.0) / (radius + 1.0)
        self._gamma = 0.5 - self._alpha
        self._beta = 0.25 * (1.0 - self._alpha) ** 2

    def begin(self, start: Motion, time: float) -> tuple[Array, Rate]:
        """Sets the inertia forces of the step; predicts with the last acceleration."""
        dt, beta, gamma = time - start.time, self._beta, self._gamma
        u, v, a = start.displacements, start.velocity, start.acceleration
        coasted = u + dt * v + (0.5 - beta) * dt**2 * a
        weight = (1.0 - self._alpha) / (beta * dt**2)
        # weight * (u1 - reference) = (1 - alpha_m) a1 + alpha_m a0
        reference = coasted - self._alpha / weight * a
        if acceleration := self._plate(time):
            reference.reshape(-1, self._rubber.mesh.geometry.dim)[:, 0] -= acceleration / weight
        self._rubber.set_inertia(weight, reference)
        slope = gamma / (beta * dt)
        intercept = v + (1.0 - gamma) * dt * a - slope * coasted
        return coasted + beta * dt**2 * a, Rate(slope, intercept)

    def end(self, start: Motion, time: float, displacements: Array) -> Motion:
        """Newmark's formulas solved for acceleration and velocity."""
        dt, beta, gamma = time - start.time, self._beta, self._gamma
        u, v, a = start.displacements, start.velocity, start.acceleration
        coasted = u + dt * v + (0.5 - beta) * dt**2 * a
        following = (displacements - coasted) / (beta * dt**2)
        velocity = v + dt * ((1.0 - gamma) * a + gamma * following)
        return Motion(time, dt, False, False, displacements, velocity, following)

    def local_error(self, start: Motion, end: Motion) -> Array:
        """(beta - 1/6) dt^2 (a1 - a0): Zienkiewicz and Xie, Earthq. Eng. Struct. Dyn. 20 (1991)."""
        dt = end.time - start.time
        change = end.acceleration - start.acceleration
        return np.asarray((self._beta - 1.0 / 6.0) * dt**2 * change)

    def extrapolated_velocity(self, start: Motion, time: float) -> Array:
        """None: `begin` predicts with it."""
        return np.zeros_like(start.velocity)

    def velocity_error(self, start: Motion, end: Motion) -> Array:
        """None: the local error tells."""
        return np.zeros_like(end.displacements)

    def behind_kink(self, start: Motion, end: Motion) -> Motion:
        """As it is: mass knows no corners."""
        return end

    def kinetic_energy(self, motion: Motion) -> float:
        """Of the velocities relative to the plate, J (J/m in a slice). Collective."""
        return self._rubber.kinetic_energy(motion.velocity)

    def mass_moment(self, motion: Motion) -> float:
        """Of the displacements relative to the plate, kg m (kg in a slice). Collective."""
        return self._rubber.momentum(motion.displacements)
