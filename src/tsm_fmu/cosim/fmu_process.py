"""Processes for FMUs: one that ends or hangs loses its FMU alone."""

from __future__ import annotations

import multiprocessing
import select
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any

from ..batching.processes import exit_in_words, without_main
from ..batching.stopping import stop_asked
from .description import Description
from .fmu_server import serve

_POLL, _PATIENCE, _START = 0.2, 10.0, 120.0
"""How often a wait looks round, how long it lasts after Ctrl-C, and how long the start of a process may take [s]."""
MOST_IDLE = 8
"""Processes that wait for the next run of their FMU; a start takes half a second."""


class ProcessLost(Exception):
    """The process of an FMU has gone; says how."""


@contextmanager
def _children_allowed() -> Iterator[None]:
    """A worker of a cluster is a daemon, which may have no children lest they outlive it; ours end with their pipe."""
    here = multiprocessing.current_process()
    daemon, here.daemon = here.daemon, False
    try:
        yield
    finally:
        here.daemon = daemon


class FmuProcess:
    """A process for one FMU at a time.

    Parameters
    ----------
    time_limit : float
        Longest time that a call may take [s].

    Attributes
    ----------
    ended : str
        How the process was lost, in words; empty while it lives.
    """

    def __init__(self, time_limit: float) -> None:
        self._limit, self.ended = time_limit, ""
        context = multiprocessing.get_context("spawn")  # a fork would inherit the threads of compiled kernels
        self._connection, other = context.Pipe()
        self._process: Any = context.Process(target=serve, args=(other,), daemon=True)
        with without_main(), _children_allowed():
            self._process.start()
        other.close()
        self._poll: Any = None
        if hasattr(select, "poll"):
            self._poll = select.poll()
            self._poll.register(self._connection.fileno(), select.POLLIN)
        self._started = False

    def ask(self, request: bytes) -> bytes:
        """Send a request and return the answer.

        Raises
        ------
        ProcessLost
            If the process ends, or does not answer in time.
        """
        if self.ended:
            raise ProcessLost(self.ended)
        try:
            if not self._started:
                self._wait(max(self._limit, _START))
                self._connection.recv_bytes()
                self._started = True
            self._connection.send_bytes(request)
            self._wait(self._limit)
            return self._connection.recv_bytes()
        except (EOFError, ConnectionError):
            self._process.join(_PATIENCE)
            self._lost(f"ended its process {exit_in_words(self._process.exitcode or 0)}")
        except BaseException:
            self.kill()
            raise
        raise ProcessLost(self.ended)

    def _wait(self, limit: float) -> None:
        since = monotonic()
        while not self._ready():
            if stop_asked():
                limit = min(limit, _PATIENCE)  # the run ends with the step that it is in, if it can
            if monotonic() - since > limit:
                self._lost(f"did not return within {limit:g} s")
                raise ProcessLost(self.ended)

    def _ready(self) -> bool:
        return bool(self._connection.poll(_POLL) if self._poll is None else self._poll.poll(1000 * _POLL))

    def _lost(self, how: str) -> None:
        self.kill()
        self.ended = how

    def kill(self) -> None:
        """End the process at once."""
        self.ended = self.ended or "was ended"
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._connection.close()

    def close(self) -> None:
        """End the process, which waits for that."""
        if not self.ended:
            self.ended = "was ended"
            self._connection.close()
            self._process.join(_PATIENCE)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()


class Processes:
    """Processes for FMUs; one whose run is over is kept for the next run of the same FMU.

    Parameters
    ----------
    time_limit : float
        As in `FmuProcess`.
    every : bool
        For FMUs of this project too.
    """

    def __init__(self, time_limit: float, every: bool = False) -> None:
        self._limit, self._every = time_limit, every
        self._idle: list[tuple[str, FmuProcess]] = []

    def take(self, description: Description) -> FmuProcess | None:
        """A process for an FMU; None for one that runs here."""
        if not (self._every or is_foreign(description)):
            return None
        for entry in self._idle:
            if entry[0] == str(description.path):
                self._idle.remove(entry)
                return entry[1]
        return FmuProcess(self._limit)

    def give_back(self, description: Description, process: FmuProcess) -> None:
        """The run of an FMU is over."""
        if process.ended:
            return
        self._idle.append((str(description.path), process))
        if len(self._idle) > MOST_IDLE:
            self._idle.pop(0)[1].close()

    def close(self) -> None:
        """End all that wait."""
        while self._idle:
            self._idle.pop()[1].close()

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_idle": []}


def is_foreign(description: Description) -> bool:
    """Whether an FMU is not of this project: it may do to the process what it likes."""
    return not (description.model.generationTool or "").startswith("tsm-fmu ")
