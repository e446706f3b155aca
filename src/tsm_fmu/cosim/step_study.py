"""What the communication step and the order of exchange do to a system's signals."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .master import METHODS, number_of_steps, simulate_system
from .ssp import Case
from .trajectory import SimulationStopped, Trajectory

MATTERS = 0.01
"""From this share of a signal's size on, the order of exchange is said to matter."""
COMPARED_STEPS = 1000
"""Communication steps at the start of a run over which the orders of exchange are compared."""


@dataclass(frozen=True)
class SignalStudy:
    """One signal; differences are root mean squares at the communication points of the longest step.

    Attributes
    ----------
    signal, unit : str
    size : float
        Peak-to-peak value with the longest step, Gauss-Seidel.
    halved : mapping of str to tuple of float
        By method: difference between each step and its half, the longest step first.
    exchange : tuple of float
        Difference between Jacobi and Gauss-Seidel at each step.
    """

    signal: str
    unit: str
    size: float
    halved: dict[str, tuple[float, ...]]
    exchange: tuple[float, ...]

    def order(self, method: str) -> float:
        """Observed order from the last two halvings; NaN where nothing changes or there are less."""
        last = self.halved[method][-2:]
        return math.log2(last[0] / last[1]) if len(last) == 2 and min(last) > 0.0 else math.nan

    @property
    def share(self) -> float:
        """Difference between the methods at the longest step, as a share of the size."""
        return self.exchange[0] / self.size if self.size > 0.0 else 0.0


def step_study(
    case: Case,
    halvings: int,
    *,
    record: Sequence[str] | None = None,
    simulate: Callable[..., Trajectory] = simulate_system,
) -> tuple[SignalStudy, ...]:
    """Run a system with its step and its halves, with Gauss-Seidel and Jacobi.

    Parameters
    ----------
    case : (System, Experiment)
    halvings : int
        How often the step is halved, 1 or more.
    record, simulate
        As in `run_cases`.
    """
    system, experiment = case
    runs: dict[str, list[Trajectory]] = {method: [] for method in METHODS}
    for method in METHODS:
        for k in range(halvings + 1):
            parts = 2**k
            runs[method].append(
                simulate(
                    system, experiment.stop, experiment.step / parts, start=experiment.start, method=method,
                    loops=experiment.loops, record=record, decimation=parts,
                )
            )  # fmt: skip
    first = runs[METHODS[0]][0]
    window = experiment.window(first.time)

    def rms(one: Trajectory, other: Trajectory, name: str) -> float:
        difference = np.asarray(one.columns[name], float)[window] - np.asarray(other.columns[name], float)[window]
        return float(np.sqrt(np.mean(difference**2)))

    found = []
    for name, values in first.columns.items():
        halved = {method: tuple(rms(own[k], own[k + 1], name) for k in range(halvings)) for method, own in runs.items()}
        exchange = tuple(rms(a, b, name) for a, b in zip(*runs.values(), strict=True))
        size = float(np.ptp(np.asarray(values, float)[window]))
        found.append(SignalStudy(name, first.units[name], size, halved, exchange))
    return tuple(found)


def order_sentence(shares: Mapping[str, float], step: float, end: float) -> str:
    """Whether the order of exchange matters, from the differences of the signals as shares of their size."""
    worst = max(shares, key=lambda name: shares[name])
    share = 100.0 * shares[worst]
    if share < 100.0 * MATTERS:
        return f"The order of exchange does not matter: at most {share:.2g} % ({worst}) until {end:g} s."
    return (
        f"The order of exchange matters: with Jacobi {worst} differs by {share:.3g} % of its size from Gauss-Seidel at "
        f"{step:g} s, until {end:g} s; shorten the step, or take the master it is meant for."
    )


def compared(
    case: Case, *, record: Sequence[str] | None = None, simulate: Callable[..., Trajectory] = simulate_system
) -> str:
    """Whether the order of exchange matters in a system: `order_sentence` over the first `COMPARED_STEPS` steps.

    Empty where there is nothing to compare: one component, or loops that are iterated.
    """
    system, experiment = case
    if len(system.components) < 2 or experiment.loops == "iterate":
        return ""
    steps = min(number_of_steps(experiment.start, experiment.stop, experiment.step), COMPARED_STEPS)
    end = experiment.start + steps * experiment.step
    runs = []
    for method in METHODS:
        try:
            runs.append(
                simulate(
                    system, end, experiment.step, start=experiment.start, method=method, loops=experiment.loops,
                    record=record,
                )
            )  # fmt: skip
        except SimulationStopped as stopped:
            return (
                f"The order of exchange matters: with {method} the system stops at {stopped.trajectory.time[-1]:g} s."
            )
    one, other = runs
    shares = {}
    for name, values in one.columns.items():
        own, theirs = np.asarray(values, float), np.asarray(other.columns[name], float)
        size = max(float(np.ptp(own)), float(np.ptp(theirs)))  # an error that one of them makes zero is rounding there
        shares[name] = float(np.sqrt(np.mean((own - theirs) ** 2))) / size if size > 0.0 else 0.0
    return order_sentence(shares, experiment.step, end) if shares else ""
