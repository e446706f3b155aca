"""A Dask cluster in this process: who gets what, how much the scheduler knows of, and what is refused."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import pytest
from distributed import Client, KilledWorker, LocalCluster, default_client

from tsm_fmu import __version__
from tsm_fmu.batching import cluster as module
from tsm_fmu.batching.cluster import cluster
from tsm_fmu.batching.mapped import done
from tsm_fmu.models.contract import InputError

LOST = "{}: {}".format


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with LocalCluster(n_workers=1, threads_per_worker=3, processes=False, dashboard_address="127.0.0.1:0") as workers:
        yield workers.scheduler_address


def test_each_item_comes_back_once_with_its_number_and_few_wait_at_the_scheduler(address, monkeypatch) -> None:
    monkeypatch.setattr(module, "AHEAD", 6)
    drawn: list[int] = []

    def items() -> Iterator[tuple[int, str]]:
        for k in range(17):
            drawn.append(k)
            yield 100 + k, "__import__('os').urandom(8)"  # the same work, and yet not the same result

    found: dict[int, object] = {}
    waiting = []
    with cluster(address) as mapped:
        with pytest.raises(ValueError, match="client"):
            default_client()  # what the caller does with Dask is not affected
        for number, result in mapped(eval, items(), LOST):
            waiting.append(len(drawn) - len(found))
            found[number] = result
    assert sorted(found) == list(range(100, 117))
    assert len(set(found.values())) == 17
    assert waiting == [*[6] * 12, 5, 4, 3, 2, 1]


def test_work_is_done_one_at_a_time_in_a_worker_and_given_back_by_who_leaves(address) -> None:
    begun: list[int] = []
    now = [0]
    most = [0]
    lock = threading.Lock()

    def work(item: int) -> int:
        with lock:
            begun.append(item)
            now[0] += 1
            most[0] = max(most[0], now[0])
        time.sleep(0.03)
        with lock:
            now[0] -= 1
        return item**2

    globals()["_seen"] = work  # workers are threads of this process
    with cluster(address) as mapped:
        results = mapped(_by_name, ((k, k) for k in range(30)), LOST)
        first = [next(results) for _ in range(4)]
        results.close()
        time.sleep(0.4)
    assert {number**2 == result for number, result in first} == {True}
    assert most == [1]
    assert 4 <= len(begun) < 15


def _by_name(item: int) -> int:
    return _seen(item)  # noqa: F821  # pyright: ignore


def _killing(work: Callable[[str], object], lost: Callable[[str, str], object], item: str) -> object:
    if item == "kills":
        raise KilledWorker("task", SimpleNamespace(address="tcp://w:1"), 3)  # pyright: ignore[reportArgumentType]
    return done(work, lost, item)


def test_what_kills_its_workers_is_lost_and_a_defect_costs_its_item(address, monkeypatch) -> None:
    monkeypatch.setattr(module, "_worked", _killing)
    with cluster(address) as mapped:
        found = dict(mapped(eval, enumerate(["2**7", "kills", "1/0", "3**5"]), LOST))
    assert (found[0], found[3]) == (128, 243)
    assert found[1].startswith("kills: its workers died (")
    assert "\n" not in found[1]
    assert found[2].startswith("1/0: internal error: ZeroDivisionError")


def test_workers_of_another_version_or_without_one_are_refused(address, monkeypatch) -> None:
    def missing() -> str:
        raise ModuleNotFoundError("No module named 'tsm_fmu'")

    monkeypatch.setattr(module, "_version", lambda: "0.0.7")
    with pytest.raises(InputError) as wrong, cluster(address):
        pass
    assert str(wrong.value).endswith(f"has tsm-fmu 0.0.7 -- expected {__version__} as here -- install the same")
    monkeypatch.setattr(module, "_version", missing)
    with pytest.raises(InputError) as wrong, cluster(address):
        pass
    expected = f"--scheduler {address}: No module named 'tsm_fmu' on its workers -- expected tsm-fmu {__version__}"
    assert str(wrong.value).startswith(expected)


def test_every_worker_is_asked_for_its_version(monkeypatch) -> None:
    class Found:
        def wait_for_workers(self, number: int, timeout: float) -> None:
            assert number == 1
            assert timeout > 0.0

        def run(self, _: object) -> dict[str, str]:
            return {"a": __version__, "b": "9.9.9", "c": __version__}

    with pytest.raises(InputError, match=r"worker b has tsm-fmu 9\.9\.9"):
        module._check_workers(Found(), "tcp://x:1")


@pytest.mark.parametrize("failure", [OSError("refused\n  twice"), ValueError(""), TimeoutError("late")])
def test_no_scheduler_is_one_line(monkeypatch, failure: Exception) -> None:
    def none(*_: object, **__: object) -> None:
        raise failure

    monkeypatch.setattr("distributed.Client", none)
    with pytest.raises(InputError) as wrong, cluster("tcp://nowhere:1"):
        pass
    why = " ".join(str(failure).split()) or "ValueError"
    assert str(wrong.value) == (
        f"--scheduler tcp://nowhere:1 -- expected the address of a running Dask scheduler ({why}) -- start one with "
        "'dask scheduler'"
    )


def test_without_dask_it_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"--scheduler tcp://a:1 -- expected the package distributed .*tsm-fmu\[dask"):
        cluster("tcp://a:1").__enter__()


def test_the_connection_ends_with_the_work_even_where_it_fails(address, monkeypatch) -> None:
    closed: list[str] = []
    close = Client.close
    monkeypatch.setattr(Client, "close", lambda self, *a, **k: (closed.append("closed"), close(self, *a, **k))[1])
    with pytest.raises(KeyError), cluster(address):
        raise KeyError
    assert closed == ["closed"]
