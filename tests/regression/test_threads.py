"""Work on threads: results in order, errors as they are, and work that starts more of it."""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections.abc import Callable

import pytest

from tsm_fmu.regression.threads import on_shared_threads, together


@pytest.mark.parametrize("way", [together, on_shared_threads])
def test_results_are_in_the_order_of_the_items(way: Callable[..., list[int]]) -> None:
    def late(n: int) -> int:
        time.sleep(0.003 * (7 - n))
        return n * n

    assert way(late, range(7)) == [n * n for n in range(7)]
    assert way(late, []) == []


@pytest.mark.parametrize("way", [together, on_shared_threads])
def test_an_error_of_one_is_raised(way: Callable[..., list[int]]) -> None:
    def wrong(n: int) -> int:
        raise ValueError(f"item {n}")

    with pytest.raises(ValueError, match="item 3"):
        way(wrong, [3, 4, 5])


def test_work_may_start_more_of_it_and_end() -> None:
    """Items that wait for work of their own on the same threads would wait for ever; those of `spread` start none."""
    done: list[list[int]] = []

    def outer(n: int) -> list[int]:
        return [sum(together(lambda k: k + n, range(9))), sum(on_shared_threads(lambda k: k * n, range(9)))]

    thread = threading.Thread(target=lambda: done.extend(together(outer, range(20))), daemon=True)
    thread.start()
    thread.join(30.0)
    assert done == [[36 + 9 * n, 36 * n] for n in range(20)]


def _twice(n: int) -> int:
    return 2 * n


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="processes cannot be forked here")
def test_a_forked_process_has_threads_of_its_own() -> None:
    """Those of its parent are not there: what waited for them never ended (a `reproduce` after an `identify`)."""
    assert on_shared_threads(_twice, range(3)) == [0, 2, 4]
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(on_shared_threads, (_twice, range(4))).get(timeout=30.0) == [0, 2, 4, 6]
