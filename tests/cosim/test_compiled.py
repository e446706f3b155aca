"""The compiled step loop against the interpreted master: the same bits, messages, ends; Ctrl-C; other threads run."""

import itertools
import subprocess
import sys

import numpy as np
import pytest

from tsm_fmu.cosim.isolation import simulation
from tsm_fmu.cosim.master import METHODS, simulate_system
from tsm_fmu.cosim.system import Component, Connection, System
from tsm_fmu.cosim.trajectory import SimulationInterrupted, SimulationStopped

from .test_isolation import CRASHES, HANGS, moody


def outcome(system, *arguments, **options):
    """What a run leaves behind: rows to the last bit, units, why it ended, what was said."""
    try:
        run = simulate_system(system, *arguments, **options)
    except (SimulationStopped, SimulationInterrupted) as early:
        run = early.trajectory
    columns = {name: (values.dtype.str, values.tobytes()) for name, values in run.columns.items()}
    return run.time.tobytes(), columns, run.units, run.incomplete, run.messages


def same(system, *arguments, **options):
    compiled, interpreted = (outcome(system, *arguments, compiled=c, **options) for c in (True, False))
    assert compiled == interpreted
    return compiled


def network(foreign, seed):
    """Gains and integrators wired at random, with factors and offsets; every input driven or set."""
    rng = np.random.default_rng(seed)
    kinds = [("integrator", "x")] * 3 + [("gain", "y")] * 3
    components, connections, outputs = [], [], []
    for k, (kind, output) in enumerate(kinds):
        name = f"{kind}_{k}"
        values = {"x_0": rng.normal()} if kind == "integrator" else {"k": rng.normal(0.0, 0.7)}
        inputs = ["u"] if kind == "integrator" else ["u", "u_2"]
        for variable in inputs:
            if outputs and rng.random() < 0.8:
                source = outputs[rng.integers(len(outputs))]
                factor, offset = (1.0, 0.0) if rng.random() < 0.5 else (rng.normal(), rng.normal())
                connections.append(Connection(source, f"{name}.{variable}", factor, offset))
            else:
                values[variable] = rng.normal()
        components.append(Component(name, foreign[kind], values))
        outputs.append(f"{name}.{output}")
    back = Connection(outputs[-1], "integrator_0.u", -1.3)
    components[0].parameters.pop("u", None)
    order = rng.permutation(len(components))
    return System(tuple(components[k] for k in order), (*connections, back))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(8))
def test_random_networks_give_the_same_bits(foreign, seed, method):
    _, columns, *_ = same(network(foreign, seed), 1.7, 0.017, method=method, decimation=1 + seed % 3)
    assert len(columns) == 6
    assert any(np.ptp(np.frombuffer(values)) > 0.1 for _, values in columns.values())


def test_integers_and_booleans_are_handed_on_and_texts_are_left_to_the_interpreter(foreign):
    links = [Connection("t.n_next", "t.n"), Connection("t.inverse", "t.flag"), Connection("t.greeting", "t.text")]
    for some, values in ((links[:2], {"text": "b"}), (links, {})):
        system = System((Component("t", foreign["typed"], values),), tuple(some))
        _, columns, *_ = same(system, 0.4, 0.01)
        assert np.frombuffer(columns["t.n_next"][1], columns["t.n_next"][0]).tolist() == list(range(41))


def test_fmi_3_arrays_and_types_are_handed_on(in_c, foreign):
    system = System(
        (
            Component("x", foreign["integrator"], {"u": 2.0, "x_0": 0.125}),
            Component("a", in_c["arrays"], {"u": 0.0, "gain[2]": -3.0}),
        ),
        (Connection("x.x", "a.u[3]"),),
    )
    for method in METHODS:
        same(system, 0.5, 0.01, method=method)


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_failures_say_the_same_and_keep_the_same_rows(foreign, mode):
    belt = Component("belt", foreign["failing"], {"mode": mode, "t_fail": 0.37})
    beside = Component("x", foreign["integrator"], {"u": 1.0})
    for components, method in itertools.product([(belt, beside), (beside, belt)], METHODS):
        same(System(components, ()), 1.0, 0.01, method=method)


@pytest.mark.parametrize("mood", range(3))
def test_units_that_end_the_run_end_it_at_the_same_row(in_c, mood):
    for steps in (10, 7):
        same(moody(in_c, mood), steps * 0.01, 0.01)
        same(moody(in_c, mood, t_end=0.06), steps * 0.01, 0.01, decimation=3)


def test_fmi_3_units_that_end_the_run_end_it_at_the_same_row(in_c):
    _, _, _, _, messages = same(System((Component("one", in_c["arrays"], {"t_end": 0.05, "u": 0.0}),), ()), 0.2, 0.01)
    assert messages[-1] == "FMU one (arrays.fmu) ended the run at t = 0.05 s"


def test_ctrl_c_within_a_step_of_python_ends_after_that_step(foreign):
    belt = System((Component("belt", foreign["failing"], {"mode": 4, "t_fail": 0.37}),), ())
    time, _, _, incomplete, _ = same(belt, 1.0, 0.01)
    assert (len(time) // 8, incomplete) == (39, "interrupted")


def test_a_crash_and_a_hang_are_told_with_the_rows_until_then(in_c):
    with simulation(None, 4.0) as there:
        for mood, how in ((CRASHES, "by SIGSEGV"), (HANGS, "did not return within 4 s")):
            with pytest.raises(SimulationStopped, match=rf"one \(moody.fmu\): doStep at t = 0\.05 s .*{how}") as caught:
                there.simulate_system(moody(in_c, mood), 0.1, 0.01, compiled=True)
            assert caught.value.trajectory.columns["one.y"].tolist() == [0.0, *[1.5] * 5]


ALONE = """
import os, sys, threading, time
from pathlib import Path
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.system import Component, System

def system(mood):
    return System((Component("one", Path(sys.argv[1]), {"mood": mood, "t_end": 0.05, "u": 1.5}),), ())

simulate_system(system(0), 0.1, 0.01, compiled=True)  # loaded before it is watched
threading.Thread(target=simulate_system, args=(system(5), 0.1, 0.01), kwargs={"compiled": True}, daemon=True).start()
time.sleep(1.0)
print("alive", flush=True)
os._exit(0)
"""


def test_units_in_c_run_without_the_interpreter_lock(in_c):
    """One thread is in a step that never returns; the other goes on."""
    done = subprocess.run([sys.executable, "-c", ALONE, in_c["moody"]], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.strip()) == (0, "alive"), done.stderr
