"""Simulation with FMUs in processes of their own: one that crashes, exits or hangs does not take this process, the
other FMUs or the rows until then with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..models.contract import InputError
from .derivatives import of_derivatives
from .fmu_process import Processes
from .linearize import Linear
from .master import simulate_system
from .replay import replay
from .trajectory import Trajectory


class Simulations:
    """Where to simulate: everything in this process, or FMUs in processes of their own, kept from run to run.

    Work that goes to other processes takes it along; there it starts processes anew.

    Parameters
    ----------
    isolate : bool or None
        Whether every FMU gets a process, or none; if None, those that are not ours.
    time_limit : float
        Longest time that one call of an FMU may take there [s].

    Raises
    ------
    InputError
        If the time limit is not positive.
    """

    def __init__(self, isolate: bool | None, time_limit: float) -> None:
        if not time_limit > 0.0:
            raise InputError(f"time limit {time_limit!r} s -- expected a positive number -- correct it")
        self._processes = None if isolate is False else Processes(time_limit, every=isolate is True)

    def simulate_system(self, *arguments: Any, **options: Any) -> Trajectory:
        """`master.simulate_system`; also `SimulationStopped` where the process of an FMU ends or hangs."""
        return simulate_system(*arguments, processes=self._processes, **options)

    def replay(self, *arguments: Any, **options: Any) -> Trajectory:
        """`replay.replay`; also `SimulationStopped` where the process of the FMU ends or hangs."""
        return replay(*arguments, processes=self._processes, **options)

    def of_derivatives(self, *arguments: Any) -> Linear:
        """`derivatives.of_derivatives`."""
        return of_derivatives(*arguments, processes=self._processes)

    def close(self) -> None:
        """End the processes."""
        if self._processes is not None:
            self._processes.close()


@contextmanager
def simulation(isolate: bool | None, time_limit: float) -> Iterator[Simulations]:
    """`Simulations` whose processes end with the context."""
    there = Simulations(isolate, time_limit)
    try:
        yield there
    finally:
        there.close()
