"""k, D and H_V at the contact's age below slices and blocks, wherever films live."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from slides import slide, started  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.film.law import log_shearing  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.runs.point import point_history  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS  # noqa: E402

pytestmark = pytest.mark.fe

FRAMES = {
    "attached": {"ice": {"motion": "attached"}},
    "on rubber": {"ice": {"motion": "sliding"}, "film": {"carrier": "rubber"}},
    "on ice": {"ice": {"motion": "sliding"}, "film": {"carrier": "ice"}},
}
DRY = {"dry_stress": 2e5, "dry_softening": 10.0, "initial_height": 0.0}


def scene(frame, arms=((0.3, 2e-3),), celsius=-4.0, model="slice", **changes):
    """A coarse stiff block of 5 mm at 2 bar and 4 m/s."""
    tables = {
        "rubber": {
            "compound": "B",
            "length": 5e-3,
            "width": 5e-3,
            "height": 2e-3,
            "prony": arms,
            "modulus_is": "instantaneous",
        },
        "load": {"pressure": 2e5, "speed": 4.0, "duration": 1e-3},
        "ice": {"temperature": celsius + 273.15},
        "film": {"contact_age": True},
        "numerics": {"tolerance": 1e-2, "refinement": 0.5},
    }
    for more in (FRAMES[frame], changes):
        tables |= {name: tables.get(name, {}) | dict(table) for name, table in more.items()}
    return scene_from_dict({"name": "aged", "model": model, **tables})


@pytest.mark.parametrize("film", [{}, DRY], ids=["film", "dry"])
@pytest.mark.parametrize("frame", FRAMES)
def test_rubber_of_one_modulus_is_elastic(frame, film, tmp_path):
    """As slow as never: the film law with E_0; as fast as at once: with E_inf.

    The nominal pressure does not fall, so that no contact is held; the block is as soft. Brought to
    its speed with E_0, it lags behind that for some (tau / G) H / v, and with inertia it swings.
    """
    inertia = {"inertia": bool(film)}
    film = {"pressure": "nominal", **film}
    kinds = ((1e12, 1.0, 1e-5), (1e-14, 0.7, 4e-4))
    for tau, share, since in kinds[: 1 if inertia["inertia"] else 2]:
        table = scene(frame).contact_parameters.at_modulus(share * 3.0 * 546e3)
        columns = [table.pressure, table.k.values, table.D.values, table.H_V.values]
        lines = [",".join(map(repr, row)) for row in zip(*columns, strict=True)]
        (tmp_path / "t.csv").write_text("\n".join(["pressure_Pa,k,D_m,H_V_m", *lines]))
        own = {"contact_age": False, "contact": str(tmp_path / "t.csv")}
        B = COMPOUNDS["B"]
        soft = {"compound": None, "C10": share * B.C10, "C01": share * B.C01, "D1": B.D1}
        soft |= {"prony": None, "modulus_is": None}
        elastic = slide(scene(frame, film=film | own, rubber=inertia | soft))
        found = slide(scene(frame, [[0.3, tau]], film=film, rubber=inertia))
        expected = np.interp(found["time_s"], elastic["time_s"], elastic["mu"])
        later = found["time_s"] > since
        assert found["mu"][later] == pytest.approx(expected[later], rel=1e-2)
        k = float(table(2e5).k)
        assert found["contact_area_fraction"][1:] == pytest.approx(k, rel=2e-3)


@pytest.mark.parametrize("frame", FRAMES)
def test_energies_close_and_k_is_that_of_a_point(frame):
    """Under one pressure: over passing ice the mean of k is that of a point over its transit."""
    found = slide(scene(frame, load={"duration": 2e-3}, film={"pressure": "nominal"}))
    assert abs(found["energy_imbalance"][-1]) < 1e-3
    rows, _ = point_history(
        scene(frame if frame != "on rubber" else "attached", model="point", load={"duration": 2e-3})
    )
    k = np.interp(
        found["time_s"],
        [row.time_s for row in rows],
        [row.contact_area_fraction for row in rows],
    )
    assert found["contact_area_fraction"] == pytest.approx(k, rel=3e-3)
    assert k[-1] > 1.01 * k[0]


@pytest.mark.parametrize("frame", FRAMES)
def test_finer_steps_give_the_same_curve(frame):
    """Local pressures, fast and slow arms: mu within the tolerance of a run five times closer."""
    arms = [[0.2, 1e-5], [0.2, 1e-3]]
    coarse = slide(scene(frame, arms))
    fine = slide(scene(frame, arms, numerics={"tolerance": 2e-3}))
    mu = np.interp(coarse["time_s"], fine["time_s"], fine["mu"])
    assert np.abs(coarse["mu"] / mu - 1.0).mean() < 1e-2


def test_warm_rubber_is_older():
    """With heat in the rubber its surface shifts the times, in columns as on a mesh."""
    wlf = {"C1": 17.44, "C2": 51.6, "reference": 261.15}
    bodies = [(False, "column"), (True, "column"), ("mesh", "mesh")]
    k = []
    for heat, ice in bodies:
        here = scene(
            "attached", celsius=-12.0, rubber={"heat": heat, "wlf": wlf}, ice={"heat": ice}
        )
        k.append(slide(here)["contact_area_fraction"][-1])
    assert k[1] > 1.01 * k[0]
    assert k[2] == pytest.approx(k[1], rel=5e-3)


@pytest.mark.parametrize("film", [{}, DRY], ids=["film", "dry"])
def test_points_and_nodes_have_the_same_power(film):
    """To rounding, with a film at each node and a history at each point."""
    sliding = started(scene("on ice", film=film, rubber={"inertia": bool(film)}))
    frame, loads = sliding.frame, sliding.current.loads
    state, rng = sliding.current.interface, np.random.default_rng(1)
    age = state.age.copy()
    age[-1] = rng.uniform(0.0, 2e5, age.shape[1])  # c of the one arm
    height = state.log_height + rng.uniform(-1.0, 1.0, state.log_height.size)
    young = frame.sheared(state._replace(log_height=height), loads)
    state = state._replace(log_height=height, age=age)
    shear = frame.sheared(state, loads)(loads.pressure, loads.speed)[0]
    _, aged = frame.on_nodes(loads, state.age)
    power = aged.viscous * aged.speed * np.exp(log_shearing(state))
    power = power @ frame.ice.grid.cell_area[frame.ice.grid.own]
    assert power == pytest.approx(float(loads.touching @ (shear * loads.speed)), rel=1e-10)
    touching = loads.touching > 0.0
    growth = shear[touching] / young(loads.pressure, loads.speed)[0][touching]
    assert growth.min() >= 1.0 and growth.mean() > 1.01


@pytest.mark.mpi
@pytest.mark.parametrize("film", [{}, DRY], ids=["film", "dry"])
@pytest.mark.parametrize("frame", FRAMES)
def test_any_number_of_ranks_has_the_same_contact(frame, film):
    found = []
    for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
        sliding = started(scene(frame, film=film, rubber={"inertia": bool(film)}), comm)
        ledger = Ledger(sliding)
        for _ in range(8):
            ledger.add(accepted := sliding.advance())
        found.append(slide_row(sliding, ledger, accepted))
    together, alone = found
    for name, share in (("mu", 1e-6), ("contact_area_fraction", 1e-7), ("ice_heat_J", 2e-4)):
        assert getattr(together, name) == pytest.approx(getattr(alone, name), rel=share), name
