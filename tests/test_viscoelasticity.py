"""Rubber that relaxes at finite strain: exact stresses, heat, tangent, elastic limits."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from blocks import a_block  # noqa: E402
from test_rubber import uniform  # noqa: E402

from iceslide_fem.relaxation.compound import Relaxation  # noqa: E402
from iceslide_fem.relaxation.prony import Prony  # noqa: E402
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.mpi]

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
    rubber = HyperelasticBody(a_block(cells, 1), B, relaxation=ONE)
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

    off = {}
    for n in (20, 40):
        rubber = HyperelasticBody(a_block("quadrilateral", 1), B, relaxation=ONE)
        times = np.linspace(0.0, 10e-3, 2 * n + 1)
        _, stress, _, _ = history(rubber, gamma, times)
        found = dict(zip(times, stress, strict=True))
        for time, value in exact.items():
            assert found[times[np.argmin(abs(times - time))]][0, 1] == pytest.approx(
                value, rel=2e-5
            )
        middle = stress[n]
        off[n] = middle[0, 1] / exact[5e-3] - 1.0
        assert middle[0, 0] - middle[1, 1] == pytest.approx(117289.06, rel=5e-5)
    assert off[20] == pytest.approx(-7.7e-6, rel=0.05) and off[40] == pytest.approx(
        -1.9e-6, rel=0.1
    )
