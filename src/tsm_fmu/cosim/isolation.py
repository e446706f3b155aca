"""Simulation in a process of its own: an FMU that crashes, exits or hangs there does not take this one with it.

The other process writes its rows, and which call it is in, to files that outlive it (`journal.Journal`).
"""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import tempfile
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any

import numpy as np

from ..batching.processes import exit_in_words, without_main
from ..models.contract import InputError
from .description import describe
from .journal import Journal, recovered
from .master import simulate_system
from .replay import in_si, replay
from .trajectory import SimulationInterrupted, SimulationStopped, Trajectory

_POLL, _PATIENCE = 0.2, 10.0


def foreign(fmus: Iterable[Path]) -> bool:
    """Whether an FMU among them is not of this project: it may do to the process what it likes.

    Raises
    ------
    InputError
        As `describe`.
    """
    return any(not (describe(f).model.generationTool or "").startswith("tsm-fmu ") for f in fmus)


class InProcess:
    """Simulates here."""

    simulate_system = staticmethod(simulate_system)
    replay = staticmethod(replay)


@contextmanager
def simulation(fmus: Iterable[Path], isolate: bool | None, time_limit: float) -> Iterator[InProcess | Isolated]:
    """Where to simulate these FMUs: in a process of its own if wanted, without a wish if one of them is `foreign`."""
    if not time_limit > 0.0:
        raise InputError(f"time limit {time_limit!r} s -- expected a positive number -- correct it")
    if isolate or (isolate is None and foreign(fmus)):
        with Isolated(time_limit) as there:
            yield there
    else:
        yield InProcess()


class Simulator:
    """`simulate_system` for work that goes to other processes: each opens its own `Isolated`, if wanted, and keeps it.

    Parameters
    ----------
    isolated : bool
    time_limit : float
        As in `Isolated`.
    """

    def __init__(self, isolated: bool, time_limit: float) -> None:
        self._isolated, self._limit = isolated, time_limit
        self._there: Isolated | None = None

    def __call__(self, *arguments: Any, **options: Any) -> Trajectory:
        if not self._isolated:
            return simulate_system(*arguments, **options)
        self._there = self._there or Isolated(self._limit)
        return self._there.simulate_system(*arguments, **options)

    def close(self) -> None:
        """End the other process, if there is one."""
        if self._there is not None:
            self._there.__exit__(None, None, None)
            self._there = None

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_there": None}


class _Lost(Exception):
    """The other process has gone; says how."""


class Isolated:
    """Simulates in another process, which lives until the context ends or an FMU ends it; then the next is a new one.

    Parameters
    ----------
    time_limit : float
        Longest time that one call of an FMU may take [s].
    """

    def __init__(self, time_limit: float) -> None:
        self._limit = time_limit
        self._process: Any = None
        self._connection: Any = None

    def __enter__(self) -> Isolated:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, failure: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process is not None:
            self._connection.close()  # which it waits for
            self._process.join(_PATIENCE)
            self._end()

    def simulate_system(self, *arguments: Any, **options: Any) -> Trajectory:
        """`master.simulate_system` there; also `SimulationStopped` where the process ends or hangs."""
        return self._call(simulate_system, arguments, options, lambda rows: rows)

    def replay(self, *arguments: Any, **options: Any) -> Trajectory:
        """`replay.replay` there; also `SimulationStopped` where the process ends or hangs."""
        return self._call(replay, arguments, options, in_si)

    def _call(
        self,
        function: Callable[..., Trajectory],
        arguments: tuple[Any, ...],
        options: dict[str, Any],
        rescued: Callable[[Trajectory], Trajectory],
    ) -> Trajectory:
        """Call it there; ``rescued`` brings rows that a dead process left into the form of a result."""
        folder = Path(tempfile.mkdtemp(prefix="tsm_fmu_rows_"))
        try:
            if self._process is None:
                self._start()
            self._connection.send((function, arguments, options, folder))
            return self._answer(folder)
        except _Lost as lost:
            where, rows = recovered(folder)
            message = f"{where} {lost} -- expected a return from every call -- get a corrected FMU from its maker"
            raise SimulationStopped(message, replace(rescued(rows), incomplete=message)) from None
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would inherit the threads of compiled kernels
        self._connection, other = context.Pipe()
        self._process = context.Process(target=_work, args=(other,), daemon=True)
        with without_main():
            self._process.start()
        other.close()

    def _answer(self, folder: Path) -> Trajectory:
        seen, since, limit = -1, monotonic(), self._limit
        while True:
            try:
                ready = self._connection.poll(_POLL)
            except KeyboardInterrupt:
                limit = min(limit, _PATIENCE)  # it ends with the step that it is in, if it can
                if os.name != "nt":  # where the console tells all its processes
                    os.kill(self._process.pid, signal.SIGINT)
                continue
            if ready:
                break
            calls = Journal.calls(folder)
            if calls != seen:
                seen, since = calls, monotonic()
            elif monotonic() - since > limit:
                self._end()
                raise _Lost(f"did not return within {limit:g} s")
        try:
            failure, result = self._connection.recv()
        except (EOFError, ConnectionError):
            raise self._died() from None
        if failure is not None:
            raise failure
        return result

    def _died(self) -> _Lost:
        self._process.join()
        code = self._process.exitcode
        self._end()
        return _Lost(f"ended its process {exit_in_words(code)}")

    def _end(self) -> None:
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._connection.close()
        self._process = self._connection = None


def _work(connection: Any) -> None:
    """The loop of the other process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            function, arguments, options, folder = connection.recv()
        except EOFError:
            return
        signal.signal(signal.SIGINT, signal.default_int_handler)
        failure: BaseException | None = None
        result: Trajectory | None = None
        try:
            result = _in_memory(function(*arguments, journal=Journal(folder), **options))
        except (SimulationStopped, SimulationInterrupted) as early:
            early.trajectory = _in_memory(early.trajectory)
            failure = early
        except (InputError, KeyboardInterrupt) as wrong:
            failure = wrong
        except Exception:
            failure = RuntimeError(traceback.format_exc())
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        connection.send((failure, result))


def _in_memory(run: Trajectory) -> Trajectory:
    columns = {name: np.array(values) for name, values in run.columns.items()}
    return replace(run, time=np.array(run.time), columns=columns)
