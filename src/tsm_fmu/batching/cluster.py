"""Work on a Dask cluster that is there already."""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from itertools import islice
from typing import Any, TypeVar

from .. import __version__
from ..models.contract import InputError
from .mapped import Mapped, done

T = TypeVar("T")
R = TypeVar("R")

PATIENCE = 15.0
"""How long a scheduler and its first worker are waited for [s]."""
AHEAD = 1000
"""Items that the scheduler knows of at a time."""

_one_at_a_time = threading.Lock()


@contextmanager
def cluster(address: str) -> Iterator[Mapped]:
    """A `Mapped` on the workers of a scheduler.

    An item whose worker dies is given to another; one that has taken several workers with it is lost. Files are read
    where they are: workers see the same folders.

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
        from distributed import Client
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
        yield partial(_mapped, client)
    finally:
        client.close()


def _mapped(
    client: Any, work: Callable[[T], R], items: Iterable[tuple[int, T]], lost: Callable[[T, str], R]
) -> Generator[tuple[int, R], None, None]:
    from distributed import KilledWorker, as_completed

    rest = iter(items)
    taken: dict[Any, tuple[int, T]] = {}
    ready = as_completed(loop=client.loop)
    there = partial(_worked, work, lost)
    try:
        while True:
            for number, item in islice(rest, AHEAD - len(taken)):
                future = client.submit(there, item, pure=False)
                taken[future] = number, item
                ready.add(future)
            if not taken:
                return
            future = next(ready)
            number, item = taken.pop(future)
            try:
                yield number, future.result()
            except KilledWorker as killed:
                yield number, lost(item, f"its workers died ({_line(killed)})")
    finally:
        client.cancel(list(taken))


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


def _worked(work: Callable[[T], R], lost: Callable[[T, str], R], item: T) -> R:
    with _one_at_a_time:  # threads of a worker: loading an FMU changes the folder of the process
        return done(work, lost, item)


def _line(failure: BaseException) -> str:
    return " ".join(str(failure).split()) or type(failure).__name__
