"""Rubber that relaxes at finite strain: exact stresses, heat, tangent, elastic limits."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from blocks import CELLS, SIZE, a_block, all_of, bend  # noqa: E402
from test_rubber import uniform  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody  # noqa: E402
from iceslide_fem.relaxation.prony import (
    Prony,  # noqa: E402
    Relaxation,  # noqa: E402
)
from iceslide_fem.relaxation.shift import Shift  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS, MooneyRivlin  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.versions]

B = COMPOUNDS["B"]
ONE = Relaxation(Prony((0.3,), (5e-3,)))
ROOM = 293.15  # K


def sheared(gamma, dim=2):
    F = np.eye(dim)
    F[0, -1] = gamma
    return F


def cauchy(rubber, F):
    """Cauchy stress (d, d) of uniform rubber in an isochoric deformation F, by virtual work."""
    return uniform(rubber, F) @ F.T


def history(rubber, deformation, times, temperature=ROOM):
    """Internal variables, stresses after each step and heat (J) on the way along `deformation`."""
    visco = rubber.viscoelasticity
    stress = [cauchy(rubber, deformation(times[0]))]
    now, heat, errors = visco.at_rest(), [0.0], [0.0]
    for before, after in zip(times[:-1], times[1:], strict=True):
        visco.begin_step(now, after - before, temperature)
        stress.append(cauchy(rubber, deformation(after)))
        step = visco.end_step(now, after - before, temperature)
        now, heat, errors = step.after, [*heat, visco.total(step.heat)], [*errors, step.error]
    return now, np.array(stress), np.array(heat), np.array(errors)


@pytest.mark.parametrize("cells", ["quadrilateral", "hexahedron"])
def test_a_step_of_shear_relaxes_as_the_closed_form(cells):
    rubber = HyperelasticBody(a_block(cells, 1), all_of(B, ONE))
    dim = rubber.mesh.geometry.dim
    times = [0.0, 1e-3, 5e-3, 20e-3, 10.0]
    _, stress, heat, _ = history(rubber, lambda time: sheared(0.5, dim), times)
    exact = np.array([273000.0, 258154.05, 221229.33, 192600.05, 191100.0])
    assert stress[:, 0, -1] == pytest.approx(exact, rel=1e-7)
    assert stress[:, 0, 0] - stress[:, -1, -1] == pytest.approx(0.5 * exact, rel=1e-7)
    assert (np.diff(heat.cumsum()) > 0.0).all()  # what is stored turns into heat


def test_a_ramp_of_shear_is_of_second_order():
    exact = {2.5e-3: 127815.83, 5e-3: 243411.55, 10e-3: 210344.34}

    def gamma(time):
        return sheared(0.5 * min(time / 5e-3, 1.0))

    off = []
    for n in (20, 40):
        rubber = HyperelasticBody(a_block("quadrilateral", 1), all_of(B, ONE))
        times = np.linspace(0.0, 10e-3, 2 * n + 1)
        _, stress, _, _ = history(rubber, gamma, times)
        for time, value in exact.items():
            at = stress[np.argmin(abs(times - time))]
            assert at[0, 1] == pytest.approx(value, rel=2e-5)
        N1 = stress[n, 0, 0] - stress[n, 1, 1]
        off.append([stress[n, 0, 1] / exact[5e-3] - 1.0, N1 / 117289.06 - 1.0])
    assert [one[0] for one in off] == pytest.approx([-7.7e-6, -1.9e-6], abs=1e-7)
    assert off[1][1] == pytest.approx(off[0][1] / 4.0, rel=0.02)


@pytest.mark.mpi
def test_a_stretch_relaxes_as_the_closed_form():
    rubber = HyperelasticBody(a_block("hexahedron", 1), all_of(B, ONE))
    F = np.diag([1.2**-0.5, 1.2**-0.5, 1.2])
    _, stress, _, _ = history(rubber, lambda time: F, [0.0, 10.0])
    found = stress[:, 2, 2] - stress[:, 0, 0]
    assert found == pytest.approx([309642.67, 216749.87], rel=1e-7)


@pytest.mark.mpi
@pytest.mark.parametrize(("amplitude", "loss"), [(0.1, 2579.53), (0.5, 68425.7)])
def test_a_cycle_makes_the_heat_of_its_loss_modulus(amplitude, loss):
    """Those by an independent integration of one point; of small strains pi G'' amplitude^2."""
    rubber = HyperelasticBody(a_block("quadrilateral", 1), all_of(B, ONE))
    n, cycles = 200, 3
    times = np.linspace(0.0, 2.0 * np.pi * 5e-3 * cycles, n * cycles + 1)

    def gamma(time):
        return sheared(amplitude * np.sin(time / 5e-3))

    _, _, heat, _ = history(rubber, gamma, times)
    last = heat[-n:].sum() / SIZE**2
    assert last == pytest.approx(loss, rel=3e-4)
    assert amplitude > 0.1 or last == pytest.approx(np.pi * 81900.0 * amplitude**2, rel=3e-3)


@pytest.mark.parametrize("cells", CELLS)
def test_arms_that_relax_at_once_or_never_are_elastic(cells):
    block, dim = a_block(cells, 1), 2 if cells in ("triangle", "quadrilateral") else 3
    F = np.eye(3)
    F[:dim, :dim] += np.array([[0.1, -0.2, 0.05], [0.3, -0.15, 0.1], [-0.1, 0.2, 0.05]])[:dim, :dim]
    F, times = F[:dim, :dim], [0.0, 1e-3, 2e-3]
    soft = MooneyRivlin(0.7 * B.C10, 0.7 * B.C01, B.D1)
    for tau, material in ((1e-14, soft), (1e14, B)):
        arm = Relaxation(Prony((0.3,), (tau,)))
        rubber = HyperelasticBody(block, all_of(B, arm))
        _, stress, _, _ = history(
            rubber, lambda time: np.eye(dim) + 500.0 * time * (F - np.eye(dim)), times
        )
        elastic = uniform(HyperelasticBody(block, all_of(material)), F) @ F.T
        assert stress[-1] == pytest.approx(elastic, rel=1e-9, abs=1e-9 * B.C10)


@pytest.mark.mpi
@pytest.mark.parametrize("cells", ["quadrilateral", "hexahedron"])
def test_tangent_is_the_derivative_of_the_relaxing_forces(cells):
    rubber = HyperelasticBody(a_block(cells, 2), all_of(B, ONE))
    bend(rubber, 0.1)
    now = rubber.viscoelasticity.at_rest()
    rubber.viscoelasticity.begin_step(now, 3e-3, ROOM)
    u = rubber.u.x.array
    u *= 0.6
    start, step = u.copy(), 1e-5
    moves = 0.1 * np.cos(3e3 * u + 0.2) * SIZE
    forces = []
    for sign in (1.0, -1.0):
        u[:] = start + sign * step * moves
        vector = rubber.create_vector()
        rubber.internal_forces(vector)
        compat.sum_ghosts(vector)
        forces.append(vector.array.copy())
    u[:] = start
    matrix = rubber.create_matrix()
    rubber.tangent(matrix)
    matrix.assemble()
    direction, predicted = matrix.createVecRight(), matrix.createVecLeft()
    direction.array[:] = moves[: direction.getLocalSize()]
    matrix.mult(direction, predicted)
    found = (forces[0] - forces[1]) / (2.0 * step)
    size = rubber.mesh.comm.allreduce(float(np.abs(found).max()))
    np.testing.assert_allclose(predicted.array, found, atol=1e-6 * size)


@pytest.mark.mpi
def test_cold_rubber_is_stiffer_and_warm_parts_relax_first():
    shift = Shift(17.44, 51.6, 223.15).moved(ROOM)
    materials = all_of(B, Relaxation(ONE.prony, shift))
    rubber = HyperelasticBody(a_block("quadrilateral", 1), materials)
    _, stress, _, _ = history(rubber, lambda time: sheared(0.5), [0.0, 5e-3 * 10**1.8198], 269.15)
    assert stress[-1, 0, 1] == pytest.approx(221229.33, rel=1e-3)
    temperatures = np.where(np.arange(9) < 3, ROOM, 269.15)[None]
    now, _, _, _ = history(rubber, lambda time: sheared(0.5), [0.0, 5e-3], temperatures)
    for R, S in zip(now.relaxed[0, ..., 3], now.strained.stress[..., 3], strict=True):
        fraction = R / (0.3 * S)
        assert fraction[0] == pytest.approx(1.0 - np.exp(-1.0), rel=1e-6)
        assert fraction[8] == pytest.approx(1.0 - np.exp(-(10**-1.8198)), rel=1e-3)


def test_the_error_of_a_step_tells_how_far_the_line_is_off():
    """Of a stress that goes with the square of time: the estimate is the error itself."""
    found = {}
    for n in (8, 16):
        rubber = HyperelasticBody(a_block("quadrilateral", 1), all_of(B, ONE))
        times = np.linspace(0.0, 5e-3, n + 1)
        *_, errors = history(rubber, lambda time: sheared(0.05 * (time / 5e-3) ** 2), times)
        found[n] = errors[2:].mean()
    assert found[16] == pytest.approx(found[8] / 8.0, rel=0.05)  # of a step of third order
