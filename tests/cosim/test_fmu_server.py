"""Both ends of the pipe to an FMU in a process of its own, here in one: every call as the FMU itself gets it."""

from __future__ import annotations

import ctypes
import pickle
from collections import deque
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException

from tsm_fmu.cosim import fmu_server
from tsm_fmu.cosim.fmi_calls import C_TYPES, FATAL, c_type
from tsm_fmu.cosim.fmu_process import ProcessLost
from tsm_fmu.cosim.fmu_server import _Served
from tsm_fmu.cosim.remote_slave import RemoteSlave

NUMBERS = {"Boolean": [1, 0, 1], "String": [b"one", b"", "zwölf".encode()], "Float32": [0.5, -1.25, 3e30]}


class Unit:
    """A stand-in for FMPy's slave: keeps values by reference and notes its calls."""

    def __init__(self, fmi: int, lines: deque[str]) -> None:
        self.fmi, self.lines = fmi, lines
        self.component = ctypes.c_void_p(77)
        self.calls: list[tuple[Any, ...]] = []
        self.held: dict[tuple[str, int], list[Any]] = {}
        self.status = 0
        self.says: list[str] = []
        self._functions = {f"fmi{fmi}DoStep": self.step}
        for kind in C_TYPES:
            self._functions[f"fmi{fmi}Set{kind}"] = lambda *a, kind=kind: self.put(kind, *a)
            self._functions[f"fmi{fmi}Get{kind}"] = lambda *a, kind=kind: self.get(kind, *a)

    def put(self, kind: str, component: Any, references: Any, number: int, values: Any, *count: int) -> int:
        each = len(values) // number
        self.calls.append(("set", kind, component.value, list(references), number, *count))
        for k, reference in enumerate(references):
            self.held[kind, reference] = list(values[k * each : (k + 1) * each])
        self.lines.extend(self.says)
        return self.status

    def get(self, kind: str, component: Any, references: Any, number: int, values: Any, *count: int) -> int:
        self.calls.append(("get", kind, component.value, list(references), number, *count))
        found = [v for r in references for v in self.held[kind, r]]
        values[: len(found)] = found
        return self.status

    def step(self, component: Any, time: float, dt: float, no_return: Any, *answers: Any) -> int:
        self.calls.append(("step", component.value, time, dt, int(no_return)))
        for place, flag in zip(answers[:3], (False, True, True), strict=False):
            place[0] = flag
        if answers:
            answers[3]._obj.value = time + 0.75 * dt
        return self.status

    def getFMUState(self) -> str:
        return f"state {len(self.calls)}"

    def setFMUState(self, state: Any) -> None:
        self.calls.append(("restored", state))

    def freeFMUState(self, state: Any) -> None:
        self.calls.append(("freed", state))

    def exitInitializationMode(self) -> None:
        pass

    def terminate(self) -> None:
        raise FMICallException("fmi2Terminate", 3)

    def setupExperiment(self, *arguments: Any) -> Any:
        if not arguments:
            raise ValueError("two\nlines")
        if arguments[0] is None:
            raise KeyError
        return [*arguments, "answered"]


class Pipe:
    """The process, without one: requests are answered at once."""

    def __init__(self) -> None:
        self.served, self.requests, self.lost = _Served(), 0, False

    def ask(self, request: bytes) -> bytes:
        if self.lost:
            raise ProcessLost("gone")
        self.requests += 1
        return self.served.answer(request)


@pytest.fixture(params=[2, 3])
def both(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> tuple[RemoteSlave, Unit, Pipe, deque[str]]:
    fmi, made = request.param, []

    def load(version: int, arguments: dict[str, Any], lines: deque[str], python: bool) -> Unit:
        assert (version, arguments, python) == (fmi, {"instanceName": "one"}, True)
        made.append(Unit(version, lines))
        return made[0]

    monkeypatch.setattr(fmu_server, "load", load)
    pipe, lines = Pipe(), deque[str]()
    slave = RemoteSlave(pipe, fmi, {"instanceName": "one"}, lines, True)  # type: ignore[arg-type]
    return slave, made[0], pipe, lines


def call(slave: RemoteSlave, fmi: int, verb: str, kind: str, references: list[int], values: Any) -> int:
    """As the step loop does: by the C function, with addresses."""
    placed = (ctypes.c_uint32 * len(references))(*references)
    more = (len(values),) if fmi == 3 else ()
    function = slave._functions[f"fmi{fmi}{verb}{kind}"]
    return function(slave.component, ctypes.addressof(placed), len(references), ctypes.addressof(values), *more)


@pytest.mark.parametrize("kind", list(C_TYPES))
def test_values_of_every_type_arrive_as_they_were_set_and_come_back(both, kind: str) -> None:
    slave, unit, _, _ = both
    own = c_type(kind, unit.fmi == 3)
    numbers = NUMBERS.get(kind, [3, 100, 7])
    given = (own * 3)(*numbers)
    more = (3,) if unit.fmi == 3 else ()
    assert call(slave, unit.fmi, "Set", kind, [5, 9, 2], given) == 0
    assert unit.calls == [("set", kind, 77, [5, 9, 2], 3, *more)]
    taken = (own * 3)()
    assert call(slave, unit.fmi, "Get", kind, [2, 5, 9], taken) == 0
    assert unit.calls[1:] == [("get", kind, 77, [2, 5, 9], 3, *more)]
    assert [v or b"" if kind == "String" else v for v in taken] == [given[2], given[0], given[1]]


def test_an_array_of_fmi_3_is_one_reference_with_many_values(both) -> None:
    slave, unit, _, _ = both
    if unit.fmi == 2:
        return  # which has none
    given = (ctypes.c_double * 6)(*range(6))
    call(slave, 3, "Set", "Float64", [4, 8], given)
    assert unit.held == {("Float64", 4): [0.0, 1.0, 2.0], ("Float64", 8): [3.0, 4.0, 5.0]}
    taken = (ctypes.c_double * 3)()
    call(slave, 3, "Get", "Float64", [8], taken)
    assert list(taken) == [3.0, 4.0, 5.0]


def test_a_step_answers_its_flags_and_the_values_that_were_asked_after_the_step_before(both) -> None:
    slave, unit, pipe, _ = both
    unit.held = {("Integer", 1): [10], ("Integer", 2): [20]}
    one, two = (ctypes.c_int * 1)(), (ctypes.c_int * 1)()
    flags, reached = (ctypes.c_bool * 3)(), ctypes.c_double()
    places = [ctypes.addressof(flags) + k for k in range(3)] + [ctypes.addressof(reached)]
    step = slave._functions[f"fmi{unit.fmi}DoStep"]
    more = places if unit.fmi == 3 else []

    def gone_on(time: float, expected_requests: int) -> None:
        before = pipe.requests
        assert step(slave.component, time, 0.5, True, *more) == unit.status
        for k, values in ((1, one), (2, two)):
            call(slave, unit.fmi, "Get", "Integer", [k], values)
        assert pipe.requests - before == expected_requests
        assert (one[0], two[0]) == (unit.held["Integer", 1][0], unit.held["Integer", 2][0])

    unit.held["Real", 7] = [1.5]
    call(slave, unit.fmi, "Get", "Real", [7], (ctypes.c_double * 1)())
    slave.exitInitializationMode()  # what was asked before is not asked again
    gone_on(1.0, 3)  # not known yet what will be asked
    unit.held = {("Integer", 1): [11], ("Integer", 2): [21]}
    gone_on(1.5, 1)
    unit.held = {("Integer", 1): [12], ("Integer", 2): [22]}
    gone_on(2.0, 1)
    assert [c for c in unit.calls if c[0] == "step"] == [("step", 77, t, 0.5, 1) for t in (1.0, 1.5, 2.0)]
    if unit.fmi == 3:
        assert (list(flags), reached.value) == ([False, True, True], 2.375)
    unit.held["Integer", 1] = [13]
    call(slave, unit.fmi, "Set", "Real", [3], (ctypes.c_double * 1)(1.0))  # what was answered ahead is stale then
    call(slave, unit.fmi, "Get", "Integer", [1], one)
    assert one[0] == 13
    unit.status = 3  # a refused step answers nothing ahead
    before = len(unit.calls)
    assert step(slave.component, 2.5, 0.5, False, *more) == 3
    assert unit.calls[before:] == [("step", 77, 2.5, 0.5, 0)]
    unit.status = 1
    gone_on(3.0, 1)  # a warning does
    assert [c for c in unit.calls if c[1] == "Real" and c[0] == "get"] == [("get", "Real", 77, [7], 1, *(more and [1]))]


def test_what_is_logged_comes_with_the_answer_once(both) -> None:
    slave, unit, _, lines = both
    unit.says = ["hot", "hotter"]
    call(slave, unit.fmi, "Set", "Real", [3], (ctypes.c_double * 1)(1.0))
    assert list(lines) == ["hot", "hotter"]
    unit.says = []
    call(slave, unit.fmi, "Set", "Real", [3], (ctypes.c_double * 1)(1.0))
    assert list(lines) == ["hot", "hotter"]


def test_methods_answer_refuse_and_fail_as_there(both) -> None:
    slave, unit, pipe, _ = both
    assert slave.setupExperiment(1.5, "x") == [1.5, "x", "answered"]
    with pytest.raises(RuntimeError, match=r"^two$"):
        slave.setupExperiment()
    with pytest.raises(RuntimeError, match=r"^KeyError$"):
        slave.setupExperiment(None)
    with pytest.raises(FMICallException) as refused:
        slave.terminate()
    assert refused.value.status == 3
    with pytest.raises(AttributeError, match="doNothing"):
        slave.doNothing  # noqa: B018
    states = [slave.getFMUState() for _ in range(3)]
    assert len(set(states)) == 3
    slave.setFMUState(states[1])
    slave.freeFMUState(states[1])
    slave.setFMUState(states[2])
    slave.freeFMUState(states[2])
    assert slave.getFMUState() != states[0]
    assert unit.calls == [("restored", "state 0"), ("freed", "state 0"), ("restored", "state 0"), ("freed", "state 0")]
    with pytest.raises(RuntimeError):
        slave.setFMUState(states[2])  # freed
    pickle.loads(pickle.dumps(states))  # they go through the pipe
    assert pipe.requests > 9


def test_a_lost_process_is_a_fatal_status_and_another_failure_is_kept(both, monkeypatch) -> None:
    slave, unit, pipe, _ = both
    values = (ctypes.c_double * 1)(1.0)
    monkeypatch.setattr(unit, "put", None)
    with_failure = call(slave, unit.fmi, "Set", "Real", [3], values)
    assert with_failure == FATAL
    assert isinstance(slave.failure, TypeError)
    slave.failure = None
    pipe.lost = True
    assert call(slave, unit.fmi, "Set", "Real", [3], values) == FATAL
    assert slave.failure is None


class Connection:
    """One end of a pipe whose other end is gone after some requests."""

    def __init__(self, requests: list[bytes], failure: type[Exception]) -> None:
        self.requests, self.failure, self.sent = requests, failure, []

    def send_bytes(self, data: bytes) -> None:
        self.sent.append(data)

    def recv_bytes(self) -> bytes:
        if not self.requests:
            raise self.failure
        return self.requests.pop(0)


@pytest.mark.parametrize("failure", [EOFError, ConnectionResetError])
def test_the_process_says_that_it_is_there_answers_and_ends_with_the_pipe(monkeypatch, failure) -> None:
    monkeypatch.setattr(fmu_server.signal, "signal", lambda *_: None)
    monkeypatch.setattr(fmu_server, "load", lambda *_: Unit(2, deque()))
    load = b"C" + pickle.dumps(("load", (2, {}, False)))
    there = Connection([load, b"C" + pickle.dumps(("setupExperiment", (1,)))], failure)
    fmu_server.serve(there)
    assert there.sent[0] == b"ready"
    assert len(there.sent) == 3
    assert pickle.loads(there.sent[2][8:]) == [1, "answered"]
