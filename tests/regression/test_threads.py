"""Work on threads: results in order, errors as they are, and work that starts more of it."""

from __future__ import annotations

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
