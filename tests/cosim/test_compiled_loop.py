"""The compiled step loop against the interpreted master: the same bits, messages, ends; Ctrl-C; other threads run."""

import ctypes
import itertools
import subprocess
import sys

import numpy as np
import pytest

from tsm_fmu.cosim import compiled_loop as loop
from tsm_fmu.cosim.isolation import simulation
from tsm_fmu.cosim.master import METHODS, simulate_system
from tsm_fmu.cosim.program import Stimulus
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


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("add", [False, True])
def test_given_inputs_give_the_same_bits(foreign, method, add):
    """What an input gets from a table, instead of what it would have or on top of it, beside units and connections."""
    signal = np.random.default_rng(8).normal(0.0, 1.0, 60)
    other = np.cos(np.arange(60.0))
    stimuli = [Stimulus("integrator_1", "u", signal, add), Stimulus("gain_3", "u_2", other, add)]
    _, columns, *_ = same(network(foreign, 5), 1.02, 0.017, method=method, stimuli=stimuli, decimation=2)
    _, without, *_ = same(network(foreign, 5), 1.02, 0.017, method=method, decimation=2)
    assert columns["integrator_1.x"] != without["integrator_1.x"]


KINDS = {
    loop.F64: ctypes.c_double, loop.F32: ctypes.c_float, loop.I8: ctypes.c_int8, loop.I16: ctypes.c_int16,
    loop.I32: ctypes.c_int32, loop.I64: ctypes.c_int64, loop.U8: ctypes.c_uint8, loop.U16: ctypes.c_uint16,
    loop.U32: ctypes.c_uint32, loop.BOOL: ctypes.c_bool,
}  # fmt: skip
"""Types of memory by their number."""


class Tables:
    """One communication step of the loop, written by hand."""

    def __init__(self) -> None:
        self.ops: list[tuple[int, ...]] = []
        self.moves: list[tuple[int, ...]] = []
        self.scales: list[tuple[float, float]] = []
        self.tables = np.zeros((0, 3), np.int64)
        self.clock = np.array([0.25, 0.5])
        self.times, self.row = np.zeros(50), np.zeros(1, np.int64)
        self.asked = np.zeros(1, np.int32)
        self.alive: list = []

    def add(self, kind: int, *arguments: int) -> None:
        self.ops.append((kind, *arguments, *(0,) * (loop.OP_WIDTH - 1 - len(arguments))))

    def run(self, at: list[int], decimation: int = 0) -> tuple[int, list[int]]:
        place = np.array(at, np.int64)
        status = loop.compiled_loop(False)(
            np.array(self.ops, np.int64).reshape(-1, loop.OP_WIDTH), np.array(self.moves, np.int64).reshape(-1, 4),
            np.array(self.scales, float).reshape(-1, 2), self.tables, self.clock, place, decimation, self.times,
            self.row, self.asked,
        )  # fmt: skip
        return status, place.tolist()

    def function(self, python, *types) -> int:
        """Address of a C function that calls a Python one."""
        made = ctypes.CFUNCTYPE(ctypes.c_int, *types)(python)
        self.alive.append(made)
        return ctypes.cast(made, ctypes.c_void_p).value or 0


def test_a_number_is_handed_on_as_c_converts_it_between_any_two_types():
    """Reals with factor and offset, whole numbers cut to the bits of their target; neighbours in memory stay."""
    for target, source in itertools.product(KINDS, KINDS):
        if (target <= loop.F32) != (source <= loop.F32):
            continue
        numbers = [0.3, -2.7] if source <= loop.F32 else [0, 1, 100, 200, -3, 70_000, -70_000, 2**33 + 5]
        for number, (gain, offset) in itertools.product(numbers, [(1.0, 0.0), (-3.7, 0.0), (1.0, 0.125), (0.1, -2.3)]):
            given, taken = (KINDS[source] * 3)(), (KINDS[target] * 3)()
            given[1] = number
            one = Tables()
            one.add(loop.MOVE, 0, 1)
            size = [ctypes.sizeof(KINDS[k]) for k in (target, source)]
            one.moves = [(ctypes.addressof(taken) + size[0], target, ctypes.addressof(given) + size[1], source)]
            one.scales = [(gain, offset)]
            assert one.run([0, 0, 1]) == (0, [1, loop.DONE, 1])
            expected = (KINDS[target] * 3)()
            plain = given[1] if target > loop.F32 or (gain, offset) == (1.0, 0.0) else gain * given[1] + offset
            expected[1] = plain
            assert bytes(taken) == bytes(expected), (target, source, number)


def test_the_moves_of_an_operation_are_its_own_and_in_order():
    """Two operations of several moves; the second takes what the first put."""
    values = (ctypes.c_double * 5)(1.5, 0.0, 0.0, 0.0, 0.0)
    place = [ctypes.addressof(values) + 8 * k for k in range(5)]
    one = Tables()
    one.moves = [(place[k + 1], loop.F64, place[k], loop.F64) for k in range(4)]
    one.scales = [(2.0, 0.0), (1.0, 0.25), (1.0, 0.0), (-1.0, 1.0)]
    one.add(loop.MOVE, 1, 3)
    one.run([0, 0, 1])
    assert list(values) == [1.5, 0.0, 0.25, 0.25, 0.0]
    one.add(loop.MOVE, 0, 4)
    one.run([0, 0, 1])
    assert list(values) == [1.5, 3.0, 3.25, 3.25, -2.25]


@pytest.mark.parametrize("status", [-1, 0, 1, 2, 3, 4])
def test_functions_get_their_arguments_and_stop_the_loop_beyond_a_warning(status):
    """A set and a get of either version and both steps; where one stops it, the loop can go on behind it."""
    one, called, stopping = Tables(), [], [0]
    names = ["two", "three", "step 2", "step 3", "none"]
    long, real = ctypes.c_int64, ctypes.c_double

    def noting(name):
        def function(*arguments):
            called.append((name, *arguments))
            return status if name == names[stopping[0]] else 0

        return function

    flags, reached = (ctypes.c_bool * 3)(), ctypes.c_double()
    first = ctypes.addressof(flags)
    one.add(loop.VALUES_2, one.function(noting("two"), *[long] * 4), 11, 12, 13, 14)
    one.add(loop.VALUES_3, one.function(noting("three"), *[long] * 5), 21, 22, 23, 24, 25)
    one.add(loop.STEP_2, one.function(noting("step 2"), long, real, real, ctypes.c_int), 31)
    answers = (first, first + 1, first + 2, ctypes.addressof(reached))
    one.add(loop.STEP_3, one.function(noting("step 3"), long, real, real, ctypes.c_int, *[long] * 4), 41, *answers)
    for k in range(4):
        called.clear()
        stopping[0] = k
        stops = status not in (0, 1)
        assert one.run([3, 0, 4]) == ((status, [3, k, 4]) if stops else (0, [4, loop.DONE, 4]))
        times = (0.25 + 3 * 0.5, 0.5, 1)
        expected = [("two", 11, 12, 13, 14), ("three", 21, 22, 23, 24, 25), ("step 2", 31, *times),
                    ("step 3", 41, *times, *answers)]  # fmt: skip
        assert called == expected[: k + 1 if stops else 4]
        called.clear()
        assert one.run([3, k + 1, 4]) == (0, [4, loop.DONE, 4])  # the rest of this step
        assert [c[0] for c in called] == names[k + 1 : 4]
    flags[1] = True
    stopping[0] = 4
    called.clear()
    assert one.run([0, 0, 9]) == (0, [0, 3, 9])  # an FMI 3.0 unit ends the run with status 0
    assert len(called) == 4


def test_tables_are_given_or_added_and_rows_are_kept_at_every_nth_point():
    """Two buffers of unlike size; the value of step k is that of the table's row k."""
    given, added = np.arange(10.0) ** 2, 0.5 - np.arange(10.0)
    values, single = (ctypes.c_double * 2)(), (ctypes.c_float * 3)(0.0, 7.5, 0.0)
    kept = [np.zeros((9, 2)), np.zeros((9, 3), np.float32)]
    one = Tables()
    one.add(loop.GIVE, ctypes.addressof(values), loop.F64, given.ctypes.data)
    one.add(loop.ADD, ctypes.addressof(values), loop.F64, added.ctypes.data)
    one.add(loop.ADD, ctypes.addressof(single) + 4, loop.F32, added.ctypes.data)
    one.tables = np.array([(ctypes.addressof(b), t.ctypes.data, t[0].nbytes)
                           for b, t in zip((values, single), kept, strict=True)], np.int64)  # fmt: skip
    one.row[0] = 1
    assert one.run([1, 0, 8], decimation=3) == (0, [8, loop.DONE, 8])
    assert one.row[0] == 3  # after steps 3 and 6
    assert one.times[:4].tolist() == [0.0, 0.25 + 3 * 0.5, 0.25 + 6 * 0.5, 0.0]
    assert kept[0][:4, 0].tolist() == [0.0, given[2] + added[2], given[5] + added[5], 0.0]
    assert kept[1][1:3, 1].tolist() == pytest.approx([7.5 + added[1:3].sum(), 7.5 + added[1:6].sum()])
    assert not kept[0][:, 1].any()
    one.asked[0] = 1
    assert one.run([4, 0, 8], decimation=1) == (0, [5, loop.DONE, 8])  # after the step, which is kept
    assert one.row[0] == 4
    assert one.run([8, 0, 8]) == (0, [8, loop.DONE, 8])
    assert one.row[0] == 4
