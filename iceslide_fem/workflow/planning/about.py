"""All that is known of a scene before a run: what `iceslide info` shows, as rows and notes."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from html import escape
from itertools import groupby
from typing import TYPE_CHECKING, Any

from iceslide_fem.scene import Scene
from iceslide_fem.workflow.planning.cost import foreseen
from iceslide_fem.workflow.planning.info import describe
from iceslide_fem.workflow.planning.passes import Row

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class About:
    """What a scene means: `rows` of group, quantity, value with unit and meaning, and `notes`.

    `about["steps"]` is the value of a quantity.
    """

    name: str
    model: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    def __getitem__(self, quantity: str) -> str:
        for row in self.rows:
            if row.quantity == quantity:
                return row.value
        raise KeyError(quantity)

    def as_dict(self) -> dict[str, Any]:
        """The same as dictionaries and lists."""
        return asdict(self) | {"rows": [row._asdict() for row in self.rows]}

    def to_dataframe(self) -> pd.DataFrame:
        """The rows as a pandas table."""
        import pandas as pd

        return pd.DataFrame(self.rows)

    def __repr__(self) -> str:
        first, second = (max(len(row[i]) for row in self.rows) for i in (1, 2))
        lines = [f"{self.name} ({self.model})"]
        for group, rows in groupby(self.rows, lambda row: row.group):
            lines.append(group)
            lines += [
                f"  {row.quantity:{first}}  {row.value:>{second}}  {row.meaning}".rstrip()
                for row in rows
            ]
        return "\n".join([*lines, *(f"Note: {note}." for note in self.notes)])

    def _repr_html_(self) -> str:
        rows = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
            for row in self.rows
        )
        notes = "".join(f"<p>Note: {escape(note)}.</p>" for note in self.notes)
        return f"<b>{escape(self.name)}</b> ({self.model})<table>{rows}</table>{notes}"


def about(scene: Scene) -> About:
    """What is known of a `scene`, whose model is not "auto".

    Raises SceneError if the user's mesh is unsuitable.
    """
    rows = tuple(describe(scene))
    return About(scene.name, scene.model, rows, tuple(foreseen(scene)))
