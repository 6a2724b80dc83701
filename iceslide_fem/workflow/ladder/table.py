"""The tables of `iceslide ladder`."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from iceslide_fem.run.simplifications import Simplifications
from iceslide_fem.workflow.ladder.runs import RungResult, finest_of


def simplification_table(found: Simplifications, tolerance: float) -> Table:
    """What the rungs leave out, as estimated before anything was run."""
    table = Table(title="What may be neglected? (estimates)", title_justify="left")
    for heading in ("neglecting with", "number", "", "moves mu by", ""):
        table.add_column(heading, justify="right" if heading in ("", "moves mu by") else "left")
    for one in found:
        small = "negligible" if one.effect <= tolerance else ""
        table.add_row(one.name, one.formula, f"{one.number:.2g}", f"{one.effect:.2g}", small)
    return table


def ladder_table(outcomes: Sequence[RungResult]) -> Table:
    """Every rung that was run: friction, difference of mu(t) to the finest, time and memory."""
    table = Table(title="The ladder", title_justify="left")
    for heading in ("rung", "mean mu", "largest", "rms", "seconds", "MB"):
        table.add_column(heading, justify="left" if heading == "rung" else "right", no_wrap=True)
    finest = finest_of(outcomes)
    for outcome in outcomes:
        if outcome.run is None:
            continue
        errors = [f"{outcome.largest:.2%}", f"{outcome.rms:.2%}"]
        table.add_row(
            outcome.name,
            f"{outcome.run.summary['mu_mean']:.4f}",
            *(["finest", ""] if outcome is finest else errors),
            f"{outcome.run.summary['wall_s']:.1f}",
            f"{outcome.memory / 1e6:.0f}",
        )
    return table


def not_run(outcomes: Sequence[RungResult]) -> list[str]:
    """A sentence for each reason why rungs were not run, or not to their end."""
    reasons: dict[str, list[str]] = {}
    for outcome in outcomes:
        if outcome.run is None:
            reasons.setdefault(outcome.note, []).append(outcome.name)
    return [f"{', '.join(names)}: {reason}." for reason, names in reasons.items()]
