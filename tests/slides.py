"""Slides of a block that write nothing: their scenes, their rows, and what is made of a step."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from iceslide_fem.coupling.accept import Acceptance, CorrectedStep  # noqa: E402
from iceslide_fem.coupling.drainage import drainage_of  # noqa: E402
from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.sliding import Sliding  # noqa: E402
from iceslide_fem.coupling.step_error import StepError, StepRejected  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.mechanics.press import press, start_sliding  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.scene import load_scene, scene_from_dict  # noqa: E402

CASES = Path(__file__).parent.parent / "cases"


def thesis(*changes):
    scene = ["model=slice", "numerics.tolerance=3e-3", "ice.heat=column", *changes]
    return load_scene(CASES / "thesis_1bar.toml", scene)


def started(scene, comm=MPI.COMM_SELF):
    block = build_block(scene, comm)
    press(block, lambda point: None)
    start_sliding(block, lambda point: None)
    return Sliding(block)


def slide(scene, comm=MPI.COMM_SELF):
    """Rows of a whole run."""
    sliding = started(scene, comm)
    ledger = Ledger(sliding)
    rows = [slide_row(sliding, ledger, None)]
    for accepted in sliding.steps():
        ledger.add(accepted)
        rows.append(slide_row(sliding, ledger, accepted))
    return dict(zip(rows[0]._fields, np.array(rows).T, strict=True))


def uniform(heat):
    return scene_from_dict(
        {
            "name": "uniform",
            "model": "slice",
            "rubber": {"C10": 166.2e6, "C01": 106.8e6, "D1": 0.0055e-6, "height": "0.05 mm"},
            "load": {"pressure": "5 bar", "speed": "4 m/s", "duration": "6 ms"},
            "ice": {"heat": heat},
            "film": {"k": 0.405, "D": "46.5 um", "H_V": "0.56 um"},
            "numerics": {"penalty": 1e12},  # softer than the block: even up to the edges
        }
    )


def refusal(sliding, change):
    """Why the next step of `sliding` is refused after a `change` of what is judged; or ""."""
    start, block = sliding.current, sliding.block
    step = sliding.advance()
    first, last = (state.mechanics.friction_force for state in (start, step.state))
    forces = [first, *(first + end * (last - first) for end in step.subcycles.ends)]
    corrected = CorrectedStep(step.state, step.dt, step.subcycles, forces, factor=1.0)
    error = StepError(block, block.scene.load.duration)
    acceptance = Acceptance(block, sliding.frame, drainage_of(block, sliding.frame), error, True)
    assert acceptance.of(start, corrected).dt == step.dt
    try:
        acceptance.of(start, change(corrected))
    except StepRejected as reason:
        return str(reason)
    return ""


def turned(factor):
    """The same step with friction that pushes, so many times as large."""
    return lambda step: step._replace(forces=[-factor * force for force in step.forces])


def quarrelling(folder, after, then="pass"):
    """A law in `folder` whose answers are other ones each time once it is as old as `after` (s).

    No step is accepted there. `then` is done at the fortieth such answer.
    """
    path = folder / "quarrelling.py"
    path.write_text(
        "import os, random, signal\n"
        "from iceslide_fem.laws.protocol import Response\n"
        "class Quarrelling:\n"
        "    fields = {'age': 0.0, 'mu': 0.2}\n"
        "    answers = 0\n"
        "    def respond(self, contact, state, surface, dt):\n"
        "        age, mu = state['age'] + dt, state['mu'] * 1.0\n"
        f"        if age.max(initial=0.0) > {after}:\n"
        "            mu[:] = random.uniform(0.1, 0.9)\n"
        "            Quarrelling.answers += 1\n"
        "            if Quarrelling.answers == 40:\n"
        f"                {then}\n"
        "        return Response(mu * contact.pressure, mu, {'age': age, 'mu': mu})\n"
    )
    return f"friction.law={path}:Quarrelling"
