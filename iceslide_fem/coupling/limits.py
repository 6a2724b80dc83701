"""Error limits of a coupled step, each relative to the scene's tolerance."""

from __future__ import annotations

from dataclasses import dataclass


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
