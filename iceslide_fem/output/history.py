"""State of a block and its interface at one time: a table row, and values at points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from iceslide_fem.coupling.energy import Energies
from iceslide_fem.coupling.ledger import Ledger
from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.state import AcceptedStep, CoupledState
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.contact import ContactState
from iceslide_fem.mechanics.press import PathPoint
from iceslide_fem.output.table import HistoryRow, PreloadRow, row_of
from iceslide_fem.output.water import water_columns, water_names
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import AREA, VISCOSITY
from iceslide_fem.runtime.units import ZERO_CELSIUS

# Of the law, with their names in fields.
_FIELDS = {each.column: each.name for each in (VISCOSITY, AREA)}


def preload_row(block: Block, point: PathPoint) -> PreloadRow:
    """Row of `preload.csv` for an equilibrium on the path to sliding. Collective."""
    contact = block.contact
    highest = float(contact.pressure.max(initial=0.0))
    return PreloadRow(
        phase=point.phase,
        load_fraction=point.load,
        speed_fraction=point.speed,
        normal_force_N=block.normal_force(contact),
        friction_force_N=block.drag(point.law),
        plate_displacement_m=block.equilibrium.plate_displacement(),
        contact_fraction=_contact_area(block, contact) / block.area,
        largest_pressure_Pa=block.surface.comm.allreduce(highest, op=MPI.MAX),
        newton_iterations=point.solution.iterations,
    )


def slide_row(sliding: Sliding, ledger: Ledger, accepted: AcceptedStep | None) -> HistoryRow:
    """Row of `history.csv` at the present time; accepted: last step, None at t = 0. Collective.

    Heights, temperature and the melted and saturated fractions are means over the contact area.
    """
    block, current = sliding.block, sliding.current
    contact = current.contact
    area = np.where(contact.pressure > 0.0, contact.area, 0.0)
    touching = max(_contact_area(block, contact), 1e-300)

    def mean(values: Any) -> float:
        return block.surface.total(values.reshape(area.shape), area) / touching

    frame = sliding.frame
    squeezed = frame.at_points(current.interface.squeezed_height, current.loads)
    melted, saturated = _switches(sliding, accepted)
    normal, friction = block.normal_force(contact), ledger.friction_force()
    below, beside = ledger.lying_water()
    values = {
        "step_s": accepted.dt if accepted else 0.0,
        "mu": friction / normal,
        "film_height_m": mean(frame.film_height(current.interface, current.loads)),
        "squeezed_height_m": mean(squeezed),
        "surface_temperature_C": mean(_surface(sliding, current)) - ZERO_CELSIUS,
        "contact_fraction": touching / block.area,
        "normal_force_N": normal,
        "friction_force_N": friction,
        "plate_displacement_m": block.equilibrium.plate_displacement(),
        "melted_fraction": mean(melted),
        "saturated_fraction": mean(saturated),
        "energy_imbalance": ledger.imbalance,
        "water_squeezed_m3": ledger.squeezed_water,
        "water_below_m3": below,
        "water_left_m3": beside + ledger.lost_water,
        "newton_iterations": accepted.iterations if accepted else 0,
    }
    energies = {f"{name}_J": getattr(ledger, name) for name in Energies._fields}
    reported = _at_points(sliding)
    internal = {name: mean(field) for name, field in reported.items()}
    internal |= water_columns(sliding, ledger, squeezed)
    return row_of(block.scene.load, current.time, values | energies, internal)


def interface_fields(sliding: Sliding, accepted: AcceptedStep | None) -> dict[str, Array]:
    """Fields at contact points, (f, q), by names with units. Collective.

    NaN without contact, where there is no film; means of facets exclude these points.
    """
    current = sliding.current
    shape = current.contact.pressure.shape
    melted, saturated = _switches(sliding, accepted)
    squeezed = sliding.frame.at_points(current.interface.squeezed_height, current.loads)
    always = ("contact pressure (Pa)", "friction stress (Pa)")
    fields = {
        "contact pressure (Pa)": current.contact.pressure,
        "friction stress (Pa)": sliding.friction_stress(),
        "film height (m)": sliding.frame.film_height(current.interface, current.loads),
        "squeezed height (m)": squeezed,
        "surface temperature (degC)": _surface(sliding, current) - ZERO_CELSIUS,
        "melted (1)": melted,
        "saturated (1)": saturated,
    }
    fields |= _named(_at_points(sliding))
    touching = current.contact.pressure > 0.0
    return {
        name: np.where(touching | (name in always), np.reshape(values, shape), np.nan)
        for name, values in fields.items()
    }


def law_columns(sliding: Sliding) -> tuple[str, ...]:
    """Columns of the law: internal variables, and water in load-bearing voids."""
    return *sliding.block.law.columns, *water_names(sliding.block.law)


def fields_on_nodes(sliding: Sliding) -> dict[str, Array]:
    """Values from the law's internal variables at this rank's nodes, by field name.

    k is excluded, because nodes have no pressure.
    """
    internal = sliding.current.interface.internal
    law, n = sliding.block.law, internal.shape[1]
    found = law.reported(internal, np.zeros(n), law.untouched(n))
    return _named({name: row for name, row in found.items() if name != AREA.column})


def _at_points(sliding: Sliding) -> Mapping[str, Array]:
    """Values from the law's internal variables at the points, by column, SI. Collective."""
    current = sliding.current
    if not sliding.block.law.columns:
        return {}
    internal = sliding.frame.internal_at_points(current.interface, current.loads)
    law, age = sliding.block.law, current.interface.age
    return law.reported(internal, current.loads.pressure, age)


def _named(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Columns of internal variables, by field name."""
    return {_FIELDS.get(name, name): field for name, field in columns.items()}


def thinnest_film(sliding: Sliding) -> float:
    """Smallest film height in contact, m; infinite without contact. Collective."""
    current = sliding.current
    height = sliding.frame.film_height(current.interface, current.loads)
    touching = height[current.loads.pressure > 0.0]
    own = float(np.fmin.reduce(touching, initial=np.inf))  # NaN without films
    return sliding.block.surface.comm.allreduce(own, op=MPI.MIN)


def outside_table(block: Block, contact: ContactState) -> float:
    """Fraction of the contact area with a pressure outside the table of k, D, H_V."""
    touching = contact.pressure > 0.0
    outside = touching & block.law.outside(contact.pressure)
    total = _contact_area(block, contact)
    return block.surface.total(outside.astype(float), contact.area) / total if total > 0.0 else 0.0


def _contact_area(block: Block, contact: ContactState) -> float:
    return block.surface.total((contact.pressure > 0.0).astype(float), contact.area)


def _surface(sliding: Sliding, current: CoupledState) -> Array:
    """Temperature of the ice at the points (K), limited to T_m. Collective."""
    temperature = sliding.frame.ice_temperature(current.interface, current.loads)
    return np.minimum(temperature, sliding.block.scene.ice.melting_temperature)


def _switches(sliding: Sliding, accepted: AcceptedStep | None) -> tuple[Array, Array]:
    """Melting and saturation at the points, 0 to 1; 0 at t = 0. Collective."""
    if accepted is None:
        nowhere = np.zeros(sliding.block.surface.n_points)
        return nowhere, nowhere
    end, loads, frame = accepted.subcycles.substeps[-1], accepted.loads, sliding.frame
    melting, saturated = (
        end.of_all(one) for one in (end.step.last.melting, end.step.last.saturated)
    )
    return frame.at_points(melting, loads), frame.at_points(saturated, loads)
