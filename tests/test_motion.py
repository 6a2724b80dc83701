"""Inertia of the block: exact vibrations, order, energies, and rest where nothing changes."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.sliding import Sliding  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.mechanics.press import press, start_sliding  # noqa: E402
from iceslide_fem.mechanics.time_discretisation import (  # noqa: E402
    Dynamic,
    QuasiStatic,
    motion_at_rest,
    quiescent_motion,
)
from iceslide_fem.scene import scene_from_dict  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.quick]

DENSITY = 1000.0
MODULUS = 4.0e6  # E = 4 (C10 + C01) where nu = 0
HEIGHT = 1e-3
LOAD = {"pressure": 1e5, "speed": 3.0, "duration": 1e-3}
ICE = {"temperature": 269.15}
FILM = {"k": 0.266, "D": 29e-6, "H_V": 2.86e-6}


def slice_scene(**tables):
    return scene_from_dict({"name": "inertia", "model": "slice", **tables})


def free_bar():
    """A block without transverse strain, lifted from the ice, under a plate without a force."""
    rubber = {"C10": 0.5e6, "C01": 0.5e6, "nu": 0.0, "density": DENSITY, "height": HEIGHT}
    block = build_block(
        slice_scene(rubber=rubber | {"inertia": True}, load=LOAD, ice=ICE, film=FILM),
        MPI.COMM_WORLD,
    )
    block.rubber.displacements[:, -1] += HEIGHT
    return block


def vibrate(block, n_steps: int, radius: float) -> tuple[float, list[float]]:
    """Bottom's displacement after 3/4 of the first free mode's period, per amplitude; energies.

    Exact: u = A cos(pi z / H) cos(w t) with w = pi / H sqrt(E / rho): nothing at 3/4.
    """
    rubber, law = block.rubber, Dynamic(block.rubber, radius)
    z = rubber.space.tabulate_dof_coordinates()[:, 1]
    values, lifted = rubber.u.x.array, rubber.u.x.array.copy()
    mode = 1e-5 * HEIGHT * np.cos(np.pi * z / HEIGHT)
    rubber.displacements[:, 1] += mode
    period = 2.0 * HEIGHT / np.sqrt(MODULUS / DENSITY)
    motion = motion_at_rest(values)
    start = np.zeros_like(motion.acceleration).reshape(-1, 2)
    start[:, 1] = -((2.0 * np.pi / period) ** 2) * mode
    motion = motion._replace(acceleration=start.ravel())
    energies = []
    for time in np.linspace(0.0, 0.75 * period, n_steps + 1)[1:]:
        values[:], _ = law.begin(motion, time)
        block.equilibrium.solve(0.0, block.static, 1e-9)
        motion = law.end(motion, time, values.copy())
        energies.append(rubber.elastic_energy() + law.kinetic_energy(motion))
    at_bottom = np.flatnonzero(z < 1e-9)
    moved = (motion.displacements - lifted).reshape(-1, 2)[at_bottom, 1]
    values[:] = lifted
    own = float(np.abs(moved).max(initial=0.0))
    return MPI.COMM_WORLD.allreduce(own, op=MPI.MAX) / (1e-5 * HEIGHT), energies


@pytest.mark.parametrize("radius", [0.5, 1.0])
def test_a_free_bar_vibrates_as_the_wave_equation_says(radius: float) -> None:
    block = free_bar()
    errors = [vibrate(block, n, radius)[0] for n in (20, 40, 80)]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 3e-3
    assert np.all(np.abs(slopes - 2.0) < 0.15), (errors, slopes)


def test_energy_of_the_free_bar_is_kept_and_high_frequencies_lose_it() -> None:
    block = free_bar()
    for radius, low, high in ((1.0, 1.0 - 1e-4, 1.0 + 1e-4), (0.5, 0.99, 1.0)):
        _, energies = vibrate(block, 60, radius)
        assert low < energies[-1] / energies[0] < high


def slide(inertia: bool, height: float, duration: float) -> tuple[Sliding, Ledger, list]:
    scene = slice_scene(
        rubber={"compound": "B", "length": 10e-3, "height": height, "inertia": inertia},
        load=LOAD | {"duration": duration},
        ice=ICE,
        numerics={"tolerance": 1e-2, "refinement": 0.5},
    )
    block = build_block(scene, MPI.COMM_WORLD)
    press(block, lambda _: None)
    start_sliding(block, lambda _: None)
    sliding = Sliding(block)
    ledger = Ledger(sliding)
    mu = []
    while sliding.current.time < duration:
        ledger.add(sliding.advance())
        mu.append((sliding.current.time, ledger.friction_force()))
    return sliding, ledger, mu


def test_a_low_block_slides_as_without_inertia() -> None:
    _, ledger, mu = slide(True, 0.2e-3, 1e-3)
    _, _, still = slide(False, 0.2e-3, 1e-3)
    times, forces = np.array(mu).T
    expected = np.interp(times, *np.array(still).T)
    assert np.abs(forces / expected - 1.0).max() < 0.01
    assert abs(ledger.imbalance) < 1e-3


def test_a_tall_block_swings_and_keeps_the_energy_balance() -> None:
    sliding, ledger, _ = slide(True, 6e-3, 1e-3)
    assert abs(ledger.imbalance) < 1e-3
    assert ledger.kinetic_energy > 1e-4 * ledger.friction_work
    assert not sliding.current.quiescent


def test_the_first_steps_do_not_ring() -> None:
    sliding, _, _ = slide(True, 1e-3, 1e-6)
    block = sliding.block
    assert block.normal_force(block.contact) == pytest.approx(block.force * block.scale, rel=1e-3)


def follow(times, way):
    """Motions of a quasi-static block of one unknown that is at `way(t)` at the `times`."""
    law = QuasiStatic()
    motions = [motion_at_rest(np.array([way(times[0])]))]
    for time in times[1:]:
        motions.append(law.end(motions[-1], time, np.array([way(time)])))
    return law, motions


def test_the_speed_that_is_not_foreseen_is_none_on_a_parabola_and_falls_with_the_step() -> None:
    law, motions = follow([0.0, 1.0, 1.5, 2.5], lambda t: 3.0 * t**2 - 2.0 * t)
    assert law.velocity_error(motions[2], motions[3]) == pytest.approx(0.0, abs=1e-12)
    assert motions[3].acceleration == pytest.approx(6.0)
    _, rate = law.begin(motions[3], 3.5)
    predicted = rate.slope * (motions[3].displacements + motions[3].velocity) + rate.intercept
    assert predicted + law.extrapolated_velocity(motions[3], 3.5) == pytest.approx(6.0 * 3.5 - 2.0)

    def of_a_wave(dt):
        law, motions = follow(dt * np.arange(4), lambda t: np.sin(t + 0.3))
        foreseen = law.velocity_error(motions[2], motions[3])
        _, rate = law.begin(motions[2], motions[3].time)
        found = rate.slope * motions[3].displacements + rate.intercept
        return foreseen[0], found[0] - np.cos(motions[3].time + 0.3)

    rough, fine = of_a_wave(0.02), of_a_wave(0.01)
    assert np.array(rough) / fine == pytest.approx([4.0, 4.0], rel=0.1)
    assert rough[0] / rough[1] == pytest.approx(-4.5, rel=0.1)  # with equal steps


def test_a_corner_of_the_motion_shows_in_the_speed_that_is_not_foreseen() -> None:
    law, motions = follow([0.0, 1.0, 2.0, 3.0, 4.0], lambda t: max(t - 3.0, 0.0))
    _, rate = law.begin(motions[3], 4.0)
    error = rate.slope * motions[4].displacements + rate.intercept - 1.0
    assert law.velocity_error(motions[3], motions[4])[0] > 2.0 * error[0] > 0.0


def test_a_block_that_has_rested_is_expected_to_rest() -> None:
    law, motions = follow([0.0, 1.0, 2.0], lambda t: 0.5 * t)
    still = quiescent_motion(motions[2])
    assert law.extrapolated_velocity(still, 4.0) == 0.0
    following = law.end(still, 4.0, still.displacements + 1.0)
    assert law.velocity_error(still, following) == pytest.approx(0.5)
    assert following.acceleration == pytest.approx(0.0)
