"""Every key of a scene below a wheel: it changes mu, is refused, or is declared unrelated."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import tomlkit
from program import exit_code

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.footprint.scene_keys import NOT_COMPUTED, TAKEN, UNRELATED
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.case_contact import contact_of_case
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene, put
from iceslide_fem.scene.fields import leaves

pytestmark = pytest.mark.quick

WORDS = ("--gaussian", "120mm,2bar,60mm", "--speed", "20km/h", "--temperature", "-4degC")
CASES = Path(__file__).parent.parent / "cases"
SURFACE = str(CASES / "surfaces" / "compound_B.csv")
BASE = {
    "name": "a", "model": "point", "rubber.compound": "B",
    "load.pressure": "2 bar", "load.speed": "4 m/s", "load.duration": "5 ms",
}  # fmt: skip
OWN = {
    "rubber.compound": None, "rubber.C10": 2e5, "rubber.C01": 1e5, "rubber.nu": 0.49,
    "film.contact": SURFACE,
}  # fmt: skip
CONSTANT = {**OWN, "film.contact": None, "film.k": 0.2, "film.D": "30 um", "film.H_V": "2 um"}
SOFT = {"rubber.prony": [[0.6, "1 ms"]], "rubber.modulus_is": "long-term"}
AGES = {**SOFT, "film.contact": "bare.csv", "film.contact_modulus": "2 MPa"}
DRY = {"film.dry_stress": "4 bar", "film.initial_height": 0.0}
SPEED = {**DRY, "film.dry_speed": "1 mm/s", "film.dry_width": 3}
WAVES = {"ice.roughness.longest": "0.5 mm", "ice.roughness.shortest": "5 um"}
ROUGH = {**SOFT, **WAVES, "ice.roughness.rms": "1 um"}
OF_RUBBER = {"rubber.roughness.longest": "0.1 mm", "rubber.roughness.shortest": "10 um"}
BOTH = {**ROUGH, **OF_RUBBER, "rubber.roughness.rms": "4 um"}
CARRY = {"film.voids": "carry", "film.contact": SURFACE, "ice.water": "20 um"}
LUG = {**CARRY, "rubber.length": "10 mm", "rubber.width": "10 mm", "rubber.height": "10 mm"}
COULOMB = {"friction.law": "coulomb", "friction.mu": 0.2}
ROWS = {"ice.motion": "sliding", "rubber.row_pitch": "30 mm", "load.duration": "0.2 ms"}
GROOVE = {"position": 0.0, "width": "2 mm", "depth": "0.5 mm"}
HEAT = {"rubber.heat": True, "rubber.height": "10 mm"}
LAYER = {
    "name": "steel", "thickness": "1 mm", "conductivity": 50.0, "density": 7800.0,
    "heat_capacity": 460.0,
}  # fmt: skip
LAW = """
import numpy as np
from iceslide_fem.laws.protocol import Response
class Mine:
    fields = {}
    def __init__(self, mu=0.1):
        self.mu = mu
    def respond(self, contact, state, surface, dt):
        mu = np.full_like(contact.pressure, self.mu)
        return Response(mu * contact.pressure, mu, {})
"""
FREQUENCIES = np.geomspace(1.0, 1e6, 25)
TURNED = (FREQUENCIES / 1e3) ** 2
DMA = np.column_stack(
    [FREQUENCIES, 1.6 + 20.0 * TURNED / (1.0 + TURNED), 20.0 * TURNED**0.5 / (1.0 + TURNED)]
)
# A value of each key; what else the scene has, with and without the key; what it has with it only.
GIVEN = {
    "name": ("b",),
    "model": ("block", LUG),
    "rubber.compound": ("B", OWN, dict.fromkeys(("rubber.C10", "rubber.C01", "rubber.nu"))),
    "rubber.C10": (3e5, OWN),
    "rubber.C01": (3e5, OWN),
    "rubber.D1": (1e-8,),
    "rubber.nu": (0.45,),
    "rubber.prony": ([[0.5, "1 ms"]], {}, {"rubber.modulus_is": "long-term"}),
    "rubber.dma": ("dma.csv", {}, {"rubber.modulus_is": "long-term"}),
    "rubber.wlf": ({"C1": 7.4, "C2": "121.6 K", "reference": "20 degC"}, SOFT),
    "rubber.shift_factors": ([["-20 degC", 2.0], ["20 degC", 0.0]], SOFT),
    "rubber.modulus_is": ("instantaneous", SOFT),
    "rubber.length": ("4 mm", LUG),
    "rubber.width": ("4 mm", LUG | {"model": "block"}),
    "rubber.height": ("9 mm",),
    "rubber.edge_radius": ("0.1 mm",),
    "rubber.chamfer": ("0.1 mm",),
    "rubber.draft_angle": ("3 deg",),
    "rubber.sipes": (1, LUG),
    "rubber.sipe_width": ("2 mm", LUG | {"rubber.sipes": 1}),
    "rubber.sipe_depth": ("0.3 mm", LUG | {"rubber.sipes": 1}),
    "rubber.grooves": (
        [{"position": 0.0, "width": "2 mm", "depth": "0.5 mm"}],
        LUG | {"model": "block"},
    ),
    "rubber.stores_water": (True, LUG | {"rubber.sipes": 1}),
    "rubber.wall_friction": (0.3,),
    "rubber.outline": ("outline.csv", {"model": "block"}),
    "rubber.density": (1200.0, HEAT),
    "rubber.conductivity": (0.3, HEAT),
    "rubber.heat_capacity": (1700.0, HEAT),
    "rubber.heat": (True, {"rubber.height": "10 mm"}),
    "rubber.temperature": ("10 degC", HEAT),
    "rubber.plate": ("held", HEAT),
    "rubber.inertia": (True,),
    "rubber.rows": (2, {}, ROWS),
    "rubber.row_pitch": ("40 mm", ROWS | {"rubber.rows": 2}),
    "rubber.step": ("block.step", {"model": "block"}),
    "rubber.step_unit": ("1 cm",),
    "rubber.step_up": ("x",),
    "rubber.step_along": ("y",),
    "rubber.step_plane": ("1 mm",),
    "rubber.step_gap": ("1 mm",),
    "rubber.step_heal": ("1 um",),
    "rubber.step_cells": ("tetrahedra",),
    "rubber.layers": (
        [{"name": "base", "compound": "B", "above": "0.5 mm"}],
        {"model": "block"},
    ),
    "rubber.mesh": ("block.msh", {"model": "block"}),
    "rubber.mesh_unit": ("mm",),
    "rubber.mesh_tags": ({"rubber": 1},),
    "load.pressure": ("3 bar",),
    "load.speed": ("3 m/s",),
    "load.duration": ("4 ms",),
    "load.static_friction": (0.3,),
    "load.interpolation": ("smooth",),
    "load.passes": (3, {}, {"load.period": "0.1 s"}),
    "load.period": ("0.2 s", {"load.passes": 3, "load.period": "0.1 s"}),
    "load.pressure_scale": (2.0,),
    "load.speed_scale": (2.0,),
    "ice.temperature": ("-8 degC",),
    "ice.margin": ("1 mm",),
    "ice.cell": ("0.1 mm",),
    "ice.trail": ("1 mm",),
    "ice.motion": ("sliding",),
    "ice.heat": ("half-space",),
    "ice.depth": ("0.05 mm",),
    "ice.base": ("held", {"ice.depth": "0.1 mm"}),
    "ice.base_temperature": ("-6 degC", {"ice.depth": "0.1 mm", "ice.base": "held"}),
    "ice.layers": ([LAYER], {"ice.depth": "0.1 mm"}),
    "ice.mesh": ("ice.msh", {"model": "block", "ice.heat": "mesh"}),
    "ice.mesh_unit": ("mm",),
    "ice.conductivity": (1.0,),
    "ice.density": (500.0,),
    "ice.heat_capacity": (1000.0,),
    "ice.melting_temperature": ("-2 degC",),
    "ice.latent_heat": (1e5,),
    "ice.water": ("5 um", CARRY),
    "rubber.roughness.rms": ("5 um", {**ROUGH, **OF_RUBBER}),
    "rubber.roughness.hurst": (0.9, BOTH),
    "rubber.roughness.longest": ("0.2 mm", BOTH),
    "rubber.roughness.shortest": ("20 um", BOTH),
    "rubber.roughness.map": ("ice.npy", ROUGH, {"rubber.roughness.pixel": "5 um"}),
    "rubber.roughness.pixel": ("5 um", ROUGH, {"rubber.roughness.map": "ice.npy"}),
    "rubber.roughness.height_unit": (
        "1 um",
        ROUGH,
        {"rubber.roughness.map": "ice.csv", "rubber.roughness.pixel": "5 um"},
    ),
    "ice.roughness.rms": ("2 um", {**SOFT, **WAVES}),
    "ice.roughness.hurst": (0.7, ROUGH),
    "ice.roughness.longest": ("0.3 mm", ROUGH),
    "ice.roughness.shortest": ("10 um", ROUGH),
    "ice.roughness.gamma": (0.5, ROUGH),
    "ice.roughness.map": ("ice.npy", SOFT, {"ice.roughness.pixel": "5 um"}),
    "ice.roughness.pixel": ("5 um", SOFT, {"ice.roughness.map": "ice.npy"}),
    "ice.roughness.height_unit": (
        "1 um",
        SOFT,
        {"ice.roughness.map": "ice.csv", "ice.roughness.pixel": "5 um"},
    ),
    "water.viscosity": (3e-3,),
    "water.conductivity": (0.6, HEAT),
    "film.carrier": ("rubber",),
    "film.pressure": ("nominal",),
    "film.k": (0.3, CONSTANT),
    "film.k_scale": (1.5,),
    "film.D_scale": (1.5,),
    "film.H_V_scale": (0.5,),
    "film.D": ("50 um", CONSTANT),
    "film.H_V": ("0.1 um", CONSTANT),
    "film.contact": (SURFACE,),
    "film.contact_age": (True, SOFT | {"film.contact": SURFACE}),
    "film.contact_modulus": ("3 MPa", AGES | {"film.contact_age": True}),
    "film.initial_height": ("30 nm",),
    "film.conductance": (1e6, HEAT),
    "film.water_speed": (0.5,),
    "film.dry_stress": ("4 bar",),
    "film.dry_softening": ("5 K", DRY),
    "film.dry_residual": ("2 K", DRY | {"film.dry_softening": "10 K"}),
    "film.dry_speed": ("1 mm/s", DRY, {"film.dry_width": 3}),
    "film.dry_width": (2.0, DRY, {"film.dry_speed": "1 mm/s"}),
    "film.dry_rows": ([[0.0, 1.0], [3.0, 0.5]], DRY, {"film.dry_speed": "1 mm/s"}),
    "film.dry_shift": ({"reference": "-20 degC", "C1": 7.4, "C2": "121.6 K"}, SPEED),
    "film.refreeze": ("nothing", CARRY | {"ice.water": "5 um"}),
    "film.between": ("drain", {"load.passes": 3, "load.period": "0.1 s"}),
    "film.voids": ("carry", {"film.contact": SURFACE}),
    "friction.law": ("coulomb", {}, {"friction.mu": 0.2}),
    "friction.mu": (0.3, COULOMB),
    "friction.table": ("mu.csv", COULOMB, {"friction.mu": None}),
    "friction.parameters": ({"mu": 0.3}, {"friction.law": "mine.py:Mine"}),
    "numerics.tolerance": (1e-4,),
    "numerics.refinement": (2.0,),
    "numerics.penalty": ("1000 MPa/mm",),
    "numerics.shear_ramp_pressure": ("0.01 bar",),
    "numerics.film_integrator": ("sdirk3",),
    "numerics.max_step": ("0.1 ms",),
    "numerics.time_limit": ("60 s",),
    "output.times": (5,),
    "output.fields": (["ice"],),
    "uncertainty": ({"film.k_scale": "~10%"},),
    "output.probes": ({"p": [0.0, 0.0, 0.0]},),
}
NO_MEANING = {key for keys in UNRELATED.values() for key in keys}


def test_every_key_is_declared_once():
    keys = [key for key, _ in leaves(Scene)]
    refused = [key for each in NOT_COMPUTED for key in each.keys]
    declared = [*TAKEN, *refused, *NO_MEANING]
    assert sorted(declared) == sorted(keys)
    assert sorted(GIVEN) == sorted(keys)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenes")
    (path / "mine.py").write_text(LAW, encoding="utf-8")
    (path / "mu.csv").write_text("temperature_C,speed_m_per_s,mu\n-4,1,0.4\n", encoding="utf-8")
    lines = [",".join(f"{value:.8g}" for value in (*row, -4.0)) for row in DMA]
    head = "frequency_Hz,storage_modulus_MPa,loss_modulus_MPa,temperature_C"
    (path / "dma.csv").write_text("\n".join([head, *lines]), encoding="utf-8")
    outline = "x_m,y_m\n-4e-4,-4e-4\n4e-4,-4e-4\n0,4e-4\n"
    (path / "outline.csv").write_text(outline, encoding="utf-8")
    heights = np.random.default_rng(3).standard_normal((32, 32))
    np.save(path / "ice.npy", 1e-7 * heights)
    np.savetxt(path / "ice.csv", 0.1 * heights, delimiter=",")
    for name in ("block.msh", "ice.msh", "block.step"):
        (path / name).write_text("$MeshFormat\n", encoding="utf-8")
    bare = "pressure_Pa,k,D_m,H_V_m\n1e3,0.01,1e-5,8e-6\n1e6,0.6,6e-5,3e-7\n"
    (path / "bare.csv").write_text(bare, encoding="utf-8")
    return path


def scene_of(folder, *several):
    tables = {}
    for key, value in {key: value for some in several for key, value in some.items()}.items():
        if value is not None:
            put(tables, key, value)
    (folder / "scene.toml").write_text(tomlkit.dumps(tables), encoding="utf-8")
    return folder / "scene.toml"


def wheel(scene):
    """mu at three slip ratios, and the rubber, of which blocks of a pattern would be."""
    case = WheelCase.of({"gaussian": "120mm,2bar,60mm", "speed": "20km/h", "scene": scene})
    (member,) = case.members
    fine = read_source(case).pressure_map
    coarse = PressureMap(fine.pressure[:, ::16].copy(), 16.0 * fine.dx, fine.dy)
    tread = stiffness_of(case, coarse).tread(None, member.temperature)
    contact = contact_of_case(member, coarse.contact_length)
    rolls = [Rolling(member.speed, slip) for slip in (0.005, 0.05, 1.0)]
    return [point.mu for point in friction(coarse, rolls, tread, contact)], case.law.long_term


@cache
def wheel_without(scene, folder):
    """`wheel` of the text of a scene that keys are added to."""
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    return wheel(folder / "scene.toml")


@pytest.mark.parametrize("key", sorted(GIVEN))
def test_no_key_is_dropped_in_silence(key, folder):
    value, common, more = (*GIVEN[key], {}, {})[:3]
    try:
        found = wheel(scene_of(folder, BASE, common, more, {key: value}))
    except SceneError as error:
        assert "not computed below a wheel" in str(error) and "allowed" in str(error), error
        assert key not in NO_MEANING or key in REFUSED_WITH
        return
    without = wheel_without(scene_of(folder, BASE, common).read_text(encoding="utf-8"), folder)
    assert (found == without) == (key in NO_MEANING)


# Of no meaning alone, and tested with what gives them one.
REFUSED_WITH = ("rubber.row_pitch",)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (
            {"ice.conductivity": [["-20 degC", 2.4], ["0 degC", 2.1]], "ice.heat": "mesh",
             "model": "block"},
            "rows of ice.conductivity",
        ),
        (
            {**CARRY, "ice.water": [["0 mm", "5 um"], ["10 mm", "9 um"]], "ice.motion": "sliding",
             "model": "slice"},
            "ice.water with rows",
        ),
    ],
    ids=["ice over temperature", "water over x"],
)  # fmt: skip
def test_values_that_a_wheel_does_not_compute(more, said, folder):
    with pytest.raises(SceneError, match=f"{said}.* not computed below a wheel"):
        wheel(scene_of(folder, BASE, more))


def test_a_law_whose_history_stays_on_the_rubber(folder):
    law = LAW.replace("fields = {}", 'fields = {"wear": 0.0}\n    carrier = "rubber"')
    (folder / "worn.py").write_text(law.replace("mu, {})", "mu, state)"), encoding="utf-8")
    with pytest.raises(SceneError, match='carrier = "rubber"'):
        wheel(scene_of(folder, BASE, {"friction.law": "worn.py:Mine"}))


def test_a_scene_of_contact_age_says_what_is_not_taken(folder):
    given = {"gaussian": "120mm,2bar,60mm", "speed": "20km/h", "temperature": "-4 degC"}
    common = SOFT | {"film.contact": SURFACE, "film.contact_age": True}
    plain = scene_of(folder, BASE, common)
    assert FootprintCase.of(given | {"contact_age": plain}).scene_notes == []
    for kind in (FootprintCase, WheelCase):
        more = DRY | {"ice.depth": "5 mm"}
        case = kind.of(given | {"contact_age": scene_of(folder, BASE, common, more)})
        (note,) = case.scene_notes
        assert note.endswith("ice.depth, film.initial_height, film.dry_stress")
        words = ["wheel" if kind is WheelCase else "footprint", *WORDS, "--contact-age"]
        out = folder / f"out_{kind.__name__}"
        assert exit_code(*words, folder / "scene.toml", "--out", out, "--no-report") == 0
        said = json.loads((out / "summary.json").read_text(encoding="utf-8"))["warnings"]
        assert note in said
