"""Points of a sweep on a Dask cluster that is there already."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from itertools import islice
from typing import Any

from .. import __version__
from ..models.contract import InputError
from .sweep import Compute, Point, Values

PATIENCE = 15.0
"""How long a scheduler and its first worker are waited for [s]."""
AHEAD = 1000
"""Points that the scheduler knows of at a time."""

_one_at_a_time = threading.Lock()


@contextmanager
def cluster(address: str) -> Iterator[Callable[[Compute, Iterable[Values]], Iterator[Point]]]:
    """A ``map`` for `sweep` on the workers of a scheduler; results come in order.

    A point whose worker dies is given to another; one that has taken several workers with it is recorded as failed.
    FMUs are read where they are: workers see the same folders.

    Parameters
    ----------
    address : str
        Of the scheduler, as in ``tcp://host:8786``.

    Raises
    ------
    InputError
        Dask is not installed, no scheduler answers, it has no worker, or workers have another version.
    """
    try:
        from distributed import Client, KilledWorker
    except ImportError:
        raise InputError(
            f"--scheduler {address} -- expected the package distributed -- install it with: pip install 'tsm-fmu[dask]'"
        ) from None
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as failure:
        raise InputError(
            f"--scheduler {address} -- expected the address of a running Dask scheduler ({_line(failure)}) -- "
            "start one with 'dask scheduler'"
        ) from failure
    try:
        _check_workers(client, address)

        def mapped(compute: Compute, points: Iterable[Values]) -> Iterator[Point]:
            waiting: list[tuple[Values, Any]] = []
            rest = iter(points)
            work = partial(_worked, compute)
            try:
                while True:
                    more = list(islice(rest, AHEAD - len(waiting)))
                    waiting += zip(more, client.map(work, more, pure=False) if more else (), strict=True)
                    if not waiting:
                        return
                    at, future = waiting.pop(0)
                    try:
                        yield future.result()
                    except KilledWorker as lost:
                        yield Point(at, {}, f"its workers died ({_line(lost)})")
            finally:
                client.cancel([future for _, future in waiting])

        yield mapped
    finally:
        client.close()


def _check_workers(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
        found: Mapping[str, str] = client.run(_version)
    except TimeoutError:
        raise InputError(
            f"--scheduler {address} has no worker -- expected one or more -- start one with 'dask worker {address}'"
        ) from None
    except ImportError as failure:
        raise InputError(
            f"--scheduler {address}: {_line(failure)} on its workers -- expected tsm-fmu {__version__} there -- "
            "install it"
        ) from failure
    if other := {worker: version for worker, version in found.items() if version != __version__}:
        worker, version = next(iter(other.items()))
        raise InputError(f"worker {worker} has tsm-fmu {version} -- expected {__version__} as here -- install the same")


def _version() -> str:
    return __version__


def _worked(compute: Compute, at: Values) -> Point:
    with _one_at_a_time:  # threads of a worker: loading an FMU changes the folder of the process
        return compute(at)


def _line(failure: BaseException) -> str:
    return " ".join(str(failure).split()) or type(failure).__name__
