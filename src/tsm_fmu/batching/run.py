"""A batch: all items that are not done yet, wherever the work is done."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from typing import TypeVar

from .cluster import cluster
from .mapped import Mapped
from .processes import processes

T = TypeVar("T")
R = TypeVar("R")


@contextmanager
def place(workers: int | None, scheduler: str | None, items: int) -> Iterator[Mapped]:
    """Where so many items are done: on the workers of a Dask scheduler if one is named, else on local processes.

    Raises
    ------
    InputError
        As `cluster` and `processes`.
    """
    if scheduler is None:
        yield processes(workers, items)
    else:
        with cluster(scheduler) as there:
            yield there


def run_batch(
    work: Callable[[T], R],
    items: Sequence[T],
    done: dict[int, R],
    *,
    lost: Callable[[T, str], R],
    keep: Callable[[int, R], object],
    workers: int | None = None,
    scheduler: str | None = None,
    advance: Callable[[int], object] = lambda _: None,
) -> None:
    """Do the work for the items that are not ``done``, and add them there as they come.

    Parameters
    ----------
    work : callable
        ``work(item)``; it, the items and the results go to other processes.
    items : sequence
    done : dict of int to result
        By number of the item; what was added is there after an interruption too.
    lost : callable
        ``lost(item, reason)``: the result of an item whose process is gone.
    keep : callable
        ``keep(number, result)``: told each new result, once there is a place to work.
    workers : int, optional
        Local processes; one a processor without it.
    scheduler : str, optional
        Address of a Dask scheduler that does the work instead.
    advance : callable
        Told how many are done.
    """
    todo = [(number, item) for number, item in enumerate(items) if number not in done]
    with place(workers, scheduler, len(todo)) as mapped, closing(mapped(work, todo, lost)) as results:
        for number, result in results:
            done[number] = result
            keep(number, result)
            advance(len(done))
