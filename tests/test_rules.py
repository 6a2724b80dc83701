"""Every row of the rules refuses a scene that breaks it, and is listed in the reference."""

from pathlib import Path

import pytest

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import load_scene, read_scene
from iceslide_fem.scene.rules import RULES
from iceslide_fem.scene.tables import Tables

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parent.parent
# What makes a condition hold that names no value.
ROWS = "[['0 ms', '1 bar'], ['1 ms', '2 bar']]"
RELAXES = "rubber.prony=[[0.3, 1e-3]]", "rubber.modulus_is=long-term"
OUTLINE = "x_m,y_m,ring\n-1e-3,-1e-3,1\n1e-3,-1e-3,1\n1e-3,1e-3,1\n-1e-3,1e-3,1\n"
BASE = ("model=slice", "ice.heat=column")
FREEZES = (
    "film.refreeze=film", "film.dry_stress=2bar", "film.dry_softening=10",
    "film.initial_height=0nm",
)  # fmt: skip
MADE = {
    "ice.mesh": "ice.mesh=meshes/siped_block.msh",
    "ice.depth": "ice.depth=1mm",
    "ice.layers": "ice.layers=[{conductivity=50, density=7800, heat_capacity=500}]",
    "ice.base_temperature": "ice.base_temperature=-5degC",
    "rubber.layers": "rubber.layers=[{name='base', compound='B', above='0.5 mm'}]",
    "rubber.step": f"rubber.step={ROOT / 'meshes' / 'tread.step'}",
    "rubber.mesh": "rubber.mesh=meshes/siped_block.msh",
    "rubber.outline": "rubber.outline=OUTLINE",
    "rubber.sipes": ("rubber.sipes=1", "rubber.sipe_width=0.1mm", "rubber.sipe_depth=0.5mm"),
    "rubber.grooves": "rubber.grooves=[{width='0.1 mm', depth='0.5 mm'}]",
    "rubber.edge_radius": "rubber.edge_radius=20um",
    "rubber.chamfer": "rubber.chamfer=20um",
    "rubber.draft_angle": "rubber.draft_angle=1deg",
    "rubber.C10": "rubber.C10=0.2MPa",
    "rubber.C01": "rubber.C01=0MPa",
    "rubber.D1": "rubber.D1=7e-8",
    "rubber.nu": "rubber.nu=0",
    "rubber.prony": RELAXES,
    "rubber.dma": ("rubber.dma=cases/rubber/synthetic_dma.csv", RELAXES[1]),
    "rubber.wlf": ("rubber.wlf={C1=7.4, C2=121, reference='20 degC'}", *RELAXES),
    "rubber.shift_factors": ("rubber.shift_factors=[[253.15, 3], [293.15, 0]]", *RELAXES),
    "film.contact": "film.contact=cases/surfaces/compound_B.csv",
    "load.changes": f"load.pressure={ROWS}",
    "load.pressures.is_constant": f"load.pressure={ROWS}",
    "load.speeds.is_constant": "load.speed=[['0 ms', '1 m/s'], ['1 ms', '2 m/s']]",
    "load.passes": ("load.passes=2", "load.period=1"),
    "rubber.rows": ("rubber.rows=2", "rubber.row_pitch=400mm"),
    "rubber.wall_friction": "rubber.wall_friction=0.5",
    "rubber.heat": "rubber.heat=true",
    "film.water_speed": "film.water_speed=0.5",
    "film.refreeze": FREEZES,
    "film.k": ("film.k=0.3", "film.D=30um", "film.H_V=2um"),
    "film.contact_age": ("film.contact_age=true", *RELAXES),
    "film.dry_stress": ("film.dry_stress=2bar", "film.dry_softening=10"),
    "film.dry_residual": ("film.dry_stress=2bar", "film.dry_residual=1"),
    "film.dry_softens": ("film.dry_stress=2bar", "film.dry_softening=10"),
    "film.dry_speed": (
        "film.dry_speed=1cm/s", "film.dry_width=3", "film.dry_stress=2bar",
    ),
    "ice.roughness.is_rough": (
        "ice.roughness.rms=1um", "ice.roughness.longest=0.5mm", "ice.roughness.shortest=10um",
        *RELAXES,
    ),
    "rubber.roughness.is_rough": (
        "rubber.roughness.rms=1um", "rubber.roughness.longest=0.5mm",
        "rubber.roughness.shortest=10um",
    ),
    "film.conductance": "film.conductance=1e5",
    "ice.is_wet": "ice.water=20um",
    "ice.water_has_rows": "ice.water=[[0, 1e-6], [1, 2e-6]]",
    "ice.has_rows": "ice.conductivity=[[250, 2.4], [270, 2.2]]",
    "ice.heat": "ice.heat=column",
    "water.table": "water.viscosity=[[272, 1.9e-3], [274, 1.7e-3]]",
    "friction.law": ("friction.law=coulomb", "friction.mu=0.2"),
}  # fmt: skip


def overrides(condition, plain):
    """What makes the condition hold that does not hold in the `plain` scene."""
    if condition.holds(plain):
        return ()
    if condition.key == "film.refreeze" and condition.values[0] == "film":
        return FREEZES
    if condition.values and not condition.key.endswith("is_constant"):
        return (f"{condition.key}={str(condition.values[0]).lower()}",)
    found = MADE[condition.key]
    return (found,) if isinstance(found, str) else found


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: " & ".join(i.words for i in rule.named))
def test_a_scene_that_breaks_it_is_refused(rule, tmp_path):
    (tmp_path / "outline.csv").write_text(OUTLINE)
    path = ROOT / "cases" / "thesis_1bar.toml"
    plain, given = Tables.model_validate(read_scene(path, BASE)), {}
    for condition in (*rule.where, *rule.named):
        for text in overrides(condition, plain):
            given.setdefault(text.partition("=")[0], text)
    file = str(tmp_path / "outline.csv")
    changes = [*BASE, *(text.replace("OUTLINE", file) for text in given.values())]
    said = rule.fault(Tables.model_validate(read_scene(path, changes)))
    assert said.endswith(f"allowed: {rule.allowed}") and "contradict each other" in said
    for condition in rule.named:
        assert condition.key in said or condition.shown in said
    with pytest.raises(SceneError, match="contradict"):
        load_scene(path, changes)


def test_no_case_breaks_a_rule():
    for path in sorted((ROOT / "cases").glob("*.toml")):
        scene = load_scene(path)
        assert not any(rule.fault(scene) for rule in RULES)
