"""Stepping against known solutions, and what is left when a run ends early."""

import contextlib
import math
import os
import re
from itertools import pairwise

import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from tsm_fmu import InputError
from tsm_fmu.cosim.master import METHODS, simulate_system
from tsm_fmu.cosim.replay import replay
from tsm_fmu.cosim.system import Component, Connection, System
from tsm_fmu.cosim.trajectory import SimulationInterrupted, SimulationStopped, write_trajectory
from tsm_fmu.logs.record import Record, read_record


def decay(foreign, rate=2.7, start=1.3):
    """Decay, x' = -rate x, through a gain."""
    return System(
        (
            Component("x", foreign["integrator"], {"x_0": start}),
            Component("g", foreign["gain"], {"k": -rate, "u_2": 0.0}),
        ),
        (Connection("x.x", "g.u"), Connection("g.y", "x.u")),
    )


def failing(foreign, mode):
    return System((Component("belt", foreign["failing"], {"mode": mode, "t_fail": 0.37}),), ())


@pytest.mark.parametrize("method", METHODS)
def test_both_methods_converge_to_the_solution_with_first_order(foreign, method):
    exact = 1.3 * math.exp(-2.7 * 1.2)
    errors = [
        abs(simulate_system(decay(foreign), 1.2, dt, method=method).columns["x.x"][-1] - exact)
        for dt in (0.008, 0.004, 0.002)
    ]
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    assert orders == pytest.approx([1.0, 1.0], abs=0.05)


def test_gauss_seidel_is_explicit_euler_where_only_a_gain_is_between(foreign):
    run = simulate_system(decay(foreign), 0.5, 0.01)
    assert run.columns["x.x"] == pytest.approx(1.3 * (1.0 - 0.027) ** np.arange(51), rel=1e-13)


def test_an_oscillator_keeps_its_energy_in_gauss_seidel_and_gains_in_jacobi(foreign):
    """With x' = v, v' = -w^2 x: symplectic against explicit Euler, whose gain is (1 + w^2 dt^2) a step."""
    w, dt, steps = 3.1, 0.01, 2000
    system = System(
        (
            Component("x", foreign["integrator"], {"x_0": 0.7}),
            Component("v", foreign["integrator"]),
        ),
        (Connection("v.x", "x.u"), Connection("x.x", "v.u", factor=-w * w)),
    )
    energy = {}
    for method in METHODS:
        run = simulate_system(system, steps * dt, dt, method=method)
        energy[method] = (w * run.columns["x.x"]) ** 2 + run.columns["v.x"] ** 2
    start = (w * 0.7) ** 2
    assert np.ptp(energy["gauss-seidel"]) < 2.0 * w * dt * start
    assert energy["jacobi"][-1] == pytest.approx(start * (1.0 + (w * dt) ** 2) ** steps, rel=1e-9)


def test_initialisation_hands_values_on_through_the_whole_chain(foreign):
    """The first row is consistent: three gains after a start value, declared against their order."""
    gains = [Component(f"g{k}", foreign["gain"], {"k": 1.7, "u_2": 0.0}) for k in (3, 2, 1)]
    system = System(
        (*gains, Component("x", foreign["integrator"], {"x_0": 0.9, "u": 0.0})),
        (Connection("x.x", "g1.u"), Connection("g1.y", "g2.u"), Connection("g2.y", "g3.u")),
    )
    assert simulate_system(system, 0.1, 0.05).columns["g3.y"] == pytest.approx([0.9 * 1.7**3] * 3, rel=1e-14)


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize(("factor", "offset"), [(1.0, 0.37), (1.0, -0.37), (-2.5, 0.0), (-2.5, 0.37), (1.0, 0.0)])
def test_a_connection_carries_factor_times_value_plus_offset(foreign, factor, offset, compiled):
    system = System(
        (
            Component("x", foreign["integrator"], {"x_0": 1.3, "u": 0.7}),
            Component("g", foreign["gain"], {"k": 3.1, "u_2": 0.0}),
        ),
        (Connection("x.x", "g.u", factor=factor, offset=offset),),
    )
    run = simulate_system(system, 0.1, 0.01, compiled=compiled)
    assert run.columns["g.y"] == pytest.approx(3.1 * (factor * run.columns["x.x"] + offset), rel=1e-14)
    assert run.columns["x.x"] == pytest.approx(1.3 + 0.7 * np.arange(11) * 0.01, rel=1e-13)


def test_typed_ports_carry_their_values(foreign):
    links = tuple(
        Connection(f"t.{a}", f"t.{b}") for a, b in (("n_next", "n"), ("inverse", "flag"), ("greeting", "text"))
    )
    run = simulate_system(System((Component("t", foreign["typed"]),), links), 0.04, 0.01)
    assert run.columns["t.n_next"].tolist() == [0, 1, 2, 3, 4]
    assert run.columns["t.inverse"].tolist() == [True, False, True, False, True]


def test_recording_selects_and_decimates(foreign):
    full = simulate_system(decay(foreign), 0.5, 0.01)
    thin = simulate_system(decay(foreign), 0.5, 0.01, record=["g.y", "x"], decimation=7)
    assert list(thin.columns) == ["g.y", "x.x"]
    assert thin.time == pytest.approx(np.arange(8) * 0.07, abs=1e-12)
    assert thin.columns["g.y"].tolist() == full.columns["g.y"][::7].tolist()
    for wrong in ("z", "g.z"):
        with pytest.raises(InputError, match=f"record '{wrong}' -- expected one of"):
            simulate_system(decay(foreign), 0.5, 0.01, record=[wrong])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            (1.0, 0.3),
            "stop 1.0 s with step 0.3 s from 0.0 s -- expected a whole number of steps -- set for example stop 0.9 s",
        ),
        ((1.0, -0.1), "expected start < stop and step > 0"),
        ((-1.0, 0.1), "expected start < stop and step > 0"),
        ((math.nan, 0.1), "expected start < stop and step > 0"),
    ],
)
def test_wrong_times_are_refused(foreign, arguments, message):
    with pytest.raises(InputError, match=re.escape(message)):
        simulate_system(decay(foreign), *arguments)


def test_wrong_method_and_decimation_are_refused(foreign):
    with pytest.raises(InputError, match=r"method 'newton' -- expected one of gauss-seidel, jacobi"):
        simulate_system(decay(foreign), 1.0, 0.1, method="newton")
    with pytest.raises(InputError, match=r"decimation 0 -- expected 1 or more"):
        simulate_system(decay(foreign), 1.0, 0.1, decimation=0)


@pytest.mark.parametrize(("mode", "status", "reason"), [(1, "Discard", "the belt slipped"), (2, "Fatal", "belt tore")])
def test_a_failing_step_names_fmu_time_and_last_log_line_and_keeps_the_rows(foreign, mode, status, reason, tmp_path):
    with pytest.raises(SimulationStopped) as caught:
        simulate_system(failing(foreign, mode), 1.0, 0.01)
    message = str(caught.value)
    assert message.startswith(f"FMU belt (Failing.fmu) returned {status} from doStep at t = 0.37 s: ")
    assert reason in message
    assert "\n" not in message
    kept = caught.value.trajectory
    assert kept.columns["belt.count"].tolist() == list(range(38))
    assert kept.incomplete == message
    path = write_trajectory(tmp_path / "results.csv", kept)
    assert path.name == "results.incomplete.csv"
    assert read_record(path).columns["belt.count"].tolist() == list(range(38))


def test_an_output_that_is_not_finite_is_named_with_its_time(foreign):
    with pytest.raises(SimulationStopped, match=r"^belt\.count is nan from t = 0\.38 s on") as caught:
        simulate_system(failing(foreign, 3), 1.0, 0.01)
    assert caught.value.trajectory.time[-1] == pytest.approx(0.37)


@pytest.mark.skipif(os.name == "nt", reason="sends itself SIGINT, which Windows does not have")
def test_ctrl_c_ends_after_the_step_and_keeps_the_rows(foreign):
    with pytest.raises(SimulationInterrupted) as caught:
        simulate_system(failing(foreign, 4), 1.0, 0.01)
    kept = caught.value.trajectory
    assert kept.incomplete == "interrupted"
    assert kept.columns["belt.count"].tolist() == list(range(39))


@pytest.mark.skipif(os.name == "nt", reason="sends itself SIGINT, which Windows does not have")
@pytest.mark.parametrize("function", ["__init__", "setup_experiment", "exit_initialization_mode", "terminate"])
def test_ctrl_c_outside_of_the_steps_is_neither_lost_nor_a_failure_of_the_fmu(foreign, monkeypatch, function):
    monkeypatch.setenv("PRESSED", function)
    unit = foreign["pressed"]
    with pytest.raises(KeyboardInterrupt) as caught:
        simulate_system(System((Component("one", unit, {"u": 0.7}),), ()), 0.3, 0.1)
    if function == "terminate":
        assert caught.value.trajectory.columns["one.y"].tolist() == [0.0, 1.4, 1.4, 1.4]
    record = Record("r", np.arange(4) * 0.1, {"u": np.array([0.1, 0.7, -0.3, 0.2])}, {"u": "1"})
    with pytest.raises(KeyboardInterrupt):
        replay(unit, record)
    monkeypatch.delenv("PRESSED")
    assert replay(unit, record).columns["y"].tolist() == [0.0, 1.4, -0.6, 0.4]


@pytest.mark.parametrize(
    ("mode", "ends"),
    [(0, ["terminate", "freeInstance"]), (1, ["terminate", "freeInstance"]), (2, [])],
    ids=["good", "discarded", "fatal"],
)
def test_after_fatal_fmi_allows_no_further_call(foreign, monkeypatch, mode, ends):
    calls = []
    for name in ("terminate", "freeInstance"):
        original = getattr(FMU2Slave, name)
        monkeypatch.setattr(FMU2Slave, name, lambda s, n=name, o=original: (calls.append(n), o(s))[1])
    with contextlib.nullcontext() if mode == 0 else pytest.raises(SimulationStopped):
        simulate_system(failing(foreign, mode), 0.5, 0.01)
    assert calls == ends


def test_a_run_can_follow_a_failed_one_in_the_same_process(foreign):
    for mode in (2, 1, 2):
        with pytest.raises(SimulationStopped):
            simulate_system(failing(foreign, mode), 1.0, 0.01)
    assert simulate_system(failing(foreign, 0), 1.0, 0.01).columns["belt.count"][-1] == 100.0


def test_a_damaged_member_and_a_path_outside_are_named(foreign, tmp_path):
    import zipfile

    outside = tmp_path / "outside.fmu"
    with zipfile.ZipFile(foreign["failing"]) as old, zipfile.ZipFile(outside, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name))
        new.writestr("../escape.txt", "x")
    damaged = tmp_path / "damaged.fmu"
    content = bytearray(foreign["failing"].read_bytes())
    with zipfile.ZipFile(foreign["failing"]) as archive:
        largest = max(archive.infolist(), key=lambda i: i.file_size)
    for k in range(largest.header_offset + 200, largest.header_offset + 400):
        content[k] ^= 0xFF
    damaged.write_bytes(content)
    for path, message in ((outside, r"has the member '\.\./escape\.txt'"), (damaged, "cannot be unpacked")):
        with pytest.raises(InputError, match=message):
            simulate_system(System((Component("belt", path),), ()), 1.0, 0.1)
    assert not (tmp_path.parent / "escape.txt").exists()


def test_an_fmu_without_a_library_for_this_platform_is_named(foreign, tmp_path):
    import zipfile

    bare = tmp_path / "bare.fmu"
    with zipfile.ZipFile(foreign["failing"]) as old, zipfile.ZipFile(bare, "w") as new:
        for name in old.namelist():
            if not name.startswith("binaries/"):
                new.writestr(name, old.read(name))
    with pytest.raises(InputError, match=r"FMU belt \(bare\.fmu\) cannot be loaded: Cannot find shared library"):
        simulate_system(System((Component("belt", bare),), ()), 1.0, 0.1)
