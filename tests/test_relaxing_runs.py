"""Slices and blocks of rubber that relaxes, by the whole program."""

import numpy as np
import pytest
from program import rows_of, run

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
from slides import CASES, slide, started  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402

pytestmark = pytest.mark.fe
WORLD = MPI.COMM_WORLD
ARMS = "rubber.prony=[[0.2, '0.2 ms'], [0.3, '2 ms']]"
INSTANTANEOUS, LONG_TERM = "rubber.modulus_is=instantaneous", "rubber.modulus_is=long-term"


def scene(*changes, case="thesis_1bar"):
    short = "model=slice", "numerics.tolerance=1e-2", "numerics.refinement=0.5", "ice.heat=column"
    return load_scene(CASES / f"{case}.toml", [*short, "load.duration=2ms", *changes])


CONSTANT = '''
import numpy as np
from iceslide_fem.laws.protocol import Response


class Constant:
    """10 kPa wherever there is contact."""

    fields = {}

    def respond(self, contact, state, surface, dt):
        there = contact.pressure > 0.0
        return Response(np.where(there, 1e4, 0.0), np.zeros_like(contact.pressure), {})
'''


def test_a_flat_block_creeps_as_the_closed_form(tmp_path):
    """Sheared by a constant stress, its foot goes as J(t), far from its ends."""
    (tmp_path / "constant.py").write_text(CONSTANT, encoding="utf-8")
    flat = (
        "rubber.prony=[[0.3, '5 ms']]", INSTANTANEOUS, "rubber.length=10mm", "rubber.width=10mm",
        "rubber.height=0.15mm", "load.pressure=0.4bar", "load.duration=20ms",
        f"friction.law={tmp_path / 'constant.py'}:Constant", "output.probes.foot=[0, 0, 0]",
    )  # fmt: skip
    run(scene(*flat, "numerics.refinement=1", "numerics.tolerance=1e-3"), tmp_path / "out")
    rows = rows_of(tmp_path / "out" / "probes.csv")
    time, moved = (
        np.array([float(row[n]) for row in rows]) for n in ("time_s", "displacement_x_m")
    )
    creep = 1.0 + 0.3 / 0.7 * -np.expm1(-time / (5e-3 / 0.7))
    assert -moved[0] == pytest.approx(1e4 * 0.15e-3 / 546e3, rel=2e-3)
    np.testing.assert_allclose(moved / moved[0], creep, rtol=3e-4)


@pytest.mark.mpi
def test_the_same_on_any_number_of_ranks():
    relaxing = scene(ARMS, INSTANTANEOUS, "load.duration=0.5ms")
    together, alone = slide(relaxing, WORLD), slide(relaxing, MPI.COMM_SELF)
    for name in ("mu", "rubber_dissipation_J"):
        assert together[name][-1] == pytest.approx(alone[name][-1], rel=1e-5)


@pytest.mark.parametrize(("tau", "modulus"), [("1e-12 s", LONG_TERM), ("1e9 s", INSTANTANEOUS)])
def test_arms_that_relax_at_once_or_never_are_elastic(tau, modulus):
    """At once: but for t = 0, when the block is as stiff as it ever is."""
    relaxing = slide(scene(f"rubber.prony=[[0.3, '{tau}']]", modulus))
    elastic = slide(scene())
    at = np.linspace(0.1e-3, 2e-3, 40)
    mu, due = (np.interp(at, rows["time_s"], rows["mu"]) for rows in (relaxing, elastic))
    np.testing.assert_allclose(mu, due, rtol=3e-3)


@pytest.mark.parametrize(
    "more", [[], ["rubber.inertia=true", "load.duration=0.2ms"]], ids=["", "inertia"]
)
def test_energies_close_and_rubber_makes_heat(more):
    sliding = started(scene(ARMS, LONG_TERM, *more))
    ledger, heats = Ledger(sliding), []
    for accepted in sliding.steps():
        ledger.add(accepted)
        heats.append(accepted.energies.rubber_dissipation)
    assert min(heats) >= -1e-4 * sum(heats) and ledger.rubber_dissipation > 0.0
    assert abs(ledger.imbalance) < 3e-4


def test_its_heat_stays_in_its_mesh():
    sliding = started(scene(ARMS, LONG_TERM, "ice.heat=mesh", "rubber.heat=mesh"))
    ledger = Ledger(sliding)
    for accepted in sliding.steps():
        ledger.add(accepted)
    ice, heat_state, scale = sliding.frame.ice, sliding.current.interface.ice, sliding.block.scale
    kept = scale * ice.rubber_heat(heat_state)
    assert kept == pytest.approx(ledger.rubber_heat + ledger.rubber_dissipation, rel=1e-9)
    assert kept - ledger.rubber_heat > 0.0


def test_closer_tolerances_come_closer():
    """Mean mu, against that at a tolerance of 1e-4."""
    means = {}
    for tolerance in (1e-2, 1e-3, 1e-4):
        rows = slide(scene(ARMS, LONG_TERM, f"numerics.tolerance={tolerance}"))
        time, mu = rows["time_s"], rows["mu"]
        means[tolerance] = (0.5 * (mu[1:] + mu[:-1]) * np.diff(time)).sum() / time[-1]
    assert abs(means[1e-2] / means[1e-4] - 1.0) < 1e-2
    assert abs(means[1e-3] / means[1e-4] - 1.0) < 1e-3


def test_walls_that_meet_and_rub_do_so_while_lugs_relax():
    sipe = (
        "rubber.length=4mm", "rubber.height=3mm", "rubber.wall_friction=0.3",
        "rubber.sipes=[{position='0.3 mm', width='20 um', depth='2 mm'}]",
    )  # fmt: skip
    sliding = started(scene(ARMS, LONG_TERM, *sipe, "load.duration=1ms"))
    ledger = Ledger(sliding)
    for accepted in sliding.steps():
        ledger.add(accepted)
    assert ledger.wall_heat > 0.0 and ledger.rubber_dissipation > 0.0
    assert abs(ledger.imbalance) < 1e-3


def test_a_pass_begins_with_rubber_that_has_recovered():
    sliding = started(scene(ARMS, LONG_TERM, "load.passes=2", "load.period=50ms"))
    first = sliding.current.relaxed
    for _ in sliding.steps():
        pass
    assert np.abs(sliding.current.relaxed.relaxed).max() > 0.0
    sliding.begin_pass()
    again = sliding.current.relaxed
    assert not again.relaxed.any()
    scale = np.abs(first.strained.stress).max()
    np.testing.assert_allclose(again.strained.stress, first.strained.stress, atol=1e-3 * scale)
