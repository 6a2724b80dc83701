"""How large the errors of a coupled step may be, each relative to the scene's tolerance."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StepLimits:
    """Limits of a coupled step; `docs/validation/accuracy.md` has what they cost and what they
    gain.

    Film and heat
        local, local_power: a local error may be local * tolerance^local_power. Errors of single
        steps add up to one of mu(t) that falls as their power 2/3 to 3/4, so that mu(t) stays
        within the tolerance.
        moving_ice: how much larger the temperature's local error may be where ice slides. It sits
        in the one or two cells where melting begins, and leaves with them.
        most_substeps: steps of film and heat in one coupled step.
    Block and film together
        agreement: change of the film by one more pass over block and film, over the tolerance (of
        1 % where it is larger).
        passes: passes over block and film.
    Friction over the step
        curve: how far friction may leave the line between the ends of a step, over the tolerance.
        predicted: how far friction at the end may be from that with the extrapolated velocity of
        the rubber, over the tolerance. In a smooth motion it is off by a fifth of this, at a kink
        of the velocity by up to a half.
        straight, smooth: two kinks in a row may hide each other, so friction may differ by
        `straight` tolerances from that of a block that goes on straight, or by `smooth` from that
        with the extrapolated velocity.
        jump: friction that differs by more than this fraction of itself has jumped, and with it
        the block's velocity.
    Energy
        energy: fraction of the energy that a step turns over which may be missing or too much.
        snap_step, snap_energy: a point that folds over snaps from one equilibrium to the next,
        however short the step, because no inertia delays it. A step of up to this fraction of the
        duration may do so, if what is missing is at most that fraction of what the whole run turns
        over at the present friction.
        least_friction: where loads go in time, or the law is not viscous, energies count against
        this friction coefficient at the mean speed at least, and the block's speed always. Those of
        a plate that starts or stops are nothing but the solver's tolerance. A tenth of it takes
        five to twenty times the steps, to the same work (docs/how-to/loads.md).
        least_elasticity: under a law whose friction does not follow the slip speed an error of it
        still is one of the heat, so that much of it counts.
    Steps without mechanics
        quiet: change of the shear without which the block is not solved again, over the tolerance
        (of 1 % where it is larger).
        skipped_motion: how far the block may lag behind its equilibrium, over the distance that it
        slides in the longest step. When it is solved again film and heat see half of that, and the
        step's energy does not close by the other half.
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
