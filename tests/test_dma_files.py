"""DMA tables as instruments and programs write them: read right, or doubted in words."""

import json
import tomllib

import numpy as np
import pytest

from iceslide_fem.cli import main
from iceslide_fem.relaxation.dma import read_dma
from iceslide_fem.relaxation.dma_fit import characterised
from iceslide_fem.relaxation.doubts import of_fit, of_use
from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.relaxation.shift import Shift, ShiftTable
from iceslide_fem.runs.notes import notes
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict

pytestmark = pytest.mark.quick

SHIFT = Shift(9.0, 120.0, 293.15)
KNOWN = Prony((0.3, 0.3, 0.2, 0.1, 0.05), (1e-7, 1e-5, 1e-3, 1e-1, 1e1))
E0 = 500e6
HERTZ = np.logspace(-1.0, 1.5, 8)


def moduli(celsius, shift=SHIFT, hertz=HERTZ):
    """Rows of frequency (Hz), temperature (degC), E' and E'' (Pa)."""
    rows = []
    for each in celsius:
        found = E0 * KNOWN.dynamic(2.0 * np.pi * hertz * shift(each + 273.15))
        rows.append([hertz, np.full_like(hertz, each), found.real, found.imag])
    return np.concatenate(rows, axis=1).T


COLD = moduli([-20.0, -10.0, 0.0, 10.0])
PLAIN = "frequency_Hz,temperature_C,storage_modulus_Pa,loss_modulus_Pa\n"


def rows(columns, separator, decimal="."):
    """Rows of text of a list of columns."""
    lines = (separator.join(f"{x:.8g}" for x in row) for row in zip(*columns, strict=True))
    return "".join(line.replace(".", decimal) + "\n" for line in lines)


F, T, STORAGE, LOSS = COLD.T
MPA = (STORAGE / 1e6, LOSS / 1e6)
ANGULAR = 2.0 * np.pi * F
TAN = LOSS / STORAGE
TRIOS = "[step]\nFrequency sweep - 1\nAngular frequency,Step time,Temperature,Oscillation strain,"
TRIOS += "Tan(delta),Storage modulus,Loss modulus\nrad/s,s,°C,%,,MPa,MPa\n"


def trios():
    """Blocks of a temperature each, words before, between and after them."""
    text = "Filename,C:\\x.tri\nInstrument type,DMA850\nSample name,B\n" + 20 * "Note,none\n" + "\n"
    for start in range(0, len(F), len(HERTZ)):
        here = slice(start, start + len(HERTZ))
        columns = (ANGULAR, 10.0 * F, T, 0.1 + 0.0 * F, TAN, *MPA)
        text += TRIOS + rows([column[here] for column in columns], ",") + "\n"
    return text + "[End]\nOperator,A. Person\n"


FILES = {
    "double quote": "f [Hz]\tT [C]\tE' [MPa]\tE\" [MPa]\n" + rows((F, T, *MPA), "\t"),
    "quoted double quote": 'f [Hz],T [C],"E\' [MPa]","E"" [MPa]"\n' + rows((F, T, *MPA), ","),
    "typographic": "f [Hz];T [°C];E’ [MPa];E” [MPa]\n" + rows((F, T, *MPA), ";"),
    "unit row with a dash": "f,E',E'',T,Set\nHz,MPa,MPa,C,-\n" + rows((F, *MPA, T, T > 0), ","),
    "unit row with brackets": "f,E',tan d,T,phase,n\n[Hz],[MPa],[],[°C],[°],[1/s]\n"
    + rows((F, MPA[0], TAN, T, T, T), ","),
    "unit row with percent": "strain,f,E',E'',T\n%,Hz,MPa,MPa,°C\n"
    + rows((0 * F + 1, F, *MPA, T), ","),
    "pyvisco": "f_set,E_stor,E_loss,T,tan_del\nHz,MPa,MPa,°C,-\n" + rows((F, *MPA, T, TAN), ","),
    "Hz and rad/s": "Temperature (C),Frequency (Hz),Angular Frequency (rad/s),E' (MPa),E'' (MPa)\n"
    + rows((T, F, ANGULAR, *MPA), ","),
    "TRIOS": trios(),
    "tan(delta)": "Frequency (Hz),T (C),E' (MPa),tan(delta)\n" + rows((F, T, MPA[0], TAN), ","),
    "tan δ": "Frequency (Hz),Temperature (C),E' (MPa),tanδ\n" + rows((F, T, MPA[0], TAN), ","),
    "small hz and pa": "freq_hz,temperature_C,E_storage_pa,E_loss_pa\n"
    + rows((F, T, STORAGE, LOSS), ","),
    "German": "Frequenz [Hz];Temperatur [°C];Speichermodul [MPa];Verlustmodul [MPa];"
    "Verlustfaktor [-]\n" + rows((F, T, *MPA, TAN), ";", ","),
    "Netzsch": "#EXPORTTYPE:DATA ALL\n#INSTRUMENT:NETZSCH DMA 242\n"
    "##Temp./°C;Freq./Hz;E'/MPa;E''/MPa;tan d\n" + rows((T, F, *MPA, TAN), ";"),
    "Eplexor": "T [°C]\tf [Hz]\tE' [MPa]\tE'' [MPa]\ttan delta [-]\n"
    + rows((T, F, *MPA, TAN), "\t"),
    "named marks": "Kreisfrequenz (rad/s);Temp. (°C);Storage modulus E' (Pa);"
    "Loss modulus E'' (Pa)\n" + rows((ANGULAR, T, STORAGE, LOSS), ";"),
    "remark of numpy": "# frequency_Hz,temperature_C,E_storage_Pa,E_loss_Pa\n"
    + rows((F, T, STORAGE, LOSS), ","),
    "tabs above blanks, a column twice": 'Freq\tE\'\tE"\tTemp\tEta"\tTemp\n'
    "rad/s\tPa\tPa\t°C\tPa-s\t°C\n" + rows((ANGULAR, STORAGE, LOSS, T, LOSS / ANGULAR, T), "     "),
    "complex modulus": "f [Hz],T [°C],|E*| [MPa],tan delta\n"
    + rows((F, T, np.hypot(*MPA), TAN), ","),
    "Japanese": "周波数 (Hz),温度 (°C),貯蔵弾性率 (MPa),損失弾性率 (MPa)\n"
    + rows((F, T, *MPA), ","),
    "UTF-16": "No.\tFrequency\tTemperature\tStorage Modulus\tLoss Modulus\tLoss Factor\tStatus\n"
    "\t[Hz]\t[°C]\t[Pa]\t[Pa]\t[1]\t[ ]\n"
    + "".join(
        f"{i}\t{f:.8g}\t{t:g}\t{s:.8g}\t{v:.8g}\t{v / s:.8g}\tME+\n"
        for i, (f, t, s, v) in enumerate(COLD, 1)
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_files_of_instruments_are_read(tmp_path, name):
    encoding = "utf-16" if name == "UTF-16" else "utf-8"
    (tmp_path / "a.txt").write_text(FILES[name], encoding=encoding)
    found = read_dma(tmp_path / "a.txt", "the table")
    order = np.lexsort((F, T))
    assert found.of == "E" and found.doubts == ()
    assert found.frequency == pytest.approx(ANGULAR[order], rel=1e-6)
    assert found.temperature == pytest.approx(273.15 + T[order])
    assert found.storage == pytest.approx(STORAGE[order], rel=1e-6)
    assert found.loss == pytest.approx(LOSS[order], rel=1e-6)
    words = name in ("TRIOS", "German", "Japanese", "UTF-16")  # which say storage modulus only
    assert found.named is not words


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (FILES["Hz and rad/s"].replace(f"{ANGULAR[2]:.8g}", "9.9", 1), r"\(line 4\): its freq"),
        (PLAIN + "1,20,0,1e5\n2,20,2e6,1e5\n3,20,3e6,1e5\n4,20,3e6,1e5\n", r"storage_modulus = 0 "),
        (PLAIN + "1,20,1e6,1e5\n[step]\n3,20,3e6,1e5\n4,20,3e6,1e5\n", r'line 3 .* \("\[step\]"\)'),
        (PLAIN + "1,20,1e6,1e5\n2,20,3e6\n3,20,3e6,1e5\n4,20,3e6,1e5\n", "line 3 has 3 values"),
    ],
)  # fmt: skip
def test_a_refusal_says_the_line_and_the_reason(tmp_path, text, said, recwarn):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=said):
        read_dma(tmp_path / "a.csv", "the table")
    assert not recwarn.list


def fitted(path, table, **options):
    path.write_text(PLAIN + rows(table.T, ","), encoding="utf-8")
    return characterised(read_dma(path, "the table"), "the table", **options)


def test_a_master_curve_of_many_decades(tmp_path):
    table = moduli([-45.0], hertz=np.logspace(-13.0, -2.0, 56))
    found = fitted(tmp_path / "a.csv", table)
    times = np.logspace(2.0, 12.0, 50)
    modulus = found.instantaneous * found.relaxation.prony.modulus(times)
    assert modulus == pytest.approx(E0 * KNOWN.modulus(times / SHIFT(228.15)), rel=2e-2)
    text = "f (Hz),E' (Pa),E'' (Pa)\n" + rows(table[:, [0, 2, 3]].T, ",")
    (tmp_path / "b.csv").write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match="no column temperature_C"):
        read_dma(tmp_path / "b.csv", "the table")
    assert read_dma(tmp_path / "b.csv", "the table", temperature=283.15).isotherms == [283.15]


def test_relaxation_moduli_over_time(tmp_path):
    time, lines = np.logspace(-3.0, 2.0, 12), ["t (s),T (degC),E(t) (MPa)"]
    for celsius in (-20.0, -10.0, 0.0, 10.0, 20.0):
        values = E0 / 1e6 * KNOWN.modulus(time / SHIFT(celsius + 273.15))
        lines += [f"{t:.8g},{celsius},{E:.8g}" for t, E in zip(time, values, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(lines), encoding="utf-8")
    found = characterised(read_dma(tmp_path / "a.csv", "it"), "it")
    law = found.relaxation.shift
    assert law(np.array([253.15, 273.15])) == pytest.approx(
        SHIFT(np.array([253.15, 273.15])), rel=0.05
    )
    times = np.geomspace(1.0 / found.reduced.max(), 1.0 / found.reduced.min(), 40)
    modulus = found.instantaneous * found.relaxation.prony.modulus(times)
    assert modulus == pytest.approx(E0 * KNOWN.modulus(times), rel=0.01)
    assert found.misfit.storage < 2e-3 and found.misfit.tan_delta is None
    with pytest.raises(SystemExit) as ended:
        main(["rubber", str(tmp_path / "a.csv"), "--out", str(tmp_path / "out")])
    assert ended.value.code == 0


def complex_rubber():
    """Two parts of a rubber whose times shift by different laws: no one shift describes it."""
    table = moduli(np.arange(-30.0, 41.0, 10.0))
    other = Prony((0.7, 0.2), (1e-2, 1e0))
    for row in table:
        turned = 2.0 * np.pi * row[0] * 10.0 ** (0.02 * (20.0 - row[1]))
        extra = 150e6 * other.dynamic(turned)
        row[2:] += extra.real, extra.imag
    return table


def test_a_poor_fit_says_so(tmp_path):
    good = fitted(tmp_path / "a.csv", moduli(np.arange(-30.0, 41.0, 10.0)))
    assert of_fit(good) == []
    poor = fitted(tmp_path / "a.csv", complex_rubber())
    said = " ".join(of_fit(poor))
    assert poor.misfit.tan_delta > 0.2 or abs(poor.misfit.largest) > np.log(2.0)
    assert "the fit is poor" in said and "with any number of arms" in said
    assert f"by a factor of {np.exp(abs(poor.misfit.largest)):.2g}" in said


def test_factors_of_each_isotherm_where_no_law_holds(tmp_path):
    """Isotherms with shifts off any WLF law by a decade: a table keeps them, a scene takes it."""
    celsius = np.arange(-30.0, 31.0, 10.0)
    logs = np.array([5.4, 3.4, 3.0, 2.6, 0.8, 0.0, -1.6])
    own = ShiftTable(tuple(celsius + 273.15), tuple(logs))
    path = tmp_path / "a.csv"
    by_law = fitted(path, moduli(celsius, own))
    assert any("off the law of the shift" in each for each in of_fit(by_law))
    found = fitted(path, moduli(celsius, own), law="table")
    assert found.relaxation.shift(celsius + 273.15) == pytest.approx(10.0**logs, rel=0.1)
    assert found.misfit.tan_delta < 0.1 * by_law.misfit.tan_delta and of_fit(found) == []
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        main(["rubber", str(path), "--shift", "table", "--out", str(out)])
    assert ended.value.code == 0
    rubber = tomllib.loads((out / "rubber.toml").read_text(encoding="utf-8"))["rubber"]
    relaxation = scene(rubber).rubber.relaxation
    assert relaxation.shift(268.15) == pytest.approx(found.relaxation.shift(268.15), rel=1e-5)
    assert relaxation.measured == (243.15, 303.15)


def test_one_activation_energy(tmp_path):
    """ln a_T = E/R (1/T - 1/T_r): two isotherms are enough, and it goes on beyond them."""
    R, energy = 8.314462618, 90e3
    celsius = np.array([-10.0, 0.0, 10.0])
    exact = energy / R * (1.0 / (celsius + 273.15) - 1.0 / 283.15)
    law = ShiftTable(tuple(celsius[[0, 2]] + 273.15), tuple(exact[[0, 2]] / np.log(10.0)))
    found = fitted(tmp_path / "a.csv", moduli(celsius, law), law="arrhenius")
    assert "90" in found.relaxation.shift.words.split("kJ")[0]
    beyond = np.exp(energy / R * (1.0 / 253.15 - 1.0 / 283.15))
    assert found.relaxation.shift(253.15) == pytest.approx(beyond, rel=0.05)
    assert found.relaxation.shift(283.15) == pytest.approx(1.0)


def scene(rubber, temperature="-4 degC"):
    given = {
        "name": "a",
        "model": "slice",
        "rubber": {"compound": "B", "length": "2 mm"} | rubber,
        "load": {"pressure": "1 bar", "speed": "1 m/s", "duration": "1 ms"},
        "ice": {"temperature": temperature},
    }
    if "C10" in rubber:
        del given["rubber"]["compound"]
        given["film"] = {"k": 0.3, "D": 3e-5, "H_V": 2e-6}
    return scene_from_dict(given)


def test_a_scene_outside_of_the_isotherms(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(PLAIN + rows(COLD.T, ","), encoding="utf-8")
    rubber = {"dma": str(path), "modulus_is": "long-term", "C10": 3e5, "C01": 0.0, "D1": 7e-10}
    assert not any("isotherm" in each for each in notes(scene(rubber)))
    said = " ".join(notes(scene(rubber, "-35 degC")))
    assert "-35 degC is 15 K colder than the nearest isotherm of the rubber, -20 degC" in said
    one = PLAIN + rows(moduli([20.0]).T, ",")
    path.write_text(one, encoding="utf-8")
    said = " ".join(notes(scene(rubber)))
    assert "one isotherm" in said and "24 K colder than" in said
    arms = {**rubber, "prony": [[0.3, "5 ms"]]}
    del arms["dma"]
    assert any("do not shift with temperature" in each for each in notes(scene(arms)))


def test_isotherms_that_do_not_determine_the_law(tmp_path):
    """Four of them over 21 K, with noise: C2 is anything, and no use far outside is allowed."""
    path, celsius = tmp_path / "a.csv", [32.0, 39.0, 46.0, 53.0]
    table = moduli(celsius)
    table[:, 2:] *= np.exp(0.02 * np.random.default_rng(1).standard_normal((len(table), 2)))
    found = fitted(path, table)
    assert any("do not determine C1 and C2" in each for each in of_fit(found))
    rubber = {"dma": str(path), "modulus_is": "long-term", "C10": 3e5, "C01": 0.0, "D1": 7e-10}
    with pytest.raises(SceneError, match="says nothing about -4 degC.*36 K outside"):
        scene(rubber)
    assert of_use(found.relaxation, 310.15) == []
    given = {**rubber, "wlf": {"C1": 9, "C2": "120 K", "reference": "20 degC"}}
    assert any("36 K colder" in each for each in notes(scene(given)))


def test_amplitudes_of_strain(tmp_path):
    """Two amplitudes are never averaged; one that drifts is said."""
    head, path = PLAIN.replace("\n", ",strain_%\n"), tmp_path / "a.csv"
    small, large = (np.column_stack([COLD, np.full(len(COLD), each)]) for each in (0.1, 5.0))
    large[:, 2:4] /= 2.0
    path.write_text(head + rows(np.vstack([small, large]).T, ","), encoding="utf-8")
    with pytest.raises(SceneError, match=r"several strain amplitudes \(0.1 %, 5 %\)"):
        read_dma(path, "it")
    assert read_dma(path, "it", strain=1e-3).storage.max() == pytest.approx(STORAGE.max())
    assert read_dma(path, "it", strain=5e-2).storage.max() == pytest.approx(STORAGE.max() / 2.0)
    with pytest.raises(SceneError, match="no rows at a strain of 1.000%; allowed: 0.1 %, 5 %"):
        read_dma(path, "it", strain=1e-2)
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        main(["rubber", str(path), "--strain", "0.1%", "--out", str(out)])
    assert ended.value.code == 0
    assert "taken as E" in " ".join(json.loads((out / "rubber.json").read_text())["warnings"])
    drifts = np.column_stack([COLD, np.geomspace(0.1, 1.0, len(COLD))])
    path.write_text(head + rows(drifts.T, ","), encoding="utf-8")
    assert "from 0.100% to 1.000%" in read_dma(path, "it").doubts[0]


def test_rows_of_shift_factors_are_checked():
    rubber = {"prony": [[0.3, "5 ms"]], "modulus_is": "long-term"}
    for wrong, said in (
        ([["20 degC", 0.0]], "two or more rows"),
        ([["20 degC", 0.0], ["0 degC", -1.0]], "does not fall"),
        ([["20 degC", 3.0], ["0 degC", 5.0]], "nowhere 0"),
    ):
        with pytest.raises(SceneError, match=said):
            scene(rubber | {"shift_factors": wrong})
    table = [["20 degC", 0.0], ["-20 degC", 3.0]]
    with pytest.raises(SceneError, match="contradict each other"):
        wlf = {"C1": 7.4, "C2": 121.0, "reference": "20 degC"}
        scene(rubber | {"shift_factors": table, "wlf": wlf})
    assert scene(rubber | {"shift_factors": table}).rubber.relaxation.shift(253.15) == 1000.0
