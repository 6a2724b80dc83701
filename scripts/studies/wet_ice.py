"""Full voids that share the load, and wet ice: what the water bears, and what it does to friction.

Load sharing on the generated surface of compound B; and a block of 20 mm on ice with 20 um of water
at 2 bar and -1 degC with 0, 2 and 4 sipes, as points that pass it: over time, over speed, and again
and again. mu is drawn over time beside the water in the voids. With --slices slices are run.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import trapezoid
from scipy.optimize import brentq

from iceslide_fem.film.voids import Voids, lugs_of
from iceslide_fem.output.table import PassRow
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.scene.contact_table import read_contact_table
from iceslide_fem.scene.materials import BAR, ICE, WATER_VISCOSITY
from iceslide_fem.simulate import run
from scripts.studies.blocks import slid
from scripts.studies.common import ROOT, case, draw, options, picture_options, table

FILE = ROOT / "cases" / "surfaces" / "compound_B.csv"
VOIDS = Voids(read_contact_table(FILE, "the surface"))
SHARED = (  # um, bar; reference numbers: p_c (bar) and k
    (3.0, 2.0, 0.857, 0.226), (2.0, 5.0, 1.619, 0.358), (2.0, 2.0, 1.619, 0.358),
    (1.0, 5.0, 3.295, 0.560), (1.5, 2.0, 2.0, None),
)  # fmt: skip
LENGTH, PRESSURE, WATER, CELSIUS = 20e-3, 2.0 * BAR, 20e-6, -1.0  # of the block on wet ice
SPEED = 4.0
SIPES = 0, 2, 4
STORES = {
    "4 mm deep": ("rubber.sipes=2", "rubber.stores_water=true"),
    "1 mm deep": ("rubber.sipes=2", "rubber.stores_water=true", "rubber.sipe_depth=1 mm",
                  "rubber.sipe_width=0.3 mm"),
    "1 mm deep, drained": ("rubber.sipes=2", "rubber.sipe_depth=1 mm", "rubber.sipe_width=0.3 mm"),
    "none": ("rubber.sipes=0",),
}  # fmt: skip
SLIDING = 3.0, 4.0, 10.0
SPEEDS = 1.0, 2.0, 4.0, 8.0, 15.0, 30.0
AGAIN, NEXT, TURN, MINUTE = 4, 7e-3, 1.0, 60.0  # passes; s from each to the next: rows 28 mm apart
RESTS = (("keep", NEXT), ("drain", NEXT), ("freeze", NEXT), ("freeze", TURN), ("freeze", MINUTE))
HALF, WHOLE = 0.5, 0.99  # of the load; HALF of mu on ice without water, too


def closed_height(lug: float, start: float, time: float) -> float:
    """h (m) of water that alone bears `PRESSURE` below a lug (m), after a time (s)."""
    return float((start**-2 + 2.0 * PRESSURE * time / (WATER_VISCOSITY * lug**2)) ** -0.5)


def closed_time(lug: float, start: float, end: float) -> float:
    """Seconds until such water is squeezed from `start` to `end` (m)."""
    return float(WATER_VISCOSITY * lug**2 / (2.0 * PRESSURE) * (end**-2 - start**-2))


# Water does not freeze, and moves with the ice.
AS_IS = "film.refreeze=nothing", "film.water_speed=1"


def wet(sipes: int, speed: float = SPEED, water: float = WATER, tolerance: float = 1e-3) -> Scene:
    """A point of ice below the block for as long as it passes."""
    return scene_from_dict({
        "name": "wet", "model": "point",
        "rubber": {
            "compound": "B", "length": LENGTH, "width": LENGTH, "height": 8e-3, "sipes": sipes,
        },
        "load": {"pressure": PRESSURE, "speed": speed, "duration": LENGTH / speed},
        "ice": {"temperature": f"{CELSIUS} degC", "water": water},
        "film": {
            "voids": "carry", "contact": str(FILE), "refreeze": "nothing", "water_speed": 1.0,
        },
        "numerics": {"tolerance": tolerance},
    })  # fmt: skip


def again(sipes: int, between: str, period: float, tolerance: float) -> list[PassRow]:
    """The same point below `AGAIN` blocks, one every `period` (s)."""
    scene, found = wet(sipes, tolerance=tolerance), list[PassRow]()
    load = scene.load.model_copy(update={"passes": AGAIN, "period": period})
    film = scene.film.model_copy(update={"between": between})
    point_history(scene.model_copy(update={"load": load, "film": film}), found.append)
    return found


class Passed(NamedTuple):
    """A point that passes a block: time (s), mu, water in the voids (m), and the lug (m)."""

    time: Array
    mu: Array
    water: Array
    lug: float

    @classmethod
    def of(cls, scene: Scene) -> Passed:
        """That of a scene."""
        rows, _ = point_history(scene)
        columns = np.array([(row.time_s, row.mu, row.squeezed_height_m) for row in rows]).T
        return cls(columns[0], columns[1], columns[2], lugs_of(scene.rubber, wide=True).longest)

    @property
    def borne(self) -> Array:
        """p_f / p: the fraction of the load that the water bears."""
        pressure = np.full_like(self.water, PRESSURE)
        return 1.0 - VOIDS.contact_pressure(pressure, self.water) / PRESSURE

    def mean(self, values: Array) -> float:
        """Over time."""
        return float(trapezoid(values, self.time)) / float(self.time[-1])

    def first(self, condition: Mask) -> str:
        """ms of the first row that meets it."""
        return f"{1e3 * self.time[np.argmax(condition)]:.2f} ms" if condition.any() else "never"


def print_sharing() -> None:
    """Rows of load sharing against reference numbers."""
    rows = []
    for water, bar, due, due_k in SHARED:
        solid = VOIDS.contact_pressure(np.array([bar * BAR]), np.array([water * 1e-6]))
        k = f"{float(VOIDS.contact(solid)[0][0]):.3f}"
        due_row = f"{due:.3f} bar, {due_k:.3f}" if due_k else "no lift"
        rows.append((f"{water:g} um", f"{bar:g} bar", f"{solid[0] / BAR:.3f} bar", k, due_row))
    table(("water", "pressure", "contact pressure", "k", "reference"), rows)


def print_lengths() -> None:
    """Over which lengths a pressure drives as much water as sliding drags: W^2 p / (6 eta v)."""
    rows = []
    for bar in (1.0, 2.0, 5.0):
        holds = float(VOIDS.held(np.array([bar * BAR]))[0])
        for water, name in ((holds, "full voids"), (WATER, "wet ice")):
            lengths = (water**2 * bar * BAR / (6.0 * WATER_VISCOSITY * v) for v in SLIDING)
            cells = (f"{1e6 * length:.3g} um" for length in lengths)
            rows.append((f"{bar:g} bar", f"{name}, {1e6 * water:.2f} um", *cells))
    table(("pressure", "water", *(f"at {v:g} m/s" for v in SLIDING)), rows)


def print_passes(passes: dict[int, Passed], dry: dict[int, Passed]) -> None:
    """What wet ice does below blocks with sipes, over the time of a pass."""
    rows = []
    for sipes, here in passes.items():
        bare = dry[sipes]
        reached = here.mu >= HALF * np.interp(here.time, bare.time, bare.mu)
        rows.append((
            sipes, f"{1e3 * here.lug:.2f} mm", f"{here.mean(here.mu):.4f}", f"{here.mu[-1]:.4f}",
            f"{bare.mean(bare.mu):.4f}", f"{bare.mu[-1]:.4f}",
            f"{1e6 * here.water[-1]:.2f} um", here.first(reached),
            here.first(here.borne < HALF), f"{here.mean(here.borne):.0%}",
            f"{here.mean((here.borne > WHOLE).astype(float)):.0%}",
        ))  # fmt: skip
    heads = (
        "sipes", "lug", "mean mu", "mu at the end", "mean without water", "at the end",
        "water at the end", "half of mu without water at", "water bears half until",
        "water bears, mean", "time wholly on water",
    )  # fmt: skip
    table(heads, rows)


def afloat(sipes: int, fraction: float, tolerance: float) -> float:
    """Speed (m/s) above which water bears the `fraction` of the load at the trailing edge."""

    def more(log_speed: float) -> float:
        scene = wet(sipes, float(np.exp(log_speed)), tolerance=tolerance)
        return float(Passed.of(scene).borne[-1]) - fraction

    return float(np.exp(brentq(more, np.log(3e-3), np.log(99.0), xtol=3e-3)))


def print_speeds(speeds: tuple[float, ...], tolerance: float) -> None:
    """Mean mu and what the water bears at the trailing edge, over speed.

    The closed form is the block's length over the time in which water that bears the whole load is
    squeezed to what voids hold under the rest of it.
    """
    rows = []
    for sipes in SIPES:
        cells = []
        for speed in speeds:
            here = Passed.of(wet(sipes, speed, tolerance=tolerance))
            cells.append(f"{here.mean(here.mu):.4f}, {here.borne[-1]:.0%}")
        for fraction in (WHOLE, HALF):
            holds = VOIDS.held(np.array([(1.0 - fraction) * PRESSURE]))
            closed = LENGTH / closed_time(here.lug, WATER, float(holds[0]))
            cells.append(f"{afloat(sipes, fraction, tolerance):.3g}, {closed:.3g} m/s")
        rows.append((sipes, *cells))
    bears = (f"water bears {f:.0%} above; closed form" for f in (WHOLE, HALF))
    table(("sipes", *(f"{v:g} m/s" for v in speeds), *bears), rows)


def print_again(tolerance: float) -> None:
    """mu of block after block over the same ice, and the water that each leaves.

    Water that bears all loads is squeezed by them as by one block that passes for as long; a
    surface that jumps to the melting point takes 2 e dT sqrt(t / pi), from water that freezes.
    """
    rows = []
    for sipes in (SIPES[0], SIPES[-1]):
        for between, period in RESTS:
            found = again(sipes, between, period, tolerance)
            means = (f"{one.mu_mean:.4f}" for one in found)
            water = (f"{1e6 * one.squeezed_height_m:.2f}" for one in found)
            rows.append((sipes, between, f"{period:g} s", *means, ", ".join(water) + " um"))
    table(
        ("sipes", "between", "period", *(f"mu {n + 1}" for n in range(AGAIN)), "water left"), rows
    )
    times = LENGTH / SPEED * np.arange(1, AGAIN + 1)
    closed = (f"{1e6 * closed_height(LENGTH, WATER, time):.2f}" for time in times)
    print(f"closed form, no sipes, kept: {', '.join(closed)} um")
    for rest in (NEXT - LENGTH / SPEED, TURN, MINUTE):
        taken = -2.0 * ICE.effusivity * CELSIUS * (rest / np.pi) ** 0.5 / ICE.melting_enthalpy
        print(f"closed form, frozen in {rest:g} s: {1e6 * taken:.2f} um")


def print_slices(quick: bool) -> None:
    """The cases as slices."""
    rows = []
    for name in ("wet_slick", "wet_siped"):
        scene = case(
            name, *AS_IS, *(("numerics.refinement=0.4", "load.duration=1 ms") if quick else ())
        )
        with tempfile.TemporaryDirectory() as folder:
            summary = run(scene, Path(folder), pictures=False)
            history = read_run(folder).history
        water = history["squeezed_height_m"][-1]
        rows.append((
            name, f"{summary['mu_mean']:.4f}", f"{history['mu'][-1]:.4f}", f"{1e6 * water:.2f} um",
            summary["steps"], summary["rejected_steps"], f"{summary['energy_imbalance']:.1e}",
        ))  # fmt: skip
    heads = "case", "mean mu", "mu at the end", "water at the end", "steps", "rejected", "energy"
    table(heads, rows)


def print_stores(quick: bool) -> None:
    """A block that slides on over wet ice: its sipes are deep, fill, or are not there.

    The ledger is that of the water, over what the ice has brought.
    """
    at, rows = np.array([0.0025, 0.01, 0.02, 0.04, 0.08]), []
    settings = ["load.duration=20 ms"]
    if quick:
        settings = ["load.duration=2 ms", "numerics.refinement=0.4"]
    for name, changes in STORES.items():
        scene = case(
            "wet_siped", *AS_IS, "ice.motion=sliding", "ice.water=40 um", *settings, *changes
        )
        with tempfile.TemporaryDirectory() as folder:
            summary = run(scene, Path(folder), pictures=False)
            history = read_run(folder).history
        mu = np.interp(at, history["slip_m"], history["mu"])
        squeezed, below, left, brought, stored, out = (
            history[f"water_{kind}_m3"]
            for kind in ("squeezed", "below", "left", "brought", "in_sipes", "pushed_out")
        )
        ledger = float(np.abs(squeezed + brought - below - left - stored - out).max()) / brought[-1]
        cells = (f"{1e9 * amount[-1]:.2f}" for amount in (brought, below, left, stored, out))
        steps = f"{summary['steps']}, {summary['rejected_steps']}"
        rows.append((name, *(f"{value:.4f}" for value in mu), *cells, f"{ledger:.0e}", steps))
    heads = (
        "sipes", *(f"mu after {1e3 * x:g} mm" for x in at), "brought, mm3", "below", "left",
        "in sipes", "pushed out", "ledger", "steps, rejected",
    )  # fmt: skip
    table(heads, rows)


def drawn_below() -> Figure:
    """Pressure, its part that the asperities bear, and water below blocks with sipes, after as long
    as ice is below them.
    """
    figure = Figure(figsize=(10.5, 5.2), layout="constrained")
    panels = figure.subplots(2, len(SIPES), sharex=True, sharey="row")
    for (above, below), sipes in zip(panels.T, SIPES, strict=True):
        sliding = slid(
            case("wet_siped", *AS_IS, "ice.motion=sliding", f"rubber.sipes={sipes}")
        ).last
        now, law = sliding.current, sliding.block.law
        water = sliding.frame.at_points(now.interface.squeezed_height, now.loads)
        solid = law.contact_pressure(now.loads.pressure, water, now.interface.age)
        order = np.argsort(now.loads.positions[:, 0])
        order = order[now.loads.pressure[order] > 0.0]
        x = 1e3 * now.loads.positions[order, 0]
        gaps = np.flatnonzero(np.diff(x) > 0.25) + 1  # the sipes
        lines = (
            (above, now.loads.pressure, "0.6", "rubber on ice"),
            (above, solid, "C3", "asperities bear"),
            (below, water * BAR * 1e6, "C0", "water in the voids"),
        )
        for ax, values, color, label in lines:
            ax.plot(np.insert(x, gaps, np.nan), np.insert(values[order] / BAR, gaps, np.nan),
                    color=color, label=label)  # fmt: skip
        above.set(title=f"{sipes or 'no'} sipes")
        below.set(xlabel="x (mm): the block slides to the right")
    panels[0, 0].set(ylabel="pressure (bar)", ylim=(0.0, 5.0))
    panels[1, 0].set(ylabel="water (µm)", ylim=(0.0, None))
    for ax in panels.ravel():
        ax.grid(alpha=0.25)
    panels[0, 0].legend(fontsize=8)
    return figure


def drawn(passes: dict[int, Passed], dry: Passed) -> Figure:
    """Water and mu over time, by sipes."""
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for sipes, here in passes.items():
        label = f"{sipes or 'no'} sipes, lugs of {1e3 * here.lug:.1f} mm"
        left.plot(1e3 * here.time, 1e6 * here.water, label=label)
        right.plot(1e3 * here.time, here.mu, label=label)
    holds = 1e6 * float(VOIDS.held(np.full(1, PRESSURE))[0])
    left.axhline(holds, color="0.4", linestyle=":", label=f"what the voids hold: {holds:.2f} µm")
    right.plot(1e3 * dry.time, dry.mu, color="0.4", linestyle=":", label="ice without water")
    left.set(ylabel="water (µm)", yscale="log", ylim=(0.5, 25.0), yticks=(1, 2, 5, 10, 20))
    left.yaxis.set_major_formatter("{x:g}")
    left.yaxis.set_minor_formatter("")
    right.set(ylabel=r"$\mu$", ylim=(0.0, None))
    for ax in (left, right):
        ax.set(xlabel="time below the block (ms)", xlim=(0.0, 1e3 * LENGTH / SPEED))
        ax.legend(fontsize=8)
        ax.grid(alpha=0.25)
    return figure


def main() -> None:
    """Print the tables, draw the picture."""
    parser = options(__doc__)
    picture_options(parser)
    parser.add_argument("--quick", action="store_true", help="coarser steps, fewer speeds")
    parser.add_argument("--slices", action="store_true", help="run the cases, and nothing else")
    given = parser.parse_args()
    if given.slices:
        print_slices(given.quick)
        print()
        print_stores(given.quick)
        draw(drawn_below(), given.pictures / "wet_below.png", 90)
        return
    print_sharing()
    print()
    print_lengths()
    print()
    tolerance = 1e-2 if given.quick else 1e-3
    dry = {sipes: Passed.of(wet(sipes, water=0.0, tolerance=tolerance)) for sipes in SIPES}
    passes = {sipes: Passed.of(wet(sipes, tolerance=tolerance)) for sipes in SIPES}
    print_passes(passes, dry)
    print()
    print_speeds(SPEEDS[::2] if given.quick else SPEEDS, tolerance)
    print()
    print_again(tolerance)
    draw(drawn(passes, dry[0]), given.pictures / "wet_ice.png", 90)


if __name__ == "__main__":
    main()
