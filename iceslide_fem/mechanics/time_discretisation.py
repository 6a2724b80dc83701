"""Time discretisation of the block's motion: quasi-static or with inertia.

Both give the nodal velocities as `slope * displacement + intercept`, linear in the unknown. The
slip speed is therefore implicit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.runtime.arrays import Array

# Spectral radius of the generalised-alpha method at high frequencies: amplification of unresolved
# modes in a step.
HIGH_FREQUENCY_RADIUS = 0.5


class Motion(NamedTuple):
    """Displacements (m), velocities (m/s) and accelerations (m/s2) of all dofs of this rank.

    time: of this solution, s; span: time since the solution before, s, infinite after rest;
    behind_kink: whether the velocity has a kink or a jump there; smooth: whether the extrapolated
    velocity was a better prediction than the held velocity.
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
    """The block's law of motion, as the coupled step uses it."""

    may_skip: bool

    def begin(self, start: Motion, time: float) -> tuple[Array, Rate]:
        """Predicted displacements at `time` (s), and the velocity as a function of displacement."""

    def end(self, start: Motion, time: float, displacements: Array) -> Motion:
        """The motion at `time` (s) with the solved `displacements`."""

    def local_error(self, start: Motion, end: Motion) -> Array:
        """Estimated local error of the displacements (dofs,), m."""

    def extrapolated_velocity(self, start: Motion, time: float) -> Array:
        """Velocity increment (dofs,) by the acceleration, beyond that of `begin` at `time`, m/s."""

    def velocity_error(self, start: Motion, end: Motion) -> Array:
        """Velocity (dofs,) at the end minus the predicted one, m/s; 0 with another error
        estimate.
        """

    def behind_kink(self, start: Motion, end: Motion) -> Motion:
        """`end` after a kink: data before the kink do not predict the velocity."""

    def kinetic_energy(self, motion: Motion) -> float:
        """Kinetic energy relative to the plate, J (J/m in a slice). Collective."""

    def mass_moment(self, motion: Motion) -> float:
        """Mass times displacement of its centre along x relative to the plate, kg m. Collective."""


def motion_at_rest(displacements: Array) -> Motion:
    """The motion of a block at rest at t = 0."""
    still = np.zeros_like(displacements)
    return Motion(0.0, np.inf, False, False, displacements.copy(), still, still)


def quiescent_motion(motion: Motion) -> Motion:
    """The same displacements, held at rest since then."""
    still = np.zeros_like(motion.velocity)
    return motion._replace(
        span=np.inf, behind_kink=False, smooth=False, velocity=still, acceleration=still
    )


class QuasiStatic:
    """No inertia. The predictor is linear through the last two solutions.

    The velocity at the end of a step is that of the parabola through three solutions (BDF2), or of
    the line through two after a rest or a jump: v1 = v + dt / (dt + dt0) (v - v0), with the mean
    velocities v and v0 and the lengths dt and dt0 of this step and the last one. The parabola's
    acceleration is a = 2 (v - v0) / (dt + dt0).
    """

    may_skip = True

    def begin(self, start: Motion, time: float) -> tuple[Array, Rate]:
        """Prediction by the line through the last two solutions; rate by the parabola."""
        dt = time - start.time
        weight = 0.0 if start.behind_kink else dt / (dt + start.span)
        slope = (1.0 + weight) / dt
        rate = Rate(slope, -slope * start.displacements - weight * start.velocity)
        return start.displacements + dt * start.velocity, rate

    def end(self, start: Motion, time: float, displacements: Array) -> Motion:
        """The motion; its velocity is the mean one since the last solution."""
        span = time - start.time
        velocity = (displacements - start.displacements) / span
        acceleration = 2.0 * (velocity - start.velocity) / (span + start.span)
        return Motion(time, span, False, False, displacements, velocity, acceleration)

    def local_error(self, start: Motion, end: Motion) -> Array:
        """Zero: there is no differential equation."""
        return np.zeros_like(end.displacements)

    def extrapolated_velocity(self, start: Motion, time: float) -> Array:
        """a0 t, with a0 of the last parabola and t since the middle of the last step."""
        if not np.isfinite(start.span):
            return np.zeros_like(start.velocity)
        return np.asarray((0.5 * start.span + time - start.time) * start.acceleration)

    def velocity_error(self, start: Motion, end: Motion) -> Array:
        """Difference of the velocities of this and the last parabola at the end: v1 - (v0 + a0 t).

        It is of second order in dt. In a smooth motion with equal steps it is 4.5 times the error
        of v1, at a kink at least twice.
        """
        found = end.velocity + 0.5 * end.span * end.acceleration
        return np.asarray(found - start.velocity - self.extrapolated_velocity(start, end.time))

    def behind_kink(self, start: Motion, end: Motion) -> Motion:
        """Drop the parabola; the first step after a kink uses a line."""
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
        """rubber: holds the inertia forces; radius: spectral radius, 0 to 1 (1 has no dissipation).

        `plate` is the acceleration (m/s2) along x of the plate at a time (s).
        """
        self._rubber, self._plate = rubber, plate
        self._alpha = (radius - 1.0) / (radius + 1.0)
        self._gamma = 0.5 - self._alpha
        self._beta = 0.25 * (1.0 - self._alpha) ** 2

    def begin(self, start: Motion, time: float) -> tuple[Array, Rate]:
        """Set the inertia forces of the step; predict with the last acceleration."""
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
        """Zero: `begin` already includes the acceleration."""
        return np.zeros_like(start.velocity)

    def velocity_error(self, start: Motion, end: Motion) -> Array:
        """Zero: the local error is the estimate."""
        return np.zeros_like(end.displacements)

    def behind_kink(self, start: Motion, end: Motion) -> Motion:
        """Unchanged: with inertia the velocity has no kinks."""
        return end

    def kinetic_energy(self, motion: Motion) -> float:
        """Kinetic energy relative to the plate, J (J/m in a slice). Collective."""
        return self._rubber.kinetic_energy(motion.velocity)

    def mass_moment(self, motion: Motion) -> float:
        """Mass moment relative to the plate, kg m (kg in a slice). Collective."""
        return self._rubber.momentum(motion.displacements)
