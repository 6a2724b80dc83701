"""Friction laws of one's own under a block: exact numbers, the film by the protocol, faults."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from pathlib import Path

from program import run  # noqa: E402
from slides import slide, started, thesis  # noqa: E402
from test_laws import BAD, LAWS, aged, ageing, page_law  # noqa: E402
from test_passing import passing  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.laws.table import law_of  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.output.history import interface_fields, slide_row  # noqa: E402
from iceslide_fem.runs.point import point_history  # noqa: E402
from iceslide_fem.runtime.errors import SceneError, SimulationStopped  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402

pytestmark = pytest.mark.fe
ROOT = Path(__file__).parent.parent
COMMS = MPI.COMM_WORLD, MPI.COMM_SELF
COARSE = ("numerics.refinement=0.5", "numerics.tolerance=1e-2", "load.duration=0.1ms")


@pytest.mark.parametrize("motion", ["attached", "sliding"])
def test_coulomb_is_its_number_under_a_block(motion):
    coulomb = ("friction.law=coulomb", "friction.mu=0.2", f"ice.motion={motion}")
    rows = slide(thesis(*COARSE, *coulomb))
    np.testing.assert_allclose(rows["mu"], 0.2, rtol=1e-9)
    assert abs(rows["energy_imbalance"][-1]) < 1e-3
    assert rows["surface_temperature_C"][-1] > -4.0 and not rows["water_squeezed_m3"].any()


@pytest.mark.parametrize("more", ["", "ice.motion=sliding", "rubber.inertia=true"])
def test_without_friction_a_block_slides(more):
    rows = slide(thesis(*COARSE, "friction.law=coulomb", "friction.mu=0", *more.split()))
    assert not rows["mu"].any() and not rows["friction_work_J"].any()
    assert rows["time_s"].size == 52


@pytest.mark.parametrize(("start", "end"), [(0.0, 0.2), (0.2, 0.0)])
def test_friction_that_grows_from_nothing_or_dies_away(start, end, tmp_path):
    """However little it changes in a step: as many steps, and energies close."""
    path = tmp_path / "turning.py"
    path.write_text(
        "import numpy as np\n"
        "from iceslide_fem.laws.protocol import Response\n"
        "class Turning:\n"
        "    fields = {'age': 0.0}\n"
        "    def __init__(self, start, end): self.start, self.end = start, end\n"
        "    def respond(self, contact, state, surface, dt):\n"
        "        age = state['age'] + dt\n"
        "        mu = self.start + (self.end - self.start) * np.minimum(age / 8e-5, 1.0)\n"
        "        return Response(mu * contact.pressure, mu, {'age': age})\n"
    )
    law = (f"friction.law={path}:Turning", f"friction.parameters={{start={start}, end={end}}}")
    rows = slide(thesis(*COARSE, *law))
    expected = start + (end - start) * np.minimum(rows["time_s"] / 8e-5, 1.0)
    np.testing.assert_allclose(rows["mu"], expected, atol=2e-4)
    assert rows["time_s"].size < 200 and abs(rows["energy_imbalance"][-1]) < 1e-3


@pytest.mark.parametrize("case", sorted(path.stem for path in LAWS.glob("*.toml")))
def test_laws_of_the_cases_run_on_their_own_level(case):
    scene = load_scene(LAWS / f"{case}.toml", COARSE)
    if scene.model == "slice":
        rows = slide(scene)
        assert abs(rows["energy_imbalance"][-1]) < 1e-3 and rows["time_s"][-1] == 1e-4
        assert 0.1 < rows["mu"][-1] < 0.5
    else:
        assert point_history(scene)[0][-1].time_s == 1e-4


def test_the_film_law_by_the_protocol_slides_as_the_built_in_one():
    same = (*COARSE, "numerics.shear_ramp_pressure=5000", "numerics.tolerance=3e-3")
    built_in = slide(thesis(*same))
    own = slide(thesis(*same, f"friction.law={LAWS / 'film_law.py'}:FilmLaw"))
    there = np.interp(own["time_s"], built_in["time_s"], built_in["mu"])
    np.testing.assert_allclose(own["mu"], there, rtol=3e-3)
    assert own["mu"][-1] == pytest.approx(built_in["mu"][-1], rel=1e-3)


def test_what_a_law_remembers_has_its_column_its_field_and_goes_on(tmp_path):
    scene = thesis(*COARSE, page_law(tmp_path), "friction.parameters.capacity=5000.0")
    sliding = started(scene)
    ledger = Ledger(sliding)
    for _ in range(3):
        ledger.add(sliding.advance())
    saved = checkpoint_tables(sliding)
    step = sliding.advance()
    row = slide_row(sliding, ledger, step)
    work = row.slip_m * 1e5 * 0.4 / row.contact_fraction  # by the mean pressure
    assert 0.9 * work < row.law_work_J_m2 < 1.01 * work
    field = interface_fields(sliding, step)["law_work_J_m2"]
    assert np.nanmax(field) > row.law_work_J_m2 and np.isnan(row.film_height_m)
    again = resumed(build_block(scene, MPI.COMM_SELF), saved)
    again.advance()
    np.testing.assert_allclose(
        again.current.interface.internal, sliding.current.interface.internal, rtol=1e-9
    )


def test_a_law_that_fails_under_a_block_stops_it_with_its_name(tmp_path):
    path = tmp_path / "bad.py"
    path.write_text(BAD.format(fault="if late: p = p * np.nan").replace("1e-4", "2e-5"))
    sliding = started(thesis(*COARSE, f"friction.law={path}:Law"))
    named = "friction law bad.py:Law returns a shear that is not finite at .* the run stops at"
    with pytest.raises(SimulationStopped, match=named):
        for _ in sliding.steps():
            pass
    assert 0.0 < sliding.current.time <= 2e-5  # what was accepted before stays


EVEN = {
    "rubber__length": "6 mm", "rubber__height": "0.1 mm", "load__speed": "3 m/s",
    "load__duration": "3 ms", "numerics__penalty": 2e12, "numerics__refinement": 0.5,
}  # fmt: skip


def own(scene, law):
    """The scene with the law of an override."""
    return scene.model_copy(update={"friction": thesis(law).friction})


def test_what_the_ice_remembers_passes_with_it(tmp_path):
    """An even block on fresh ice: mu is the mean over ages; and from a checkpoint."""
    scene = own(passing(**EVEN), ageing(tmp_path))
    sliding, saved = started(scene), None
    ledger = Ledger(sliding)
    rows = [slide_row(sliding, ledger, None)]
    for number, accepted in enumerate(sliding.steps()):
        ledger.add(accepted)
        rows.append(slide_row(sliding, ledger, accepted))
        if number == 20:
            saved, middle = checkpoint_tables(sliding), rows[-1]
    time, mu, fresh = np.array([(row.time_s, row.mu, row.law_fresh) for row in rows]).T
    np.testing.assert_allclose(mu, aged(time, 2e-3), rtol=0.01)
    np.testing.assert_allclose(mu[time > 2.1e-3], aged(3e-3, 2e-3), rtol=3e-3)
    np.testing.assert_allclose(0.1 + 0.3 * fresh, mu, rtol=0.01)
    assert abs(rows[-1].energy_imbalance) < 1e-3
    again = resumed(build_block(scene, MPI.COMM_SELF), saved)
    assert slide_row(again, Ledger(again), None).law_fresh == pytest.approx(middle.law_fresh)


def test_the_film_law_by_the_protocol_on_passing_ice_is_the_built_in_one():
    """Films live on the ice in both: as `film.carrier` says where the law says nothing."""
    same = (*COARSE, "numerics.shear_ramp_pressure=5000", "ice.motion=sliding")
    there = slide(thesis(*same))
    here = slide(thesis(*same, f"friction.law={LAWS / 'film_law.py'}:FilmLaw"))
    found = np.interp(here["time_s"], there["time_s"], there["mu"])
    np.testing.assert_allclose(here["mu"], found, rtol=0.01)
    assert here["mu"][-1] == pytest.approx(there["mu"][-1], rel=3e-3)


def test_what_springs_back_while_friction_falls_makes_heat(tmp_path):
    """The ledger closes under a law whose shear falls all the time, in usual steps."""
    more = ("ice.motion=sliding", "load.duration=0.3ms", ageing(tmp_path, "rubber"))
    rows = slide(thesis("numerics.refinement=1", "numerics.tolerance=1e-2", *more))
    assert rows["mu"][-1] < 0.35 and len(rows["mu"]) < 150
    assert abs(rows["energy_imbalance"][-1]) < 1e-3


IN_3D = ("model=block", "numerics.refinement=0.25", "numerics.tolerance=1e-2")


@pytest.mark.mpi
@pytest.mark.parametrize("carrier", ["ice", "rubber"])
def test_a_memory_in_3d_is_the_same_on_any_number_of_ranks(tmp_path, carrier):
    """Some steps of a coarse block: what has been in contact since t = 0 is as old as the run."""
    folder = MPI.COMM_WORLD.bcast(tmp_path, root=0)
    law = ageing(folder, carrier) if MPI.COMM_WORLD.rank == 0 else ""
    law = MPI.COMM_WORLD.bcast(law, root=0)
    scene = thesis(*IN_3D, "ice.motion=sliding", "friction.parameters.time=1e-4", law)
    found = []
    for comm in COMMS:
        sliding = started(scene, comm)
        ledger = Ledger(sliding)
        for _ in range(5):
            ledger.add(accepted := sliding.advance())
        found.append((slide_row(sliding, ledger, accepted), sliding.current.time))
    (together, _), (alone, time) = found
    # heat takes the slip of microseconds, which Newton's tolerance shows in
    for name, share in (("mu", 1e-6), ("law_fresh", 1e-6), ("ice_heat_J", 2e-4)):
        assert getattr(together, name) == pytest.approx(getattr(alone, name), rel=share), name
    assert alone.law_fresh == pytest.approx(np.exp(-time / 1e-4), abs=0.1 * time / 1e-4)
    assert alone.mu == pytest.approx(0.1 + 0.3 * alone.law_fresh, rel=1e-3)


def test_coulomb_is_its_number_in_3d():
    sliding = started(thesis(*IN_3D, "friction.law=coulomb", "friction.mu=0.2"))
    ledger = Ledger(sliding)
    for _ in range(3):
        ledger.add(accepted := sliding.advance())
    assert slide_row(sliding, ledger, accepted).mu == pytest.approx(0.2, rel=1e-9)


def stribeck(folder, fastest, slowest):
    """A scene whose mu falls in a line from `slowest` at rest to `fastest` at 5 m/s."""
    rows = [f"{t},{v},{mu}" for t in (-40, 0) for v, mu in ((0, slowest), (5, fastest))]
    (folder / "table.csv").write_text("\n".join(["temperature_C,speed_m_s,mu", *rows]))
    starts = 'load.speed=[["0ms","0m/s"],["1ms","2m/s"],["2ms","0m/s"]]'
    law = ["friction.law=coulomb", f"friction.table={folder / 'table.csv'}"]
    return load_scene(ROOT / "cases" / "thesis_1bar.toml", ["model=slice", starts, *law])


def test_friction_that_falls_with_speed_is_refused_where_a_block_cannot_follow(tmp_path):
    falls = stribeck(tmp_path, 0.1, 0.4)
    with pytest.raises(SceneError, match="6 kPa.s/m at 1.* without inertia has no motion then"):
        law_of(falls)
    heavy = falls.rubber.model_copy(update={"inertia": True})
    with pytest.raises(SceneError, match="sticks and slips faster than any step"):
        law_of(falls.model_copy(update={"rubber": heavy}))
    mild = stribeck(tmp_path, 0.3, 0.4)  # 2 kPa s/m, below sqrt(rho G) / 8 = 3.1
    assert law_of(mild.model_copy(update={"rubber": heavy})) is not None
    rises = stribeck(tmp_path, 0.4, 0.1)
    assert law_of(rises) is not None
    at_one_speed = falls.load.model_copy(update={"speed": 2.0})
    stribeck(tmp_path, 0.1, 0.4)
    assert law_of(falls.model_copy(update={"load": at_one_speed})) is not None


def test_constant_friction_over_continuum_ice_takes_the_steps_of_columns(tmp_path):
    """Points that begin to melt one after the other do not shorten steps: mu does not change."""
    changes = ["ice.heat=continuum", "load.pressure=3bar", "load.duration=0.2ms"]
    scene = load_scene(ROOT / "cases" / "laws" / "coulomb.toml", changes)
    summary = run(scene, tmp_path)
    assert summary["melt_onset_s"] is not None
    assert summary["mu_mean"] == pytest.approx(0.2, rel=1e-12)
    assert summary["rejected_steps"] == 0 and summary["steps"] <= 60
