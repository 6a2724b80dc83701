"""From DMA tables to shifts, WLF constants and Prony series; other programs' series."""

import numpy as np
import pytest

from iceslide_fem.preprocess.rubber.compound import at_rate, simple_shear, stresses, uniaxial
from iceslide_fem.relaxation.dma import read_dma
from iceslide_fem.relaxation.dma_fit import characterised
from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import COMPOUNDS

pytestmark = pytest.mark.quick

UNIVERSAL = Shift(17.44, 51.6, 223.15).moved(293.15)  # about a glass transition at -50 degC
KNOWN = Prony((0.2, 0.25, 0.2, 0.15, 0.1, 0.06, 0.02), (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-1))
E0 = 200e6
HERTZ, CELSIUS = np.logspace(-1.0, 2.0, 10), np.arange(-40.0, 41.0, 10.0)


def moduli(shift=UNIVERSAL, noise=0.0, seed=0):
    """Rows of frequency (Hz), temperature (degC), E' and E'' (Pa)."""
    rng, rows = np.random.default_rng(seed), []
    for celsius in CELSIUS:
        found = E0 * KNOWN.dynamic(2.0 * np.pi * HERTZ * shift(celsius + 273.15))
        factors = np.exp(noise * rng.standard_normal((2, HERTZ.size)))
        rows.append([HERTZ, np.full_like(HERTZ, celsius), *(factors * [found.real, found.imag])])
    return np.concatenate(rows, axis=1).T


def written(path, rows, head="frequency_Hz,temperature_C,storage_modulus_Pa,loss_modulus_Pa"):
    np.savetxt(path, rows, delimiter=",", header=head, comments="")
    return path


def fitted(path, rows, **options):
    table = read_dma(written(path, rows), "the table")
    return characterised(table, "the table", **options)


def off(found):
    """Largest relative error of E(t) over the times that were measured."""
    times = np.geomspace(1.0 / found.reduced.max(), 1.0 / found.reduced.min(), 300)
    exact = E0 * KNOWN.modulus(times)
    return np.abs(found.instantaneous * found.relaxation.prony.modulus(times) / exact - 1.0).max()


@pytest.mark.parametrize(
    ("noise", "of_constants", "of_modulus"), [(0.0, 2e-3, 2e-3), (0.02, 0.03, 0.02)]
)
def test_a_known_compound_comes_back(tmp_path, noise, of_constants, of_modulus):
    found = fitted(tmp_path / "a.csv", moduli(noise=noise))
    law = found.relaxation.shift
    assert (law.C1, law.C2) == pytest.approx((7.4005, 121.6), rel=of_constants)
    assert law.reference == 293.15
    assert off(found) < of_modulus
    assert found.misfit.storage < 1.1 * noise + 1e-3
    assert found.misfit.tan_delta < 1.5 * noise + 2e-3
    assert len(found.relaxation.prony.times) <= 20 and not found.flows
    assert np.log10(found.factors / UNIVERSAL(found.dma.isotherms)) == pytest.approx(0.0, abs=0.05)


def test_another_reference_is_the_same_compound(tmp_path):
    at_20 = fitted(tmp_path / "a.csv", moduli()).relaxation
    at_0 = fitted(tmp_path / "a.csv", moduli(), reference=273.15).relaxation
    assert at_0.shift.C2 == pytest.approx(121.6 - 20.0, rel=1e-2)
    times = np.logspace(-6, 2, 30)
    assert at_0.modulus(times, 263.15) == pytest.approx(at_20.modulus(times, 263.15), rel=5e-3)


def test_a_given_shift_is_taken(tmp_path):
    cold = [row for row in moduli() if row[1] in (-40.0, 20.0)]  # which do not overlap
    with pytest.raises(SceneError, match="-40 degC and 20 degC do not overlap"):
        fitted(tmp_path / "a.csv", cold)
    found = fitted(tmp_path / "a.csv", cold, shift=UNIVERSAL)
    assert found.relaxation.shift == UNIVERSAL and found.factors is None
    times = 1.0 / found.reduced
    exact = E0 * KNOWN.modulus(times)
    assert found.instantaneous * found.relaxation.prony.modulus(times) == pytest.approx(
        exact, rel=0.01
    )


def test_below_a_temperature_an_activation_energy(tmp_path):
    shift = Shift(17.44, 51.6, 223.15, 258.15, 180e3).moved(293.15)
    found = fitted(tmp_path / "a.csv", moduli(shift), arrhenius_below=258.15)
    assert found.relaxation.shift.activation_energy == pytest.approx(180e3, rel=0.01)
    assert off(found) < 0.01
    with pytest.raises(SceneError, match="allowed: a warmer reference"):
        fitted(tmp_path / "a.csv", moduli(), arrhenius_below=258.15, reference=243.15)


def test_one_temperature_has_no_shift(tmp_path):
    rows = moduli()
    found = fitted(tmp_path / "a.csv", rows[rows[:, 1] == 20.0])
    assert (found.relaxation.shift(250.0), found.factors) == (1.0, None)
    assert off(found) < 0.03


@pytest.mark.parametrize(
    "head",
    [
        "f (Hz),T (degC),E' (Pa),E'' (Pa)",
        "f [Hz],T [°C],G' [Pa],G'' [Pa]",
        "Frequency / Hz,Temperature / °C,E_storage / Pa,E_loss / Pa",
        "frequency_Hz,temperature_C,storage_modulus_Pa,loss modulus (Pa)",
    ],
)
def test_headings_as_people_write_them(tmp_path, head):
    rows = moduli()
    found = read_dma(written(tmp_path / "a.csv", rows, head), "the table")
    order = np.lexsort((rows[:, 0], rows[:, 1]))
    assert found.of == ("G" if "G'" in head else "E")
    assert found.frequency == pytest.approx(2.0 * np.pi * rows[order, 0])
    assert found.temperature == pytest.approx(273.15 + rows[order, 1])
    assert (found.storage, found.loss) == (
        pytest.approx(rows[order, 2]), pytest.approx(rows[order, 3])
    )  # fmt: skip


@pytest.mark.parametrize("name", ["angular_frequency_rad_s", "omega (rad/s)", "f (rad/s)"])
def test_radians_are_no_turns(tmp_path, name):
    rows = moduli()
    rows[:, 3] /= rows[:, 2]
    path = written(tmp_path / "a.csv", rows, f"{name},T (degC),E' (kPa),tan delta")
    found = read_dma(path, "the table")
    assert found.frequency[:10] == pytest.approx(rows[:10, 0])
    assert found.storage[:10] == pytest.approx(1e3 * rows[:10, 2])
    assert found.tan_delta[:10] == pytest.approx(rows[:10, 3])


def test_an_isotherm_is_one_though_its_temperature_wanders(tmp_path):
    rows = moduli()
    rows[:, 1] += np.random.default_rng(0).uniform(-0.2, 0.2, len(rows))
    assert len(fitted(tmp_path / "a.csv", rows).dma.isotherms) == 9


HEAD = "f (Hz),T (degC),E' (MPa),tan delta\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEAD + "1,20,5,0.1\n10,20,6,0.1\n", "has 2 rows; allowed: 4 to 20000"),
        (HEAD + 4 * "1,20,5,0.1\n", "has 1 different frequencies; allowed: 4 or more"),
        (HEAD + "1,20,5,0.1\n10,20,6,0.1\n20,320,7,0.1\n40,20,8,0.1\n", "temperature = 320 degC"),
        (HEAD + "1,20,5,0.1\n10,20,-6,0.1\n20,20,7,0.1\n40,20,8,0.1\n", "row 2 .line 3.: storage"),
        (HEAD + "1,20,5,0.1\n10,20,6,0\n20,20,7,0.1\n40,20,8,0.1\n", "tan_delta = 0 is out of"),
        (HEAD + "1,20,5,0.1\n10,20,6,\n20,20,7,0.1\n40,20,8,0.1\n", "tan_delta is missing"),
        (HEAD + "0,20,5,0.1\n10,20,6,0.1\n20,20,7,0.1\n40,20,8,0.1\n", "frequency = 0 Hz is out"),
        ("f (Hz),T (degC),E' (MPa)\n1,20,5\n2,20,5\n3,20,6\n4,20,6\n", "no column loss_modulus_Pa"),
        ("T (degC),E' (MPa),tan delta\n20,5,1\n20,5,1\n20,6,1\n20,6,1\n", "column frequency_Hz"),
        ("f (rpm),T (degC),E' (MPa),tan delta\n1,20,5,1\n2,20,5,1\n3,20,5,1\n4,20,6,1\n", "turns"),
        (HEAD + "".join(f"1,{0.5 * i},5,0.1\n" for i in range(9)), "in steps below 1 K"),
    ],
)  # fmt: skip
def test_a_bad_table_gets_one_sentence(tmp_path, text, said):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=said):
        read_dma(tmp_path / "a.csv", "the table")


def test_two_isotherms_do_not_say_what_wlf_is(tmp_path):
    rows = moduli()
    with pytest.raises(SceneError, match="2 isotherms do not say"):
        fitted(tmp_path / "a.csv", rows[rows[:, 1] >= 30.0])
    rows[:, 1] *= -1.0
    with pytest.raises(SceneError, match="do not (shift as those of rubber|overlap)"):
        fitted(tmp_path / "a.csv", rows)


def test_moduli_that_no_rubber_has_are_refused(tmp_path):
    rows = moduli()[:10]
    rows[:, 3] = 10.0 * rows[:, 2]  # as much loss would need a modulus that rises as fast
    with pytest.raises(SceneError, match="no Prony series describes its moduli"):
        fitted(tmp_path / "a.csv", rows)


@pytest.mark.parametrize(
    ("program", "g", "tau", "instantaneous"),
    [
        ("Abaqus", 0.3, 5e-3, 546e3),
        ("LS-DYNA", 163_800 / (382_200 + 163_800), 1 / 200, 382_200 + 163_800),
        ("FEBio", 0.428571 / 1.428571, 5e-3, 1.428571 * 382_200),
    ],
)
def test_the_same_curve_from_three_programs(program, g, tau, instantaneous):
    """G0 546 kPa, G_inf 382.2 kPa, 5 ms: what docs/explanation/relaxation.md makes of each."""
    times = np.array([0.0, 1e-3, 5e-3, 20e-3])
    curve = 546e3 * (0.7 + 0.3 * np.exp(-times / 5e-3))
    assert instantaneous * Prony((g,), (tau,)).modulus(times) == pytest.approx(curve)


B, ONE = COMPOUNDS["B"], Prony((0.3,), (5e-3,))


def test_stress_after_a_step_and_a_ramp_of_shear():
    times = np.array([0.0, 1e-3, 5e-3, 20e-3, 10.0])
    held = stresses(B, ONE, simple_shear, np.full(5, 0.5), times)
    assert held[:, 0, 1] == pytest.approx(
        [273000.0, 258154.05, 221229.33, 192600.05, 191100.0], abs=0.01
    )
    assert held[:, 0, 0] - held[:, 1, 1] == pytest.approx(0.5 * held[:, 0, 1])
    times = np.linspace(0.0, 5e-3, 401)[1:]
    ramp = stresses(B, ONE, simple_shear, 100.0 * times, times)
    assert ramp[[199, 399], 0, 1] == pytest.approx([127815.83, 243411.55], rel=1e-6)
    assert ramp[-1, 0, 0] - ramp[-1, 1, 1] == pytest.approx(117289.06, rel=1e-6)


def test_stress_of_a_bar():
    held = stresses(B, ONE, uniaxial, np.full(2, 0.2), np.array([0.0, 100.0]))
    assert held[:, 0, 0] - held[:, 1, 1] == pytest.approx([309642.67, 216749.87], abs=0.01)
    _, fast = at_rate(B, ONE, uniaxial, 0.2, 1e9)
    assert fast[-1] == pytest.approx(309642.67 / 1.2)
