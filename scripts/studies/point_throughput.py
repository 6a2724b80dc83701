"""10,000 conditions on the point level in one call, against SciPy's Radau one by one on a sample.

Both integrate the same equations with the same column, and both are compared with a run of the
point level at a tolerance of 1e-6: mu at 70 times of each condition. Radau runs as SciPy has it,
with a Jacobian by differences, and once more with the exact one; it is restarted at melt onset
and saturation, and its rtol is the loosest listed that keeps its error below the target. Times
are of the processor, on one core, each the least of five: whatever else runs only adds to it. The
ratio of times by the clock, the least of each, is printed, too.
"""

from collections.abc import Callable
from time import perf_counter
from typing import TypeVar

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.scene.materials import MELTING_ENTHALPY, MELTING_TEMPERATURE
from scripts.studies.common import conditions, options, timed

Result = TypeVar("Result")

DURATION = 7e-3  # s
TIMES = np.linspace(0.0, DURATION, 71)
TARGET = 5e-3  # relative error of mu
TOLERANCE = 0.07  # of the point level: the loosest whose error stays below the target
RTOLS = (2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
SAMPLE = 400  # conditions on which the point level is checked
RADAU_SAMPLE = 40  # and on which Radau is run
REPEATS = 5


def all_conditions() -> Conditions:
    """25 pressures, 20 speeds and 20 ice temperatures."""
    grid = np.meshgrid(
        np.geomspace(1.0, 5.0, 25),
        np.linspace(0.5, 8.0, 20),
        np.linspace(-20.0, -1.0, 20),
        indexing="ij",
    )
    bar, speed, celsius = (axis.ravel() for axis in grid)
    return conditions(bar, speed, DURATION, celsius)


class Reference:
    """One condition for SciPy: unknowns ln(h / h0), H_s / H_V and the column's amplitudes."""

    def __init__(self, condition: Conditions) -> None:
        loads = condition.loads()
        self.power = float(loads.viscous[0] * loads.speed[0])
        self.squeeze_rate = float(loads.squeeze_rate[0])
        self.free_height = float(condition.H_V[0])
        self.undercooling = float(MELTING_TEMPERATURE - condition.temperature[0])
        self.mu_times_height = float(loads.viscous[0] / condition.pressure[0])
        self.initial_height = float(condition.initial_height[0])
        column = Column(condition.temperature, DURATION)
        self.rates, self.surface = column.rates, column.surface
        # The flux that keeps the surface at its temperature.
        self.holding = self.surface * self.rates / (self.surface @ self.surface)
        self.melting = self.saturated = False

    def rhs(self, t: float, x: np.ndarray) -> np.ndarray:
        """d/dt of the unknowns; the switches are those of the present phase."""
        h = self.initial_height * np.exp(x[0])
        q_f = self.power / h
        q_ice = self.holding @ x[2:] if self.melting else q_f
        squeeze = 0.0 if self.saturated else self.squeeze_rate * h**3
        rate = np.empty_like(x)
        rate[0] = ((q_f - q_ice) / MELTING_ENTHALPY - squeeze) / h
        rate[1] = squeeze / self.free_height
        rate[2:] = self.surface * q_ice - self.rates * x[2:]
        return rate

    def jacobian(self, t: float, x: np.ndarray) -> np.ndarray:
        """Derivative of `rhs` by the unknowns."""
        h = self.initial_height * np.exp(x[0])
        q_f = self.power / h
        squeeze = 0.0 if self.saturated else self.squeeze_rate * h**3
        matrix = np.zeros((x.size, x.size))
        matrix[1, 0] = 3.0 * squeeze / self.free_height
        matrix[0, 0] = -2.0 * squeeze / h
        amplitudes = np.arange(2, x.size)
        matrix[amplitudes, amplitudes] = -self.rates
        if self.melting:
            q_ice = self.holding @ x[2:]
            matrix[0, 0] -= (2.0 * q_f - q_ice) / (h * MELTING_ENTHALPY)
            matrix[0, 2:] = -self.holding / (h * MELTING_ENTHALPY)
            matrix[2:, 2:] += np.outer(self.surface, self.holding)
        else:
            matrix[2:, 0] = -q_f * self.surface
        return matrix

    def mu(self, rtol: float, exact_jacobian: bool) -> np.ndarray:
        """mu at `TIMES` by Radau."""

        def onset(t: float, x: np.ndarray) -> float:
            return -1.0 if self.melting else float(self.surface @ x[2:] - self.undercooling)

        def filled(t: float, x: np.ndarray) -> float:
            return -1.0 if self.saturated else float(x[1] - 1.0)

        onset.terminal = filled.terminal = True  # type: ignore[attr-defined]
        self.melting = self.saturated = False
        x, t = np.zeros(2 + self.rates.size), 0.0
        atol = np.full(x.size, rtol)
        atol[2:] *= self.undercooling / np.abs(self.surface).sum()
        log_height = np.empty_like(TIMES)
        while t < DURATION:
            ahead = TIMES >= t
            run = solve_ivp(
                self.rhs,
                (t, DURATION),
                x,
                "Radau",
                t_eval=TIMES[ahead],
                events=(onset, filled),
                jac=self.jacobian if exact_jacobian else None,
                rtol=rtol,
                atol=atol,
            )
            log_height[np.flatnonzero(ahead)[: run.t.size]] = run.y[0]
            if run.status != 1:
                break
            which = 0 if run.t_events[0].size else 1
            t, x = float(run.t_events[which][0]), run.y_events[which][0]
            self.melting |= which == 0
            self.saturated |= which == 1
        return self.mu_times_height * np.exp(-log_height) / self.initial_height


def least(task: Callable[[], Result]) -> tuple[Result, float, float]:
    """The result of `task`, the least of its processor seconds and of those by the clock."""
    processor, clock = [], []
    for _ in range(REPEATS):
        started = perf_counter()
        result, seconds = timed(task, repeats=1)
        clock.append(perf_counter() - started)
        processor.append(seconds)
    return result, min(processor), min(clock)


def main() -> None:
    """Print the table and the ratio."""
    options(__doc__).parse_args()
    everything = all_conditions()
    n = everything.pressure.size
    sample = np.random.default_rng(1).choice(n, SAMPLE, replace=False)
    some = everything.take(sample)
    exact = simulate(some, tolerance=1e-6, times=TIMES).samples

    result, seconds, clock = least(lambda: simulate(everything, tolerance=TOLERANCE, times=TIMES))
    seconds, clock = seconds / n, clock / n
    error = np.abs(result.samples[:, sample] / exact - 1.0).max()
    table = Table("method", "largest error of mu", "ms per condition", "s for 10,000")
    table.add_row(
        f"point level, tolerance {TOLERANCE:g}",
        f"{error:.3%}",
        f"{1e3 * seconds:.4f}",
        f"{n * seconds:.3f}",
    )
    tried = result.steps + result.rejected

    references = [Reference(some.take(np.array([i]))) for i in range(RADAU_SAMPLE)]
    ratios = []
    for exact_jacobian, method in ((False, "Radau"), (True, "Radau, exact Jacobian")):
        for rtol in RTOLS:

            def one_by_one(rtol: float = rtol, exact_jacobian: bool = exact_jacobian) -> np.ndarray:
                return np.column_stack([one.mu(rtol, exact_jacobian) for one in references])

            mu, radau, radau_clock = least(one_by_one)
            radau, radau_clock = radau / RADAU_SAMPLE, radau_clock / RADAU_SAMPLE
            radau_error = np.abs(mu / exact[:, :RADAU_SAMPLE] - 1.0).max()
            table.add_row(
                f"{method}, rtol {rtol:g}",
                f"{radau_error:.3%}",
                f"{1e3 * radau:.2f}",
                f"{n * radau:.0f}",
            )
            if radau_error <= TARGET:
                break
        ratios.append((radau / seconds, radau_clock / clock))
    Console().print(table)
    print(
        f"steps tried per condition: mean {tried.mean():.1f}, most {tried.max()}, refused "
        f"{result.rejected.mean():.1f}; {1e6 * n * seconds / tried.sum():.2f} us for each"
    )
    print(
        f"Radau takes {ratios[0][0]:.0f} times as long, with the exact Jacobian {ratios[1][0]:.0f} "
        f"times; by the clock {ratios[0][1]:.0f} and {ratios[1][1]:.0f} times"
    )
    print(f"(errors of at most {TARGET:.1%})")


if __name__ == "__main__":
    main()
