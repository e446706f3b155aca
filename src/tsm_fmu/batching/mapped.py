"""What a place to work is: a ``map`` whose results come as they are ready, each with the number of its item."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from typing import Protocol, TypeVar

T = TypeVar("T")
R = TypeVar("R")


class Mapped(Protocol):
    """Do the work for each numbered item; results with their numbers, in any order.

    ``lost(item, reason)`` is the result of an item that nothing else came of.
    """

    def __call__(
        self, work: Callable[[T], R], items: Iterable[tuple[int, T]], lost: Callable[[T, str], R]
    ) -> Generator[tuple[int, R], None, None]: ...


def done(work: Callable[[T], R], lost: Callable[[T, str], R], item: T) -> R:
    """The result of one item; a defect in the work costs this item, not the others."""
    try:
        return work(item)
    except Exception as failure:
        return lost(item, f"internal error: {failure!r} -- expected none -- a defect of ours, please report it")


def here(
    work: Callable[[T], R], items: Iterable[tuple[int, T]], lost: Callable[[T, str], R]
) -> Generator[tuple[int, R], None, None]:
    """A `Mapped` in this process, one after the other."""
    for number, item in items:
        yield number, done(work, lost, item)
