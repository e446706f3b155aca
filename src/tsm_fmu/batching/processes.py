"""Work in processes of this machine: one that dies costs at most the item it had, which is tried once more."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from ..models.contract import InputError
from .mapped import Mapped, done, here

T = TypeVar("T")
R = TypeVar("R")

TRIES = 2
"""Processes that an item may take with it before it counts as failed."""


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def processes(number: int | None, items: int) -> Mapped:
    """Where to do so many items: on processes, or in this one if one is enough.

    Parameters
    ----------
    number : int or None
        Processes; None: one a processor. 1 is this one.
    items : int
        How many there are to do.

    Raises
    ------
    InputError
        Fewer than 1.
    """
    if number is not None and number < 1:
        raise InputError(f"workers {number} -- expected 1 or more -- leave it out for one a processor")
    wanted = min(cores() if number is None else number, items)
    return here if wanted < 2 else partial(_mapped, wanted)


def exit_in_words(code: int) -> str:
    """How a process ended, from its exit code."""
    return f"with exit code {code}" if code >= 0 else f"by {signal.Signals(-code).name}"


@contextmanager
def without_main() -> Iterator[None]:
    """Keep a new process from running the caller's script again, which need not be guarded against that."""
    main = vars(sys.modules["__main__"])
    hidden = {name: main.pop(name) for name in ("__spec__", "__file__") if name in main}
    main["__spec__"] = None
    try:
        yield
    finally:
        main.update(hidden)


class _Worker:
    """A process that does one item after the other."""

    number: int
    """Of the item it has."""

    def __init__(self, work: Callable[[Any], Any], lost: Callable[[Any, str], Any]) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would inherit the threads of compiled kernels
        self.connection, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, work, lost))  # no daemon: it may isolate an FMU
        with without_main():
            self._process.start()
        other.close()

    def take(self, number: int, item: Any) -> None:
        self.number = number
        self.connection.send(item)

    def ended(self) -> str:
        """Wait for the end of a process that has closed its side; how it ended, in words."""
        self._process.join()
        self.connection.close()
        return exit_in_words(self._process.exitcode or 0)

    def stop(self) -> None:
        self.connection.close()  # which it waits for between items
        self._process.terminate()
        self._process.join()


def _mapped(
    count: int, work: Callable[[T], R], items: Iterable[tuple[int, T]], lost: Callable[[T, str], R]
) -> Generator[tuple[int, R], None, None]:
    rest = iter(items)
    taken: dict[int, T] = {}
    tries: dict[int, int] = {}
    workers: list[_Worker] = []

    def employ(worker: _Worker) -> None:
        """Give it the next item, or send it home."""
        found = next(rest, None)
        if found is None:
            workers.remove(worker)
            worker.stop()
            return
        taken[found[0]] = found[1]
        worker.take(*found)

    try:
        for first in rest:
            worker = _Worker(work, lost)
            workers.append(worker)
            taken[first[0]] = first[1]
            worker.take(*first)
            if len(workers) == count:
                break
        while workers:
            for connection in wait([worker.connection for worker in workers]):
                worker = next(w for w in workers if w.connection is connection)
                number, item = worker.number, taken[worker.number]
                try:
                    result = worker.connection.recv()
                except (EOFError, ConnectionError):
                    workers.remove(worker)
                    how = worker.ended()
                    tries[number] = tries.get(number, 0) + 1
                    worker = _Worker(work, lost)
                    workers.append(worker)
                    if tries[number] < TRIES:
                        worker.take(number, item)
                        continue
                    result = lost(item, f"it ended its process {how}, {TRIES} times")
                del taken[number]
                yield number, result
                employ(worker)
    finally:
        for worker in workers:
            worker.stop()


def _serve(connection: Connection, work: Callable[[Any], Any], lost: Callable[[Any, str], Any]) -> None:
    """The loop of a process; Ctrl-C is for the one that started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        while True:
            connection.send(done(work, lost, connection.recv()))
    except (EOFError, ConnectionError, KeyboardInterrupt):
        return  # the one that started it has gone or has no more to do; or an FMU sent Ctrl-C
