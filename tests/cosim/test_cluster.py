"""Sweeps on a Dask cluster of processes: the numbers of a sweep here, also where a worker is killed in the middle."""

import json
import multiprocessing
import os
import signal
import threading
import time

import pytest
from distributed import Client, LocalCluster

import tsm_fmu as tsm
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System

VARY = ["--vary", "belt.mode=0:2:3", "--vary", "g.k=-3.3:-0.7:4"]


@pytest.fixture(scope="module")
def workers():
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster


@pytest.fixture(scope="module")
def path(foreign, tmp_path_factory):
    """A decay, beside a unit of which two of three modes fail."""
    components = (
        Component("x", foreign["integrator"], {"x_0": 1.3}),
        Component("g", foreign["gain"], {"u_2": 0.0}),
        Component("belt", foreign["failing"], {"t_fail": 0.37}),
    )
    links = (Connection("x.x", "g.u"), Connection("g.y", "x.u"))
    system = System(components, links)
    return write_ssp(tmp_path_factory.mktemp("system") / "decay.ssp", (system, Experiment(stop=5.0, step=0.01)))


@pytest.fixture(scope="module")
def here(path, tmp_path_factory):
    out = tmp_path_factory.mktemp("here")
    assert run(["sweep", str(path), *VARY, "--out", str(out), "--no-isolate"]) == 2  # points fail
    return json.loads((out / "sweep.json").read_text())


def kill_one(address, points, killed):
    """Kill a worker as soon as some points are done."""
    with Client(address, set_as_default=False) as client:
        pids = client.run(os.getpid)
        while not points.is_file() or len(points.read_text().splitlines()) < 4:
            time.sleep(0.01)
        os.kill(next(iter(pids.values())), signal.SIGKILL)
        killed.append(len(points.read_text().splitlines()) - 1)


@pytest.mark.skipif(os.name == "nt", reason="kills a process with SIGKILL, which Windows does not have")
def test_a_killed_worker_costs_nothing_and_failed_points_are_recorded(workers, path, here, tmp_path):
    killed: list[int] = []
    arguments = (workers.scheduler_address, tmp_path / "sweep.points.jsonl", killed)
    killer = threading.Thread(target=kill_one, args=arguments, daemon=True)
    killer.start()
    code = run(["sweep", str(path), *VARY, "--out", str(tmp_path), "--scheduler", workers.scheduler_address])
    killer.join(10.0)
    there = json.loads((tmp_path / "sweep.json").read_text())
    assert code == 2  # points fail, as here
    assert killed[0] < len(there["points"]), "the sweep was done before a worker was killed"
    assert there["points"] == here["points"]
    assert sum(bool(point["failed"]) for point in there["points"]) == 8
    assert there["complete"]


def alive():
    return os.getpid(), len(multiprocessing.active_children())


def test_an_fmu_that_crashes_takes_no_worker_of_the_cluster_with_it(workers, in_c, tmp_path):
    """Workers are daemons, which may have no children by themselves; none is left behind either."""
    unit = Component("m", in_c["moody"], {"u": 1.3})
    path = write_ssp(tmp_path / "moody.ssp", (System((unit,), ()), Experiment(stop=1.0, step=0.01)))
    with Client(workers.scheduler_address, set_as_default=False) as client:
        before = client.run(alive)
        vary = {"m.mood": [0, 4], "m.k": [0.7, -1.9]}
        found = tsm.sweep(path, vary, scheduler=workers.scheduler_address)
        until = time.monotonic() + 20.0
        while client.run(alive) != before and time.monotonic() < until:  # until the workers have let go of the work
            time.sleep(0.1)
        assert client.run(alive) == before
    assert [bool(point.failed) for point in found.points] == [False, False, True, True]
    for point in found.points[2:]:
        assert point.failed.startswith("FMU m (moody.fmu): doStep at t = 0.5 s ended its process by SIGSEGV")
    for point, k in zip(found.points[:2], vary["m.k"], strict=True):
        assert point.metrics["m.y.mean"].value == pytest.approx(1.3 * k * 100 / 101)  # 0 at the start


def test_the_table_is_written_as_parquet_too(workers, path, tmp_path):
    import pandas as pd

    vary = ["--vary", "g.k=-3.3:-0.7:3"]
    assert run(["sweep", str(path), *vary, "--out", str(tmp_path), "--scheduler", workers.scheduler_address]) == 0
    table = pd.read_parquet(tmp_path / "sweep.parquet")
    text = pd.read_csv(tmp_path / "sweep.csv")
    assert list(table.columns) == list(text.columns)
    assert table["g.k [1]"].tolist() == pytest.approx([-3.3, -2.0, -0.7])


def test_a_scheduler_without_workers_is_one_line(path, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("tsm_fmu.batching.cluster.PATIENCE", 1.0)
    with LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as empty:
        address = empty.scheduler_address
        assert run(["sweep", str(path), "--vary", "g.k=1:2:2", "--out", str(tmp_path), "--scheduler", address]) == 2
    assert f"--scheduler {address} has no worker -- expected one or more" in capsys.readouterr().err
