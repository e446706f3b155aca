"""Work side by side: compiled kernels and most of the linear algebra run without the interpreter's lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")


def together(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """Results in the order of the items, made on as many threads as there are processors."""
    if len(items) < 2 or (os.cpu_count() or 1) < 2:
        return [work(item) for item in items]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(work, items))


def on_shared_threads(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """Results of ``work`` for each item, on threads that all callers share: for work that starts none itself."""
    return list(_shared().map(work, items)) if len(items) > 1 else [work(item) for item in items]


@cache
def _shared() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count())


if hasattr(os, "register_at_fork"):  # a forked process has none of the threads, and would wait for them for ever
    os.register_at_fork(after_in_child=_shared.cache_clear)
